# In the guest: an emulated USB3 Vision camera on the kernel's virtual USB host. First the driver, then the whole program, which
# captures while the cable is pulled in the middle of an image and comes back.
set -e
modprobe vhci_hcd
"$HUELINE_BIN/vm_usb_test"

cd "$(mktemp -d)"
cat > rig.yaml <<END
rig: a camera on USB
sensors:
  - name: camera
    driver: genicam
    serial: HL02
    width: 320
    height: 240
    pixel_format: BayerRG8
    frame_rate_hz: 10
    exposure_us: 2500
    event_input: 0
head:
  T_body_head: {position_m: [0, 0, 1.9], rotation_deg: [0, 0, 90]}
  panorama: {width: 4000, height: 2000, stitching_radius_m: 20}
  lenses:
    - name: front
      camera: camera
      offset_px: [0, 0]
      width: 320
      height: 240
      model: brown
      focal_px: [300, 300]
      principal_point_px: [159.5, 119.5]
      distortion: []
      T_head_lens: {position_m: [0, 0, 0], rotation_matrix: [0, 0, 1, -1, 0, 0, 0, -1, 0]}
colouring: {method: panorama}
END
# The camera streams for 20 images, is unplugged in the middle of one, comes back after 2 s and streams until its input ends.
mkfifo hold
"$HUELINE_BIN/vm_usb_camera" 20 < hold > camera.txt &
camera=$!
exec 7> hold
"$HUELINE_BIN/hueline" capture rig.yaml --out drive --seconds 120 --quiet > said.txt 2>&1 &
capture=$!
# waits until the camera has said a line
said() {
  for _ in $(seq 600); do
    ! grep -q "$1" camera.txt || return 0
    sleep 0.1
  done
  cat camera.txt said.txt; exit 1
}
said "plugged in again"
said "20 images since"
kill -INT $capture
# Without a scanner there is no point, which is status 5.
status=0; wait $capture || status=$?
exec 7>&-
wait $camera
cat camera.txt said.txt
[ $status = 5 ]
"$HUELINE_BIN/hueline" replay drive/drive.mcap --out again > /dev/null 2>&1 || [ $? = 5 ]
for file in cloud.las view.mcap; do cmp drive/$file again/$file; done
for told in "Disconnected x1" "Reconnected x1"; do grep -q "$told" said.txt; done
