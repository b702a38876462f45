#!/usr/bin/env bash
# Inputs that a user may give to calibrate lens and calibrate mount by mistake. Each must be refused with its reason. (calibrate targets: calibrate_targets_test.sh)
# usage: calibrate_bad_input_test.sh HUELINE MEASURING_PROOF
set -euo pipefail
hueline=$1 proof=$2
source "$(dirname "$(realpath "$0")")/../program.sh"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mount() { "$hueline" calibrate mount --points "$1" --rig "${2:-in/true.yaml}" --sigma-point-m 0.005; }
change() { awk -F, -v OFS=, "NR > 1 {$1} 1" one.csv >"$2"; }

echo '{seed: 4, camera: {lens_width: 306, lens_height: 256}}' >small.yaml
mkdir in
"$proof" inputs small.yaml in 3 20 2000 1
grep -E "^name|,lens0," in/points.csv >one.csv
ends 0 mount in/points.csv
ends 0 mount one.csv

# Wrong units.
change '$5 *= 3.28084; $6 *= 3.28084; $7 *= 3.28084' feet.csv
ends 3 mount feet.csv
says "points 1/3.281 as far away: wrong units, feet taken for metres"
change '$5 *= 0.3048; $6 *= 0.3048; $7 *= 0.3048' small.csv
ends 3 mount small.csv
says "points 3.281 times as far away: wrong units, feet converted twice to metres"
change '$5 *= 1000; $6 *= 1000; $7 *= 1000' mm.csv
ends 3 mount mm.csv
says "mm.csv:[0-9]+: the point is [0-9]+ m from the scanner; are these millimetres"
sed '1s/x_m/x_ft/' one.csv >unit.csv
ends 3 mount unit.csv
says "unit.csv:1: column 'x_ft' is unknown; allowed: .*metres"
# Wrong axes.
change 't = $5; $5 = $6; $6 = t' xy.csv
ends 3 mount xy.csv
says "two axes are exchanged"
change 't = $5; $5 = $6; $6 = -t' turned.csv
ends 3 mount turned.csv
says "rotated by 90 deg from its pose in the rig: the points' axes are not the scanner's"
change 't = $3; $3 = $4; $4 = t' uv.csv
ends 3 mount uv.csv
says "two axes are exchanged"
# Points of another lens, points of two places of the vehicle, and points of a lens that the rig does not have.
sed 's/,lens0,/,lens3,/' one.csv >lens.csv
ends 3 mount lens.csv
says "lens 'lens3': the lens would be rotated"
change 'if (NR % 2) {x = $5; $5 = $6 + 3; $6 = -x + 1; $7 += 0.5}' places.csv
ends 3 mount places.csv
says "agree|rotated|from its place in the rig"
sed 's/,lens0,/,lens9,/' one.csv >absent.csv
ends 3 mount absent.csv
says "the rig has no lens 'lens9'; its lenses are: lens0, lens1"
# Too few points, and a missing column.
head -3 one.csv >two.csv
ends 3 mount two.csv
says "2 points; a resection needs 4"
cut -d, -f1-6 one.csv >missing.csv
ends 3 mount missing.csv
says "missing.csv:1: column 'z_m' is missing"

lens() { "$hueline" calibrate lens "$@" --spacing-m 0.04; }
boards=in/boards/lens0
ends 3 lens $boards/01.png $boards/02.png --size 14x10
says "2 views with the board; 3 are needed"
# The first picture has one pixel. The size of the lens is that of the views, not of the first image.
echo iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNgAAAAAgABSK+kcQAAAABJRU5ErkJggg== | base64 -d >other.png
ends 0 lens other.png $boards --size 14x10 --model kannala_brandt
says "3 of 4 images"
says "left out: other.png"
cp $boards/02.png copy.png
ends 0 lens $boards copy.png --size 14x10 --model kannala_brandt
says "left out: copy.png: the same picture as 02.png"
ends 2 lens $boards --board charuco --size 14x10 --dictionary DICT_4X4
says "DICT_4X4_50"
ends 3 lens $boards --size 15x11
says "01.png: the board of 15 x 11 is not completely visible"
ends 3 lens one.csv --size 14x10
says "one.csv: cannot be read as an image"
ends 2 lens $boards --size 14
says "--size is '14'; allowed: columns x rows"
ends 2 "$hueline" calibrate lens $boards --size 14x10 --spacing-m 40
says "spacing-m.*40 is not in range"
ends 3 lens absent --size 14x10
says "absent: is not there"
echo "calibrate lens and mount refuse what they should"
