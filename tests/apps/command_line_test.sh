#!/usr/bin/env bash
# Mistakes of a new user, and files that are not what they should be. Each is reported soon, in a sentence, with the exit status that
# docs/operating.md lists. The program runs in a folder of its own, as an installed program does.
# usage: command_line_test.sh HUELINE SOURCE
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
told() { local want=$1 sentence=$2; shift 2; ends "$want" timeout 60 "$hueline" "$@"; says "$sentence"; }
never_says() { ! grep -qE -- "$1" said.txt || fail "told: $1"; }

# A typing error is reported as such, and not as the word that is missing because of it.
told 2 "hueline: unknown command captur; did you mean capture\?" captur rig.yaml --out d
told 2 "hueline capture: unknown option --thread; did you mean --threads\?" capture rig.yaml --thread 2
told 2 "hueline calibrate: unknown command lense; did you mean lens\?" calibrate lense
told 2 "hueline measure: unknown option --pick; did you mean --picks\?" measure --pick=a.csv
told 2 "hueline score: unknown option -q" score -q
told 2 "hueline: give a command: capture, replay, .*calibrate"
told 2 "hueline rig: give a command: show" rig
told 2 "hueline replay: RECORDING is required" replay --out d
told 2 "hueline capture --help says what may be given" capture
told 2 "threads.*1 (-|to) 64" replay x --out d --threads 0
told 2 "from: nan is no number" replay x --out d --from nan
told 2 "speed: abc is no number" replay x --out d --speed abc
told 2 "speed: 5000 is not in range 0 to 1000" replay x --out d --speed 5000
told 2 "threads: 1.5 is no whole number" replay x --out d --threads 1.5
told 2 "--out and --drives are both given: give --out FOLDER for this drive, or --drives FOLDER" capture street --out d --drives e
[ ! -e d ] && [ ! -e e ] || fail "a refused capture made a folder"
told 2 "picture: give --above PNG, --street PNG, --moving WEBP or several of them" picture cloud.las
told 2 "a.jpg: a picture is written as PNG" picture cloud.las --above a.jpg
told 2 "one recording is nothing to merge: name two or more" merge a.mcap --rig street --out b.mcap
touch a.mcap
told 2 "a.mcap and ./a.mcap are the same: name each recording once" merge a.mcap ./a.mcap --rig street --out b.mcap
told 3 "open nothere.mcap: there is no such recording or folder" merge a.mcap nothere.mcap --rig street --out b.mcap
told 2 "a.gif: a moving picture is written as WebP" picture cloud.las --moving a.gif
for command in "" capture replay simulate verify score colour "calibrate lens" "calibrate mount" "calibrate mask" "calibrate boresight" "calibrate targets" "calibrate targets-example" measure "rig show" \
               inspect merge panorama picture "fleet plan" "fleet run" "fleet task" "fleet submit" "fleet status" "fleet catalogue"; do
  ends 0 "$hueline" $command --help
  [ "$(wc -l <said.txt)" -gt 5 ] || fail "no help for '$command'"
done

# The help of every command ends with an example of it, whose options it has: --help behind an example is refused otherwise. Where the
# words name files, the mistake that is left without --help is a file that is not there.
for command in $("$hueline" --complete ""); do
  below=$("$hueline" --complete "$command" "" | sed "s/^/$command /")
  while read -r one; do
    ends 0 "$hueline" $one --help
    example=$(sed -n "s/^Example: hueline //p" said.txt)
    [[ "$example " == "$one "* ]] || fail "no example of '$one'"
    grep -qE "^Exit status: 0[;, .]|^Exit status: 0 if" said.txt && grep -qE "^More: docs/[a-z_]+.md" said.txt || fail "no status or document of '$one'"
    ends 0 "$hueline" $example --help
    case $one in capture | check | doctor | simulate | score | "rig show" | "rig schema" | "calibrate targets-example") continue ;; esac  # which need no file, and work for long
    timeout 60 "$hueline" $example >said.txt 2>&1 && fail "an example without its files succeeded: $example"
    never_says "unknown option|is required|may be given|unknown command"
  done <<<"${below:-$command}"
done

