#!/usr/bin/env bash
# A camera adapts its shutter in a tunnel and reports it: all lenses alike as GenICam chunks, then each lens its own inside the images. Each
# exposure has the time of its own middle, each lens sees each place from where it was, and a replay gives the same bytes.
# usage: shutter_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
ports="--pps-socket $work/pps.sock --data-port 42568 --position-port 48508 --pos-port 43201 --address 127.0.0.8"
fail() { echo "FAILED: $*"; cat devices.txt said.txt verified.json 2>/dev/null; exit 1; }

cp "$source/tests/scenarios/shutter.yaml" chunks.yaml
sed 's/auto_exposure_sets: shutter,/auto_exposure_sets: shutters, payload: jpeg_planes, jpeg_quality: 90,/' chunks.yaml >lenses.yaml
for kind in chunks lenses; do
  $hueline simulate $kind.yaml --out sim --write-rig $kind-rig.yaml $ports >devices.txt 2>&1 || fail "rendering"
  $hueline simulate $kind.yaml --out sim --play $ports >devices.txt 2>&1 &
  devices=$!
  $hueline capture $kind-rig.yaml --out $kind --until-silent --seconds 60 --quiet >said.txt 2>&1 || fail "capture"
  wait $devices || fail "devices"
  $hueline replay $kind --out again --threads 2 >said.txt 2>&1 || fail "replay"
  cmp $kind/cloud.las again/cloud.las || fail "the replay's points are not the live run's"
  rm -rf again
  $hueline verify $kind/drive.mcap --scenario $kind.yaml --sim sim --max-rms-px 1.0 --json >verified.json || fail "reprojection"
  python3 - <<'EOF' || fail "$kind: times of the exposures"
import json
found = json.load(open("verified.json"))["exposure_time_error_us"]
assert found["exposures"] >= 20 and found["max"] < 10, found
EOF
done
grep -q "auto_exposure: true" chunks-rig.yaml && grep -q "shutter_step_us: 1" lenses-rig.yaml || fail "the rigs"
