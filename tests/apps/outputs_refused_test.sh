#!/usr/bin/env bash
# A command never overwrites what it reads, or what another command is writing. Links are not followed. The refusal comes before the work.
# usage: outputs_refused_test.sh HUELINE
set -euo pipefail
hueline=$1
work=$(mktemp -d)
capturing=
trap '[ -z "$capturing" ] || kill -9 $capturing 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
source "$(dirname "$(realpath "$0")")/program.sh"
# refused SENTENCE INPUT... -- COMMAND...: expects exit status 4, the sentence, and unchanged inputs.
refused() {
  local sentence=$1 inputs=(); shift
  while [ "$1" != -- ]; do inputs+=("$1"); shift; done; shift
  local before; before=$(sha256sum "${inputs[@]}")
  ends 4 timeout 60 "$@"
  says "$sentence"
  [ "$(sha256sum "${inputs[@]}")" = "$before" ] || fail "'$*' changed what it reads"
}
own='refused, this command reads that file'
link='refused, it is a symbolic link'
busy='refused, another capture, replay or the like is writing into that folder'

# The drive of an empty file: a raw recording, whole, without points.
head -c 20000 /dev/zero >nothing.gps
printf 'rig: log\nsensors:\n  - {name: pos, driver: novatel, file: nothing.gps}\ncolouring: {method: lens}\n' >rig.yaml
ends 5 "$hueline" capture rig.yaml --out drive --quiet
printf 'exposure,u_px,v_px\n1,10,10\n' >picks.csv
printf 'name,east_m,north_m,up_m,scan\nS,0,0,0,S.las\n' >stations.csv
printf 'name,east_m,north_m,up_m\nA,1,0,0\n' >targets.csv
cp "$(dirname "$(realpath "$0")")/../../config/scenarios/square.yaml" scenario.yaml

refused "$own" drive/drive.mcap -- "$hueline" measure drive/drive.mcap --picks picks.csv --out drive/drive.mcap
refused "$own" drive/drive.mcap -- "$hueline" measure drive --picks picks.csv --out drive/../drive/drive.mcap
refused "$own" picks.csv -- "$hueline" measure drive --picks picks.csv --out picks.csv
refused "$own" drive/drive.mcap -- "$hueline" cut drive --out drive/drive.mcap
refused "$own" drive/drive.mcap -- "$hueline" recover drive/drive.mcap --out drive/../drive/drive.mcap
cp drive/drive.mcap second.mcap
refused "$own" second.mcap -- "$hueline" merge drive second.mcap --rig rig.yaml --out second.mcap

# A new recording replaces none but an earlier result of such a command, and no other result replaces a recording.
there='File exists; recordings are never overwritten: choose another name or move it away'
cp drive/drive.mcap other.mcap
printf 'name,value\n' >table.csv
for file in other.mcap table.csv; do
  refused "write $file: $there; --force replaces it" $file -- "$hueline" cut drive --out $file
  refused "write $file: $there; --force replaces it" $file -- "$hueline" recover drive --out $file
  refused "write $file: $there; --force replaces it" $file -- "$hueline" merge drive second.mcap --rig rig.yaml --out $file
done
refused "write other.mcap: $there$" other.mcap -- "$hueline" measure drive --picks picks.csv --out other.mcap
refused "write other.mcap: $there$" other.mcap -- "$hueline" extract drive --sensor pos --out other.mcap
refused "write drive/drive.mcap: $there; --force replaces it" drive/drive.mcap -- "$hueline" import absent.bag --out drive
mkdir completed; cp rig.yaml completed
refused "write completed/rig.yaml: File exists, and is not as an import wrote it" completed/rig.yaml -- "$hueline" import nothing.gps --out completed
ends 3 "$hueline" import nothing.gps --out completed --force
: >empty.mcap  # as mktemp leaves it
ends 0 "$hueline" cut drive --out empty.mcap
ends 0 "$hueline" cut drive --out part.mcap
ends 0 "$hueline" recover second.mcap --out part.mcap
ends 0 "$hueline" cut drive --out other.mcap --force
cmp -s other.mcap empty.mcap || fail "--force did not replace the recording"
refused "$own" drive/drive.mcap -- "$hueline" cut drive --out drive/drive.mcap --force
refused "$own" part.mcap -- "$hueline" recover part.mcap --out part.mcap --force

