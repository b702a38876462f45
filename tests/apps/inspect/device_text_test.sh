#!/usr/bin/env bash
# Texts of devices that are not UTF-8, or that would control a terminal, go through capture, replay and inspect. They are recorded as they
# came, and shown safely.
# usage: device_text_test.sh HUELINE
set -euo pipefail
hueline=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$(dirname "$(realpath "$0")")/../program.sh"

printf '\r\n<ERROR:no \xe9\xff \x1b[2J\x1b]0;owned\x07 such log\r\n[COM1]' >pos.gps
{
  for i in $(seq 100 150); do echo "(1700000000.$i) can0 155#0102030405060708"; done
  printf '(1700000001.000) can0 \xb0\x1b[31m#01\n'
} >bus.log
printf 'rig: words\nsensors:\n  - {name: pos, driver: novatel, file: pos.gps}\n' >rig.yaml
cat >>rig.yaml <<'YAML'
  - name: wheel
    driver: wheel
    can_log: {file: bus.log}
    messages: [{id: 341, speeds: [{unit: km/h, start_bit: 0, bits: 16, scale: 0.01}]}]
colouring: {method: lens}
YAML
# The file has bytes that a terminal would obey, or that are no UTF-8.
unsafe() { LC_ALL=C grep -qaP '[\x00-\x08\x0b-\x1f\x7f]' "$1" || ! iconv -f UTF-8 -t UTF-8 "$1" >/dev/null 2>&1; }
safe() { unsafe "$1" && fail "$2 is not safe to show"; return 0; }

ends 5 "$hueline" capture rig.yaml --out drive --quiet
says "line 52: no id in .*can0 .xb0.x1b\[31m#01"
says 'Refused x1'
safe said.txt "what capture says"
safe drive/summary.json "summary.json"
grep -qF 'can0 \\xb0\\x1b[31m#01' drive/summary.json || fail "the summary does not quote the log"
LC_ALL=C grep -qaP 'no \xe9\xff \x1b\[2J' drive/drive.mcap || fail "the receiver's bytes are not recorded as they came"
LC_ALL=C grep -qaP '\xb0\x1b\[31m' drive/drive.mcap && fail "the log's line is recorded as a fault of raw bytes"
ends 5 "$hueline" replay drive/drive.mcap --out again
cmp drive/summary.json again/summary.json || fail "the replay's summary differs"
for form in "" --json; do
  ends 0 "$hueline" inspect drive/drive.mcap $form
  safe said.txt "what inspect says $form"
  says 'xb0.+x1b\[31m#01'
done
ends 3 "$hueline" inspect bus.log --json
safe said.txt "what inspect says of the log"
printf 'VERSION ""\nBU_: X\nBO_ 1 M: 8 X\n SG_ Temp\xe9 : 0|16@1+ (0.1,0) [0|0] "\xb0C\x1b[31m" X\n' >signals.dbc
got=0; "$hueline" inspect signals.dbc --json >said.txt 2>&1 || got=$?
[ $got = 0 ] || [ $got = 3 ] || fail "inspect of a DBC in Latin-1 gave $got"
safe said.txt "what inspect says of the DBC"
ends 3 "$hueline" inspect "$(printf 'no\xff\x1b[31m.mcap')"
safe said.txt "a file's name"
echo "what devices say is recorded as it came and shown safely"
