#!/usr/bin/env bash
# Two profile scanners and a camera of JPEG planes send on real sockets. The points of both scanners come and are coloured, nothing is
# lost, and a replay gives the same bytes, also of the strips that are written beside the cloud.
# usage: two_scanners_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 scenario=$2/tests/scenarios/two_scanners.yaml second=$2/tests/scenarios/two_scanners_second.yaml
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
vehicle="--beside $second --pps-socket $work/pps.sock --data-port 42468 --position-port 48408 --pos-port 43101 --address 127.0.0.6"
fail() { echo "FAILED: $*"; cat devices.txt said.txt 2>/dev/null; exit 1; }

$hueline simulate "$scenario" --out sim --write-rig rig.yaml $vehicle >devices.txt 2>&1 || fail "rendering"
sed -i 's/^cloud:/cloud:\n  split: time:0.5s/' rig.yaml
grep -q "split: time:0.5s" rig.yaml || fail "the rig has no cloud"
$hueline simulate "$scenario" --out sim --play $vehicle >devices.txt 2>&1 &
devices=$!
$hueline capture rig.yaml --out drive --until-silent --seconds 60 --quiet >said.txt 2>&1 || fail "capture"
wait $devices || fail "devices"
grep -Eq "LaserData +[0-9]+ sent, 0 refused" devices.txt || fail "the scanners' datagrams"
grep -q "Lost x\|Overflow x\|Malformed x\|WrongDevice x" said.txt && fail "something was lost"
read -r first other <<<"$(sed -nE 's/^laser2? +([0-9]+) packets.*/\1/p' said.txt | tr '\n' ' ')"
[ "$first" -gt 500 ] && [ "$first" = "$other" ] || fail "datagrams of the two scanners: $first, $other"
grep -q "^camera     11 packets" said.txt || fail "images"
$hueline replay drive/drive.mcap --out again --threads 2 >/dev/null
cmp drive/cloud.las again/cloud.las || fail "the replay's points are not the live run's"
cmp drive/view.mcap again/view.mcap || fail "the replay's view is not the live run's"
# So are the strips, which are those of an export after the drive.
$hueline export drive --split time:0.5s --out strips >/dev/null
[ "$(ls drive/parts/strip_*.laz | wc -l)" -gt 3 ] || fail "strips"
diff -r drive/parts again/parts && diff -r drive/parts strips || fail "the strips of the live run are not those of the replay and of the export"
share=$(sed -nE 's/^points +[0-9]+, ([0-9]+)\.[0-9] % coloured.*/\1/p' said.txt)
[ "$share" -ge 75 ] || fail "$share % coloured"

# A drive of another vehicle cannot be played beside this one.
sed 's/^seed: .*/seed: 32/' "$second" >other.yaml
status=0
$hueline simulate "$scenario" --beside other.yaml --out sim >said.txt 2>&1 || status=$?
[ $status = 2 ] && grep -q "one vehicle on one drive" said.txt || fail "another drive was taken ($status)"

# Devices that come late are waited for: that one is not there yet is no word of it.
SECONDS=0 status=0
$hueline capture rig.yaml --out late --until-silent --seconds 8 --quiet >said.txt 2>&1 || status=$?
[ $SECONDS -ge 8 ] && [ $status = 5 ] && grep -q "nothing came from any sensor" said.txt || fail "gave up after $SECONDS s ($status)"
