#!/bin/bash
# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
#
# A Slurm of two nodes on this machine, started here: the archive gives the same bytes as without it, and
# also when a node is killed in mid-run and then Snakemake itself.
source "$(dirname "$0")/common.sh"
export CI=true  # Snakemake asks for its jobs each second then, not each ten
PATH=$PATH:/usr/sbin
for program in munged slurmctld slurmd sbatch scontrol; do
  command -v $program >/dev/null || { echo "$program is missing: scripts/setup.sh --batch"; exit 77; }
done
# A node is a process namespace, so that it can be killed with all that runs on it.
unshare --pid --fork --kill-child --mount-proc true 2>/dev/null || { echo "unshare is not permitted here"; exit 77; }
grep -q ' /sys/fs/cgroup' /proc/mounts || { echo "slurmd wants /sys/fs/cgroup, which is not mounted"; exit 77; }

cluster=$(mktemp -d)  # short: the socket's path is limited to 108 characters
chmod 755 "$cluster"
nodes=() munged='' controller='' runs=()
clean_up() {
  for pid in "${runs[@]}"; do kill -9 -- "-$pid" 2>/dev/null || true; done
  for pid in "${nodes[@]}" $controller $munged; do kill -9 "$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf "$cluster"
}
trap clean_up EXIT

mkdir "$cluster/state" "$cluster/spool-n1" "$cluster/spool-n2"
head -c 1024 /dev/urandom >"$cluster/munge.key"
chmod 600 "$cluster/munge.key"
munged --foreground --key-file="$cluster/munge.key" --socket="$cluster/munge" --num-threads=2 \
  --pid-file="$cluster/munged.pid" --log-file="$cluster/munged.log" --seed-file="$cluster/munged.seed" &
munged=$!
port=$((20000 + $$ % 12000))  # below those that systems give away
export SLURM_CONF=$cluster/slurm.conf
cat >"$SLURM_CONF" <<CONF
ClusterName=vlp
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmctldPort=$port
AuthType=auth/munge
AuthInfo=socket=$cluster/munge
CredType=cred/munge
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool-%n
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/slurmd-%n.pid
SlurmctldLogFile=$cluster/slurmctld.log
SlurmdLogFile=$cluster/slurmd-%n.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
ReturnToService=2
SlurmdTimeout=10
MpiDefault=none
NodeName=n[1-2] NodeHostname=$(hostname -s) NodeAddr=127.0.0.1 Port=$((port + 1))-$((port + 2)) CPUs=1 RealMemory=4000
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
patiently 30 test -S "$cluster/munge"
slurmctld -D >/dev/null 2>&1 &
controller=$!
for node in n1 n2; do
  # A shell comes first in it: it takes leave of what ended without its parent, and a group that never empties would
  # have Slurm drain the node.
  unshare --pid --fork --kill-child --mount-proc bash -c "slurmd -D -N $node & wait" >/dev/null 2>&1 &
  nodes+=($!)
done
both_idle() { [ "$(sinfo --noheader --states=idle --format=%D)" = 2 ]; }
patiently 60 both_idle

results=$scratch/slurm
rm -rf "$results" "$results-killed"
reprocess "$results" --profile slurm --shard-size 3
expect_baseline "$results"
done_on_n2() { scontrol show job --oneliner | grep 'JobState=COMPLETED.*BatchHost=n2'; }
done_on_n2 >/dev/null || fail "no job ran on the second node: $(scontrol show job --oneliner)"

# Snakemake's plugin keeps SLURM_CONF from the srun in its jobs, which on a cluster finds its configuration without.
mkdir "$cluster/bin"
printf '#!/bin/bash\nSLURM_CONF=%s exec %s "$@"\n' "$SLURM_CONF" "$(command -v srun)" >"$cluster/bin/srun"
chmod +x "$cluster/bin/srun"
for python in $(other_snakemakes); do
  results=$scratch/slurm-other
  rm -rf "$results"
  PATH=$cluster/bin:$PATH VLP_PYTHON=$python reprocess "$results" --profile slurm --shard-size 5
  expect_baseline "$results"
  for shard in 000000 000001; do
    grep -q "has been submitted with SLURM jobid .*/rule_shard/$shard/" "$results/.state/reprocess.log" ||
      fail "shard $shard was not submitted: $(cat "$results/.state/reprocess.log")"
  done
done

results=$scratch/slurm-killed
start_reprocess "$results" --profile slurm --shard-size 3
runs+=($!)
works_on_n2() { squeue --noheader --states=running --nodelist=n2 | grep vlp; }
patiently 120 works_on_n2
kill -9 "${nodes[1]}"
scontrol update NodeName=n2 State=DOWN Reason=killed  # Slurm finds out alone, but later
node_failed() { scontrol show job --oneliner | grep JobState=NODE_FAIL; }
patiently 120 node_failed
a_shard_is_done() { ls "$results"/.state/rows/*.csv; }
patiently 300 a_shard_is_done
kill -0 "${runs[0]}" 2>/dev/null || fail "the run ended with its node: $(cat "$said")"
kill -9 -- "-${runs[0]}"
patiently 60 flock --nonblock "$results/.state/lock" true  # what was killed may take a moment to end
[ ! -e "$results/summary.csv" ] || fail "Snakemake was killed too late"
reprocess "$results" --profile slurm --shard-size 3
expect_baseline "$results"
