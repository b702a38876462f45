#!/usr/bin/env bash
# hueline fleet on one computer: drives that differ are planned and done, a run is killed with all it started, one drive is damaged; the
# results are those of single replays, byte by byte.
# usage: fleet_test.sh HUELINE IMAGE_PROOF SOURCE_DIR
set -euo pipefail
hueline=$1 proof=$2 source=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
source "$source/tests/apps/fleet/drives.sh"

make_drives 4
cp -r drives/1 drives/cut
truncate -s "$(($(stat -c %s drives/1/drive.mcap) * 6 / 10))" drives/cut/drive.mcap
singles
ends 0 "$hueline" fleet plan drives/* --out fleet.json
says "5 drives; "
# Written twice, it is the same plan.
ends 0 "$hueline" fleet plan drives/* --out other.json
cmp fleet.json other.json || fail "the plan changes"

# The whole group is killed, as a computer that loses its power; nothing that is left looks finished. On a busy computer the drives may be
# done before the kill comes: then they are begun again.
is_under_way() { compgen -G "fleet/.*/drive/cloud.las" >/dev/null; }
for ((round = 0; round < 5; round++)); do
  rm -rf fleet
  set -m  # a process group of its own
  "$hueline" fleet run fleet.json --jobs 2 >killed.txt 2>&1 & run=$!
  set +m
  while kill -0 $run 2>/dev/null && ! is_under_way; do sleep 0.02; done
  kill -9 -- -$run 2>/dev/null || true
  wait $run 2>/dev/null || true
  ! is_under_way || break
done
is_under_way || fail "each kill came too late: $(cat killed.txt)"
ends 7 "$hueline" fleet status fleet.json
for drive in fleet/[!.]*; do [ ! -e "$drive" ] || (cd "$drive" && result_is_whole) || fail "$drive looks finished"; done

# A drive is damaged after it was planned.
cp drives/3/drive.mcap saved.mcap
printf 'X' | dd of=drives/3/drive.mcap bs=1 seek=100000 conv=notrunc status=none
ends 3 "$hueline" fleet run fleet.json --jobs 2
says "3 of 5 drives done; "
says "1 failed, an input is not what it was when the plan was made: 3$"
says "1 failed, an input is damaged; the results are those of what is whole: cut$"
[ ! -e fleet/3 ] || fail "results of a damaged drive"
same_as_singles 1 2 4 cut
[ -z "$(compgen -G 'fleet/.*')" ] || fail "left: $(ls -A fleet)"

