#!/usr/bin/env bash
# Logs of receivers: recognised by what is in them, captured by a rig, and written out again as the maker's file, to the byte.
# usage: receivers_test.sh HUELINE
set -euo pipefail
hueline=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$(dirname "$(realpath "$0")")/../program.sh"

# UBX-NAV-PVT of 2026-03-01 00:00:00 UTC, behind a comment; the name says nothing.
{
  printf '# a log\n'
  printf '\xb5\x62\x01\x07\x5c\x00\x50\x46\x00\x00\xea\x07\x03\x01\x00\x00\x00\x07\x19\x00\x00\x00\x00\x00\x00\x00\x03\x01\x00\x11'
  printf '\x40\xff\x10\x05\x40\x6d\x31\x1c\x4b\xde\x06\x00\x80\x1a\x06\x00\x86\x05\x00\x00\xd0\x07\x00\x00'
  printf '\x00%.0s' {1..20}
  printf '\x64\x00\x00\x00'
  printf '\x00%.0s' {1..20}
} >body
python3 - <<'PY'
data = open('body', 'rb').read()
message = data[data.index(b'\xb5\x62'):]
message += bytes(6 + 0x5c - len(message))
a = b = 0
for byte in message[2:]:
    a = (a + byte) & 255
    b = (b + a) & 255
open('receiver', 'wb').write(b'# a log\n' + message + bytes([a, b]))
PY
ends 0 "$hueline" inspect receiver
says 'format +u-blox UBX'
says 'NAV-PVT +1'
says 'Single +1'
says 'begin +2026-03-01T00:00:00.000Z'
says 'no_solution +none of the messages is a navigation solution, so a replay places no points; a navigation solution is NAV-PVAT'
printf '$GPGGA,120000,4718.0,N,00830.0,E,1,8,1.0,400,M,50,M,,*78\r\n' >sentences
ends 0 "$hueline" inspect sentences
says 'NMEA 0183'
says 'NoTime'
printf 'rig: files\nsensors:\n  - {name: pos, driver: ublox, file: receiver}\ncolouring: {method: lens}\n' >rig.yaml
ends 5 "$hueline" capture rig.yaml --out drive
says 'the rig has no laser scanner'
says 'the POS sent 1 NAV-PVT, 1 text, and no navigation solution; a navigation solution is NAV-PVAT'
ends 0 "$hueline" extract drive --sensor pos --out again
cmp receiver again || fail "the maker's file came out with other bytes"
ends 2 "$hueline" extract drive --sensor camera --out other
says "no sensor 'camera' in the recording; there are: pos"
# The name decides only if the bytes do not, and a log without one message is no success.
cp receiver misnamed.gps
ends 0 "$hueline" inspect misnamed.gps
says 'format +u-blox UBX'
head -c 3000 /dev/zero >NOTHING.GPS
ends 3 "$hueline" inspect NOTHING.GPS
says 'none of its 3000 bytes belong to a message of NovAtel OEM7 binary'
# A log of a CAN bus by its bytes, and one without a frame.
printf ';$FILEVERSION=1.1\r\n;\r\n   1)  17535.4  Tx  00000100  2  00 01 \r\n' >bus
ends 0 "$hueline" inspect bus
says 'id +00000100'
# A position without its quality.
printf '$GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,,,A*74\r\n' >lonely
ends 0 "$hueline" inspect lonely
says 'ask the receiver for GGA'
# The ending of a log of a bus is also that of a receiver's log in ASCII.
cp lonely lonely.asc
ends 0 "$hueline" inspect lonely.asc
says 'NMEA 0183'
# The first log of a receiver is longer than any line of a bus, or its head is missing.
{ printf '#RANGEA,COM1,0,63.5,FINESTEERING,1429,226979.000,02000000,5103,2748;26'; printf ',6,0,23359924.081,0.078' | sed 's/.*/&&&&&&&&&&&&&&&&/;s/.*/&&&&&&&&&&&&&&&&/'; printf '*00000000\r\n'; } >range.asc
if [ "$(wc -c <range.asc)" -lt 4200 ]; then fail "the line is short"; fi
for log in range.asc tail.asc; do
  if [ $log = tail.asc ]; then { printf '9,0.078*1234abcd\r\n'; cat range.asc; } >$log; fi
  "$hueline" inspect $log >said.txt 2>&1 || true
  if grep -q 'CAN' said.txt; then fail "$log is taken for a log of a bus: $(cat said.txt)"; fi
  says 'NovAtel'
