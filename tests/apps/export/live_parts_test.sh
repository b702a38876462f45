#!/usr/bin/env bash
# Strips and tiles that are written beside the cloud: the bytes of an export after the drive, with any number of threads and beside any form
# of the cloud; named as unfinished when the program is killed, and made again by a replay.
# usage: live_parts_test.sh HUELINE IMAGE_PROOF SOURCE_DIR
set -euo pipefail
hueline=$1 proof=$2 source=$3
source "$source/tests/apps/export/short_drive.sh"

for split in tile:20m distance:5m time:1s; do
  rig las $split
  for threads in 1 3; do ends 0 "$hueline" replay drive --rig rig.yaml --out las-$threads --threads $threads --no-feed; done
  says "^parts +[0-9]+ files of $split in the folder parts: [0-9]+ points"
  diff -r las-1/parts las-3/parts || fail "$split: threads changed the bytes"
  rm -rf exported driven
  mkdir driven
  cp drive/drive.mcap las-1/cloud.las driven  # strips by distance are cut along the path of the recording
  ends 0 "$hueline" export driven --split $split --out exported
  [ "$(ls exported | wc -l)" -gt 3 ] || fail "$split: too few parts"
  diff -r las-1/parts exported || fail "$split: the parts are not those of the export"
done
# An octree has its points in another order; its parts are written in that of the drive.
for format in laz copc; do
  rig $format time:1s
  ends 0 "$hueline" replay drive --rig rig.yaml --out $format --no-feed
  diff -r las-1/parts $format/parts || fail "the parts depend on the form of the cloud"
done
grep -q "Parts of the cloud" copc/report.html || fail "the report does not name the parts"

# A folder keeps the parts of its last run only, and the files of others.
rig las tile:1000m
touch las-1/parts/notes.txt
ends 0 "$hueline" replay drive --rig rig.yaml --out las-1 --no-feed
[ ! -e "$(ls las-1/parts/strip_* 2>/dev/null | head -1)" ] && [ -e las-1/parts/notes.txt ] || fail "strips of the run before"
cp -r las-1/parts whole
ends 0 "$hueline" replay drive --rig plain.yaml --out las-1 --no-feed
[ "$(ls las-1/parts)" = notes.txt ] || fail "the parts of the run before stayed: $(ls las-1/parts)"

# A run that is killed leaves files that are named as unfinished, and no index. A replay makes them whole.
# (The first points come when the short drive is over, so the moment to kill it is short.)
for attempt in 1 2 3 4 5; do
  "$hueline" replay drive --rig rig.yaml --out las-1 --no-feed >killed.txt 2>&1 &
  killed=$!
  while kill -0 $killed 2>/dev/null && ! ls las-1/parts/*.laz.part >/dev/null 2>&1; do sleep 0.01; done
  kill -KILL $killed 2>/dev/null || true
  wait $killed 2>/dev/null || true
  [ -e las-1/parts/index.geojson ] || break
done
[ ! -e las-1/parts/index.geojson ] && [ ! -e "$(ls las-1/parts/tile_*.laz 2>/dev/null | head -1)" ] || fail "parts of a killed run look finished"
for file in summary.json report.html report.pdf; do [ ! -e las-1/$file ] || fail "$file of the run before stayed"; done
ends 0 "$hueline" replay drive --rig rig.yaml --out las-1 --no-feed
diff -r las-1/parts whole || fail "the replay after a kill gave other parts"

# What cannot be written is told, and the cloud goes on.
rm -rf blocked; mkdir -p blocked; touch blocked/parts
ends 4 "$hueline" replay drive --rig rig.yaml --out blocked --no-feed
mkdir -p stuck/parts/tile_0_0_1m.laz/other
ends 4 "$hueline" replay drive --rig rig.yaml --out stuck --no-feed
says "parts: .*tile_0_0_1m.laz: Directory not empty.*the raw recording goes on"
cmp stuck/cloud.las las-3/cloud.las || fail "the cloud did not go on without parts"
rig copc tile:1000m  # the octree is written late: the part is the first to grow too large
(ulimit -f 1500; ends 4 "$hueline" replay drive --rig rig.yaml --out limit --no-feed)
says "parts: .*laz.part at byte [0-9]+: File too large.*the raw recording goes on"
says "[0-9]+ points are not in them: a replay makes them whole"
sed "s/^cloud:/cloud:\n  split: tile:0/" plain.yaml >wrong.yaml
ends 2 "$hueline" replay drive --rig wrong.yaml --out wrong --no-feed
says "split.*tile:0.*allowed: time:60s, distance:500m or tile:100m"
echo "strips and tiles of $(stat -c %s las-3/cloud.las) bytes of cloud.las are those of an export"
