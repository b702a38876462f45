#!/usr/bin/env bash
# hueline check where no sensor is: in a folder that is not there yet it listens to them, and where nothing can be written it says so of them too.
# hueline inspect warns of what check finds in the rig alone.
# usage: check_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"

ends 9 "$hueline" check street --seconds 3 --disk drives/today/
says "^MISSING pos: it is not there: tcp 127.0.0.1:3001"
! grep "cannot be written" said.txt || fail "a folder that a capture makes is missed"
[ -z "$(ls | grep -v said.txt)" ] || fail "something was left: $(ls -A)"

ends 9 "$hueline" check street --seconds 3 --disk /proc/nowhere
says "^MISSING disk: 64 MB cannot be written to /proc: No such file or directory"
says "^MISSING sensors: nobody has listened to them"
says "^not ready: 2 things"

sed 's/offset_px: \[612, 0\]/offset_px: [0, 512]/; s/crs: utm/crs: EPSG:4326/' "$source/config/rigs/street.yaml" >rig.yaml
ends 0 "$hueline" inspect rig.yaml
says "warning lens3: has the same region of the image as lens1"
says "warning rig: cloud: EPSG:4326 is not a projected CRS"
ends 0 "$hueline" inspect "$source/config/rigs/street.yaml"
! grep warning said.txt || fail "a warning of a good rig"
