#!/usr/bin/env bash
# Measures objects through the panorama as a user does, from calibration to coordinates: lenses from boards, mountings from points, the fragments
# in the rig, a drive, picked pixels, and coordinates, which are compared with the simulator's truth.
# usage: measure_test.sh HUELINE MEASURING_PROOF OUT [SCENARIO VIEWS POINTS PANORAMA_WIDTH OBJECTS MOST_RMS_M LENSES]
# Without a scenario the test uses a small one (seconds) with one calibrated lens, and also gives the inputs that must be refused.
set -euo pipefail
hueline=$1 proof=$2 out=$3
mkdir -p "$out"
scenario=${4:-$out/small.yaml} views=${5:-12} points=${6:-20} panorama=${7:-2000} objects=${8:-150} most=${9:-0.15} lenses=${10:-1}
if [ $# -lt 4 ]; then
  echo '{seed: 4, duration_s: 6, drive: {stand_s: 0, accelerate_s: 1}, camera: {rate_hz: 4, lens_width: 306, lens_height: 256}}' >"$scenario"
fi
fail() { echo "FAILED: $*"; [ ! -e "$out/said.txt" ] || cat "$out/said.txt"; exit 1; }

# A fragment replaces the same keys of its lens. Each of its lines is indented as its place in the rig requires.
paste_fragments() {  # rig, folder of lens fragments or "", folder of mount fragments or ""
  awk -v lenses="$2" -v mounts="$3" '
    function paste(file, blanks, line, any) {
      while ((getline line < file) > 0) if (line != "lens:") { print blanks line; any = 1 }
      return any
    }
    /^    - name: lens/ { name = $3 }
    /^colouring:/ { name = "" }
    name != "" && lenses != "" && (system("test -e " lenses "/" name "/lens.yaml") == 0) && /^      (model|width|height|focal_px|principal_point_px|distortion|max_angle_deg):/ {
      if ($1 == "model:") paste(lenses "/" name "/lens.yaml", "    ")
      next
    }
    name != "" && mounts != "" && /^      T_head_lens:/ { if (paste(mounts "/" name ".yaml", "      ")) next }
    { print }' "$1"
}

"$proof" inputs "$scenario" "$out" "$views" "$points" "$panorama" "$lenses"
for boards in "$out"/boards/lens*; do
  lens=$(basename "$boards")
  "$hueline" calibrate lens "$boards" --size 14x10 --spacing-m 0.04 --model kannala_brandt --date 2026-11-21 --out "$out/lens/$lens" >"$out/$lens.txt" || { cat "$out/$lens.txt"; fail "lens $lens"; }
  sed -n 2,6p "$out/$lens.txt"
done
paste_fragments "$out/nominal.yaml" "$out/lens" "" >"$out/with_lenses.yaml"
head -1 "$out/points.csv" >"$out/points_used.csv"
for boards in "$out"/boards/lens*; do grep ",$(basename "$boards")," "$out/points.csv" >>"$out/points_used.csv"; done
"$hueline" calibrate mount --points "$out/points_used.csv" --rig "$out/with_lenses.yaml" --sigma-point-m 0.005 --date 2026-11-21 --out "$out/mount"
paste_fragments "$out/with_lenses.yaml" "" "$out/mount" >"$out/rig.yaml"
grep -q "method: .*lens" "$out/rig.yaml" && grep -q "method: .*mount" "$out/rig.yaml" || fail "the records of the calibrations are not in the rig"

"$proof" picks "$scenario" "$out/sim" "$out/rig.yaml" "$out" "$objects" 0.5 "${PICKS:-nearest}" "${CLEAR_PX:-3}"
measure() { "$hueline" measure --scenario "$scenario" --sim "$out/sim" --rig "$out/rig.yaml" --picks "$1" --sigma-turn-deg 0.03 "${@:2}"; }
if [ $# -lt 4 ]; then
  # The small rig has one calibrated lens. Objects in the other lenses would be measured with the maker's drawing.
  "$hueline" measure --scenario "$scenario" --sim "$out/sim" --rig "$out/rig.yaml" --picks "$out/picks.csv" --out "$out/all.csv"
  awk -F, '/^#/ {next} $1 == "name" {next} $3 == "lens0" {print $1}' "$out/all.csv" >"$out/mine.txt"
  for file in picks truth; do
    awk -F, 'NR == FNR {mine[$1] = 1; next} FNR == 1 || ($1 in mine)' "$out/mine.txt" "$out/$file.csv" >"$out/$file.mine.csv"
    mv "$out/$file.mine.csv" "$out/$file.csv"
  done
fi
measure "$out/picks.csv" --out "$out/measured.csv"
"$proof" judge "$out/measured.csv" "$out/truth.csv" "$most" || fail "beyond $most m"

if [ $# -lt 4 ]; then
  ends() { local want=$1; shift; local got=0; "$@" >"$out/said.txt" 2>&1 || got=$?; [ $got = "$want" ] || fail "'$*' gave $got, not $want"; }
  says() { grep -qE -- "$1" "$out/said.txt" || fail "not told: $1"; }
  # Where the POS's datum moves against the map's, the date of the drive counts, as it does in the cloud: 2025-08-27.
  sed 's/^  crs: utm/  crs: "EPSG:25832"\n  datum: "EPSG:7912"/' "$out/rig.yaml" >"$out/itrf.yaml"
  sed 's/^  datum:.*/&\n  epoch: 2025.6516/' "$out/itrf.yaml" >"$out/itrf_then.yaml"
  for rig in itrf itrf_then; do
    "$hueline" measure --scenario "$scenario" --sim "$out/sim" --rig "$out/$rig.yaml" --picks "$out/picks.csv" --out "$out/$rig.csv"
  done
  paste -d, "$out/itrf.csv" "$out/itrf_then.csv" | awk -F, '
    $7 + 0 == 0 {next}
    {n++; if (sqrt(($13 - $36) ^ 2 + ($14 - $37) ^ 2) > 0.002) {print $13, $14, "and", $36, $37; bad = 1}}
    END {exit bad || n < 3}' || fail "the coordinates are not those of the day of the drive"

  echo "exposure,u_px,lens" >"$out/column.csv"
  ends 3 measure "$out/column.csv"
  says "column 'v_px' is missing"
  printf 'exposure,u_px,v_px,lens\n2,99999,5,\n2,5,5,lens9\n77,100,500,\n2,-40,5,lens0\n' >"$out/wrong.csv"
  ends 5 measure "$out/wrong.csv"
  says "outside the panorama of 2000 x 1000"
  says "the rig has no lens 'lens9'; it has lens0 lens1"
  says "the drive has no exposure 77"
  says "outside the image or the field of view of lens 'lens0'"
fi
echo "measure: all as it should be"
