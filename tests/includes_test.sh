#!/usr/bin/env bash
# Every source file includes the standard headers of what it uses. The builds read those headers precompiled, so no
# compiler tells. To look for missing includes is cpplint's part.
set -euo pipefail
source "$(dirname "$(realpath "$0")")/source_files.sh"
printf '%s\0' "${files[@]}" | xargs -0 -n 100 -P 2 \
  cpplint --quiet --filter=-,+build/include_what_you_use --extensions=cpp,hpp ||
  { echo "add the includes that are named above"; exit 1; }
echo "${#files[@]} files include what they use"
