#!/usr/bin/env bash
# The gate: runs the quick sheet of the program as users run it, with an empty cache, and compares it with the committed figures. It fails if a figure is worse
# beyond its noise, or if the number of threads changes a result. Commit OUT/score.json as docs/score/quick.json to make new figures the standard.
# usage: gate.sh HUELINE SOURCE_DIR WORK_DIR
set -euo pipefail
hueline=$1 source=$2 work=$3
rm -rf "$work"
mkdir -p "$work"
cd "$source"
"$hueline" score --sheet quick --out "$work" --cache "$work/drives" --against docs/score/quick.json
rm -rf "$work/drives"
