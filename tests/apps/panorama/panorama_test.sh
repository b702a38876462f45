#!/usr/bin/env bash
# Panoramas of a short simulated drive as a user makes them: chosen exposures, sizes and orientations, the tags that other programs read, the
# same bytes with any number of threads, and choices that must be refused.
# usage: panorama_test.sh HUELINE SOURCE
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
echo '{seed: 4, duration_s: 5, drive: {stand_s: 0, accelerate_s: 1}, camera: {rate_hz: 2, lens_width: 204, lens_height: 170}}' >small.yaml
panorama() { "$hueline" panorama --scenario small.yaml --sim sim "$@"; }
made() { ls "$1" | grep '^panorama' | tr '\n' ' '; }

ends 0 panorama --out all --size 512x256 --threads 1
says "10 panoramas of 512 x 256 in all; the drive has 10 moments, 10 were chosen"
[ "$(wc -l <all/panoramas.csv)" = 11 ] || fail "the table does not have a line for each panorama"
ends 0 panorama --out again --size 512x256 --threads 3
cmp all/panoramas.csv again/panoramas.csv
for picture in all/*.jpg; do cmp "$picture" again/"$(basename "$picture")"; done

ends 0 panorama --out some --exposures 2,4-5 --size 256x128 --format png
[ "$(made some)" = "panorama_000002.png panorama_000004.png panorama_000005.png panoramas.csv " ] || fail "chosen by number: $(made some)"
ends 0 panorama --out third --exposures every:3 --size 256x128
[ "$(made third)" = "panorama_000000.jpg panorama_000003.jpg panorama_000006.jpg panorama_000009.jpg panoramas.csv " ] || fail "every third: $(made third)"
from=$(awk -F, '$2 == 6 {print $3 - 0.1}' OFMT=%.3f CONVFMT=%.3f all/panoramas.csv)
ends 0 panorama --out late --from "$from" --size 256x128
[ "$(made late)" = "panorama_000006.jpg panorama_000007.jpg panorama_000008.jpg panorama_000009.jpg panoramas.csv " ] || fail "from $from on: $(made late)"

# Methods and orientations differ; without --size the pixels are those of the lenses, here of 318 / 3 px a radian.
ends 0 panorama --out natural --exposures 5
says "1 panoramas of 66[0-9] x 33[0-9] in natural"
for choice in "--method sphere" "--orientation north" "--orientation head" "--blend none" "--gains raw" "--vehicle show" "--around-s 0.2" "--fill 255,0,0"; do
  ends 0 panorama --out other --exposures 5 $choice
  ! cmp -s natural/panorama_000005.jpg other/panorama_000005.jpg || fail "$choice changes nothing"
done

# What the vehicle hides comes from other exposures, except where it never moves.
share() { awk -F, -v column="$2" 'NR == 2 {print ($column > 0.15)}' "$1/panoramas.csv"; }
ends 0 panorama --out hidden --exposures 5 --vehicle hide
[ "$(share natural 16) $(share hidden 16)" = "1 0" ] || fail "the hole is not filled: $(tail -1 natural/panoramas.csv)"
sed 's/stand_s: 0, accelerate_s: 1/stand_s: 5/' small.yaml >standing.yaml
ends 0 "$hueline" panorama --scenario standing.yaml --sim sim --out standing --exposures 5
[ "$(share standing 15) $(share standing 16)" = "1 0" ] || fail "filled without having moved: $(tail -1 standing/panoramas.csv)"

ends 0 panorama --out big --exposures 5 --size 4096x2048
# A place that is picked in a lens image is the same place when it is picked where the panorama shows it.
(echo exposure,u_px,v_px,lens; for lens in lens1 lens4; do for u in 108 116 124; do for v in 50 85 120; do echo "5,$u,$v,$lens"; done; done; done) >picks.csv
measure() { "$hueline" measure --scenario small.yaml --sim sim "$@"; }
ends 0 measure --picks picks.csv --out by_lens.csv
# Where the panorama shows the coordinates, by the level at the head.
awk -F, 'NR == FNR {if ($2 == 5) {lat = $5; lon = $6; up = $7; heading = $10}; next}
  /^#/ {next}
  $1 == "name" {print "name,exposure,u_px,v_px"; next}
  $7 == "" {next}
  {r = 3.14159265358979 / 180; n = ($16 - lat) * r * 6382000; e = ($17 - lon) * r * 6390000 * cos(lat * r); u = $15 - up
   turn = atan2(e, n) / r - heading; while (turn < -180) turn += 360; while (turn > 180) turn -= 360
   printf "%s,5,%.3f,%.3f\n", $1, (turn / 360 + 0.5) * 4096 - 0.5, (90 - atan2(u, sqrt(e * e + n * n)) / r) / 180 * 2048 - 0.5}' big/panoramas.csv by_lens.csv >in_panorama.csv
ends 0 measure --picks in_panorama.csv --panoramas big/panoramas.csv --out by_panorama.csv
awk -F, 'NR == FNR {e[$1] = $7; n[$1] = $8; u[$1] = $9; next}
  /^#/ || $1 == "name" || $7 == "" {next}
  {d = sqrt(($7 - e[$1]) ^ 2 + ($8 - n[$1]) ^ 2 + ($9 - u[$1]) ^ 2); near += d < 0.05}
  END {exit near < 6}' by_lens.csv by_panorama.csv || { cp by_panorama.csv said.txt; fail "picked in a panorama: other places"; }
# The tables of other programs lead to the same pixels, of level panoramas and of those in the head's own axes.
ends 0 panorama --out tilted --exposures 5 --size 4096x2048 --orientation head
for folder in big tilted; do
  for table in pano-poses pointerra orbit; do
    [ $folder$table = tiltedorbit ] && { [ -e tilted/orbit.txt ] && fail "orbit.txt of panoramas that are not level"; continue; }
    ends 0 python3 "$source/tests/apps/panorama/import_tables_test.py" "$folder" $table by_lens.csv picked.csv
    ends 0 measure --picks picked.csv --panoramas $folder/panoramas.csv --out by_table.csv
    awk -F, 'NR == FNR {e[$1] = $7; n[$1] = $8; u[$1] = $9; next}
      /^#/ || $1 == "name" || $7 == "" {next}
      {d = sqrt(($7 - e[$1]) ^ 2 + ($8 - n[$1]) ^ 2 + ($9 - u[$1]) ^ 2); near += d < 0.05}
      END {exit near < 6}' by_lens.csv by_table.csv || { cp by_table.csv said.txt; fail "$folder/$table.csv leads to other places"; }
  done
done
# Picks in a panorama that is not in the table, or that is of another time, are not measured as if they were of the drive.
ends 5 measure --picks in_panorama.csv --panoramas some/panoramas.csv --out none.csv # smaller pictures
awk -F, -v OFS=, 'NR == 2 {$3 += 86400} {print}' big/panoramas.csv >yesterday.csv
ends 5 measure --picks in_panorama.csv --panoramas yesterday.csv --out none.csv
grep -q "exposure 5 of this drive at [0-9.]* s: the table of panoramas belongs to another drive" none.csv || fail "measured with another drive's table"
sed 's/,5,/,4,/' big/panoramas.csv >four.csv
ends 5 measure --picks in_panorama.csv --panoramas four.csv --out none.csv
grep -q "the table of panoramas has no exposure 5" none.csv || fail "measured in a panorama that is not listed"
printf 'name;exposure;u_px;v_px\ncover, left;5;4096,5;7\n' >beside.csv
ends 5 measure --picks beside.csv --panoramas big/panoramas.csv --out none.csv
grep -q "^\"cover, left\",5,,4096.500,7.000,.*outside the panorama" none.csv || fail "a pixel outside is not given back: $(tail -1 none.csv)"
sed 's/,4096,2048,/,4096,1000,/' big/panoramas.csv >odd.csv
ends 3 measure --picks in_panorama.csv --panoramas odd.csv
says "odd.csv:2: width_px is not twice height_px"

# Poses of a trajectory from post-processing, here 2e-7 rad farther north: panoramas and what is measured in images lie there.
ends 0 "$hueline" simulate small.yaml --out sim --trajectory true.sbet
python3 "$source/tests/apps/export/shifted_sbet.py" true.sbet shifted.sbet 2e-7 0
ends 0 panorama --out post --exposures 5 --size 256x128 --trajectory shifted.sbet
says "shifted.sbet in place of the POS's solutions"
north() { awk -F, -v column="$1" -v key="$2" 'NR == FNR {lat[$key] = $column; next} $key in lat && $column + 0 > 1 {d = ($column - lat[$key]) * 3.14159265358979 / 180; n++; bad += d < 1.8e-7 || d > 2.2e-7} END {print (n > 0 && !bad)}' "$3" "$4"; }
[ "$(north 5 2 big/panoramas.csv post/panoramas.csv)" = 1 ] || fail "the panorama is not where the trajectory is: $(tail -1 post/panoramas.csv)"
ends 0 measure --picks picks.csv --out post.csv --trajectory shifted.sbet
[ "$(north 16 1 by_lens.csv post.csv)" = 1 ] || fail "what is measured is not where the trajectory is: $(tail -1 post.csv)"

told() { local want=$1 sentence=$2; shift 2; ends "$want" timeout 600 "$hueline" panorama "$@"; says "$sentence"; }
simulated="--scenario small.yaml --sim sim"
told 2 "give either a recording" --out x
told 2 "out is required" $simulated
told 2 "exposures is '3-'; allowed: all, every:N, or numbers" $simulated --out x --exposures 3-
told 2 'from 2 is not the GPS time of an exposure: give seconds since 1980-01-06.*hueline cut --from' $simulated --out x --from 2
told 2 "exposures is '5-3'; allowed: all" $simulated --out x --exposures 5-3
told 2 "exposures is 'every:0'; allowed: all" $simulated --out x --exposures every:0
told 2 "size is '1000x700'; allowed: WIDTHxHEIGHT" $simulated --out x --size 1000x700
told 2 "size is '20000x10000'; allowed: WIDTHxHEIGHT" $simulated --out x --size 20000x10000
told 2 "fill is '1,2'; allowed: red,green,blue" $simulated --out x --fill 1,2
told 2 "to lies before --from" $simulated --out x --from 1450000020 --to 1450000010
told 2 "method.*depth.*sphere" $simulated --out x --method cube
told 5 "the drive has no exposure 77" $simulated --out x --exposures 3,77
[ "$(made x)" = "panorama_000003.jpg panoramas.csv " ] || fail "the exposure that there is: $(made x)"
told 5 "0 were chosen" $simulated --out y --from 1450000010 --to 1450000020
told 4 "small.yaml" $simulated --out small.yaml
told 3 "nothing.mcap" nothing.mcap --out z

# What other programs read.
if command -v exiftool >/dev/null; then
  for picture in natural/panorama_000005.jpg some/panorama_000005.png; do
    exiftool -a -s -n -G1 "$picture" >said.txt
    says "GPSLatitude +: 48.13"
    says "GPSLongitude +: 11.57"
    says "GPSHPositioningError +: 0.0"
    says "SubSecDateTimeOriginal +: 2025:08:27 11:59:5[0-9.]+\+00:00"
    says "UsePanoramaViewer +: (True|1)"
    says "ProjectionType +: equirectangular"
    heading=$(awk -F, '$2 == 5 {print substr($10, 1, 4)}' natural/panoramas.csv)
    says "GPSImgDirection +: $heading"
    says "PoseHeadingDegrees +: $heading"
    exiftool -validate -warning -a "$picture" >said.txt
    says "^Validate +: OK$"
  done
fi
echo "panorama: all as it should be"
