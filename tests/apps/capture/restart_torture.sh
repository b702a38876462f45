#!/usr/bin/env bash
# All devices of a vehicle restart at once, again and again, without notice, while a capture runs with other programs beside it. The
# capture continues, every device is found again and its absence is reported, the recording is whole, and a replay gives the same bytes.
# usage: restart_torture.sh HUELINE SOURCE_DIR [RESTARTS [SEED [BUSY_PROGRAMS [cameras]]]]
# With "cameras" the head's camera is among the devices. The test suite runs a few restarts; 200 take about ten minutes.
set -euo pipefail
hueline=$1 source=$2 restarts=${3:-3} RANDOM=${4:-1} busy=${5:-2} cameras=${6:-}
simulator=${HUELINE_SIMULATOR:-$hueline}  # emulates the devices: beside the sanitizers, the released program
work=$(mktemp -d)
trap 'kill -KILL $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
ports="--pps-socket $work/pps.sock --data-port 42568 --position-port 48508 --pos-port 43201 --can-port 40200 --address 127.0.0.9"
fail() { echo "FAILED: $*"; tail -n 40 devices.txt said.txt 2>/dev/null; exit 1; }

cp "$source/tests/scenarios/short.yaml" scenario.yaml
[ "$cameras" = cameras ] || sed -i 's/rate_hz: 4, lens_width/rate_hz: 0.1, first_exposure_s: 10, lens_width/' scenario.yaml  # never
$simulator simulate scenario.yaml --out sim --write-rig whole.yaml $ports >devices.txt 2>&1 || fail "rendering"
cp whole.yaml rig.yaml
[ "$cameras" = cameras ] || awk '/^  - name: /{is_left_out = /camera$/} /^[a-z]/{is_left_out = /^head:/} !is_left_out' whole.yaml >rig.yaml

$hueline capture rig.yaml --out drive --quiet >said.txt 2>&1 & capture=$!
for ((i = 0; i < busy; ++i)); do (while :; do :; done) & done
goes_on() { kill -0 $capture 2>/dev/null || { wait $capture && status=0 || status=$?; fail "the capture ended by itself ($status) $*"; }; }
# The capture tries again with back-off. A device that it has not found again yet cannot be reported as gone.
found() { ss -Hxn | grep -q "ESTAB.* $work/pps.sock " && ss -Htn state established 'sport = :43201' | grep -q .; }
recorded() { stat -c %s drive/drive.mcap 2>/dev/null || echo 0; }
for ((i = 1; i <= restarts; ++i)); do
  before=$(recorded)
  $simulator simulate scenario.yaml --out sim --play --wait 60 $ports >devices.txt 2>&1 & devices=$!
  # This waits until something of the devices is recorded, so that each restart counts as one, however busy the computer is.
  for ((tenths = 0; ; ++tenths)); do
    if [ "$(recorded)" -gt $((before + 20000)) ] && found; then break; fi
    goes_on "before restart $i"
    kill -0 $devices 2>/dev/null || fail "the devices ended before the capture had found all of them at start $i"
    [ $tenths -lt 900 ] || fail "nothing came of the devices at start $i"
    sleep 0.1
  done
  sleep $((RANDOM % 5)).$((RANDOM % 10))
  kill -KILL $devices 2>/dev/null || true
  wait $devices 2>/dev/null || true
  goes_on "at restart $i"
done
# From now on they stay until the end of their drive.
$simulator simulate scenario.yaml --out sim --play --wait 60 $ports >devices.txt 2>&1 || fail "devices at the end"
goes_on "at the end"
kill -INT $capture
status=0; wait $capture || status=$?
# 5: a clock that starts anew so often may place nothing; 8: what was lost meanwhile has to be driven again
[ $status = 0 ] || [ $status = 5 ] || [ $status = 8 ] || fail "the capture ended with $status"

# told SENSOR KIND: prints the number of its faults
told() {
  awk -v sensor="$1" -v kind="$2" '/^[^ ]/{is_it = $1 == sensor}
    is_it && match($0, "(^|[ ,])" kind " x[0-9]+") {split(substr($0, RSTART, RLENGTH), part, " x"); n += part[2]}
    END{print n + 0}' said.txt
}
for sensor in pps pos; do
  gone=$(told $sensor Disconnected) back=$(told $sensor Reconnected)
  [ "$gone" -ge "$restarts" ] || fail "$sensor went at $restarts restarts, $gone are told"
  [ "$back" -ge "$restarts" ] || fail "$sensor came back at $restarts restarts, $back are told"
done
# The absence of a camera is noticed after seconds only, and the camera may not have been found again before the next restart. So only
# some restarts are seen, but each return must follow an absence that was reported.
if [ "$cameras" = cameras ]; then
  gone=$(($(told camera Disconnected) + $(told camera Silent))) back=$(told camera Reconnected)
  [ "$gone" -ge "$back" ] || fail "the camera came back $back times, and went or fell silent $gone times"
  [ $((back * 2)) -ge "$restarts" ] || fail "the camera came back at $back of $restarts restarts"
fi
$hueline inspect drive/drive.mcap >inspected.txt 2>&1 || { cat inspected.txt; fail "the recording is not whole"; }
$hueline replay drive/drive.mcap --out again >/dev/null 2>replayed.txt || [ $? = $status ] || { cat replayed.txt; fail "the replay ended otherwise than the capture"; }
cmp drive/cloud.las again/cloud.las || fail "the replay's points are not the live run's"
cmp drive/view.mcap again/view.mcap || fail "the replay's view is not the live run's"
echo "$restarts restarts of all devices: $(told pos Disconnected) told of the POS, $(recorded) bytes recorded, the replay is the same"
