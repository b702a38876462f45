#!/usr/bin/env bash
# Checks that every source file is laid out as .clang-format says. tests/format_test.sh --fix lays out the files that are not.
set -euo pipefail
cd "$(dirname "$(realpath "$0")")/.."
how=(--dry-run --Werror)
[[ ${1:-} == --fix ]] && how=(-i)
mapfile -t files < <(find apps calibration config core docs drivers fusion runtime score sim storage survey sync tests \
  -name node_modules -prune -o \( -name '*.cpp' -o -name '*.hpp' \) -print)
((${#files[@]} > 800)) || { echo "only ${#files[@]} source files found: this test looks in the wrong place"; exit 1; }
printf '%s\0' "${files[@]}" | xargs -0 -n 50 -P 2 clang-format-14 --style=file "${how[@]}" ||
  { echo "not laid out as .clang-format says; tests/format_test.sh --fix mends it"; exit 1; }
echo "${#files[@]} files are laid out as .clang-format says"
