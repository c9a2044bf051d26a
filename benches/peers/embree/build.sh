#!/bin/sh
# Builds the Embree side of `cargo bench --bench rays`. Debian: apt-get install g++ libembree-dev (3.13).
set -e
cd "$(dirname "$0")"
mkdir -p ../../cache
g++ -O3 -march=native -o ../../cache/embree-rays rays.cpp -lembree3