# Rigs: the status is 2, the message names the wrong key, and it does not speak of scenarios.
rig() { printf 'rig: t\nsensors:\n  - {name: pos, driver: novatel, %s}\ncolouring: {method: lens}\n' "$1"; }
rig 'port: COM3' >port.yaml
told 2 "port.yaml:3: 'sensors\[0\]': give exactly one of tcp, serial, pcap, file; here are: port" inspect port.yaml
never_says scenario
told 2 "'sensors\[0\]': give exactly one of tcp, serial, pcap, file" capture port.yaml --out d
rig 'serial: {port: COM3, baud: 115200}' >serial.yaml
told 2 "key 'sensors\[0\].serial.device' is missing; here are: port, baud" inspect serial.yaml
sed 's/position_m:/position_mm:/' "$source/config/rigs/street.yaml" >mm.yaml
told 2 "position_m' is missing; is 'position_mm' meant for it\?" inspect mm.yaml
rig 'tcp: {host: not a host, port: 3001}' >host.yaml
told 2 "tcp.host.*is '?not a host'?; allowed: an IPv4 or IPv6 address, or the name of a computer" inspect host.yaml
laser() { printf '  - {name: %s, driver: velodyne, model: VLP-16, udp: {ports: [%s]}, T_body_scanner: {position_m: [0, 0, 1], rotation_deg: [0, 0, 0]}}\n' "$1" "$2"; }
{ printf 'rig: t\nsensors:\n'; laser a '2368, 2368'; printf 'colouring: {method: lens}\n'; } >ports.yaml
told 2 "ports.*names 2368 twice; allowed: 1 to 65535, each once" inspect ports.yaml
# What is wrong with a rig as a whole is told before its devices are opened, and the drive begins.
{ printf 'rig: t\nsensors:\n'; laser front 52368; laser rear 52368; printf 'colouring: {method: lens}\n'; } >shared.yaml
told 0 "rear: is heard at UDP port 52368, as is front; give each sensor its own port" inspect shared.yaml
told 5 "rear: is heard at UDP port 52368, as is front; give each sensor its own port" capture shared.yaml --out shared --quiet --seconds 1
sed -n '/capturing t into/q;p' said.txt | grep -q 'is heard at UDP port' || fail "the finding came after the beginning of the capture"
rig 'fiel: a.gps' >typo.yaml
told 2 "give exactly one of tcp, serial, pcap, file; here are: fiel" inspect typo.yaml
printf 'duraton_s: 5\n' >scenario.yaml
told 2 "key 'duraton_s' is not known \(did you mean duration_s\?\)" inspect scenario.yaml
printf 'rig: [\n' >broken.yaml
told 2 "broken.yaml:[0-9]*: not YAML" inspect broken.yaml
told 2 "rig show.*|svg" rig show "$source/config/rigs/street.yaml" --out x.png
[ ! -e x.png ] || fail "SVG was written as x.png"
told 2 "absent.yaml: cannot be read: open absent.yaml: No such file" capture absent.yaml --out d
told 2 "Is a directory" capture . --out d
[ ! -e d ] || fail "a refused rig made a folder"

# What comes with the program is found from anywhere. A path always wins.
told 2 "qick: no such file is here, and none of the sheets .*did you mean quick\?; those are: full, quick" score --sheet qick --out o
told 0 "rig" inspect "$source/config/rigs/street.yaml"
told 0 "score sheet" inspect "$source/config/sheets/quick.yaml"
told 0 "duration_s" inspect "$source/config/scenarios/street.yaml"
ends 0 "$hueline" rig show street --out street.svg
head -c 20000 /dev/zero >nothing.gps

