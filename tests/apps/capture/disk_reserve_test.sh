#!/usr/bin/env bash
# The disk becomes full while a vehicle drives. Cloud and view end first and leave the rest to the recording. When another program then
# takes that space too, the recording ends whole. A replay elsewhere gives everything that was recorded, and begins with what the live run
# wrote.
# usage: disk_reserve_test.sh HUELINE SOURCE_DIR
set -euo pipefail
# The test has a disk of its own, a small one in memory, in a namespace that may mount it. It also has a network of its own, because other
# tests use the same ports.
if [ -z "${OWN_SPACE-}" ]; then
  unshare -rmn true 2>/dev/null || { echo "SKIPPED: this user may not make namespaces, so there is no small disk to fill"; exit 77; }
  OWN_SPACE=1 exec unshare -rmn "$0" "$@"
fi
hueline=$1 source=$2
simulator=${HUELINE_SIMULATOR:-$hueline}  # emulates the devices: beside the sanitizers, the released program
ip link set lo up
work=$(mktemp -d)
trap 'kill -KILL $(jobs -p) 2>/dev/null || true; umount "$work/disk" 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
mkdir disk
scenario=$source/tests/scenarios/short.yaml
ports="--pps-socket $work/pps.sock --data-port 42470 --position-port 48410 --pos-port 43103 --can-port 40102 --address 127.0.0.3"
$simulator simulate "$scenario" --out sim --write-rig rig.yaml $ports >devices.txt 2>&1

# drive MEGABYTES: captures a whole drive onto a disk of that size. Its status is in $status, its output in said.txt.
drive() {
  mount -t tmpfs -o "size=$1m" disk disk
  $simulator simulate "$scenario" --out sim --play $ports >devices.txt 2>&1 & local devices=$!
  $hueline capture rig.yaml --out disk/drive --until-silent --quiet >said.txt 2>&1 & local capture=$!
  [ $# = 1 ] || { sleep 6; head -c 200000000 /dev/zero >disk/others.bin 2>/dev/null || true; }
  status=0; wait $capture || status=$?
  wait $devices 2>/dev/null || true
}
little() { od -An -tu"$3" -j"$2" -N"$3" "$1" | tr -d ' '; }
points() { little "$1" 247 8; }

# 64 MB, and the data of five minutes at the recording's own rate, are kept for the recording. From some moment of the drive on, 90 MB are
# too few for that.
drive 90
[ $status = 4 ] || fail "a disk with too little room gave $status, not 4"
says "cloud.las, view.mcap: .*they end here, a replay makes them whole; the raw recording goes on"
says "ends early"
ends 0 $hueline inspect disk/drive/drive.mcap
ends 0 $hueline replay disk/drive/drive.mcap --out again
[ "$(points disk/drive/cloud.las)" -lt "$(points again/cloud.las)" ] || fail "the cloud did not end early"
echo "the cloud has $(points disk/drive/cloud.las) of $(points again/cloud.las) points"
[ "$(points again/cloud.las)" -gt 10000 ] || fail "the replay has only $(points again/cloud.las) points"
if [ "$(points disk/drive/cloud.las)" -gt 0 ]; then
  at=$(little again/cloud.las 96 4) size=$(little again/cloud.las 105 2)
  cmp -n $(($(points disk/drive/cloud.las) * size)) disk/drive/cloud.las again/cloud.las "$at" "$at" || fail "what was written is not the replay's beginning"
fi
umount disk; rm -rf again

# Another program takes the space that was kept. The recording ends there, whole, and says so.
drive 90 taken
[ $status = 4 ] || fail "a full disk gave $status, not 4"
says "recording ended early: .*No space left on device.*drive.mcap holds the first [0-9]+ packets, whole"
held=$(sed -n 's/.*drive.mcap holds the first \([0-9]*\) packets, whole.*/\1/p' said.txt | head -1)
rm disk/others.bin
# There may have been no room for its end mark. It is then read as a recording that was cut, whole up to there.
got=0; $hueline inspect disk/drive/drive.mcap >said.txt 2>&1 || got=$?
case $got in 0) ;; 3) says "the recording was cut off; whole up to byte" ;; *) fail "inspect gave $got" ;; esac
says "^packets +$held\$"
# What was recorded until then may be too little for a good drive: on a slow machine, not even the camera's clock is known by then.
replayed=0; $hueline replay disk/drive/drive.mcap --out again >said.txt 2>&1 || replayed=$?
case $replayed in "$got" | 5 | 8) ;; *) fail "the replay gave $replayed" ;; esac
umount disk
echo "the disk's last space is the recording's, and when that is taken it holds what it says"
