# To be sourced by tests of what is written beside a drive, with $hueline, $proof and $source (the project's folder): drive/ has a drive of three
# seconds, plain.yaml its rig. The test continues in a folder of its own, which is removed when it ends.
work=$(mktemp -d)
trap 'kill -KILL $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
printf 'seed: 5\nduration_s: 3\ndrive: {stand_s: 0, accelerate_s: 0.5, speed: 6}\ncamera: {rate_hz: 2, lens_width: 64, lens_height: 54}\n' >scenario.yaml
mkdir drive
"$proof" scenario.yaml sim drive >proof.txt
ends 0 "$hueline" simulate scenario.yaml --out sim --write-rig plain.yaml
# rig FORMAT [SPLIT]: rig.yaml is plain.yaml with these keys of its cloud
rig() {
  sed "s/^cloud:/cloud:\n  format: $1${2:+\n  split: $2}/" plain.yaml >rig.yaml
  ! cmp -s plain.yaml rig.yaml || fail "the rig has no cloud"
}
