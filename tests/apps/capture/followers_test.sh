#!/usr/bin/env bash
# Panoramas that are made while the vehicle drives, when something goes wrong: the capture is killed, one that makes them is killed, the capture
# is ended at once, the office program is missing, the rig has no head. (apps.drive has them when all is well.)
# usage: followers_test.sh HUELINE SOURCE_DIR
set -euo pipefail
# The test has a network of its own where that is allowed, because other tests use the same ports.
if [ -z "${OWN_NETWORK-}" ] && unshare -rn ip link set lo up 2>/dev/null; then OWN_NETWORK=1 exec unshare -rn "$0" "$@"; fi
[ -z "${OWN_NETWORK-}" ] || ip link set lo up
hueline=$1 source=$2
simulator=${HUELINE_SIMULATOR:-$hueline}  # emulates the devices: beside the sanitizers, the released program
work=$(mktemp -d)
trap 'kill -KILL $(jobs -p) $(followers) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; tail -n 30 said.txt drive/*.log devices.txt; exit 1; }
followers() { pgrep -f "[p]anorama $work/drive" || true; }
says() { grep -q -- "$1" said.txt || fail "it does not say: $1"; }
ports="--pps-socket $work/pps.sock --data-port 42372 --position-port 48312 --pos-port 43005 --can-port 40004 --address 127.0.0.2"
$simulator simulate "$source/tests/scenarios/short.yaml" --out sim --write-rig rig.yaml $ports >devices.txt
echo 'panoramas: {size: 64x32, exposures: "every:2", around_s: 0.5, vehicle: hide}' >>rig.yaml

# Begins a drive, and waits until it has panoramas. (They wait for as much of the drive behind them as around_s says.)
begin() {
  rm -rf drive
  $simulator simulate "$source/tests/scenarios/short.yaml" --out sim --play $ports >devices.txt 2>&1 & devices=$!
  env --default-signal=INT "$hueline" capture rig.yaml --out "$work/drive" --quiet >said.txt 2>&1 & capture=$!
  for i in $(seq 400); do if ls drive/panoramas/*.jpg >/dev/null 2>&1; then break; fi; sleep 0.1; done
  ls drive/panoramas/*.jpg >/dev/null 2>&1 || fail "no panorama while it drives"
}
# Waits for the end of those that make panoramas.
alone() { for i in $(seq 400); do if [ -z "$(followers)" ]; then return; fi; sleep 0.1; done; fail "who makes panoramas goes on"; }

begin
kill -KILL $capture; wait $capture 2>/dev/null || true
kill $devices 2>/dev/null || true; wait $devices 2>/dev/null || true
alone
grep -q "the recording was cut off" drive/panoramas.log || fail "a killed capture's panoramas end without a word"
made=$(ls drive/panoramas/*.jpg | wc -l)
[ "$made" -gt 0 ] && [ "$(wc -l <drive/panoramas/panoramas.csv)" = $((made + 1)) ] || fail "the table of a killed capture's panoramas"
status=0; $hueline panorama drive --out again --size 64x32 --exposures every:2 --around-s 0.5 --vehicle hide >said.txt 2>&1 || status=$?
[ $status = 3 ] || fail "panoramas of the cut recording gave $status"
diff -r again drive/panoramas || fail "the panoramas of a killed capture are not those of its recording"

begin
kill -KILL $(followers)
for i in $(seq 100); do if grep -q "panoramas: ended" said.txt; then break; fi; sleep 0.1; done
says "panoramas: ended before the drive, with status 137: .*; hueline panorama $work/drive --out $work/drive/panoramas --exposures every:2 --size 64x32 --vehicle hide --around-s 0.5 makes them again"
kill -INT $capture; status=0; wait $capture || status=$?
[ $status = 4 ] || fail "the capture whose panoramas failed gave $status"
kill $devices 2>/dev/null || true; wait $devices 2>/dev/null || true
[ -s drive/cloud.las ] && $hueline verify drive >/dev/null || fail "the drive itself is not whole"

# The program that makes panoramas stands still; the operator does not wait.
begin
kill -STOP $(followers)
kill -INT $capture
for i in $(seq 400); do if grep -q "panoramas: they are still being made" said.txt; then break; fi; sleep 0.1; done
says "panoramas: they are still being made"
kill -INT $capture; status=0; wait $capture || status=$?
[ $status = 7 ] || fail "panoramas that are not waited for gave $status"
says "panoramas: left unfinished; hueline panorama"
kill -CONT $(followers) 2>/dev/null || true
kill $devices 2>/dev/null || true; wait $devices 2>/dev/null || true
alone
$hueline verify drive >/dev/null || fail "the recording is not whole"

# A computer that has the package of the vehicle alone.
mkdir bin && cp "$hueline" bin/hueline
rm -rf drive
status=0; bin/hueline capture rig.yaml --out drive --quiet --seconds 3 >said.txt 2>&1 || status=$?
says "panoramas: ended before the drive, with status .*hueline-office"
status=0; bin/hueline check rig.yaml >said.txt 2>&1 || status=$?
says "no panoramas are made"

printf 'rig: nobody\nsensors:\n  - {name: pps, driver: pps, socket: pps.sock}\ncolouring: {method: lens}\npanoramas: {}\n' >headless.yaml
status=0; $hueline inspect headless.yaml >said.txt 2>&1 || status=$?
[ $status = 2 ] || fail "panoramas without a head gave $status"
says "key 'panoramas' needs a camera head"
printf 'rig: nobody\nsensors:\n  - {name: pps, driver: pps, socket: pps.sock}\ncolouring: {method: lens}\npanoramas: {size: 100x60}\n' >headless.yaml
status=0; $hueline inspect headless.yaml >said.txt 2>&1 || status=$?
says "headless.yaml:5.*panoramas.size.*100x60.*allowed: WIDTHxHEIGHT"
echo "panoramas while driving: what fails is told, and the drive is whole"
