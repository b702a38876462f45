#!/usr/bin/env bash
# A cloud that is written as COPC while it grows: the same bytes with any number of threads, the points of the LAS cloud, and every command
# that takes a drive's cloud takes it.
# usage: live_copc_test.sh HUELINE IMAGE_PROOF SOURCE_DIR
set -euo pipefail
hueline=$1 proof=$2 source=$3
source "$source/tests/apps/export/short_drive.sh"
rig copc
for threads in 1 3; do ends 0 "$hueline" replay drive --rig rig.yaml --out copc-$threads --threads $threads --no-feed; done
cmp copc-1/cloud.copc.laz copc-3/cloud.copc.laz || fail "threads changed the bytes"
ends 0 "$hueline" replay drive --rig plain.yaml --out las --no-feed
cmp las/view.mcap copc-1/view.mcap || fail "the view depends on the cloud's format"

points() { "$hueline" inspect "$1" | sed -n 's/^points  *//p'; }
[ "$(points las/cloud.las)" -gt 100000 ] || fail "a drive of $(points las/cloud.las) points shows nothing"
[ "$(points las/cloud.las)" = "$(points copc-1/cloud.copc.laz)" ] || fail "the number of points"
# Sorted into tiles, both clouds have the same points; the tiles keep the order of the cloud they are made of.
for cloud in las copc-1; do
  ends 0 "$hueline" export $cloud --profile laz --split tile:20m --out tiles-$cloud
  ends 0 "$hueline" picture $cloud --above $cloud.png
done
python3 - <<'END' || fail "the tiles differ"
import json
def parts(folder):
    return {(p["file"], p["points"]) for p in (f["properties"] for f in json.load(open(f"tiles-{folder}/index.geojson"))["features"])}
assert parts("las") == parts("copc-1") and len(parts("las")) > 3, (parts("las"), parts("copc-1"))
END
# Parts of an earlier export stay, and are told; an index whose parts may have been replaced does not stay.
ends 0 "$hueline" export las --profile laz --split tile:40m --out tiles-las
says 'tiles-las has [0-9]+ more clouds, as of an earlier export'
ends 4 bash -c 'ulimit -f 2; exec "$@"' - "$hueline" export las --profile laz --split tile:30m --out tiles-las
says 'tiles-las/index.geojson of an earlier export was removed'
[ ! -e tiles-las/index.geojson ] || fail "an index of other parts stayed"
# A folder keeps the cloud of its last run only.
ends 0 "$hueline" replay drive --rig plain.yaml --out copc-1 --no-feed
[ ! -e copc-1/cloud.copc.laz ] || fail "the cloud of the run before stayed"
echo "cloud.copc.laz: $(points copc-3/cloud.copc.laz) points"
