#!/usr/bin/env bash
# `cmake --install` gives what a user of the libraries needs. The cookbook is built outside the tree against what was installed, and each
# of its programs is run. The installed programs find each other.
# usage: cookbook_test.sh BUILD_DIR SOURCE_DIR DATA_DIR
set -euo pipefail
build=$1 source=$2 data=$3
[ -x "$build/bin/hueline" ] || { echo "SKIPPED: $build has no program to install; ./test builds it"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
ends 0 cmake --install "$build" --prefix "$work/there"
cp -r "$source/docs/cookbook" book
ends 0 cmake -S book -B out -DCMAKE_BUILD_TYPE=Debug -DCMAKE_PREFIX_PATH="$work/there" -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror"
ends 0 cmake --build out -j2
for program in book/*.cpp; do [ "$(wc -l <"$program")" -le 60 ] || fail "$program has more than 60 lines"; done

ends 0 out/draw_rig street rig.svg
says "laser: velodyne"
grep -q "<svg" rig.svg || fail "no picture"
printf '12.5\n7.25\n' >ranges.txt
ends 0 out/add_device ranges.txt
says "12.500 m"
says "7.250 m"
if [ -e "$data/velodyne/vlp16_scans.pcap" ]; then
  ends 0 out/decode_pcap "$data/velodyne/vlp16_scans.pcap"
  says "^[1-9][0-9]+ returns, the farthest at [0-9.]+ m"
fi
ends 0 there/bin/hueline simulate "$source/tests/scenarios/short.yaml" --out sim
ends 0 out/read_truth "$(find sim -name truth.bin | head -1)"
says "^[1-9][0-9]* exposures"
says "^road: [0-9]+ returns|^ground: [0-9]+ returns"
printf 'rig: nobody\nsensors:\n  - {name: pps, driver: pps, socket: pps.sock}\ncolouring: {method: lens}\n' >nobody.yaml
ends 5 there/bin/hueline capture nobody.yaml --out drive --seconds 1 --quiet
ends 0 out/replay_to_csv drive
says "east_m,north_m,up_m"
says "^0 points"
echo "five programs outside the tree, each built and run"
