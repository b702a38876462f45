#!/usr/bin/env bash
# A capture as a service: it tells its manager that it is ready, alive and ending; the journal gets levels; a start after a kill makes a new
# drive beside the old one; the rig's end_within_s limits its end. And the units: what they may is "OK" or better.
# usage: service_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
printf 'rig: nobody\nsensors:\n  - {name: pps, driver: pps, socket: pps.sock}\ncolouring: {method: lens}\n' >rig.yaml

# A service manager that prints what it is told, one line a word.
cat >manager.py <<'END'
import os, socket, sys
own = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
own.bind("notify")
open("manager.ready", "w").close()
while True:
    text = own.recv(4096).decode()
    print(text, flush=True)
    if "STOPPING=1" in text.split("\n"):
        break
END
python3 manager.py >told.txt & manager=$!
for _ in {1..100}; do [ ! -e manager.ready ] || break; sleep 0.1; done
capture() { NOTIFY_SOCKET=$work/notify exec "$hueline" capture rig.yaml --drives drives --quiet >said.txt 2>&1; }
# told REGULAR_EXPRESSION COUNT: the manager has been told so, or is within 20 s
told() { for _ in {1..200}; do [ "$(grep -cE "$1" told.txt)" -lt "$2" ] || return 0; sleep 0.1; done; cat told.txt; fail "the manager was not told $1"; }

capture & first=$!
told '^READY=1$' 1
told '^WATCHDOG=1$' 2
told '^STATUS=[0-9]+ s, [0-9.]+ MB recorded, 0 points$' 1
kill -9 $first
wait $first && fail "killed, and well" || true
capture & second=$!
told '^READY=1$' 2
[ "$(ls drives | wc -l)" = 2 ] || fail "not two drives: $(ls drives)"
for drive in drives/*; do [ -s "$drive/drive.mcap" ] || fail "$drive has no recording"; done
kill $second
told '^STOPPING=1$' 1
got=0; wait $second || got=$?
[ $got = 5 ] || fail "the end gave $got"
wait $manager
ends 2 "$hueline" capture rig.yaml
says "give --out FOLDER for this drive, or --drives FOLDER"
ends 2 "$hueline" capture rig.yaml --out a --drives drives

# The journal's levels: a line that is no level would be information.
exec 3>journal.txt
JOURNAL_STREAM=$(stat -L -c %d:%i /proc/self/fd/3) "$hueline" capture rig.yaml --out levels --seconds 1 --quiet 2>&3 >/dev/null && fail "nobody came, and well" || true
exec 3>&-
grep -q '^<6>capturing' journal.txt || fail "no information: $(cat journal.txt)"
grep -q '^<3>nothing came' journal.txt || fail "no error: $(cat journal.txt)"

if command -v systemd-analyze >/dev/null; then
  for unit in hueline@ hueline-console; do
    cp "$source/packaging/systemd/$unit.service" .
    systemd-analyze security --offline=true --threshold=49 "$PWD/$unit.service" >said.txt 2>&1 || fail "$unit: its rights are not OK"
  done
  # Unknown words in a unit are warnings that nobody reads.
  sed -i "s|/usr/bin/hueline|$hueline|; /^Documentation=/d" hueline@.service
  cp hueline@.service hueline@street.service
  systemd-analyze verify "$PWD/hueline@street.service" >said.txt 2>&1 || true
  ! grep -E "hueline@.*(Unknown|Failed to parse|ignoring|Invalid)" said.txt || fail "the unit"
fi
echo "ready, alive, killed, begun anew and ended"
