# In the guest: two cameras of the kernel's test driver, with formats of one plane and of several. First the source and the decoder,
# then the whole program: both cameras are one head, and both are unplugged and come back while it captures.
set -e
modprobe vivid n_devs=2 node_types=0x1,0x1 num_inputs=1,1 input_types=0,0 multiplanar=1,2
ls /dev/video0 /dev/video1
"$HUELINE_BIN/vm_v4l2_test"

cd "$(mktemp -d)"
camera() { # NAME NUMBER FORMAT
  cat <<EOF
  - name: $1
    driver: v4l2
    bus_info: platform:vivid-00$2
    width: 320
    height: 180
    format: $3
    frame_rate_hz: 10
    controls: [{name: brightness, value: 100}, {name: test_pattern, value: 100% Colorbar}]
    event_input: 0
EOF
}
lens() { # CAMERA
  cat <<EOF
    - name: $1
      camera: $1
      offset_px: [0, 0]
      width: 320
      height: 180
      model: brown
      focal_px: [300, 300]
      principal_point_px: [159.5, 89.5]
      distortion: []
      T_head_lens: {position_m: [0, 0, 0], rotation_matrix: [0, 0, 1, -1, 0, 0, 0, -1, 0]}
EOF
}
cat > rig.yaml <<EOF
rig: two cameras
sensors:
$(camera left 0 YUYV)
$(camera right 1 RG10)
head:
  T_body_head: {position_m: [0, 0, 1.9], rotation_deg: [0, 0, 90]}
  panorama: {width: 4000, height: 2000, stitching_radius_m: 20}
  lenses:
$(lens left)
$(lens right)
colouring: {method: panorama}
EOF
"$HUELINE_BIN/hueline" capture rig.yaml --out drive --seconds 90 --quiet > said.txt 2>&1 &
capture=$!
# waits until the recording, which is flushed once a second, has N more bytes
grows() {
  local from; from=$(stat -c %s drive/drive.mcap 2>/dev/null || echo 0)
  for _ in $(seq 600); do
    [ "$(stat -c %s drive/drive.mcap 2>/dev/null || echo 0)" -lt $((from + $1)) ] || return 0
    sleep 0.1
  done
  cat said.txt; exit 1
}
grows 2000000
echo vivid.0 > /sys/bus/platform/drivers/vivid/unbind
sleep 2
echo vivid.0 > /sys/bus/platform/drivers/vivid/bind
grows 2000000
kill -INT $capture
# Without a scanner there is no point, which is status 5.
status=0; wait $capture || status=$?
cat said.txt
[ $status = 5 ]
"$HUELINE_BIN/hueline" replay drive/drive.mcap --out again > /dev/null 2>&1 || [ $? = 5 ]
for file in cloud.las view.mcap; do cmp drive/$file again/$file; done
for told in "Disconnected x1" "Reconnected x1"; do [ "$(grep -c "$told" said.txt)" = 2 ]; done