# A recording is named by its drive's folder, or a file is no recording.
rig 'file: nothing.gps' >file.yaml
ends 5 "$hueline" capture file.yaml --out drive --quiet
told 0 "hueline recording" inspect drive
ends 5 "$hueline" replay drive --out again
told 2 "sensors are not those of the recording" replay drive --out d --rig street
printf 'exposure,u_px,v_px\n1,10,10\n' >picks.csv
told 2 "the rig has no camera head" measure drive --picks picks.csv
mkdir empty
for command in cut recover; do told 3 "empty is a folder without drive.mcap in it: give a recording, or a drive's folder" $command empty --out part.mcap; done
told 3 "empty is a folder without a cloud \(cloud.las, cloud.laz, cloud.copc.laz\) in it: give a cloud" picture empty --above a.png
told 3 "empty is a folder without drive.mcap in it" inspect empty
told 3 "empty is a folder without drive.mcap in it" replay empty --out d
told 3 "empty is a folder without a cloud \(cloud.las, cloud.laz, cloud.copc.laz\) in it" export empty --out d.laz
# What an export, an import or a catalogue was asked for and would not do.
told 2 "c.ply: the profile laz writes a file that ends in .laz; is --profile ply meant\?" export drive --out c.ply
told 2 "c.copc.LAZ: the profile laz .*is --profile copc meant\?" export drive --out c.copc.LAZ
told 2 "c.las: the profile ply writes a file that ends in .ply$" export drive --profile ply --out c.las
told 2 "--lens is of the profile images, and the profile is laz" export drive --out c.laz --lens pinhole
told 2 "--trajectory: the profile laz writes the cloud as it is; .hueline replay --trajectory. makes it again" export drive --out c.laz --trajectory t.sbet
told 2 "--split: the profile trajectory does not split" export drive --profile trajectory --out t.csv --split time:60s
told 2 "--rig: the profile laz writes the cloud as it is" export drive --out c.laz --rig file.yaml
[ -z "$(ls c.* t.* 2>/dev/null)" ] || fail "a refused export wrote $(ls c.* t.*)"
told 3 "drive/cloud.las: the file is empty: the run that was to make the cloud placed no point" export drive --out c.LAZ
# A cloud that is whole and has no points.
python3 -c 'import struct, sys
head = bytearray(227)
head[0:4], head[24:26], head[104] = b"LASF", bytes([1, 2]), 1
struct.pack_into("<HI", head, 94, 227, 227)
struct.pack_into("<H", head, 105, 28)
struct.pack_into("<3d", head, 131, 0.001, 0.001, 0.001)
sys.stdout.buffer.write(head)' >none.las
for profile in copc laz ply e57; do told 5 "n(one.las has no points: there is nothing to export|.$profile: 0 points)" export none.las --profile $profile --out n.${profile/copc/copc.laz}; done
told 5 "the cloud has no points: there is nothing to export" export none.las --split tile:10m --out parts
told 5 "none.las: a cloud without points has no picture" picture none.las --above a.png
# A cloud whose capture was killed before its header counted a point, or later.
mkdir killed
cp drive/drive.mcap killed
cp none.las killed/cloud.las
software() { printf '%s\0' "$1" | dd of=killed/cloud.las bs=1 seek=58 conv=notrunc status=none; }
software "hueline: not finished"
ended="killed/cloud.las: the run that was to make it did not finish it, and further points are missing; .hueline replay killed --out killed. makes it whole"
told 3 "$ended" picture killed --above k.png
never_says "has no picture"
told 3 "$ended" inspect killed/cloud.las
for profile in copc laz ply e57; do told 3 "$ended" export killed --profile $profile --out k.${profile/copc/copc.laz}; done
told 3 "$ended" export killed --split tile:10m --out k
[ -z "$(ls -d k k.* 2>/dev/null)" ] || fail "of a cloud that is not known to be empty $(ls -d k k.*) was made"
(exec 9<killed; flock 9; told 5 "killed/cloud.las: a capture or replay is still writing it" picture killed --above k.png)
software hueline
told 5 "killed/cloud.las: a cloud without points has no picture" picture killed --above k.png
told 3 "open absent.bag: No such file" import absent.bag --out d
[ ! -e d ] || fail "an import without a recording made a folder"
told 2 "fleet.csv: a catalogue is written as a GeoPackage" fleet catalogue drive --out fleet.csv
# A part behind the end, before anything of an earlier replay is replaced.
told 2 "--from 1000: drive/drive.mcap has only [0-9.]+ s; give a smaller one" replay drive --out again --from 1000
[ -s again/summary.json ] || fail "the products of an earlier replay are gone"
told 2 "--from 1000: drive/drive.mcap has only [0-9.]+ s; give a smaller one" cut drive --out part.mcap --from 1000
[ ! -e part.mcap ] || fail "a recording of nothing was written"
: >zero.mcap
told 3 "zero.mcap is empty" inspect zero.mcap
head -c 3000 drive/drive.mcap >cut.mcap
told 3 "cut.mcap ends at byte 3000" inspect cut.mcap
printf 'no format at all\n' >words.txt
printf 'short\n' >short.txt
for command in "replay short.txt --out d" "verify short.txt" "cut short.txt --out part.mcap"; do told 3 "short.txt at byte 0: not an MCAP file" $command; done
told 3 "zero.mcap ends at byte 0 before an MCAP header" verify zero.mcap
told 3 "short.txt: is no plan of this version: it is not JSON" fleet status short.txt
cp short.txt short.json
told 3 "short.json: is no plan of this version" fleet run short.json
told 3 "words.txt: none of the formats that are known" inspect words.txt
told 3 "No such file" inspect absent.las
told 3 "No such file" picture absent.las --above a.png
told 3 "No such file" picture absent.las --moving a.webp
mkfifo pipe.pcd pipe.gps
told 3 "pipe.pcd is a pipe, not a file" inspect pipe.pcd
told 3 "is a device, not a file" inspect /dev/zero
rig 'file: pipe.gps' >pipe.yaml
told 3 "pipe.gps is a pipe, not a file" capture pipe.yaml --out piped --quiet

