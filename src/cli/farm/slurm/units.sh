#!/bin/sh
# Renders the units in one line of a list. Asked to end, it ends with their checkpoint; shortly before its time is up it also
# asks to be queued again.
#SBATCH @HEAD@
units=$(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" "$1")
time_is_up=
trap 'kill -TERM "$work" 2>/dev/null' TERM
trap 'time_is_up=1; kill -TERM "$work" 2>/dev/null' USR1
# In the background, since a shell hears signals only between commands and in wait.
# shellcheck disable=SC2086 # several words
'@FECHNER@' farm unit '@FARM@' $units --threads @CPUS@ &
work=$!
wait "$work"
status=$?
while [ "$status" -gt 128 ] && kill -0 "$work" 2>/dev/null; do
    wait "$work"
    status=$?
done
if [ -n "$time_is_up" ] && [ "$status" -ne 0 ]; then
    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID"
fi
exit "$status"
