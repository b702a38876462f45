#!/usr/bin/env bash
# usage: tidy_test.sh BUILD [FOLDER ...]
# clang-tidy's short list (.clang-tidy) over the sources of the folders; without folders those that record and stamp.
# BUILD is the folder of a clang build, e.g. build/dev.
set -euo pipefail
build=$(realpath "$1"); shift
cd "$(dirname "$(realpath "$0")")/.."
folders=("$@")
((${#folders[@]})) || folders=(core runtime sync)
# The sources as the build compiles them: alone, or several as one (unity_N_cxx.cxx), which is looked through in a third of the time.
pattern=$(IFS='|'; echo "${folders[*]}")
mapfile -t units < <(grep -oE '"file": "[^"]*"' "$build/compile_commands.json" | cut -d'"' -f4 | grep -E "^($PWD|$build)/($pattern)/")
mapfile -t files < <(for unit in "${units[@]}"; do case $unit in */Unity/*) grep -o '/[^"]*\.cpp' "$unit" ;; *) echo "$unit" ;; esac; done)
((${#files[@]} >= $(find "${folders[@]}" -name '*.cpp' | wc -l) && ${#files[@]} > 30)) ||
  { echo "only ${#files[@]} source files found: this test looks in the wrong place"; exit 1; }
# To clang-tidy the sources of a unit are headers: it tells what it finds in them and in the headers that .clang-tidy names.
# A precompiled header would be looked through with each file.
commands=$(mktemp -d)
trap 'rm -rf "$commands"' EXIT
sed 's/-Winvalid-pch -Xclang -include-pch -Xclang [^ ]* -Xclang -include -Xclang [^ ]*//' "$build/compile_commands.json" >"$commands/compile_commands.json"
printf '%s\0' "${units[@]}" | xargs -0 -n 2 -P 2 clang-tidy-14 -p "$commands" --header-filter="/(core|drivers|sync|runtime|$pattern)/" --quiet 2>&1 |
  { grep -v "warnings generated\|^Suppressed\|^Use -header-filter" || true; } ||
  { echo "clang-tidy found the errors above"; exit 1; }
echo "${#files[@]} files without a finding of clang-tidy"
