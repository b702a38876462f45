#!/usr/bin/env bash
# Runs the program as a user does on files that are cut, damaged or absent, and on disks that are full. What is whole is used, the rest is
# reported with its place, and the exit status says so. Exits 77 (a skip) without the recordings.
# usage: bad_input_test.sh HUELINE DATA
set -euo pipefail
hueline=$1 data=${HUELINE_DATA:-$2}
[ -r "$data/velodyne/vlp16_scans.pcap" ] || { echo "recording not present: $data/velodyne/vlp16_scans.pcap"; exit 77; }
work=$(mktemp -d)
trap 'mountpoint -q "$work/disk" && umount "$work/disk"; rm -rf "$work"' EXIT
cd "$work"
scans=$data/velodyne/vlp16_scans.pcap
source "$(dirname "$(realpath "$0")")/program.sh"
ends() { local want=$1; shift; local got=0; timeout 60 "$@" >said.txt 2>&1 || got=$?; [ $got = "$want" ] || fail "'$*' gave $got, not $want"; }
# Prints the packets of a sensor in a recording, also in a damaged one.
packets() { { "$hueline" inspect "$1" --json 2>/dev/null || true; } | sed -n "/\"name\": \"$2\"/,/}/s/.*\"packets\": \([0-9]*\).*/\1/p" | head -1; }
laser_rig() {
  printf 'rig: file\nsensors:\n  - name: laser\n    driver: velodyne\n    model: VLP-16\n    pcap: {file: %s}\n' "$1"
  printf '    T_body_scanner: {position_m: [0, 0, 1], rotation_deg: [0, 0, 0]}\ncolouring: {method: lens}\n'
}
put() { printf "$3" | dd of="$1" bs=1 seek="$2" conv=notrunc status=none; }  # FILE OFFSET BYTES

# Every frame of this capture file takes 16 + 1248 bytes behind a header of 24.
head -c $((24 + 1264 * 79 + 700)) "$scans" >cut.pcap
laser_rig cut.pcap >cut.yaml
ends 3 "$hueline" capture cut.yaml --out cut --quiet
says "error laser: cut.pcap: capture ends inside a record of 1248 bytes at byte $((24 + 1264 * 79))"
[ "$(packets cut/drive.mcap laser)" = 79 ] || fail "the packets before the cut are not in the recording"
ends 3 "$hueline" inspect cut.pcap
says "at byte $((24 + 1264 * 79))"

cp "$scans" broken.pcap; chmod u+w broken.pcap
put broken.pcap $((24 + 1264 * 100 + 8)) '\xff\xff\xff\xff'
laser_rig broken.pcap >broken.yaml
ends 3 "$hueline" capture broken.yaml --out broken --quiet
says "broken.pcap: record claims 4294967295 bytes at byte $((24 + 1264 * 100))"
[ "$(packets broken/drive.mcap laser)" = 100 ] || fail "a broken capture was not read up to its break, once"

# Two scanners of one kind in one capture file are two devices. A rig that takes them for one gets a fault.
frames=$((1264 * 40))
{ head -c $((24 + frames)) "$scans"; head -c $((24 + frames)) "$scans" | tail -c $frames; } >twins.pcap
for i in $(seq 40 79); do put twins.pcap $((24 + 1264 * i + 16 + 29)) '\x07'; done  # the last number of the sender's address
ends 0 "$hueline" inspect twins.pcap
[ "$(grep -c "^ *device  *velodyne VLP-16" said.txt)" = 2 ] || fail "two scanners were not told apart"
[ "$(grep -c "data dual  *40$" said.txt)" = 2 ] || fail "not every scanner has its packets"
laser_rig twins.pcap >twins.yaml
ends 5 "$hueline" capture twins.yaml --out twins --quiet
says "WrongDevice x40"

# The capture kept only the beginning of some frames.
{ head -c 24 "$scans"; head -c $((24 + 16 + 96)) "$scans" | tail -c $((16 + 96)); } >short.pcap
put short.pcap $((24 + 8)) '\x60\x00\x00\x00'
ends 3 "$hueline" inspect short.pcap
says "1 cut off by the capture"

laser_rig absent.pcap >absent.yaml
ends 3 "$hueline" capture absent.yaml --out absent --quiet
says "error laser: open absent.pcap: No such file"

