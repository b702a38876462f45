#!/usr/bin/env bash
# The program is started with descriptors 0, 1 and 2 closed: output for the terminal must not get into a file. Then its standard output
# accepts nothing: every command reports this and does not end as if all were well.
# usage: standard_streams_test.sh HUELINE MEASURING_PROOF
set -euo pipefail
hueline=$1 proof=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$(dirname "$(realpath "$0")")/program.sh"

for i in $(seq 100 999); do echo "(1700000000.$i) can0 155#0102030405060708"; done >bus.log
cat >rig.yaml <<'YAML'
rig: a log of a bus
sensors:
  - name: wheel
    driver: wheel
    can_log: {file: bus.log}
    messages: [{id: 341, speeds: [{unit: km/h, start_bit: 0, bits: 16, scale: 0.01}]}]
colouring: {method: lens}
YAML
# No point can be placed, so the status is 5. The test needs the recording only.
ends 5 "$hueline" capture rig.yaml --out usual
for closed in 0 1 2 012; do
  for command in capture replay; do
    got=0
    (
      case $closed in *0*) exec <&- ;; esac
      case $closed in *1*) exec >&- ;; *) exec >said.txt ;; esac
      case $closed in *2*) exec 2>&- ;; *) exec 2>said2.txt ;; esac
      if [ $command = capture ]; then exec "$hueline" capture rig.yaml --out "drive$closed"; else exec "$hueline" replay "drive$closed/drive.mcap" --out "again$closed"; fi
    ) || got=$?
    [ $got = 5 ] || fail "$command with $closed closed gave $got, not 5"
  done
  ends 0 "$hueline" inspect "drive$closed/drive.mcap"
  says "packets +900$"
  grep -qa "nothing came\|no point could" "drive$closed"/* "again$closed"/* && fail "with $closed closed words got into a file"
done
got=0; (exec <&- >&- 2>&-; exec "$proof") || got=$?
[ $got = 2 ] || fail "the judge of measurements gave $got without its streams"

refused() { local got=0; "$@" >/dev/full 2>said.txt || got=$?; [ $got = 4 ] || fail "'$*' on a full disk gave $got, not 4"; says "error write the result to standard output: "; }
refused "$hueline" inspect usual/drive.mcap
refused "$hueline" inspect rig.yaml --json
refused "$hueline" --help
refused "$hueline" --version
# A status that says more is kept.
got=0; "$hueline" replay usual/drive.mcap --out again >/dev/full 2>said.txt || got=$?
[ $got = 5 ] || fail "replay on a full disk gave $got, not 5"
says "standard output: .*No space left"
echo "no stream lost a word unnoticed"
