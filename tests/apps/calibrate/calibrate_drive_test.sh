#!/usr/bin/env bash
# Runs hueline calibrate mount on a drive of six seconds, with the head wrong by 2 deg and the times of its images by 20 ms. A pixel is a third of a degree
# here. The limits are three times the errors found, or more; two minutes of larger images give smaller errors (docs/calibration.md).
# usage: calibrate_drive_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; cat said.txt; exit 1; }

"$hueline" calibrate mount --scenario "$source/tests/scenarios/mount.yaml" --sim sims --off-deg 2 --off-ms 20 --every 3 --out found --date 2025-01-02 >said.txt 2>told.txt ||
  { cat told.txt; fail "gave $?"; }
cat said.txt
grep -q '^searching' told.txt && grep -q '^adjusting' told.txt || fail "says nothing while it works"
awk '/^against/ { turn = $5; time = $(NF - 1) < 0 ? -$(NF - 1) : $(NF - 1); seen = 1; exit !(turn <= 0.1 && time <= 0.6) } END { if (!seen) exit 1 }' said.txt || fail "too far from the truth"
# The stated sigma must be there, and it must not be so large that any result meets it.
awk '/deg about the head/ { for (i = 9; i <= 11; ++i) if (!($i > 0.0005 && $i < 0.06)) exit 1; seen = 1 } END { if (!seen) exit 1 }' said.txt || fail "the sigma is no sigma"
for word in T_body_head: 2025-01-02 turn_head_x_deg time_offset_ms covariance; do grep -q "$word" found/T_body_head.yaml || fail "T_body_head.yaml has no $word"; done
! grep -q residual found/T_body_head.yaml || fail "an alignment has no residual to write: $(grep residual found/T_body_head.yaml)"
echo "the head and its images' times are found from a drive"
