#!/usr/bin/env bash
# Every command, with each of its inputs in turn not there: exit status 2 for a rig, a scenario or a sheet, 3 for any other, the file in the
# message, and nothing written.
# usage: missing_inputs_test.sh HUELINE SOURCE
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
printf 'rig: log\nsensors:\n  - {name: pos, driver: novatel, file: nothing.gps}\ncolouring: {method: lens}\n' >rig.yaml
head -c 20000 /dev/zero >nothing.gps
ends 5 "$hueline" capture rig.yaml --out drive --quiet
ends 0 "$hueline" fleet plan drive --out plan.json
printf 'exposure,u_px,v_px\n1,10,10\n' >picks.csv
printf 'name,east_m,north_m,up_m,scan\nS,0,0,0,S.las\n' >stations.csv
printf 'name,east_m,north_m,up_m\nA,1,0,0\n' >targets.csv
printf "date Sun Nov 29 08:00:00 am 2026\nbase hex  timestamps absolute\n   0.100000 1  123             Rx   d 2 01 02\n" >bus.asc
cp "$source/config/scenarios/square.yaml" scenario.yaml

tried=()
# missing STATUS COMMAND WORDS...: one of the words is the file `nosuch`, with any ending.
missing() {
  local want=$1; shift
  ends "$want" timeout 60 "$hueline" "$@"
  says 'nosuch'
  [ -z "$(ls -d out* 2>/dev/null)" ] || fail "'$*' wrote $(ls -d out*)"
  tried+=("$1" "$1 $2")
}
missing 2 capture nosuch.yaml --out out --quiet
missing 2 check nosuch.yaml --disk . --seconds 3
missing 2 doctor nosuch.yaml
missing 2 rig show nosuch.yaml --out out.svg
missing 2 simulate nosuch.yaml --out out
missing 2 simulate scenario.yaml --out out --beside nosuch.yaml
missing 2 score --sheet nosuch.yaml --out out
missing 3 score --sheet quick --against nosuch.json --out out
missing 3 score --recording nosuch.mcap --out out
missing 2 score --recording drive --rig nosuch.yaml --out out
missing 3 inspect nosuch.mcap
missing 3 inspect nosuch.yaml
missing 3 inspect bus.asc --dbc nosuch.dbc
missing 3 verify nosuch.mcap
missing 2 verify --scenario nosuch.yaml --sim out
missing 3 extract nosuch.mcap --sensor pos --out out.gps
missing 3 cut nosuch.mcap --out out.mcap
missing 3 recover nosuch.mcap --out out.mcap
missing 3 merge drive nosuch.mcap --rig rig.yaml --out out.mcap
missing 2 merge drive drive/drive.mcap --rig nosuch.yaml --out out.mcap
missing 3 replay nosuch.mcap --out out
missing 2 replay drive --rig nosuch.yaml --out out
missing 3 replay drive --trajectory nosuch.sbet --out out
missing 3 replay drive --expect nosuch.yaml --out out
missing 3 decode nosuch.pcap --out out.las
missing 3 decode nothing.gps --calibration nosuch.csv --out out.las
missing 3 import nosuch.bag --out out
missing 3 picture nosuch.las --above out.png
missing 3 colour nosuch.png nosuch.pcd nosuch.yaml --out out
for profile in laz:laz copc:copc.laz ply:ply e57:e57 trajectory:csv images:d; do
  missing 3 export nosuch --profile "${profile%:*}" --out "out.${profile#*:}"
done
missing 2 export drive --profile images --rig nosuch.yaml --out out
missing 2 export drive --profile trajectory --rig nosuch.yaml --out out.csv
missing 3 export drive --profile trajectory --trajectory nosuch.sbet --out out.csv
missing 3 measure nosuch.mcap --picks picks.csv --out out.csv
missing 3 measure drive --picks nosuch.csv --out out.csv
missing 3 measure drive --picks picks.csv --panoramas nosuch.csv --out out.csv
missing 2 measure --scenario nosuch.yaml --sim out --picks picks.csv --out out.csv
missing 3 panorama nosuch.mcap --out out
missing 2 panorama drive --rig nosuch.yaml --out out
missing 3 calibrate lens nosuch.png --size 9x6
missing 3 calibrate mount --points nosuch.csv --rig rig.yaml
missing 3 calibrate mount --recording nosuch.mcap
missing 3 calibrate mount --image nosuch.png --cloud nosuch.pcd --lens nosuch.yaml --start nosuch.yaml
missing 3 calibrate boresight --recording nosuch.mcap
missing 3 calibrate mask --recording nosuch.mcap
missing 3 calibrate targets --targets nosuch.csv --stations stations.csv --out out
missing 3 calibrate targets --targets targets.csv --stations nosuch.csv --out out
missing 3 fleet plan nosuch.mcap --out out.json
for command in "run nosuch.json" "task nosuch.json 1" "submit nosuch.json" "status nosuch.json" "upload nosuch.json s3://bucket/key"; do missing 3 fleet $command; done
missing 3 fleet catalogue nosuch --out out.gpkg
missing 3 fleet catalogue nosuch --out out.html
ends 3 "$hueline" fleet catalogue nosuch drive --out drives.gpkg
says 'not in the catalogue: .*nosuch'
says '^1 drive in drives.gpkg$'

# No command was left out but those that read nothing.
for command in $("$hueline" --complete ""); do
  below=$("$hueline" --complete "$command" "" | sed "s/^/$command /")
  while read -r one; do
    case " $one " in *" keys "* | *" rig schema "* | *" targets-example "*) continue ;; esac
    [[ " $(printf '<%s>' "${tried[@]}") " == *"<$one>"* ]] || fail "not tried: $one"
  done <<<"${below:-$command}"
done
echo "$((${#tried[@]} / 2)) missing inputs have their status"
