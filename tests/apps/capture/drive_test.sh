#!/usr/bin/env bash
# Runs the whole program as a user does: emulated devices on real sockets, a capture, and replays that give the same bytes for 1, 2 and 4
# threads and for 0.5x, 1x and unlimited speed. Then it checks what must be refused.
# usage: drive_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
simulator=${HUELINE_SIMULATOR:-$hueline}  # emulates the devices: beside the sanitizers, the released program
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
scenario=$source/tests/scenarios/short.yaml
ports="--pps-socket $work/pps.sock --data-port 42368 --position-port 48308 --pos-port 43001 --can-port 40000 --address 127.0.0.2"
fail() { echo "FAILED: $*"; exit 1; }

$simulator simulate "$scenario" --out sim --write-rig rig.yaml $ports
echo 'watch: {images_per_s: 4}' >>rig.yaml
echo 'recording: {segment_mb: 2, pack_images: true}' >>rig.yaml
printf '%s\n' 'panoramas: {exposures: "every:3", size: 256x128, orientation: north}' 'images: {exposures: "every:5"}' >>rig.yaml
$simulator simulate "$scenario" --out sim --play $ports >devices.txt 2>&1 &
devices=$!
$hueline capture rig.yaml --out drive --until-silent --seconds 60 --quiet || { cat devices.txt; fail "capture"; }
wait $devices || { cat devices.txt; fail "devices"; }
# Another compiler's program gives the same bytes.
$simulator replay drive/drive.mcap --out half --threads 2 --speed 0.5 >/dev/null & half=$!
$simulator replay drive/drive.mcap --out real --threads 4 --speed 1 >/dev/null & real=$!
for threads in 1 2 4; do $hueline replay drive/drive.mcap --out t$threads --threads $threads >/dev/null; done
wait $half; wait $real
for run in t1 t2 t4 half real; do
  cmp drive/cloud.las $run/cloud.las || fail "$run/cloud.las is not the live run's"
  cmp drive/view.mcap $run/view.mcap || fail "$run/view.mcap is not the live run's"
done
# The recording is in segments. One file of the same packets gives the same bytes.
[ -s drive/drive.000003.mcap ] && [ "$(stat -c %s drive/drive.000002.mcap)" -lt 2100000 ] || { ls -l drive; fail "segments"; }
$hueline cut drive --out whole.mcap >/dev/null && $hueline replay whole.mcap --out whole >/dev/null || fail "one file of the segments"
for file in cloud.las view.mcap; do cmp drive/$file whole/$file || fail "$file of one file is not that of the segments"; done
# Its images are packed, and as they came for other programs if asked.
$hueline cut drive --out plain.mcap --unpack >/dev/null && $hueline replay plain.mcap --out plain >/dev/null || fail "a recording of unpacked images"
cmp drive/cloud.las plain/cloud.las || fail "the cloud of unpacked images is not that of packed ones"
[ "$(stat -c %s plain.mcap)" -gt $(($(stat -c %s whole.mcap) + 200000)) ] || { ls -l ./*.mcap; fail "the images are not packed"; }
# What was made of the recording while it grew is what is made of it afterwards.
$simulator panorama drive --out panoramas --exposures every:3 --size 256x128 --orientation north >/dev/null 2>&1 || fail "panoramas"
$simulator export drive --profile images --points 0 --exposures every:5 --out images >/dev/null || fail "images"
[ "$(ls drive/panoramas/*.jpg | wc -l)" -ge 4 ] && [ "$(ls drive/images/images/*/*.jpg | wc -l)" -ge 12 ] || { ls -R drive/panoramas drive/images; fail "the products of the drive"; }
for product in panoramas images; do diff -r drive/$product $product || fail "$product of the drive"; done
# The ledgers prove that all is there, and of a segment that was lost they name the sources.
$hueline verify drive >proved.txt || { cat proved.txt; fail "verify of a whole recording"; }
grep -q "^whole: the .* packets are all that entered, by" proved.txt || { cat proved.txt; fail "the proof"; }
cp -r drive lost && rm lost/drive.000002.mcap
$hueline verify drive --json >whole.json
status=0; $hueline verify lost --json >lost.json 2>said.txt || status=$?
python3 - $status <<'EOF' || { cat lost.json said.txt; fail "verify of a recording that lost a segment"; }
import json, sys
whole, lost = json.load(open("whole.json")), json.load(open("lost.json"))
assert sys.argv[1] == "3" and whole["is_whole"] and not lost["is_whole"]
missing = [row["missing"] for row in lost["sources"]]
assert sum(missing) == whole["packets"] - lost["packets"] > 1000, missing
for before, after in zip(whole["sources"], lost["sources"]):
    assert after["recorded"] + after["missing"] == before["recorded"] == after["received"], after
