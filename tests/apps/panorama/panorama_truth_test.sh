#!/usr/bin/env bash
# Panoramas of a narrow alley without noise against what an eye at the head's centre sees: joined by the laser's distances, and on a sphere. The
# cameras have rolling shutters: between its first and last row the vehicle drives 0.1 m.
# usage: panorama_truth_test.sh HUELINE PANORAMA_PROOF
set -euo pipefail
hueline=$1 proof=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cat >alley.yaml <<'YAML'
seed: 13
scene: alley
duration_s: 4
noise: false
street: {curve_deg: 0, sun_azimuth_deg: 60, sun_elevation_deg: 55}
drive: {lane_offset_m: 0, stand_s: 0, accelerate_s: 0.5, speed: 5, brake_s: 0.5, halt_s: 0}
laser: {min_range_m: 0.6}
camera: {shutter: rolling, row_time_us: 60, rate_hz: 2, lens_width: 408, lens_height: 340, vignetting: 0}
YAML
for made in "depth hide" "depth fill" "sphere hide"; do
  set -- $made
  "$hueline" panorama --scenario alley.yaml --sim sim --out "$1.$2" --method "$1" --vehicle "$2" --exposures 4 --size 1024x512 --orientation head \
    --format png --fill 255,0,255 >said.txt 2>&1 || { cat said.txt; exit 1; }
done
"$proof" alley.yaml sim depth.hide truth depth.fill | tee depth.txt
"$proof" alley.yaml sim sphere.hide | tee sphere.txt
# figure FILE LINE WORD: the number behind a word of a line
figure() { awk -v line="$2" -v word="$3" 'index($0, line) {for (i = 1; i < NF; ++i) if ($i == word) {print $(i + 1) + 0; exit}}' "$1.txt"; }
holds() { awk "BEGIN {exit !($1)}" || { echo "FAILED: $2: not $1"; exit 1; }; }
holds "$(figure depth displacement 0.2:) <= 0.05" "blocks displaced beside seams"
holds "$(figure depth displacement 0.2:) <= 0.2 * $(figure sphere displacement 0.2:)" "blocks displaced, against the sphere"
holds "$(figure depth 'beside seams  ' PSNR) >= $(figure sphere 'beside seams  ' PSNR) + 1" "PSNR beside seams"
holds "$(figure depth step p90) <= $(figure sphere step p90)" "step across seams"
holds "$(figure depth hidden vehicle:) >= 0.9" "share of the hole that is filled"
echo "panorama truth: all as it should be"
