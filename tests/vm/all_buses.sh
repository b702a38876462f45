# In the guest: the vehicle of all_buses_test. Its cameras on USB and V4L2 are unplugged once while it drives.
# usage: all_buses.sh BIN PROGRAMS FOLDER
set -euo pipefail
bin=$1 programs=$2 folder=$3
up() { cut -d' ' -f1 /proc/uptime; }
fail() {
  for file in devices genicam ladybug pulses said verified; do echo "--- $file"; grep -v "playing in real time" $file.txt || true; done
  echo "FAILED: $*"
  exit 1
}

# The devices' network and bus are cables, whose other ends are in a namespace of their own.
modprobe -a vhci_hcd can-raw vxcan veth
modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0
insmod "$PULSE"
ip netns add vehicle
ip link add lan0 mtu 9000 type veth peer name lan0 mtu 9000 netns vehicle
ip link add can0 type vxcan peer name can0 netns vehicle
ip address add 10.9.0.1/24 dev lan0
ip -n vehicle address add 10.9.0.2/24 dev lan0
for link in lan0 can0; do
  ip link set $link up
  ip -n vehicle link set $link up
done

# The rig of the emulated vehicle, with the pulse at the kernel's device and with three cameras more. They look at no laser point, so the
# head has no lens of them. Of the scanner's returns a sector is coloured, because an emulated processor colours one in a hundred that
# a real one does; images may wait for it. Who pulls three cables on purpose does not drive again for that.
cd "$folder"
cat >cameras.yaml <<END
  - name: v4l2
    driver: v4l2
    bus_info: platform:vivid-000
    width: 320
    height: 180
    format: YUYV
    frame_rate_hz: 5
    event_input: 0
  - name: usb3
    driver: genicam
    serial: HL02
    width: 320
    height: 240
    pixel_format: BayerRG8
    frame_rate_hz: 5
    exposure_us: 2500
    images_in_flight: 100
    event_input: 0
  - name: ladybug
    driver: ladybug
    usb: {frame_rate_hz: 5, gain_db: 6, jpeg_quality: 77, buffer_width: 512, buffer_height: 300, strobe_pin: 0, images_in_flight: 100}
    width: 192
    height: 96
    pixel_format: BayerRG8
    lens_columns: 3
    stamp: cycle
    counter_wraps_s: 128
    exposure_us: 2500
    event_input: 0
END
awk -v cameras="$(cat cameras.yaml)" '
  /^    socket: /{print "    device: /dev/pps0"; next}
  /^    model: VLP-16/{print; print "    azimuth_begin_deg: 300\n    azimuth_end_deg: 301"; next}
  /^    serial: HUE-0001/{print; print "    images_in_flight: 100"; next}
  /^head:/{print cameras "\n"}
  {print}
  END{print "\nhealth: {again_share: 0.6}"}' rig.yaml >all.yaml

mkfifo hold
for camera in genicam ladybug; do
  "$programs/vm_usb_camera" $camera 40 700 <hold >$camera.txt 2>&1 &
done
exec 7>hold
ip netns exec vehicle "$bin/hueline-office" simulate scenario.yaml --out sim --play $DEVICES >devices.txt 2>&1 &
devices=$!
"$programs/vm_pulses" pps.sock >pulses.txt 2>&1 &
until grep -q "waiting for a capture" devices.txt; do sleep 0.1; done
echo "the devices are there at $(up) s"
"$bin/hueline" capture all.yaml --out drive --seconds 120 >said.txt 2>&1 &
capture=$!
until grep -q "playing in real time [4-9][0-9]" devices.txt; do sleep 0.2; done
echo vivid.0 >/sys/bus/platform/drivers/vivid/unbind
sleep 0.7
echo vivid.0 >/sys/bus/platform/drivers/vivid/bind
wait $devices || fail "the emulated devices"
echo "the drive is over at $(up) s"
kill -INT $capture
status=0; wait $capture || status=$?
exec 7>&-
wait
echo "captured at $(up) s"
"$bin/hueline" verify drive/drive.mcap >verified.txt 2>&1 || fail "not proved"

# Everything that the devices sent is in the recording, or somebody said that it is lost.
said() { awk -v name="$1" '$1 == name && $3 == "packets," {on = 1; print; next} on && /^[^ ]/ {exit} on' said.txt; }
packets() { said "$1" | awk 'NR == 1 {print $2}'; }
told() { said "$1" | awk -v event="$2" '$1 == event {sub("x", "", $2); print $2 + 0; found = 1} END {if (!found) print 0}'; }
sent() { awk -v channel="$1" '$1 == channel && $3 == "sent," {print $2}' devices.txt; }
taken() { awk '$2 $3 == "imagestaken" {print $1}' "$1.txt"; }
# compare SENSOR SENT MORE: MORE of them may be incomplete, because a cable was pulled or the capture ended in their middle
compare() {
  local recorded lost
  recorded=$(packets "$1") lost=$(($(told "$1" Lost) + $(told "$1" Overflow)))
  echo "$1: $2 sent, $recorded recorded, $lost told as lost"
  [ "$recorded" -le "$2" ] && [ "$2" -le $((recorded + lost + $3)) ] || fail "$1: what was sent is neither recorded nor lost"
}
compare laser $(($(sent LaserData) + $(sent LaserPosition))) 0
compare wheel "$(sent Wheel)" 0
compare camera "$(sent Camera)" 0
compare usb3 "$(taken genicam)" 2
compare ladybug "$(taken ladybug)" 2
packets_an_image=$(($(awk '$1 $2 == "camerapackets" {print $3}' devices.txt) / $(sent Camera)))
[ $packets_an_image -lt 20 ] || fail "$packets_an_image packets an image: these are no jumbo frames"
for camera in v4l2 usb3 ladybug; do
  for event in Disconnected Reconnected; do
    [ "$(told $camera $event)" -ge 1 ] || fail "$camera: never $event"
  done
  ! grep -q " $camera: .*no images" said.txt || fail "$camera has no images"
done
replay=0
"$bin/hueline" replay drive/drive.mcap --out again >replayed.txt 2>&1 || replay=$?
[ $replay = $status ] || { cat replayed.txt; fail "the replay ended with status $replay, the capture with $status"; }
for file in cloud.las view.mcap; do cmp drive/$file again/$file || fail "$file differs"; done
cat pulses.txt verified.txt
(cd drive && sha256sum cloud.las view.mcap)
points=$(awk '$1 == "points" {print $2 + 0}' said.txt) coloured=$(awk '$1 == "points" {print int($3)}' said.txt)
echo "replayed to the same bytes at $(up) s: $points points, $coloured % coloured"

# All of that holds on a computer however busy. What the drive was good for holds for devices that keep their times: messages that are a
# second late name another second.
late_ms=$(awk '/ms at most/ {late = $(NF - 3) + 0; if (late > most) most = late} END {print int(most)}' devices.txt)
if [ "$late_ms" -gt 1000 ]; then
  echo "SKIPPED: the machine stood still, so that the emulated devices were late by $late_ms ms: the drive itself is not judged"
  exit 77
fi
[ $status = 0 ] || fail "capture ended with status $status"
grep -q "^clock  *.* pps Locked" said.txt || fail "the clock was never locked"
grep -q "^wheels  *[0-9]* speeds of wheel" said.txt || fail "the wheels have no speeds"
[ "${points:-0}" -gt 5000 ] && [ "$coloured" -ge 80 ] || fail "$points points, $coloured % coloured"
sed -n '/^drive  /,$p' said.txt
echo "the devices were late by at most $late_ms ms"