# The catalogue of it, with what is not done too. It is the same each time.
ends 0 "$hueline" fleet catalogue fleet.json --out fleet.gpkg
says "^5 drives in fleet.gpkg$"
"$source/tests/apps/fleet/catalogue_check.py" fleet.gpkg fleet 1=done 2=done 3=input_changed 4=done cut=damaged || fail "the catalogue"
ends 0 "$hueline" fleet catalogue fleet.json --out fleet2.gpkg
cmp fleet.gpkg fleet2.gpkg || fail "the catalogue changes"
# The same as a page for people: what is not done is told, and each link leads to a report.
mkdir pages
ends 0 "$hueline" fleet catalogue fleet.json --out pages/fleet.html
says "^5 drives on pages/fleet.html$"
"$source/tests/apps/fleet/page_check.py" pages/fleet.html 5 4 3 || fail "the page"
ends 0 "$hueline" fleet catalogue fleet.json --out pages/again.html
cmp pages/fleet.html pages/again.html || fail "the page changes"
# Drives without a plan: one with its products, one recording alone, one that is none.
mkdir -p "driven/it's 4"
cp single/4/* drives/4/drive.mcap "driven/it's 4"
ends 3 "$hueline" fleet catalogue driven/* drives/2/drive.mcap rig.yaml --out driven.gpkg
says "rig: .*rig.yaml"
says "^3 drives in driven.gpkg$"
told=$(ogrinfo -q -ro -dialect sqlite -sql "SELECT name, status, points > 0 AS p, (SELECT count(*) FROM products WHERE drive_fid = d.fid) AS n, line IS NULL AS l FROM drives d" driven.gpkg)
[ "$(grep = <<<"$told" | sed 's/.*= //' | tr '\n' ' ')" = "it's 4 driven 1 5 0 2 driven (null) 0 0 rig driven (null) 0 1 " ] || fail "drives without a plan: $told"

# What is done stays as it is; what has failed is done.
mv saved.mcap drives/3/drive.mcap
before=$(stat -c %y%i fleet/1/cloud.las)
ends 3 "$hueline" fleet task fleet.json 5
ends 0 "$hueline" fleet task fleet.json 3
ends 3 "$hueline" fleet run fleet.json
says "4 of 5 drives done; "
[ "$before" = "$(stat -c %y%i fleet/1/cloud.las)" ] || fail "a drive was done again"
same_as_singles 1 2 3 4 cut
ends 2 "$hueline" fleet task fleet.json 6
says "have the numbers 1 to 5$"
ends 3 "$hueline" fleet plan drives/1 drives/none --out more.json
says "none: open .*No such file"
[ ! -e more.json ] || fail "a plan without a drive"

# Another rig gives other results, and those of a replay with it.
sed 's/position_m: \[0.02,/position_m: [0.22,/' rig.yaml >better.yaml
! cmp -s rig.yaml better.yaml || fail "the rig is the same"
ends 0 "$hueline" fleet plan drives/1 --rig better.yaml --out better.json
ends 0 "$hueline" fleet run better.json
ends 0 "$hueline" replay drives/1 --rig better.yaml --out single/better --no-feed
cmp single/better/cloud.las better/1/cloud.las || fail "the rig"
! cmp -s single/1/cloud.las better/1/cloud.las || fail "the rig was not used"
ends 0 "$hueline" fleet catalogue better.json --out better.gpkg
ogrinfo -q -ro -al better.gpkg | grep -q "rig_sha256 .* = $(sha256sum better.yaml | cut -d' ' -f1)$" || fail "the catalogue's rig: $(ogrinfo -q -ro -al better.gpkg)"
# A disk that is full, here a limit of the process: told as such, and nothing that looks finished.
ends 0 "$hueline" fleet plan drives/1 --out full.json
(ulimit -f 1000; ends 4 "$hueline" fleet run full.json)
says "1 failed, the results could not be written: 1$"
[ ! -e full/1 ] || fail "results that are cut"
ends 0 "$hueline" fleet run full.json
cmp single/1/cloud.las full/1/cloud.las || fail "after the disk was full"

# A program that is killed alone, without its replay: the next attempt does not wait for that, and nothing is left in the end.
ends 0 "$hueline" fleet plan drives/2 --out alone.json
"$hueline" fleet task alone.json 1 >killed.txt 2>&1 & run=$!
for ((i = 0; i < 500; i++)); do compgen -G "alone/.*/drive/cloud.las" >/dev/null && break; sleep 0.02; done
kill -9 $run
wait $run 2>/dev/null || true
ends 0 "$hueline" fleet task alone.json 1
cmp single/2/cloud.las alone/2/cloud.las || fail "after a kill"
for ((i = 0; i < 100; i++)); do
  ends 0 "$hueline" fleet task alone.json 1
  [ "$(ls -A alone)" = 2 ] && break
  sleep 0.2
done
[ "$(ls -A alone)" = 2 ] || fail "left: $(ls -A alone)"

if command -v snakemake >/dev/null; then
  ends 0 "$hueline" fleet plan drives/1 drives/4 --out "by snakemake.json"
  ends 0 "$hueline" fleet submit "by snakemake.json" --engine snakemake
  ends 0 bash -c "$(tail -n 1 said.txt)"
  ends 0 "$hueline" fleet status "by snakemake.json"
  cmp single/4/cloud.las "by snakemake/4/cloud.las" || fail "by Snakemake"
else
  echo "Snakemake is not installed: its part is left out"
fi
echo "a fleet was fused again to the bytes of single replays"
