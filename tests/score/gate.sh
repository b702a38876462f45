#!/usr/bin/env bash
# The gate: the quick sheet of the program as users run it, from a cold cache, against the committed figures. Fails if anything is worse
# beyond its noise, or if the number of threads shows. New figures become the standard by committing OUT/score.json as docs/score/quick.json.
# usage: gate.sh HUELINE SOURCE_DIR WORK_DIR
set -euo pipefail
hueline=$1 source=$2 work=$3
rm -rf "$work"
mkdir -p "$work"
cd "$source"
"$hueline" score --sheet quick --out "$work" --cache "$work/drives" --against docs/score/quick.json
rm -rf "$work/drives"
