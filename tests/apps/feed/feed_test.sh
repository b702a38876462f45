#!/usr/bin/env bash
# The live feed: a mark in the moment in which it appears is kept. Of an emulated drive: a listener gets its messages, marks and stops the drive, a second one that never reads loses messages and
# nothing else happens; a replay gives the same bytes, with the marks, whether somebody listens or not.
# usage: feed_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
simulator=${HUELINE_SIMULATOR:-$hueline}  # emulates the devices: beside the sanitizers, the released program
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
# A path that is longer than a socket's address.
deep=$work/$(printf 'd%.0s' {1..60})/$(printf 'e%.0s' {1..60})
mkdir -p "$deep"
cd "$deep"
. "$source/tests/apps/program.sh"
ports="--pps-socket $work/pps.sock --data-port 42378 --position-port 48318 --pos-port 43011 --can-port 40010 --address 127.0.0.3"
PYTHONPATH=$source/tests/apps/feed python3 "$source/tests/apps/feed/feed_early.py" "$hueline" >said.txt 2>&1 || fail "a mark at once"
# Long enough for a listener on a busy computer; the listener's stop ends the capture, not the drive's end.
sed 's/^duration_s: .*/duration_s: 20/' "$source/tests/scenarios/short.yaml" >scenario.yaml
$simulator simulate scenario.yaml --out sim --write-rig rig.yaml $ports >said.txt 2>&1 || fail "rendering"
$simulator simulate scenario.yaml --out sim --play $ports >devices.txt 2>&1 &
$hueline capture rig.yaml --out drive --seconds 120 --quiet >capture.txt 2>&1 & capture=$!
PYTHONPATH=$source/tests/apps/feed python3 "$source/tests/apps/feed/feed_capture.py" drive >said.txt 2>&1 || { cat capture.txt; fail "the listener of the capture"; }
got=0; wait $capture || got=$?
[ $got = 0 ] || [ $got = 8 ] || { cat capture.txt; fail "the capture gave $got"; }
[ ! -e drive/feed ] || fail "the socket is still there"
ends $got $hueline replay drive --out alone --no-feed
$hueline replay drive --out heard --speed 2 >/dev/null 2>&1 & replay=$!
PYTHONPATH=$source/tests/apps/feed python3 "$source/tests/apps/feed/feed_replay.py" heard >said.txt 2>&1 || fail "the listener of the replay"
got=0; wait $replay || got=$?
for run in alone heard; do
  for file in cloud.las view.mcap report.html report.pdf; do cmp drive/$file $run/$file || fail "$run/$file is not the live run's"; done
done
cmp alone/summary.json heard/summary.json || fail "the summaries of two replays differ"
python3 - drive/summary.json alone/summary.json <<'END' || fail "the marks"
import json, sys
live, replay = (json.load(open(name))["marks"] for name in sys.argv[1:])
assert live == replay, (live, replay)
assert [m["note"] for m in live] == ["first", "bump \u2713 \u8def\u53e3"], live
END
grep -q "M2</th>" drive/report.html || fail "the report does not list the marks"
grep -q '<g class="mark">' drive/report.html || fail "the marks are not on the map"
echo "the feed said what the drive did; capture and replays agree"
