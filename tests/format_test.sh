#!/usr/bin/env bash
# Checks that every source file is laid out as .clang-format says. tests/format_test.sh --fix lays out the files that are not.
set -euo pipefail
source "$(dirname "$(realpath "$0")")/source_files.sh"
how=(--dry-run --Werror)
[[ ${1:-} == --fix ]] && how=(-i)
printf '%s\0' "${files[@]}" | xargs -0 -n 50 -P 2 clang-format-14 --style=file "${how[@]}" ||
  { echo "not laid out as .clang-format says; tests/format_test.sh --fix mends it"; exit 1; }
echo "${#files[@]} files are laid out as .clang-format says"