# One bit inside one of the receiver's messages is wrong. That message is left out and named, and all others are decoded.
messages() { "$hueline" inspect "$1" --json | sed -n "s/.*\"$2\": \([0-9]*\).*/\1/p" | head -1; }
cp "$data/novatel/ins1.gps" crc.gps; chmod u+w crc.gps
put crc.gps 5000 '\x55'
whole=$(messages "$data/novatel/ins1.gps" INSPVAS)
printf 'rig: file\nsensors:\n  - {name: pos, driver: novatel, file: crc.gps}\ncolouring: {method: lens}\n' >crc.yaml
ends 5 "$hueline" capture crc.yaml --out crc --quiet
says "Malformed x104 .*104 bytes skipped, 1 broken message among them, first INSPVAS"
[ "$(messages crc.gps INSPVAS)" = $((whole - 1)) ] || fail "more than the broken message is missing"
"$hueline" inspect crc/drive.mcap --json | grep -q "\"bytes\": $(stat -c %s crc.gps)" || fail "the broken message is not recorded"

# A recording of several chunks, one of which is damaged, and disks that fill up.
{ cat "$scans"; for i in $(seq 19); do tail -c +25 "$scans"; done; } >large.pcap
laser_rig large.pcap >large.yaml
ends 5 "$hueline" capture large.yaml --out large --quiet
[ "$(packets large/drive.mcap laser)" = $((603 * 20)) ] || fail "the large capture is not recorded whole"
cp large/drive.mcap chunk.mcap
put chunk.mcap 6000000 '\x55\x55\x55'
ends 3 "$hueline" replay chunk.mcap --out chunk
says "chunk.mcap at byte [0-9]*: wrong CRC; the chunk of [0-9]* bytes is skipped"
kept=$(packets chunk.mcap laser)
[ "$kept" -gt 6000 ] && [ "$kept" -lt $((603 * 20)) ] || fail "of the broken recording $kept packets were read"
# What is whole of it is recovered, and the status says that something was not; a missing end is no such loss.
ends 3 "$hueline" recover chunk.mcap --out recovered.mcap
says "1 parts of chunk.mcap are damaged or missing"
[ "$(packets recovered.mcap laser)" = "$kept" ] || fail "of the broken recording $(packets recovered.mcap laser) packets were recovered, not $kept"
ends 0 "$hueline" inspect recovered.mcap
head -c 6000000 large/drive.mcap >ended.mcap
ends 0 "$hueline" recover ended.mcap --out recovered.mcap
says "ended.mcap ends at byte 6000000"
head -c 3000 large/drive.mcap >begun.mcap
ends 5 "$hueline" recover begun.mcap --out none.mcap
ends 5 "$hueline" verify none.mcap
says "no packet is in the recording"

full() {  # the folder of the drive
  says "recording ended early: write $1/drive.mcap at byte [0-9]*: $2"
  local kept; kept=$(packets "$1/drive.mcap" laser)
  [ "$kept" -gt 1000 ] || fail "$kept packets are left of the recording that met the end of the disk"
  says "drive.mcap holds the first $kept packets"
  ends 0 "$hueline" inspect "$1/drive.mcap"  # closed properly
}
(ulimit -f 8192; ends 4 "$hueline" capture large.yaml --out limit --quiet)
full limit "File too large"
(ulimit -f 1000; ends 4 "$hueline" recover limit --out small.mcap)
says "small.mcap.*File too large"
mkdir disk
if [ "$(id -u)" = 0 ] && mount -t tmpfs -o size=8m none disk 2>/dev/null; then
  ends 4 "$hueline" capture large.yaml --out disk/drive --quiet
  full disk/drive "No space left on device"
else
  echo "not tried: a full file system (needs the right to mount one)"
fi

# A device beside a file: they have no time in common.
sed 's/sensors:/sensors:\n  - {name: pos, driver: novatel, tcp: {host: 127.0.0.1, port: 3001}}/' cut.yaml >mixed.yaml
ends 2 "$hueline" capture mixed.yaml --out mixed
says "mixed.yaml:[0-9]*: key 'sensors' have no time in common: laser is read from a capture file and pos from a device"
[ ! -e mixed ] || fail "a refused rig made a folder"
sed 's/T_body_scanner/T_body_scaner/' cut.yaml >typo.yaml
ends 2 "$hueline" capture typo.yaml --out typo
says "typo.yaml:[0-9]*: key 'sensors\[0\]"

# A map that does not exist: a replay has nothing else to give, a capture its recording.
{ cat cut.yaml; echo "cloud: {crs: EPSG:99999}"; } >nowhere.yaml
ends 3 "$hueline" capture nowhere.yaml --out nowhere --quiet
says "rig: cloud: EPSG:99999.*correct cloud.crs, datum or geoid in the rig"
says "no cloud can be written; everything is recorded, and a replay with a corrected rig makes the cloud"
ends 2 "$hueline" replay nowhere --out again
says "EPSG:99999.*correct cloud.crs, datum or geoid in the rig; --rig names a corrected one"
[ ! -e again ] || fail "a refused map made a folder"
echo "all refused, told and kept"
