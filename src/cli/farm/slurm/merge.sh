#!/bin/sh
# Merges the frames in one line of a list. Status 75 is no failure: a unit's file was refused, and the next round renders it, or a
# signal ended the merge, and the next round goes on with it.
#SBATCH @HEAD@
for frame in $(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" "$1"); do
    '@FECHNER@' farm merge '@FARM@' --frame "$frame" --threads @CPUS@ || [ $? -eq 75 ] || exit 1
done
