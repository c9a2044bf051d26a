#!/bin/sh
# Hands out what is open in the farm: units, then merges of their frames, then this script again for the next round.
# Harmless at any time, also after a failure: what is there is kept.
#SBATCH @HEAD@
set -eu
farm='@FARM@'
fechner='@FECHNER@'
cd "$farm/slurm"
mkdir -p log

# Numbers, one a line, packed into at most @ARRAY@ lines.
packed() {
    awk -v most=@ARRAY@ '
        NR == FNR { count++; next }
        { each = int((count + most - 1) / most); printf "%s%s", $1, FNR % each && FNR < count ? " " : "\n" }' "$1" "$1"
}
submit() {
    sbatch --parsable --kill-on-invalid-dep=yes --output="$farm/slurm/log/%x-%A_%a.txt" "$@"
}
array() {
    echo "--array=0-$(($(wc -l <"$1") - 1))%@AT_ONCE@"
}

# Lists that a job array under way reads are never written again.
name=$(date +%s).$$
"$fechner" farm status "$farm" --list frames >"frames.$name.all"
"$fechner" farm status "$farm" --list units >"units.$name.all"
packed "frames.$name.all" >"frames.$name"
packed "units.$name.all" >"units.$name"
rm "frames.$name.all" "units.$name.all"
if [ ! -s "frames.$name" ]; then
    # What needs all frames, such as a video, if it is not made yet.
    "$fechner" farm merge "$farm" --threads @CPUS@
    echo "$farm: all frames are done"
    exit
fi
after=
if [ -s "units.$name" ]; then
    units=$(submit --job-name=fechner-units --requeue --open-mode=append --signal=B:USR1@60 \
        "$(array "units.$name")" units.sh "$farm/slurm/units.$name")
    after=--dependency=afterok:$units
fi
# shellcheck disable=SC2086 # nothing or one word
merges=$(submit --job-name=fechner-merge --requeue --open-mode=append $after \
    "$(array "frames.$name")" merge.sh "$farm/slurm/frames.$name")
next=$(submit --job-name=fechner-next --requeue --dependency="afterok:$merges" submit.sh)
echo "jobs: units ${units:-none}, merges $merges, next round $next"
