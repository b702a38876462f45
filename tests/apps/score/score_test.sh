#!/usr/bin/env bash
# Runs hueline score on a drive of seconds. Against itself nothing changes; against better figures it fails and says which figures are worse; a broken
# file is refused.
# usage: score_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
fail() { echo "FAILED: $*"; exit 1; }
want() { local wanted=$1; shift; local got=0; "$@" >said.txt 2>&1 || got=$?; [ $got = "$wanted" ] || { cat said.txt; fail "'$*' gave $got, not $wanted"; }; }

sed 's/duration_s: 4/duration_s: 2/; s/accelerate_s: 1.5, brake_s: 1.5/accelerate_s: 0.7, brake_s: 0.7/; s/152/76/; s/128/64/' "$source/tests/scenarios/short.yaml" >short.yaml
printf 'scenarios: [short.yaml]\nray_returns: 1000\n' >sheet.yaml
want 0 "$hueline" score --sheet ./sheet.yaml --out one --threads 2
for file in score.json score_notes.json score.html; do [ -s one/$file ] || fail "no $file"; done
grep -q 'deterministic: short with 2 and 1 threads gave the same' said.txt || { cat said.txt; fail "determinism is not told"; }
grep -q '"unexplained_bytes": 0.0' one/score.json || { cat one/score.json; fail "bytes are unexplained"; }
! grep -q 'https\?://' one/score.html || fail "the page asks for something from elsewhere"

want 0 "$hueline" score --sheet ./sheet.yaml --out two --cache one/drives --threads 1 --against one/score.json --sights sights
# The text must be the same, except for wall-clock figures.
for run in one two; do grep -v 'realtime_factor\|points_per_second' $run/score.json >$run.txt; done
cmp one.txt two.txt || fail "a second run gave other figures"

# The judged lines of sight with their truth, and trees that are fitted to them.
evidences=Parallax,Distance,Agreement,Surface,Nearest,Nearby,Before,There,GlanceSurface,GlanceNearest,GlanceNearby,GlanceBefore,GlanceThere
[ "$(head -1 sights/short.csv)" = "point,seen,$evidences" ] || fail "the table of lines of sight: $(head -1 sights/short.csv)"
[ "$(grep -cE '^[0-9]+,[01](,[-+.0-9e]+){13}$' sights/short.csv)" -gt 100 ] || fail "few lines of sight: $(wc -l <sights/short.csv)"
fit=$(dirname "$hueline")/fit_sights
want 2 "$fit" sights/short.csv
want 3 "$fit" sights/short.csv one/score.json
"$fit" sights/short.csv sights/short.csv >trees.hpp 2>said.txt || { cat said.txt; fail "no trees"; }
[ "$(grep -o 'Evidence::' trees.hpp | wc -l)" = 400 ] || { cat trees.hpp; fail "not 80 trees of five questions"; }
grep -q '^all: ' said.txt || { cat said.txt; fail "how well they tell is not said"; }

sed 's/"coloured_share": 0\.[0-9]*/"coloured_share": 0.999/' one/score.json >better.json
want 6 "$hueline" score --sheet ./sheet.yaml --out three --cache one/drives --against better.json
grep -q 'WORSE .*coloured_share' said.txt || { cat said.txt; fail "what is worse is not told"; }

printf '{"short": 1}' >broken.json
want 3 "$hueline" score --sheet ./sheet.yaml --out four --against broken.json
want 2 "$hueline" score --sheet no_such_sheet --out four
printf 'scenarios: [missing.yaml]\n' >missing.yaml
want 2 "$hueline" score --sheet ./missing.yaml --out four
want 4 "$hueline" score --sheet ./sheet.yaml --out /proc/nowhere --cache one/drives
echo "score agrees with itself and is not fooled"
