#!/usr/bin/env bash
# Runs hueline calibrate boresight on half a minute of a drive in both directions, with the scanner's mounting wrong by a degree and 5 cm; then on drives that do not determine it.
# usage: calibrate_boresight_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 scenario=$2/tests/scenarios/boresight.yaml
source "$(dirname "$(realpath "$0")")/../program.sh"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
boresight() { "$hueline" calibrate boresight "$@"; }

ends 0 boresight --scenario "$scenario" --sim sims --off-deg 1 --off-m 0.05 --lever-sigma-m 0.05 --out found --date 2025-01-02
grep -vE '%$' said.txt
# The limits are four sigmas of a POS with a heading error of 0.02 deg, and a centimetre.
sed -nE "s/^against.*truth: ([0-9.]+) deg.*lever arm ([0-9.]+) mm in plane.*/\\1 \\2/p" said.txt | awk '{ exit !($1 <= 0.08 && $2 <= 10) } END { if (NR != 1) exit 1 }' || fail "too far from the truth"
awk '/^against/ { for (i = NF - 5; i <= NF; ++i) if ($i > 4) exit 1 }' said.txt || fail "farther from the truth than four of its sigmas"
# The stated sigma must be there, and it must not be so large that any result meets it.
awk '/^  rotation about/ { for (i = 1; i <= NF; ++i) if ($i == "+-") { ++seen; if (!($(i + 1) > 0.001 && $(i + 1) < 0.04)) exit 1; break } } END { if (seen != 3) exit 1 }' said.txt || fail "the sigma is no sigma"
says "lever arm z \(up\).*NOT determined, stays as measured"

# The result replaces the measured mounting in the rig.
for word in "method: boresight" 2025-01-02 turn_body_x_deg position_z_m covariance "position_z_m is not determined"; do
  grep -q -- "$word" found/T_body_scanner.yaml || fail "T_body_scanner.yaml has no $word"
done
grep -q '"share_from_data"' found/boresight.json || fail "boresight.json has no shares"
"$hueline" simulate "$scenario" --out sims --write-rig true.yaml >/dev/null 2>&1
sed 's/^/    /' found/T_body_scanner.yaml >deep.yaml
sed -e '/^    T_body_scanner:/{r deep.yaml' -e 'd}' true.yaml >rig.yaml
ends 0 "$hueline" rig show rig.yaml --out rig.svg
ends 0 boresight --scenario "$scenario" --sim sims --rig rig.yaml
awk '/rotated by/ { exit !($4 < 0.003) }' said.txt || fail "what was found is not found again"

# One pass only; a lever arm that was read wrongly; wrong axes; no scanner; wrong options.
sed -e 's/, turns: .*}/}/' -e 's/duration_s: 30/duration_s: 10/' "$scenario" >once.yaml
ends 3 boresight --scenario once.yaml --sim sims
says "one pass only: .* drive the same street again in the other direction"
ends 0 boresight --scenario "$scenario" --sim sims --off-m 0.2
says "more than three times its --lever-sigma-m of 0.02 m"
ends 3 boresight --scenario "$scenario" --sim sims --off-deg 10
says "measure it again"
sed -e '/^  - name: laser/,/^  - name: camera/{/^  - name: camera/!d}' true.yaml >blind.yaml
ends 2 boresight --scenario "$scenario" --sim sims --rig blind.yaml
says "the rig has no laser scanner"
ends 3 boresight --recording absent.mcap
says "absent.mcap"
ends 2 boresight --scenario "$scenario"
says "give --sim with --scenario"
ends 2 boresight --recording absent.mcap --off-deg 1
says "for a --scenario, whose truth is known"
echo "the scanner's mounting is found from a drive there and back"
