#!/usr/bin/env bash
# A farm on Slurm for real: one node, controller and daemons started here and stopped at the end, in a folder of their own.
# A unit is requeued in the middle and must go on from its checkpoint; the picture must have the bytes of one process.
#
#     tests/farm/slurm.sh FECHNER             requeued by hand, about three minutes
#     tests/farm/slurm.sh FECHNER time-limit  a unit that its time limit does not suffice for, about five minutes
#
# Needs Debian's slurm-wlm and munge, and root, as whom the daemons run. A requeued job waits two minutes by Slurm's own rule.
set -euo pipefail
end=${2:-requeue}
fechner=$(realpath "$1")
scene=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../../scenes/cornell-box.toml")

for program in munged slurmctld slurmd sbatch scontrol; do
    if ! PATH="$PATH:/usr/sbin" command -v "$program" >/dev/null; then
        echo "skipped: no $program here (Debian: slurm-wlm munge)"
        exit 0
    fi
done
if [[ $(id -u) -ne 0 || ! -r /etc/munge/munge.key ]]; then
    echo "skipped: Slurm's daemons need root and a munge key"
    exit 0
fi
PATH="$PATH:/usr/sbin"

# munged refuses sockets in folders that others may write to, as /tmp.
run=$(mktemp -d /run/fechner-slurm.XXXXXX)
chmod 755 "$run"
mkdir "$run/munge" "$run/spool" "$run/state"
chown munge "$run/munge"
stop() {
    squeue -h -o %A 2>/dev/null | sort -u | xargs -r timeout 10 scancel 2>/dev/null || true
    for daemon in slurmd slurmctld munge/munged; do
        [[ ! -s "$run/$daemon.pid" ]] || kill "$(cat "$run/$daemon.pid")" 2>/dev/null || true
    done
    sleep 1
    rm -rf "$run"
}
fail() {
    echo "failed: $*" >&2
    squeue -a 2>/dev/null >&2 || true
    tail -n 5 "$run"/farm/slurm/log/*.txt "$run"/*.log >&2 || true
    exit 1
}
trap stop EXIT

name=$(hostname -s)
free_port() {
    python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}
cat >"$run/slurm.conf" <<CONF
ClusterName=fechner
SlurmctldHost=$name(127.0.0.1)
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
AuthInfo=socket=$run/munge/socket
SlurmUser=root
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=2,batch_sched_delay=0
SlurmctldPidFile=$run/slurmctld.pid
SlurmdPidFile=$run/slurmd.pid
StateSaveLocation=$run/state
SlurmdSpoolDir=$run/spool
SlurmctldLogFile=$run/slurmctld.log
SlurmdLogFile=$run/slurmd.log
NodeName=$name NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=2000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$run/slurm.conf"
runuser -u munge -- munged --socket="$run/munge/socket" --pid-file="$run/munge/munged.pid" \
    --log-file="$run/munge/log" --seed-file="$run/munge/seed" || fail "munged does not start"
slurmctld -f "$SLURM_CONF" || fail "slurmctld does not start"
slurmd -f "$SLURM_CONF" -N "$name" || fail "slurmd does not start"
for _ in $(seq 100); do
    [[ "$(sinfo -h -o %T 2>/dev/null)" == idle ]] && break
    sleep 0.2
done
[[ "$(sinfo -h -o %T)" == idle ]] || fail "the node is not idle: $(sinfo)"

cd "$run"
case $end in
requeue) # Units of a few seconds, so that one can be met in the middle.
    options=(--size 320x320 --sampling uniform --spp 32 --seed 5) unit_samples=800000 passes=2 minutes=10 patience_s=400
    units="farm/frame-0000/round-000/unit-000000"
    ;;
time-limit) # The last round is one unit of a minute and a half, which Slurm warns after a minute that its two are soon up.
    options=(--size 720x720 --sampling uniform --spp 128 --seed 5) unit_samples=5000000 passes=1 minutes=2 patience_s=900
    units="farm/frame-0000/round-*/unit-*"
    ;;
*)
    echo "$end: neither requeue nor time-limit" >&2
    exit 2
    ;;
esac
"$fechner" farm plan "$scene" --passes $passes --unit-samples $unit_samples -o farm -- "${options[@]}"
"$fechner" farm slurm farm --cpus 1 --memory 500M --time $minutes >/dev/null
sh farm/slurm/submit.sh

# The first unit that runs is ended in the middle: its checkpoint must be there afterwards.
is_there() { compgen -G "$1" >/dev/null; }
for _ in $(seq 300); do is_there "$units.lock" && break; sleep 0.1; done
is_there "$units.lock" || fail "no unit starts"
running() { squeue -h -r -t RUNNING -n fechner-units -o %i | head -n 1; }
if [[ $end == requeue ]]; then
    sleep 0.5
    job=$(running)
    [[ -n $job ]] || fail "no unit runs"
    scontrol requeue "${job%_*}_0"
else
    for _ in $(seq 400); do is_there "$units.partial" && [[ -z $(running) ]] && break; sleep 1; done
    [[ -n "$(squeue -h -n fechner-units -o %i)" ]] || fail "the unit whose time was up is not queued again"
fi
for _ in $(seq 100); do is_there "$units.partial" && break; sleep 0.1; done
is_there "$units.partial" || fail "the unit left no checkpoint"
echo "a unit ended ($end) and left its checkpoint; Slurm lets it wait two minutes"

for _ in $(seq $patience_s); do
    [[ -e farm/frame-0000/result.json ]] && break
    [[ -n "$(squeue -h -o %i)" ]] || fail "nothing is left to run, and the frame is not done"
    sleep 1
done
[[ -e farm/frame-0000/result.json ]] || fail "not done in time"
grep -q "unit [0-9]*: goes on from its checkpoint" farm/slurm/log/fechner-units-*_0.txt || fail "the unit began anew"
"$fechner" render "$scene" -o one.exr "${options[@]}" >/dev/null 2>&1
cmp one.exr farm/pictures/picture.exr || fail "the picture is not that of one process"
echo "Slurm: $(cat farm/slurm/log/fechner-units-*.txt | grep -c 'million samples in') units, one ended in the middle ($end); the bytes of one process"