EOF
# The scanner's datagrams as a capture file: all of them decode, also the status that it sent before its first points, and each arrived after
# the firings that it tells of, by the scanner's own clock.
$hueline extract drive --sensor laser --out laser.pcap >said.txt && grep -q "by the drive's clock (UTC)" said.txt || { cat said.txt; fail "extract of datagrams"; }
$hueline decode laser.pcap --out laser.las >said.txt 2>&1 || { cat said.txt; fail "decode of the extracted datagrams"; }
python3 - drive/summary.json <<'EOF' || fail "the extracted datagrams"
import json, re, struct, sys
data, at, lags = open("laser.pcap", "rb").read(), 24, []
packets = 0
while at < len(data):
    seconds, ns, size, _ = struct.unpack_from("<IIII", data, at)
    payload = data[at + 16 + 28:at + 16 + size]
    packets += 1
    if len(payload) == 1206:
        lags.append((seconds % 3600 + ns * 1e-9 - struct.unpack_from("<I", payload, 1200)[0] * 1e-6 + 1800) % 3600 - 1800)
    at += 16 + size
summary = json.load(open(sys.argv[1]))
assert [packets] == [one["packets"] for one in summary["sensors"] if one["name"] == "laser"], packets
lags.sort()
# A datagram is complete 1.33 ms after its first firing; on a busy computer it comes later.
assert 0.0013 < lags[0] and lags[len(lags) // 2] < 0.1, (lags[0], lags[len(lags) // 2])
points = int(re.search(r"(\d+) points", open("said.txt").read())[1])
assert points == summary["points"]["returns"], (points, summary["points"])
EOF
# The replay judges as the capture did. (That a flawless drive is good is tested without real time: on a busy computer the devices themselves
# are late.)
grep -qE '"grade": "(good|usable with remarks)"' drive/summary.json || { sed -n '/"verdict"/,/"journal"/p' drive/summary.json; fail "the drive is not usable"; }
[ "$(grep -c "<svg" drive/report.html)" = 1 ] || fail "the report has no map"
for run in t1 t4; do
  for report in report.html report.pdf; do cmp drive/$report $run/$report || fail "the replay's $report differs"; done
done
python3 "$(dirname "$(realpath "$0")")/report_test.py" drive >said.txt 2>&1 || { cat said.txt; fail "the report as a PDF"; }
# The watch over mounting and times looked at the same images, and saw the same in them.
watched() { python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["watch"])' "$1/summary.json"; }
for run in t1 t2 t4 half real; do
  [ "$(watched $run)" = "$(watched drive)" ] || { watched $run; watched drive; fail "$run watched otherwise than the live run"; }
done
python3 - drive/summary.json <<'EOF' || fail "nothing was watched"
import json, sys
watch = json.load(open(sys.argv[1]))["watch"]
assert watch["images"] >= 4 and watch["patches"] > 20 and watch["images_dropped"] == 0, watch
EOF
points=$($hueline inspect drive/cloud.las --json | sed -n 's/.*"points": \([0-9]*\).*/\1/p')
[ "$points" -gt 100000 ] || fail "only $points points"
$hueline verify drive/drive.mcap --scenario "$scenario" --sim sim --max-rms-px 1.0 || fail "reprojection"
# The figures that need no truth are those of the recording, and say so if they are of nothing.
$hueline score --recording drive --out judged >said.txt 2>&1 || { cat said.txt; fail "score of a recording"; }
python3 - judged/score.json <<'EOF' || fail "figures of the recording"
import json, sys
figures = json.load(open(sys.argv[1]))["drive"]
known = {name for name, value in figures.items() if value is not None}
assert known == {"held_out_de00_median", "held_out_within10_share", "depth_edge_missed_share", "depth_edge_missed_share_by_chance"}, known
assert figures["held_out_de00_median"] < 6 and figures["held_out_within10_share"] > 0.7, figures
EOF
# The wheel encoder came over its own socket, and its distance is that of the POS.
[ "$(grep -c '"disagreeing_s": 0.0' drive/summary.json)" = 2 ] || { grep -A20 '"wheels"' drive/summary.json; fail "the wheels' way is not the POS's"; }
$hueline inspect drive/drive.mcap --json | grep -q '"wheel_speeds": [3-9][0-9][0-9]' || fail "too few words of the wheels"

# A bad input gives a clear error and the right status, and existing files stay as they are.
refused() { local want=$1; shift; local got=0; "$@" >said.txt 2>&1 || got=$?; [ $got = "$want" ] || { cat said.txt; fail "'$*' gave $got, not $want"; }; }
sed 's/event_input/event_imput/' rig.yaml >typo.yaml
refused 2 $hueline capture typo.yaml --out x
grep -q "typo.yaml:[0-9]*: key 'sensors" said.txt || { cat said.txt; fail "the typo's place is not told"; }
refused 4 $hueline capture rig.yaml --out drive            # an existing drive
cmp drive/cloud.las t1/cloud.las || fail "a refused capture touched the drive"
refused 4 $hueline replay drive/drive.mcap --out /proc/nowhere
mkdir blocked; mkdir blocked/cloud.las
refused 4 $hueline replay drive/drive.mcap --out blocked
# The disk takes no more after the first megabyte.
(ulimit -f 1024; refused 4 $hueline replay drive/drive.mcap --out limit)
grep -q "cloud.las.*File too large" said.txt || { cat said.txt; fail "the refused write is not told"; }
kept=$({ $hueline inspect limit/cloud.las --json 2>said_of.txt || [ $? = 3 ]; } | sed -n 's/.*"points": \([0-9]*\).*/\1/p')
grep -q "limit/cloud.las: the run that was to make it did not finish it" said_of.txt || fail "a cloud that lacks points does not say so: $(cat said_of.txt)"
grep -q "$((points - kept)) points not written: write limit/cloud.las at byte [0-9]*: File too large" said.txt || { cat said.txt; fail "the points that are in no file are not counted"; }
[ "$kept" -gt 1000 ] || fail "of a cloud that hit the limit of its size $kept points are left"

for profile in laz ply e57; do
  (ulimit -f 1024; refused 4 $hueline export drive --profile $profile --out limit.$profile)
  grep -q "write limit.$profile.*File too large" said.txt || { cat said.txt; fail "the refused write of an export is not told"; }
done

# A camera sends another size than the rig says: this is reported, and its images are recorded, but not used for colours.
images=$(sed -n 's/^ *width: \([0-9]*\)$/\1/p' rig.yaml | head -1)
sed "s/^    width: $images\$/    width: $((images + 16))/" rig.yaml >size.yaml
refused 8 $hueline replay drive/drive.mcap --rig size.yaml --out size  # nothing is coloured: drive again
grep -q "points     $points, 0.0 % coloured" said.txt || { cat said.txt; fail "images of another size coloured points"; }
grep -q "WrongSize.*is $images x [0-9]*; the rig says $((images + 16)) x" said.txt || { cat said.txt; fail "the size is not told"; }
refused 5 $hueline score --recording drive --rig size.yaml --out judged_nothing
grep -q "no point of the recording could be seen in an image" said.txt || { cat said.txt; fail "figures of nothing"; }
head -c 1500000 drive/drive.mcap >cut.mcap
refused 3 $hueline replay cut.mcap --out cut
[ -s cut/cloud.las ] || fail "a cut recording gave nothing"
printf 'nonsense' >nonsense.bin
refused 3 $hueline inspect nonsense.bin
refused 3 $hueline replay missing.mcap --out y
echo "live and five replays agree: $(sha256sum drive/cloud.las | cut -d' ' -f1)"