done
printf 'MDF     4.10    CANedge \0\0' >bus.mf4
ends 3 "$hueline" inspect bus.mf4
says 'bus.mf4 is a measurement file \(MDF, .mf4\), which is not read: make a CAN log of it'
printf 'date Mon Mar 1 12:00:00 2026\nbase hex timestamps absolute\n 0.100 1 100 Rx d 2 00 01\n' >bus.asc
ends 0 "$hueline" inspect bus.asc
says 'id +00000100|id +100'
# Comments and empty lines come before the first frame of a candump. Without times its frames are refused, not passed over.
printf '# on the test track\n\n (1705.250000) can0 321#1122\n' >noted
ends 0 "$hueline" inspect noted
says 'id +321'
printf '  can0  321   [2]  11 22\n  can0  322   [1]  11\n' >timeless
ends 3 "$hueline" inspect timeless
says 'timeless: no frame of a CAN bus could be read: line 1: a frame without a time \(candump -L writes it\)'
printf '$STARTTIME=45628.86\r\nNumber Time (ms) Bus Direction Type ID (hex) Reserved Length D0 D1 D...\r\n1 0.100 1 Rx DT 0321 - 1 11\r\n' >trace.csv
ends 0 "$hueline" inspect trace.csv
says 'id +321'
# What tcpdump captures on the interface of a bus is a log of it.
{ printf '\xd4\xc3\xb2\xa1\2\0\4\0\0\0\0\0\0\0\0\0\0\0\4\0\xe3\0\0\0'; printf '\1\0\0\0\0\0\0\0\12\0\0\0\12\0\0\0\0\0\3\x21\2\0\0\0\x11\x22'; } >bus.pcap
ends 0 "$hueline" inspect bus.pcap
says 'id +321'
printf ';$FILEVERSION=1.1\r\n;\r\n' >silent
ends 3 "$hueline" inspect silent
says 'silent: no line of it is a frame of a CAN bus'
# A BLF may have recorded other networks of a vehicle alone.
{ printf 'LOGG\220\0\0\0'; head -c 136 /dev/zero; printf 'LOBJ\40\0\1\0\50\0\0\0\107\0\0\0'; head -c 24 /dev/zero; } >other.blf
ends 3 "$hueline" inspect other.blf
says 'other.blf: it has no frame of a CAN bus, but 1 object of Ethernet, which are not read'
says 'Ethernet +1'
# Recordings and results of known kinds that are not read are told by what they are, whatever their names promise.
printf '%% program   : RTKPOST ver.2.4.3\n' >path.pos
ends 3 "$hueline" inspect path.pos
says 'path.pos is a solution of RTKLIB'
printf '%60s%s\n' '     3.04           OBSERVATION DATA    M                   ' 'RINEX VERSION / TYPE' >day.obs
ends 3 "$hueline" inspect day.obs
says 'day.obs is a RINEX file'
printf '<OK\r\n[COM1]\r\n<BESTPOS COM1 0 65.0 FINESTEERING 1687 419192.035 00000000 3681 3153\r\n<     SOL_COMPUTED SINGLE 51.1\r\n' >short.asc
ends 3 "$hueline" inspect short.asc
says 'short.asc holds logs of a NovAtel receiver in abbreviated ASCII'
printf 'Com1>\r\n\252\104\021\362\1\0\0\0\14\0\0\0' >old.gps
ends 3 "$hueline" inspect old.gps
says 'old.gps holds logs of a NovAtel OEM3'
printf 'Com1>\r\n\252\104\021\363\1\0\0\0\14\0\0\0' >damaged.gps
ends 3 "$hueline" inspect damaged.gps
if grep -q OEM3 said.txt; then fail "a wrong check sum makes a message of an OEM3"; fi
printf '\323\0\2\1\2\3\4\5\323\0\2\1\2\3\4\5' >base.rtcm
ends 3 "$hueline" inspect base.rtcm
says 'base.rtcm holds corrections'
# Some programs write neither the comment nor the version in front of the fields of a PCD.
printf 'FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n' >plain.pcd
ends 0 "$hueline" inspect plain.pcd
says 'points +1'
# No geoid: the height above the ellipsoid is not known, and none is shown.
printf '$GPRMC,120000,A,4718.0,N,00830.0,E,0,0,010326,,,A*74\r\n$GPGGA,120000,4718.0,N,00830.0,E,1,8,1.0,400,M,,M,,*7D\r\n' >flat
ends 0 "$hueline" inspect flat
says 'latitude_deg +\[47.3'
if grep -q height said.txt; then fail "a height that nobody gave is shown"; fi
# An attitude without the geoid is a solution that is not good: its height is above the sea, and it is not shown either.
printf '$PASHR,120000,1,T,1,1,0,0.1,0.1,0.1,2,1*0E\r\n' >>flat
ends 0 "$hueline" inspect flat
says 'not_good +1'
if grep -q height said.txt; then fail "a height above the sea is shown as one above the ellipsoid"; fi
gzip -c receiver >receiver.gz
ends 3 "$hueline" inspect receiver.gz
says 'compressed as a whole: unpack it with gunzip'
echo "receivers' logs are recognised and come out again"
