#!/usr/bin/env bash
# Runs hueline calibrate mask on eight seconds of a simulated street with small images, puts the result into the rig and learns it again with that; then on drives that determine nothing.
# usage: calibrate_mask_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 scenario=$2/tests/scenarios/mask.yaml
source "$(dirname "$(realpath "$0")")/../program.sh"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mask() { "$hueline" calibrate mask "$@"; }

ends 0 mask --scenario "$scenario" --sim sims --out found
grep -vE '%$' said.txt
# Fifteen images teach little of a vehicle that is partly as grey as the road: a longer drive finds more (docs/calibration.md).
awk '/^  against/ { ++lenses; is += $8; missed += $13; much += $20 } END { exit !(lenses == 6 && is > 30 && missed < 0.3 * is && much < 0.2 * is) }' said.txt ||
  fail "too far from the truth"
# The last lens looks up, and sees no vehicle.
awk '/^  against/ { much = $20 } END { exit !(much < 2) }' said.txt || fail "a vehicle in the sky"
for i in 0 1 2 3 4 5; do [ -s found/masks_lens$i.png ] && [ -s found/masks_lens$i.yaml ] || fail "no files of lens $i"; done

# The fragments replace the masks in the rig.
"$hueline" simulate "$scenario" --out sims --write-rig true.yaml >/dev/null 2>&1
awk '/^ *masks:/ { skips = 1; next } skips && /^ *- polygon_px/ { next } { skips = 0 } { print }
     /^ *- name: lens[0-5]$/ { name = $3; while ((getline line < ("found/masks_" name ".yaml")) > 0) print "      " line }' true.yaml >rig.yaml
grep -c polygon_px rig.yaml
ends 0 "$hueline" inspect rig.yaml
ends 0 mask --scenario "$scenario" --sim sims --rig rig.yaml --out again
cmp found/masks_lens0.yaml again/masks_lens0.yaml || fail "the masks of the rig were used"

# Too short a drive; no lens; a recording and a folder that are not there.
sed -e 's/duration_s: 8/duration_s: 2/' "$scenario" >short.yaml
ends 5 mask --scenario short.yaml --sim sims --out short
says "lens 'lens0': NOT determined"
says "drive farther"
[ ! -e short/masks_lens0.yaml ] || fail "a mask that is not determined was written"
sed -e '/^  - name: laser/,/^  - name: camera/{/^  - name: camera/!d}' true.yaml >blind.yaml
ends 2 mask --scenario "$scenario" --sim sims --rig blind.yaml
says "the rig has no laser scanner or no lens"
ends 3 mask --recording absent.mcap
says "absent.mcap"
ends 2 mask --scenario "$scenario"
says "give --sim with --scenario"
echo "the vehicle is found in the images of a drive"
