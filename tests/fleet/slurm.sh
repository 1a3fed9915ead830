#!/usr/bin/env bash
# Runs a night and an experiment through a real Slurm on this machine: a controller and two nodes. Four logs (or LOGS)
# of 20 s (or SECONDS), one of them empty; a job is killed while it runs and must be done again. Not part of the test
# suite: installs and starts daemons, requires root.
#
#   tests/fleet/slurm.sh build/release/bin/lodestone /tmp/night [LOGS [SECONDS]]
set -euo pipefail
program=$(realpath "$1")
mkdir -p "$2"
work=$(realpath "$2")
logs=${3:-4}
length_s=${4:-20}
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

"$root/tools/setup.sh" snakemake slurmctld slurmd slurm-client munge jq >/dev/null
mkdir -p "$work"/{state,spool.n1,spool.n2,logs} /run/munge
chown munge: /run/munge
pgrep -x munged >/dev/null || runuser -u munge -- /usr/sbin/munged
host=$(hostname -s)
export SLURM_CONF=$work/slurm.conf
cat >"$SLURM_CONF" <<CONF
ClusterName=night
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool.%n
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.%n.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.%n.log
SlurmctldPort=16817
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
MailProg=/bin/true
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=16818 CPUs=1 RealMemory=4000
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=16819 CPUs=1 RealMemory=4000
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
stop() {
  for pid in "$work"/slurm*.pid; do [[ -e $pid ]] && kill "$(cat "$pid")" 2>/dev/null; done
  true
}
trap stop EXIT
slurmctld
slurmd -N n1
slurmd -N n2
for _ in $(seq 30); do
  [[ $(sinfo -h -o %T -t idle -N | wc -l) -eq 2 ]] && break
  sleep 1
done
sinfo

drive=$work/drive
"$program" simulate "$root/config/worlds/tunnel.yaml" --out "$drive" --duration "$length_s" --only log,cloud --quiet \
  --set sensors.lidar.rows=16 --set sensors.lidar.columns=512 >/dev/null
"$program" map magnetic "$drive/log.bag" --trajectory "$drive/truth.tum" --platform "$drive/platform.yaml" \
  --out "$drive/field.yaml" --quiet >/dev/null
for ((i = 1; i < logs; ++i)); do ln -f "$drive/log.bag" "$work/logs/drive$i.bag"; done
: >"$work/logs/empty.bag"
cat >"$work/night.yaml" <<YAML
logs: $work/logs/*.bag
platform: $drive/platform.yaml
cloud: $drive/cloud.pcd
magnetic: $drive/field.yaml
out: $work/night
lodestone: $program
settings: {run: "--initial-pose-from $drive/truth.tum"}
YAML
cd "$work"
SECONDS=0
snakemake --profile "$root/tools/fleet/slurm" --snakefile "$root/tools/fleet/Snakefile" --configfile night.yaml \
  --latency-wait 5 >snakemake.log 2>&1 &
night=$!
# Kill the job of the first run that is under way.
killed=
while kill -0 "$night" 2>/dev/null; do
  if [[ -z $killed ]]; then
    killed=$(squeue -h -t running -n lodestone.GROUP -o %i | head -1)
    [[ -n $killed ]] && sleep 1 && scancel --signal=KILL --full "$killed" && echo "killed job $killed"
  fi
  sleep 0.5
done
wait "$night" || { tail -30 snakemake.log; exit 1; }
steps_s=$(jq -s 'map(.seconds) | add' night/drives/*/*.json)
echo "a night of $logs logs of $length_s s took $SECONDS s; its steps took $steps_s s on 2 nodes"
cat night/drives.csv
[[ -n $killed ]] || { echo "no job was killed" >&2; exit 1; }
expect() {
  [[ $(grep -c ",$2," night/drives.csv) -eq $1 ]] || { echo "expected $1 drives that are $2" >&2; exit 1; }
}
expect $((logs - 1)) done
expect 1 refused
cat >"$work/experiment.yaml" <<YAML
name: tunnel
seeds: [1]
estimators: [smoother]
duration_s: 10
groups:
  tunnel: {drives: [{world: $root/config/worlds/tunnel.yaml, sequences: ["3", "4"]}]}
tables:
  - {name: ate, group: tunnel, columns: [{estimator: smoother}]}
YAML
"$program" reproduce experiment.yaml --out experiment --profile "$root/tools/fleet/slurm"
echo "passed"
