#!/usr/bin/env bash
# Sends SIGINT, SIGTERM and SIGHUP, once and twice, at random moments of a capture's start, drive and end, with devices that answer and
# devices that do not. The capture ends as docs/operating.md says, its recording is whole, and a replay gives what the live run gave.
# usage: signals_test.sh HUELINE SOURCE_DIR [ROUNDS [SEED]]
set -euo pipefail
# The parent of this test may ignore some of these signals (nohup, a shell's background), and that is inherited.
if [ -z "${HEARS_SIGNALS-}" ]; then HEARS_SIGNALS=1 exec env --default-signal=HUP,INT,TERM "$0" "$@"; fi
# The test has a network of its own where that is allowed, because other tests use the same ports.
if [ -z "${OWN_NETWORK-}" ] && unshare -rn ip link set lo up 2>/dev/null; then OWN_NETWORK=1 exec unshare -rn "$0" "$@"; fi
[ -z "${OWN_NETWORK-}" ] || ip link set lo up
hueline=$1 source=$2 rounds=${3:-8}
simulator=${HUELINE_SIMULATOR:-$hueline}  # emulates the devices: beside the sanitizers, the released program
seed=${4:-1}
work=$(mktemp -d)
devices= capture= hog=
end() { for one in $devices $capture $hog; do kill -CONT "$one" 2>/dev/null || true; kill -KILL "$one" 2>/dev/null || true; done; rm -rf "$work"; }
trap end EXIT
cd "$work"
fail() { echo "FAILED in round $round (seed $seed): $*"; tail -n 5 capture.txt devices.txt inspected.txt replayed.txt 2>/dev/null; exit 1; }
round=0
scenario=$source/tests/scenarios/short.yaml
ports="--pps-socket $work/pps.sock --data-port 42370 --position-port 48310 --pos-port 43003 --can-port 40002 --address 127.0.0.2"
$simulator simulate "$scenario" --out sim --write-rig rig.yaml $ports >devices.txt
# Prints a random time from .. to milliseconds, in seconds.
between() { local ms=$(($1 + (RANDOM * 32768 + RANDOM) % ($2 - $1))); printf '%d.%03d' $((ms / 1000)) $((ms % 1000)); }
one_of() { local all=($@); echo "${all[RANDOM % ${#all[@]}]}"; }
little() { od -An -tu"$3" -j"$2" -N"$3" "$1" | tr -d ' '; }
# The points of a cloud that ends early are the first points of the whole cloud.
is_prefix() {
  [ -s "$1" ] || return 0
  local at count size; at=$(little "$1" 96 4); size=$(little "$1" 105 2); count=$(little "$1" 247 8)
  [ "$count" -gt 0 ] || return 0
  [ "$(little "$2" 247 8)" -ge "$count" ] && cmp -n $((count * size)) "$1" "$2" "$at" "$at"
}

# A window is closed: SIGHUP comes, and the terminal answers every call with EIO. Under nohup this ends nothing.
script -qec "$hueline capture rig.yaml --out window" /dev/null </dev/null >/dev/null 2>&1 & terminal=$!
nohup "$hueline" capture rig.yaml --out deaf --seconds 3 >deaf.txt 2>&1 & deaf=$!
for i in $(seq 100); do if [ -s window/drive.mcap ] && [ -s deaf/drive.mcap ]; then break; fi; sleep 0.1; done
sleep 0.5
kill -KILL $terminal; kill -HUP $deaf
wait $terminal 2>/dev/null || true
for i in $(seq 300); do if [ -s window/summary.json ]; then break; fi; sleep 0.1; done
$hueline inspect window/drive.mcap >inspected.txt 2>&1 || fail "a closed terminal cuts the recording"
[ -s window/summary.json ] || fail "a closed terminal leaves no summary"
got=0; wait $deaf || got=$?
[ $got = 5 ] || fail "SIGHUP under nohup gave $got"
grep -q "stop asked for" deaf.txt && fail "nohup does not keep SIGHUP away"

