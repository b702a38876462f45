#!/usr/bin/env bash
# Every source file includes the standard headers of what it uses. The builds read those headers precompiled, so no
# compiler tells. What is missing is found by cpplint's rule.
set -euo pipefail
source "$(dirname "$(realpath "$0")")/source_files.sh"
printf '%s\0' "${files[@]}" | xargs -0 -n 100 -P 2 tests/includes_test.py ||
  { echo "add the includes that are named above"; exit 1; }
echo "${#files[@]} files include what they use"
