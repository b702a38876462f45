#!/usr/bin/env bash
# drive.mcap is deleted, moved, replaced and cut while it is recorded. This is reported at once and at the end, the status is 4, and what
# can be saved is saved as the message says.
# usage: recording_gone_test.sh HUELINE
set -euo pipefail
hueline=$1
work=$(mktemp -d)
capture=
trap '[ -z "$capture" ] || kill -KILL $capture 2>/dev/null; rm -rf "$work"' EXIT
cd "$work"
source "$(dirname "$(realpath "$0")")/../program.sh"

# No device is at the other end. One tick a second is recorded.
printf 'rig: nobody\nsensors:\n  - {name: pps, driver: pps, socket: pps.sock}\ncolouring: {method: lens}\n' >rig.yaml
# DRIVE WHAT-HAPPENS: its output is in said.txt.
happens() {
  "$hueline" capture rig.yaml --out "$1" --quiet >said.txt 2>&1 & capture=$!
  for i in $(seq 600); do if [ -s "$1/drive.mcap" ]; then break; fi; sleep 0.05; done
  eval "$2"
  for i in $(seq 600); do if grep -q "error" said.txt; then break; fi; sleep 0.05; done
  grep -q "error" said.txt || fail "$1: nothing is told while it runs"
}
finish() { kill -INT $capture 2>/dev/null || kill -TERM $capture 2>/dev/null || true; kill -TERM $capture 2>/dev/null || true; local got=0; wait $capture || got=$?; capture=; [ $got = 4 ] || fail "$1 gave $got, not 4"; }

happens deleted 'rm deleted/drive.mcap'
says "deleted/drive.mcap was deleted while it is being written; as long as this program runs, save it: cp /proc/[0-9]*/fd/[0-9]* SAVED.mcap"
$(sed -n 's/.*save it: \(cp [^ ]*\) SAVED.mcap.*/\1/p' said.txt | head -1) saved.mcap
finish deleted
says "is not the recording of this drive"
grep -q '"kind": "DiskFull"' deleted/summary.json || fail "the summary does not have it"
"$hueline" inspect saved.mcap >inspected.txt 2>&1 || true
grep -q "^packets  *[1-9]" inspected.txt || { cat inspected.txt; fail "what was saved holds nothing"; }

happens moved 'mv moved/drive.mcap elsewhere.mcap; echo other >moved/drive.mcap'
says "was moved or replaced"
finish moved
ends 0 "$hueline" inspect elsewhere.mcap
says "DiskFull"
grep -q other moved/drive.mcap || fail "what replaced it was written over"

happens cut ': >cut/drive.mcap'
finish cut
says "was cut by another program"
echo "a recording that is taken away is told"
