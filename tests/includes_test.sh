#!/usr/bin/env bash
# Every source file includes the standard headers of what it uses. The builds read those headers precompiled, so no
# compiler tells. To look for missing includes is cpplint's part.
set -euo pipefail
cd "$(dirname "$(realpath "$0")")/.."
mapfile -t files < <(find apps calibration config core docs drivers fusion runtime score sim storage survey sync tests \
  -name node_modules -prune -o \( -name '*.cpp' -o -name '*.hpp' \) -print)
((${#files[@]} > 800)) || { echo "only ${#files[@]} source files found: this test looks in the wrong place"; exit 1; }
printf '%s\0' "${files[@]}" | xargs -0 -n 100 -P 2 \
  cpplint --quiet --filter=-,+build/include_what_you_use --extensions=cpp,hpp ||
  { echo "add the includes that are named above"; exit 1; }
echo "${#files[@]} files include what they use"
