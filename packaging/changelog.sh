#!/usr/bin/env bash
# Writes the two changelogs of a Debian package: CHANGELOG.md as it is, and the entry of this version in Debian's form.
# usage: changelog.sh VERSION SECONDS_SINCE_1970 OUT
set -euo pipefail
cd "$(dirname "$0")/.."
version=$1 time=$2 out=$3
mkdir -p "$out"
gzip -9n <CHANGELOG.md >"$out/changelog.gz"
gzip -9n >"$out/changelog.Debian.gz" <<END
hueline ($version) bookworm; urgency=medium

  * Packages of this revision; changelog.gz says what is new.

 -- hueline maintainers <maintainers@hueline.example>  $(LC_ALL=C date --utc --date="@$time" '+%a, %d %b %Y %H:%M:%S %z')
END
