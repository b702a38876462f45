#!/usr/bin/env bash
# Orients static scans as a user does: simulates them, orients them and checks the results; then gives every input that must be refused, with its reason.
# usage: calibrate_targets_test.sh HUELINE
set -euo pipefail
hueline=$1
source "$(dirname "$(realpath "$0")")/../program.sh"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
orient() { "$hueline" calibrate targets --stations "$1" --targets "$2" --out "${3:-out}" --date 2026-03-01 "${@:4}"; }

ends 0 "$hueline" calibrate targets-example --out in --stations 2 --points 50000 --seed 3
ends 0 orient in/stations.csv in/targets.csv out --write float32 --time-reading
says "S01: 4 of 6 targets used"
says "S02: 4 of 6 targets used"
says "reading alone"
[ "$(stat -c %s out/S01.f32)" = "$(stat -c %s in/S01.f32)" ] || fail "the oriented cloud has not the scan's points"
grep -q "date: .*2026-03-01" out/orientation.yaml || fail "no date in the record"
grep -q "covariance" out/orientation.yaml || fail "no covariance in the record"
grep -q "<svg" out/targets.html || fail "no picture in the page"
cp out/targets.json first.json
ends 0 orient in/stations.csv in/targets.csv out --threads 1 --write las
cmp -s first.json out/targets.json || fail "another number of threads gave another result"
head -c 4 out/S02.las | grep -q LASF || fail "no LAS written"

# The same scan in coordinates of a map, as text and as LAS: its rotation and place are those of the scan in the scanner's frame, to tenths of a millimetre.
place=$(awk -F, '$1 == "S01" {print $2, $3, $4}' in/stations.csv)
on_map() { od -An -v -w12 -tf4 in/S01.f32 | awk -v place="$1" 'BEGIN {split(place, p, " ")} {printf "%.4f %.4f %.4f\n", $1 + p[1], $2 + p[2], $3 + p[3]}'; }
pose() { awk '/ S01:/ {on = 1} on && /position_m|quaternion_wxyz/ {gsub(/[^-0-9. ]/, ""); print}' "$1" | head -2 | tr '\n' ' '; }
same_pose() { awk -v a="$(pose alone/orientation.yaml)" -v b="$(pose "$1")" 'BEGIN {n = split(a, p, " "); split(b, q, " "); if (n != 7) exit 1; for (i = 1; i <= n; ++i) if ((p[i] - q[i]) ^ 2 > (i > 3 ? 1e-5 : 2e-4) ^ 2) exit 1}'; }
ends 0 orient in/stations.csv in/targets.csv alone --scan S01=in/S01.f32
on_map "$place" >map.xyz
ends 0 orient in/stations.csv in/targets.csv map --scan S01=map.xyz --write las
says "map.xyz .text.*coordinates of a map, counted from the station's place"
grep -q "coordinates of a map" map/orientation.yaml || fail "the record does not say what was taken away"
same_pose map/orientation.yaml || fail "a scan in coordinates of a map is oriented otherwise: $(pose alone/orientation.yaml) and $(pose map/orientation.yaml)"
[ "$(stat -c %s map/S01.las)" = "$(stat -c %s out/S01.las)" ] || fail "the cloud of a map has not the scan's points"
ends 0 orient in/stations.csv in/targets.csv again --scan S01=out/S01.las
says "S01: 4 of 6 targets used"
says "S01.las .LAS.*coordinates of a map"
on_map "$(echo "$place" | awk '{print $1 + 50000, $2, $3}')" >elsewhere.xyz
ends 5 orient in/stations.csv in/targets.csv elsewhere --scan S01=elsewhere.xyz
says "from station S01: a scan is wanted in the scanner's frame or in the coordinates of the stations"

sed '1s/up_m/height/' in/targets.csv >column.csv
ends 2 orient in/stations.csv column.csv
says "column.csv:1: column 'height' is unknown"
cut -d, -f1-3 in/targets.csv >missing.csv
ends 2 orient in/stations.csv missing.csv
says "column 'up_m' is missing"
sed '1s/east_m/east_ft/' in/targets.csv >feet.csv
ends 2 orient in/stations.csv feet.csv
says "'east_ft' is not in metres"
awk -F, -v OFS=, 'NR > 1 {t = $2; $2 = $4; $4 = t} 1' in/targets.csv >up.csv
ends 2 orient in/stations.csv up.csv
says "no height on Earth; are the axes swapped"
swap() { awk -F, -v OFS=, 'NR > 1 {t = $2; $2 = $3; $3 = t} 1' "$1"; }
swap in/targets.csv >swapped.csv
swap in/stations.csv >in/swapped_stations.csv
ends 5 orient in/swapped_stations.csv swapped.csv
says "two axes are swapped|axes are swapped"
ends 5 orient in/stations.csv in/targets.csv out --scan S01=in/S02.f32
says "its scan is that of station S02"
head -3 in/targets.csv >two.csv
ends 5 orient in/stations.csv two.csv
says "2 surveyed targets to orient by; at least 3"
ends 3 orient in/stations.csv in/targets.csv out --scan S01=absent.f32
says "absent.f32"
ends 2 orient in/stations.csv in/targets.csv out --scan S09=in/S01.f32
says "S09=in/S01.f32"
echo "calibrate targets: all as it should be"
