#!/usr/bin/env bash
# Runs a shipped scenario without noise, shortened and with small images. The remaining reprojection error comes from geometry and from the
# resolution of the wire formats, and must be at most 0.01 px of an 8000 x 4000 panorama.
# usage: exact_scene_test.sh HUELINE SOURCE_DIR SCENARIO
set -euo pipefail
hueline=$1 source=$2 name=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
sed -E 's/^(duration_s):.*/\1: 4/; s/rate_hz: [0-9]+/rate_hz: 4/; s/lens_width: [0-9]+/lens_width: 102/; s/lens_height: [0-9]+/lens_height: 86/; 1i noise: false' \
  "$source/config/scenarios/$name.yaml" >"$work/$name.yaml"
"$hueline" verify --scenario "$work/$name.yaml" --sim "$work/sim" --max-rms-px 0.01