# A scanner of an unknown kind is reported with its factory byte, and the command does not succeed.
octal() { printf '%b' "$1"; }
{ octal '\0324\0303\0262\0241\02\0\04\0'; head -c 8 /dev/zero; octal '\0\0\01\0\01\0\0\0'  # pcap, Ethernet
  for second in 1 2 3; do
    octal "\\0$second\\0\\0\\0\\0\\0\\0\\0\\0340\\04\\0\\0\\0340\\04\\0\\0"  # 1248 bytes
    head -c 12 /dev/zero; octal '\010\0\0105\0\04\0322\0\01\0\0\0100\021\0\0\0300\0250\01\0311\0300\0250\01\0106'  # IPv4
    octal '\011\0100\011\0100\04\0276\0\0'; head -c 1204 /dev/zero; octal '\067\0231'  # UDP to 2368; strongest return, product 0x99
  done; } >unknown.pcap
told 3 "unknown.pcap: a Velodyne of product 0x99; known: 0x22 \(VLP-16\), 0x21 \(HDL-32E\), 0x24 \(Puck Hi-Res\), 0x28 \(VLP-32C\), 0xA1 \(VLS-128\): it is counted, not decoded. In all: [0-9]+ packets? of 1206 bytes on average from" inspect unknown.pcap
says '^datagrams +3'

# Progress: where every line stays, a line is written when something changes and once a minute. On a terminal one line is rewritten each
# second.
printf 'rig: nobody\nsensors:\n  - {name: pps, driver: pps, socket: pps.sock}\ncolouring: {method: lens}\n' >nobody.yaml
ends 5 "$hueline" capture nobody.yaml --out lines --seconds 4
[ "$(grep -c 'MB recorded' said.txt)" = 1 ] || fail "nothing changed in 4 s, and that was told $(grep -c 'MB recorded' said.txt) times"
script -qec "$hueline capture nobody.yaml --out rewritten --seconds 4" /dev/null </dev/null >said.txt 2>&1 || true
[ "$(tr '\r' '\n' <said.txt | grep -c 'MB recorded')" -ge 3 ] || fail "the line of a terminal stands still"
[ "$(grep -c 'MB recorded' said.txt)" -le 2 ] || fail "the line of a terminal is not rewritten"

# Files that would take much memory and minutes are refused with the limit in the message.
{ printf 'a: ['; head -c 20000000 /dev/zero | tr '\0' 1; printf ']\n'; } >large.yaml
told 2 "large.yaml has 20.0 MB; a configuration of more than 1 MB is not read" inspect large.yaml
told 2 "a configuration of more than 1 MB is not read" capture large.yaml --out d
{ printf '# .PCD v0.7\nVERSION 0.7\nFIELDS'; head -c 16000000 /dev/zero | sed 's/\x00\x00/ x/g'; printf '\n'; } >wide.pcd
told 3 "wide.pcd: no DATA line within its first 64 kB" inspect wide.pcd
printf '\x89PNG\r\n\x1a\n\x00\x00\x00\x0dIHDR\x00\x00\x4e\x20\x00\x00\x4e\x20\x08\x02\x00\x00\x00\x9c\x5b\x17\x2f' >large.png
told 3 "an image of 400 million pixels; at most 134 million are read" calibrate lens large.png --size 9x6
echo "every mistake is told"
