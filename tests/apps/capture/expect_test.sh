#!/usr/bin/env bash
# hueline replay --expect: what the products are is expected of them the next time; each thing that moved is told and is a failure in the
# report; a file that is no expectation is refused.
# usage: expect_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
printf 'rig: nobody\nsensors:\n  - {name: pps, driver: pps, socket: pps.sock}\ncolouring: {method: lens}\n' >rig.yaml
ends 5 "$hueline" capture rig.yaml --out drive --seconds 1 --quiet
ends 5 "$hueline" replay drive --out first --write-expect is.json
# The hashes are those of another program.
for file in cloud.las view.mcap; do grep -q "$(sha256sum <first/$file | cut -d' ' -f1)" is.json || fail "the hash of $file: $(cat is.json)"; done
ends 0 "$hueline" replay drive --out again --expect is.json --junit is.xml
says "all 6 figures are as expected"

# expects STATUS JSON: of the replay's products
expects() { echo "$2" >want.json; ends "$1" "$hueline" replay drive --out again --expect want.json --junit want.xml; }
expects 6 '{"sha256": {"cloud.las": "00", "gone.las": "00"}, "summary": {"/verdict/grade": "go<od", "/points/total": {"least": 1}, "/nothing": 1, "/journal/packets": {"most": 1000}}}'
says "sha256 cloud.las: expected 00, found [0-9a-f]{64}$"
says "sha256 gone.las: open .*gone.las: No such file"
says 'summary /verdict/grade: expected "go<od", found "drive again"'
says 'summary /points/total: expected \{"least":1\}, found 0$'
says "summary /nothing: expected 1, and summary.json has no such value"
! grep "/journal/packets" said.txt || fail "told what did not move"
python3 - <<'END' || fail "the report: $(cat want.xml)"
import xml.etree.ElementTree as xml
def failures(file):
    suite = xml.parse(file).getroot().find("testsuite")
    cases = suite.findall("testcase")
    assert len(cases) == int(suite.get("tests")) == 6
    out = {case.get("name"): case.find("failure").get("message") for case in cases if case.find("failure") is not None}
    assert len(out) == int(suite.get("failures"))
    return out
assert failures("is.xml") == {}
moved = failures("want.xml")
assert len(moved) == 5 and "summary /journal/packets" not in moved and '"go<od"' in moved["summary /verdict/grade"]
END
expects 0 '{}'
expects 0 '{"summary": {"/points/total": {"least": 0, "most": 0}, "/verdict/remarks/0/text": "no point was placed"}}'
for wrong in '' '[]' '{"sha": {}}' '{"sha256": {"../drive/drive.mcap": "00"}}' '{"sha256": {"cloud.las": 1}}' '{"summary": {"points": 1}}' '{"summary": {"/points": [1]}}' \
  '{"summary": {"/points/total": {"at_most": 1}}}' '{"summary": {"/points/total": {"least": "1"}}}' '{"summary": {"/points/total": {}}}' "$(printf '[%.0s' {1..100000})"; do
  expects 2 "$wrong"
  says "want.json: (is not JSON|is not an object|has 'sha'|sha256|summary)"
done
# The expectation is read before the work. The report may lie in the folder that the replay makes, as the first run of a CI job has it.
ends 3 "$hueline" replay drive --out never --expect none.json
[ ! -e never ] || fail "the drive was replayed before its expectation was read"
ends 0 "$hueline" replay drive --out fresh/again --expect is.json --junit fresh/is.xml
ends 0 "$hueline" replay drive --out new --expect is.json --junit new/is.xml
cmp fresh/is.xml is.xml && cmp new/is.xml is.xml || fail "the report in a new folder is another one"
ends 4 "$hueline" replay drive --out newer --expect is.json --junit nowhere/is.xml
says "write nowhere/is.xml: No such file or directory; the folder does not exist"
# Without an expectation nothing is held, and a report would say nothing.
ends 2 "$hueline" replay drive --out again --junit want.xml
says "hueline replay: --junit requires --expect"
ends 2 "$hueline" replay drive --out again --expect is.json --write-expect other.json
says "excludes"
echo "products held against what is expected of them"
