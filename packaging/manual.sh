#!/usr/bin/env bash
# Makes the manual pages of all commands from their --help, with help2man: OUT/capture and OUT/tools, one folder a package.
# The commands are those that the programs name, at any depth: hueline-calibrate-lens(1) is `hueline calibrate lens`.
# usage: manual.sh BIN OUT
set -euo pipefail
bin=$1 out=$2
command -v help2man >/dev/null || { echo "help2man is missing: apt-get install help2man" >&2; exit 1; }
PATH=$bin:$PATH
rm -rf "$out"
mkdir -p "$out/capture" "$out/tools"

# page FOLDER PROGRAM WORD...: the page of this command, and those of the commands below it
page() {
  local folder=$1 name about below
  shift
  name=$(IFS=-; echo "$*")
  about=$("$@" --help)
  about=${about%%$'\n'*}
  help2man --no-info --section 1 --manual "User Commands" --name "${about#hueline*: }" \
    --version-string "${*} $version" "$*" | sed "s/^\.TH [^ ]*/.TH ${name^^}/; s/^$1 \\\\-/${name//-/\\\\-} \\\\-/" | gzip -9n >"$out/$folder/$name.1.gz"
  for below in $("$1" --complete "${@:2}" ""); do page "$folder" "$@" "$below"; done
}
version=$(hueline --version | cut -d' ' -f2-)
office=" $(hueline-office --complete "" | tr '\n' ' ') "
page capture hueline-console
# hueline's own page, without what is below it: that belongs to two packages.
for word in $(hueline --complete ""); do
  folder=capture
  # inspect and verify are in both programs: the tools' ones are for scenarios.
  [[ $office == *" $word "* && $word != inspect && $word != verify ]] && folder=tools
  page $folder hueline "$word"
done
help2man --no-info --section 1 --manual "User Commands" --version-string "hueline $version" \
  --name "records a mobile mapping vehicle's sensors and colours its laser points while it drives" hueline | gzip -9n >"$out/capture/hueline.1.gz"
# Programs that others start.
printf '.so man1/hueline.1\n' | gzip -9n >"$out/capture/hueline-guest.1.gz"
printf '.so man1/hueline-simulate.1\n' | gzip -9n >"$out/tools/hueline-office.1.gz"
