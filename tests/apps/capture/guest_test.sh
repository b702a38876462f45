#!/usr/bin/env bash
# The camera's library dies, hangs and cannot reach its camera while a drive is captured. Nothing else is affected, and a replay gives the
# same bytes. The test runs in a network of its own, in which an interface can get its address later.
# usage: guest_test.sh HUELINE SOURCE_DIR
set -euo pipefail
if [ "${3-}" != inside ]; then
  unshare --net true 2>/dev/null || { echo "skipped: needs the privilege to make network namespaces"; exit 77; }
  exec unshare --net -- "$0" "$1" "$2" inside
fi
hueline=$1 source=$2
simulator=${HUELINE_SIMULATOR:-$hueline}  # emulates the devices: beside the sanitizers, the released program
ip link set lo up
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
. "$source/tests/apps/program.sh"
scenario=$source/tests/scenarios/short.yaml
ports="--pps-socket $work/pps.sock"
$simulator simulate "$scenario" --out sim --write-rig rig.yaml $ports >/dev/null

guest_of() { pgrep -P "$1" -x hueline-guest || true; }
# wait_for WHAT COMMAND...: waits until the command prints something, at most a minute
wait_for() { local what=$1; shift; for _ in $(seq 600); do [ -z "$("$@")" ] || return 0; sleep 0.1; done; fail "in vain: $what"; }
# told TEXT N: prints yes if TEXT stands at least N times in the recording, which is flushed once a second while it is made
told() { [ "$(grep -aoF "$1" drive/drive.mcap | wc -l)" -lt "$2" ] || echo yes; }
same_when_replayed() {
  # 8: a drive of seconds, of which the camera was away for a part
  $hueline replay "$1/drive.mcap" --out "$1-again" >/dev/null || [ $? = 8 ]
  cmp "$1/cloud.las" "$1-again/cloud.las" && cmp "$1/view.mcap" "$1-again/view.mcap" || fail "a replay of $1 gives other bytes"
}

# One guest is killed, one hangs. The summary has only the newest detail of a kind, which is that of the devices' end, so the recording is
# searched.
$simulator simulate "$scenario" --out sim --play $ports >devices.txt 2>&1 &
$hueline capture rig.yaml --out drive --until-silent --seconds 60 --quiet >said.txt 2>&1 &
capture=$!
wait_for "the camera's guest" guest_of $capture
sleep 2  # the drive is under way
comebacks=0
for signal in KILL STOP; do
  guest=$(guest_of $capture)
  [ -n "$guest" ] || fail "no guest to send $signal to"
  kill -$signal $guest
  # This waits until the guest has its camera again. A failure while the camera is still being opened is the same trouble, which is
  # reported once.
  wait_for "the camera after $signal" told "open again" $((comebacks += 1))
done
wait $capture || [ $? = 8 ] || fail "the capture with broken guests failed"
says 'Disconnected.*x2|Disconnected x[2-9]'
grep -qa "ended by signal 9" drive/drive.mcap || { cat drive/summary.json; fail "the killed guest is not told"; }
grep -qa "so it hangs" drive/drive.mcap || { cat drive/summary.json; fail "the hanging guest is not told"; }
[ "$($hueline inspect drive/cloud.las --json | sed -n 's/.*"points": \([0-9]*\).*/\1/p')" -gt 100000 ] || fail "too few points"
same_when_replayed drive

# The rig names an own address that this computer does not have at first.
sed 's/^    interface: .*/    interface: 10.77.79.109/' rig.yaml >later.yaml
$simulator simulate "$scenario" --out sim --play $ports >devices.txt 2>&1 &
$hueline capture later.yaml --out later --until-silent --seconds 60 --quiet >said.txt 2>&1 &
capture=$!
wait_for "a recording" ls later/drive.mcap 2>/dev/null
sleep 1
kill -0 $capture || fail "the capture ended for an address that this computer has not"
ip address add 10.77.79.109/32 dev lo
wait $capture || [ $? = 8 ] || fail "the capture with a late address failed"
grep -qa "interface: this computer has no address 10.77.79.109" later/drive.mcap || { cat later/summary.json; fail "the missing address is not told"; }
grep -q '"kind": "Reconnected"' later/summary.json || { cat later/summary.json; fail "the camera did not come"; }
same_when_replayed later

# Ctrl-C comes while the camera is being opened, which takes its library seconds.
ip address add 10.77.79.110/32 dev lo
sed 's/^    address: 127.0.0.1/    address: 10.77.79.110/; s/^    interface: .*/    interface: 10.77.79.110/' rig.yaml >absent.yaml
$hueline capture absent.yaml --out absent --seconds 60 --quiet >said.txt 2>&1 &
capture=$!
wait_for "a guest that asks for its camera" guest_of $capture
guest=$(guest_of $capture)
kill -INT $capture
status=0; wait $capture || status=$?
[ $status = 5 ] || fail "Ctrl-C while connecting gave $status"
kill -0 $guest 2>/dev/null && fail "the guest outlived the capture"
echo "guests killed, hung and unreachable: the drives are whole, replays agree"
