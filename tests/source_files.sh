# Sourced by tests of the sources: goes to the top folder and sets `files` to every C++ file of the tree.
cd "$(dirname "$(realpath "${BASH_SOURCE[0]}")")/.."
mapfile -t files < <(find apps calibration config console core docs drivers fusion object_store products rosbag runtime score sim storage survey sync tests \
  -name node_modules -prune -o \( -name '*.cpp' -o -name '*.hpp' \) -print)
((${#files[@]} > 800)) || { echo "only ${#files[@]} source files found: this test looks in the wrong place"; exit 1; }