longest=0 whole=0 cut=0 unborn=0
for round in $(seq "$rounds"); do
  RANDOM=$((seed * 1000 + round))
  rm -rf drive again
  first=$(one_of INT TERM HUP) second=$(one_of INT TERM HUP none none)
  since="the start"
  case $((RANDOM % 4)) in
    0) moment=$(between 0 200) ;;     # it starts
    1 | 2) moment=$(between 200 2500) ;;
    3) moment=$(between 200 7000) since="the devices' first packets" ;; # it colours, or the drive is over
  esac
  are_silent=$(one_of yes no no)
  # The computer is too slow for the capture, so its end takes long enough for a second signal to come before it.
  is_starved=$(one_of yes no)
  gap=$(one_of "$(between 0 400)" "$(between 510 700)" "$(between 510 1500)")
  $simulator simulate "$scenario" --out sim --play $ports >devices.txt 2>&1 & devices=$!
  # A shell without a terminal starts its background programs with SIGINT ignored.
  env --default-signal=INT "$hueline" capture rig.yaml --out drive >capture.txt 2>&1 & capture=$!
  if [ "$since" != "the start" ]; then for i in $(seq 300); do if grep -q "playing" devices.txt; then break; fi; sleep 0.1; done; fi
  sleep "$moment"
  if [ $is_starved = yes ]; then
    taskset -c 0 sh -c 'while :; do :; done' & hog=$!
    taskset -ap -c 0 $capture >/dev/null 2>&1 || true  # every thread; one that ends meanwhile is no fault
    renice -n 15 -p $(ls /proc/$capture/task 2>/dev/null) >/dev/null 2>&1 || true
  fi
  if [ $are_silent = yes ]; then kill -STOP $devices 2>/dev/null || true; sleep 0.1; fi
  kill -$first $capture
  asked=$(date +%s%N)
  if [ $second != none ]; then
    sleep "$gap"
    if kill -$second $capture 2>/dev/null; then asked=$(date +%s%N); fi
  fi
  got=0; wait $capture 2>/dev/null || got=$?
  took=$((($(date +%s%N) - asked) / 1000000))
  kill -CONT $devices 2>/dev/null || true
  for one in $devices $hog; do kill -KILL $one 2>/dev/null || true; wait $one 2>/dev/null || true; done
  devices= capture= hog=
  what="$first $second $moment s after $since, $gap s, devices silent: $are_silent, starved: $is_starved: status $got after $took ms"
  if [ ! -e drive/drive.mcap ]; then
    # The signal came before the program had begun anything, so it was killed as any program is.
    case $got in 129 | 130 | 143) ;; *) fail "$what, and no recording" ;; esac
    unborn=$((unborn + 1))
    continue
  fi
  case $got in
    0 | 5) ;;
    # The signal came when the drive had just begun, so nothing was known yet that would colour a point.
    8) grep -q "drive again" capture.txt || fail "$what: not told" ;;
    7) [ $second != none ] || fail "$what: cut short without a second signal"
       [ "$took" -le $longest ] || longest=$took
       grep -q "ended at once" capture.txt || fail "$what: not told" ;;
    *) fail "$what" ;;
  esac
  # A disk that takes seconds for its last sync is reported. What it holds is still read.
  if ! $hueline inspect drive/drive.mcap >inspected.txt 2>&1; then grep -q "the disk did not take the end" capture.txt || fail "$what: the recording is not whole"; fi
  replayed=0; $hueline replay drive/drive.mcap --out again >replayed.txt 2>&1 || replayed=$?
  case $replayed in 0 | 3 | 5 | 8) ;; *) fail "$what: its replay gave $replayed" ;; esac
  is_prefix drive/cloud.las again/cloud.las || fail "$what: the cloud is not the replay's"
  if [ $got != 7 ]; then
    [ $got = $replayed ] || fail "$what: its replay gave $replayed"
    for product in cloud.las view.mcap summary.json; do cmp drive/$product again/$product || fail "$what: $product is not the replay's"; done
    whole=$((whole + 1))
  else
    [ ! -s drive/summary.json ] || grep -q '"ends_early"' drive/summary.json || fail "$what: the summary does not say that it ends early"
    cut=$((cut + 1))
  fi
  [ -z "${VERBOSE-}" ] || echo "$round: $what"
done
echo "$rounds rounds, seed $seed: $whole ended whole, $cut at once (the slowest $longest ms after it was asked), $unborn had not begun"