cp rig.yaml rig.svg
refused "$own" rig.svg -- "$hueline" rig show rig.svg --out rig.svg
cp drive/drive.mcap cloud.png
refused "$own" cloud.png -- "$hueline" picture cloud.png --above cloud.png
refused "$own" cloud.png -- "$hueline" picture cloud.png --street cloud.png
mv cloud.png cloud.webp
refused "$own" cloud.webp -- "$hueline" picture cloud.webp --moving cloud.webp
for option in --write-rig --clocks --sights; do refused "$own" scenario.yaml -- "$hueline" simulate scenario.yaml --out sim $option scenario.yaml; done
[ ! -e sim ] || fail "a drive was rendered before the output was refused"

# The files of a folder are links of both kinds, to the recording itself and to something else.
mkdir again
for name in cloud.las view.mcap summary.json report.html report.pdf; do
  ln drive/drive.mcap again/$name
  refused "$own" drive/drive.mcap -- "$hueline" replay drive --out again
  ln -sf ../drive/drive.mcap again/$name
  refused "$link" drive/drive.mcap -- "$hueline" replay drive --out again
  ln -sf ../nowhere again/$name
  refused "$link" drive/drive.mcap -- "$hueline" replay drive --out again
  [ ! -e nowhere ] || fail "a link was followed"
  rm again/$name
done
cp drive/drive.mcap backup.mcap
before=$(sha256sum <backup.mcap)
ln backup.mcap again/cloud.las  # not the recording that is read
echo "of another drive" >again/view.mcap
ends 5 "$hueline" replay drive --out again
[ "$(sha256sum <backup.mcap)" = "$before" ] || fail "a file was written over through its second name"
[ ! -s again/view.mcap ] && [ ! -s again/cloud.las ] || fail "a replay left an earlier one's results"
# People often replay into the folder of the recording itself.
ends 5 "$hueline" replay drive/drive.mcap --out drive

# A disk that has no room for the new file leaves the older one as it was.
for out in log.gps log.bin; do
  echo earlier >$out
  (ulimit -f 8; ends 4 "$hueline" extract drive --sensor pos --out $out)
  says "$out.part at byte [0-9]+: File too large; the file may not grow further"
  [ "$(cat $out)" = earlier ] && [ ! -e $out.part ] || fail "a failed run changed $out"
  ends 0 "$hueline" extract drive --sensor pos --out $out
  cmp -s $out nothing.gps || fail "$out is not what the device sent"
done

# A capture runs. Its folder is its own as long as it lives, however it ends.
printf 'rig: live\nsensors:\n  - name: laser\n    driver: velodyne\n    model: VLP-16\n    udp: {ports: [29368], bind_address: 127.0.0.1}\n' >live.yaml
printf '    T_body_scanner: {position_m: [0, 0, 1], rotation_deg: [0, 0, 0]}\ncolouring: {method: lens}\n' >>live.yaml
"$hueline" capture live.yaml --out live --quiet >capture.txt 2>&1 &
capturing=$!
for i in $(seq 300); do [ ! -s live/drive.mcap ] || break; kill -0 $capturing 2>/dev/null || { cat capture.txt; fail "the capture did not start"; }; sleep 0.1; done
cp live/drive.mcap begun.mcap  # it grows: what it began with must stay
for other in "replay drive --out live" "capture rig.yaml --out live --quiet" "calibrate targets-example --out live --points 10000"; do
  refused "$busy" rig.yaml -- "$hueline" $other
done
refused "$busy" rig.yaml -- "$hueline" rig show rig.yaml --out live/rig.svg
cmp -n "$(stat -c %s begun.mcap)" begun.mcap live/drive.mcap || fail "the running capture's recording was written over"
kill -0 $capturing || fail "the capture ended"
kill -9 $capturing; wait $capturing 2>/dev/null || true
capturing=
ends 5 "$hueline" replay drive --out live

# These are refused before the work: a folder that does not exist, a folder in a file's place, missing rights.
ends 4 "$hueline" measure drive --picks picks.csv --out absent/table.csv
says "write absent/table.csv: No such file or directory; the folder does not exist"
ends 4 "$hueline" measure drive --picks picks.csv --out again
says "write again: Is a directory"
ends 4 "$hueline" replay drive --out rig.yaml
says "make folder rig.yaml: Not a directory"
if [ "$(id -u)" != 0 ]; then
  mkdir closed; chmod 500 closed
  ends 4 "$hueline" replay drive --out closed/again
  says "Permission denied"
fi
echo "nothing that is read or written elsewhere was written over"
