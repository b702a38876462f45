#!/usr/bin/env bash
# hueline fleet submit on a real Slurm with two nodes: twenty drives of which one is damaged; a node loses its power in the middle of a task,
# which is queued again; the controller is started again meanwhile. The results are those of single replays, byte by byte.
# usage: slurm_test.sh HUELINE IMAGE_PROOF SOURCE_DIR
set -euo pipefail
hueline=$1 proof=$2 source=$3
work=$(mktemp -d)
cluster=$work/cluster
source "$source/tests/apps/program.sh"
source "$source/tests/apps/fleet/drives.sh"
source "$source/tests/apps/fleet/slurm.sh"
trap 'stop_slurm; rm -rf "$work"' EXIT
cd "$work"
has_slurm || { echo "SKIPPED: Slurm is not installed (slurmctld, slurmd, slurm-client, munge)"; exit 77; }
start_slurm || { echo "SKIPPED: no Slurm can be started here: $(cat why.txt)"; exit 77; }

# Five drives that differ, four times each.
make_drives 5
singles
for ((i = 6; i <= 20; i++)); do
  cp -r "drives/$(((i - 1) % 5 + 1))" "drives/$i"
  ln -s "$(((i - 1) % 5 + 1))" "single/$i"
done
ends 0 "$hueline" fleet plan drives/* --out fleet.json
cp drives/13/drive.mcap saved.mcap
printf 'X' | dd of=drives/13/drive.mcap bs=1 seek=100000 conv=notrunc status=none

# queue_ends SECONDS: waits until no job is left
queue_ends() {
  for ((i = 0; i < $1 * 5; i++)); do
    squeue -h >queue.txt 2>&1 && [ ! -s queue.txt ] && return 0
    sleep 0.2
  done
  fail "the queue does not end: $(cat queue.txt; scontrol show job; cat "$cluster/slurmctld.log")"
}
begin=$SECONDS
ends 0 "$hueline" fleet submit fleet.json --threads 1 --time 5 --sbatch=--comment=test
says "Submitted batch job [0-9]+"
ends 7 "$hueline" fleet status fleet.json
kill_node node1 replay || fail "no task to kill"
kill "$(cat "$cluster/slurmctld.pid")"
while kill -0 "$(cat "$cluster/slurmctld.pid" 2>/dev/null)" 2>/dev/null; do sleep 0.1; done
slurmctld
# The node comes back when the controller has missed it.
for ((i = 0; i < 300; i++)); do [ "$(sinfo -h -N -n node1 -o %t 2>/dev/null)" = down ] && break; sleep 0.1; done
slurmd -N node1
queue_ends 120
took=$((SECONDS - begin))
scontrol show job >jobs.txt
grep -q "Restarts=[1-9]" jobs.txt || fail "no task was queued again: $(cat jobs.txt)"
for node in node1 node2; do grep -q " *NodeList=$node" jobs.txt || fail "nothing ran on $node"; done
[ "$(grep -c "Comment=test" jobs.txt)" = 20 ] || fail "options for sbatch: $(cat jobs.txt)"
ends 3 "$hueline" fleet status fleet.json
says "^19 of 20 drives done; "
says "^1 failed, an input is not what it was when the plan was made: 13$"
[ "$(grep -c "ExitCode=3:0" jobs.txt)" = 1 ] || fail "Slurm knows another failure: $(grep -B5 -A20 ExitCode=3 jobs.txt)"
same_as_singles 1 2 3 4 5 6 7 8 9 10 11 12 14 15 16 17 18 19 20
[ -z "$(compgen -G 'fleet/.*.attempt.*')" ] || fail "left: $(ls -A fleet)"

# What has failed is submitted again, and nothing else.
mv saved.mcap drives/13/drive.mcap
ends 0 "$hueline" fleet submit fleet.json --threads 1
queue_ends 60
ends 0 "$hueline" fleet status fleet.json
same_as_singles 13
ends 0 "$hueline" fleet submit fleet.json --threads 1
says "all 20 drives are done"
echo "20 drives on two nodes in $took s, with a node killed and the controller started again, gave the bytes of single replays"
