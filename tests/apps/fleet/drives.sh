# To be sourced by tests of fleets, with $hueline and $proof: drives of two seconds that differ, and what single replays make of them.
# make_drives COUNT: drives/1, drives/2, ...; rig.yaml is that of all
make_drives() {
  local drive
  for ((drive = 1; drive <= $1; drive++)); do
    cat >scenario.yaml <<END
seed: $drive
duration_s: 2
street: {furnished: false}
drive: {stand_s: 0, accelerate_s: 0.5, speed: 6}
camera: {rate_hz: 4, lens_width: 102, lens_height: 86}
END
    mkdir -p "drives/$drive"
    "$proof" scenario.yaml sim "drives/$drive" >said.txt 2>&1 || fail "drive $drive"
    rm "drives/$drive/sights.csv"
  done
  "$hueline" simulate scenario.yaml --out sim --write-rig rig.yaml >said.txt 2>&1 || fail "rig"
  rm -r sim
}
# singles: single/NAME is the replay of drives/NAME; one that is damaged ends with status 3
singles() {
  local drive
  for drive in drives/*; do
    "$hueline" replay "$drive" --out "single/${drive#*/}" --no-feed --threads 1 >said.txt 2>&1 || [ $? = 3 ] || fail "replay of $drive"
    [ -s "single/${drive#*/}/summary.json" ] || fail "nothing of $drive"
  done
}
digests() { (cd "$1" && find . -type f ! -name result.json ! -name log.txt -print0 | sort -z | xargs -0 sha256sum); }
# same_as_singles NAME...: the results in fleet/ are those of single replays
same_as_singles() {
  local drive
  for drive; do
    [ "$(digests "fleet/$drive")" = "$(digests "single/$drive")" ] || fail "fleet/$drive: $(digests "fleet/$drive") is not $(digests "single/$drive")"
  done
}
# result_is_whole: in the folder of a drive's results, the files are those that result.json names
result_is_whole() {
  python3 - <<'END'
import hashlib, json
products = json.load(open("result.json"))["products"]
assert len(products) == 4, products
for name, one in products.items():
    assert hashlib.sha256(open(name, "rb").read()).hexdigest() == one["sha256"], name
END
}
