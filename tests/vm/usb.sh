# In the guest: emulated cameras on the kernel's virtual USB host, of USB3 Vision and a Ladybug. First their drivers, then the whole
# program, which captures while the cable is pulled in the middle of an image and comes back.
set -e
modprobe vhci_hcd
"$HUELINE_BIN/vm_usb_test"
"$HUELINE_BIN/vm_ladybug_test"

cd "$(mktemp -d)"
mkfifo hold
# waits until the camera has said a line
said() {
  for _ in $(seq 600); do
    ! grep -q "$1" camera.txt || return 0
    sleep 0.1
  done
  cat camera.txt said.txt; exit 1
}
# drives with a camera whose keys stand in camera.yaml and whose first lens image has that size
drive() {
  local driver=$1 width=$2 height=$3
  cat - camera.yaml > rig.yaml <<END
rig: a camera on USB
head:
  T_body_head: {position_m: [0, 0, 1.9], rotation_deg: [0, 0, 90]}
  panorama: {width: 4000, height: 2000, stitching_radius_m: 20}
  lenses:
    - name: front
      camera: camera
      offset_px: [0, 0]
      width: $width
      height: $height
      model: brown
      focal_px: [300, 300]
      principal_point_px: [$((width / 2)), $((height / 2))]
      distortion: []
      T_head_lens: {position_m: [0, 0, 0], rotation_matrix: [0, 0, 1, -1, 0, 0, 0, -1, 0]}
colouring: {method: panorama}
sensors:
END
  # The camera streams for 20 images, is unplugged in the middle of one, comes back after 2 s and streams until its input ends.
  "$HUELINE_BIN/vm_usb_camera" $driver 20 2000 < hold > camera.txt &
  local camera=$!
  exec 7> hold
  "$HUELINE_BIN/hueline" capture rig.yaml --out $driver --seconds 120 --quiet > said.txt 2>&1 &
  local capture=$!
  said "plugged in again"
  said "20 images since"
  kill -INT $capture
  # Without a scanner there is no point, which is status 5.
  local status=0; wait $capture || status=$?
  exec 7>&-
  wait $camera
  cat camera.txt said.txt
  [ $status = 5 ]
  "$HUELINE_BIN/hueline" replay $driver/drive.mcap --out $driver.again > /dev/null 2>&1 || [ $? = 5 ]
  for file in cloud.las view.mcap; do cmp $driver/$file $driver.again/$file; done
  for told in "Disconnected x1" "Reconnected x1"; do grep -q "$told" said.txt; done
}

cat > camera.yaml <<END
  - name: camera
    driver: genicam
    serial: HL02
    width: 320
    height: 240
    pixel_format: BayerRG8
    frame_rate_hz: 10
    exposure_us: 2500
    event_input: 0
END
drive genicam 320 240

cat > camera.yaml <<END
  - name: camera
    driver: ladybug
    usb: {frame_rate_hz: 10, gain_db: 6, jpeg_quality: 77, buffer_width: 512, buffer_height: 300, strobe_pin: 0}
    width: 192
    height: 96
    pixel_format: BayerRG8
    lens_columns: 3
    stamp: cycle
    counter_wraps_s: 128
    exposure_us: 2500
    event_input: 0
END
drive ladybug 64 48
# Its stream files have the same images.
"$HUELINE_BIN/hueline" extract ladybug --sensor camera --out images-000000.pgr | tee extracted.txt
sed -e 's/^    usb: .*/    file: images-000000.pgr/' camera.yaml > rig.file && sed -i '/^sensors:$/q' rig.yaml && cat rig.file >> rig.yaml
"$HUELINE_BIN/hueline" capture rig.yaml --out files --quiet > files.txt 2>&1 || [ $? = 5 ] || { cat files.txt; exit 1; }
cat files.txt
images=$(grep -o "of [0-9]* packets of camera" extracted.txt | grep -o "[0-9]*")
grep -q "^camera  *$((images + 1)) packets" files.txt
