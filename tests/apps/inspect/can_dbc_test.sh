#!/usr/bin/env bash
# A log of a CAN bus with the DBC file that describes it.
# usage: can_dbc_test.sh HUELINE SOURCE
set -euo pipefail
hueline=$1 dbc=$2/tests/drivers/can/multiplexed.dbc
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$(dirname "$(realpath "$0")")/../program.sh"

{
  echo '(1700000000.000) can0 064#00FEFF0000000009'
  echo '(1700000000.010) can0 064#0114000000000000'
  echo '(1700000000.020) can0 7FF#01'
} >bus.log
ends 0 "$hueline" inspect bus.log --dbc "$dbc" --json
python3 - <<'PY' || fail "what inspect says of the signals"
import json
messages = {m["id"]: m for m in json.load(open("said.txt"))["messages"]}
signals = messages["064"]["signals"]
assert messages["064"]["name"] == "Simple"
assert signals["Zero"] == {"frames": 1, "min": -4.0, "max": -4.0, "last": -4.0, "unit": "m"}, signals["Zero"]
assert signals["One"]["last"] == 40.0 and signals["Always"]["frames"] == 2 and signals["Always"]["max"] == 9.0
assert signals["Selector"]["words"] == {"zero": 1, "one; or more": 1}
assert "signals" not in messages["7FF"]
PY
# Two buses in one log, where the same id is not the same message.
printf '(1.0) can0 064#00FEFF0000000009\n(1.1) can1 064#0000000000000009\n' >buses.log
ends 0 "$hueline" inspect buses.log --dbc "$dbc" --json
python3 - <<'PY' || fail "what inspect says of two buses"
import json
said = json.load(open("said.txt"))
assert said["frames_by_channel"] == {"can0": 1, "can1": 1}, said
lows = {m["channel"]: m["signals"]["Zero"]["min"] for m in said["messages"]}
assert lows == {"can0": -4.0, "can1": -3.0}, lows
PY
ends 0 "$hueline" inspect "$dbc"
says 'Zero +8.16@1- .0.5,-3. .*multiplexed by Selector: 0'
says 'Range .*multiplexed by Outer: 3 .. 5, 9'
says 'Single .*float'
ends 3 "$hueline" inspect bus.log --dbc nothing.dbc
printf '# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n' >cloud.pcd
ends 0 "$hueline" inspect cloud.pcd
ends 2 "$hueline" inspect cloud.pcd --dbc "$dbc"
says 'cloud.pcd is no log of a CAN bus'
printf 'BO_ 1 A: 8 X\n SG_ bad : 0|99@1+ (1,0) [0|0] "" X\n SG_ good : 0|8@1+ (1,0) [0|0] "" X\n' >part.dbc
ends 3 "$hueline" inspect part.dbc
says 'line 2: bad'
says 'good +0.8@1'
echo "signals are decoded as the DBC file describes them"
