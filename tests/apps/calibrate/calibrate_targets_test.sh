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
