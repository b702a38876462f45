#!/usr/bin/env bash
# The Debian packages: each has what it should and nothing else, their manual and completion name the commands of the programs, and an
# installed program captures and replays a drive.
# usage: packages_test.sh BUILD_DIR SOURCE_DIR
set -euo pipefail
build=$1 source=$2
[ -x "$build/bin/hueline" ] || { echo "SKIPPED: $build has no program to pack; ./test builds it"; exit 77; }
work=$(mktemp -d)
devices=
trap '[ -z "$devices" ] || kill "$devices" 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
if ! cmake --build "$build" --target hueline_packages >said.txt 2>&1; then
  ! grep -q "npm could not install" said.txt || { echo "SKIPPED: the operator's page needs npm's registry"; exit 77; }
  fail "no packages"
fi

# holds PACKAGE REGULAR_EXPRESSION, lacks PACKAGE REGULAR_EXPRESSION: of the list of its files
holds() { grep -qE -- "$2" "$1.files" || fail "$1 lacks $2"; }
lacks() { ! grep -E -- "$2" "$1.files" || fail "$1 has $2"; }
needs() { dpkg-deb --field "$(ls "$build/packages/$1"_*.deb)" Depends; }
for package in hueline-capture hueline-tools libhueline-dev hueline-doc; do
  deb=$(ls "$build/packages/$package"_*.deb)
  dpkg-deb --contents "$deb" | awk '{print $6}' >$package.files
  holds $package "^./usr/share/doc/$package/copyright$"
  holds $package "^./usr/share/doc/$package/changelog.Debian.gz$"
  # Only the owner root may write, and nothing gives rights.
  ! dpkg-deb --contents "$deb" | grep -vE '^(-rw-r--r--|-rwxr-xr-x|drwxr-xr-x|l.........) root/root ' || fail "$package: rights"
  dpkg-deb --extract "$deb" root
done
holds hueline-capture '^./usr/bin/hueline(|-guest|-console)$'
holds hueline-capture '^./usr/share/hueline/console/index.html$'
lacks hueline-capture 'hueline-office|include|\.a$|simulat|scor'
! needs hueline-capture | grep -E 'embree|opencv|ceres|libpq|-dev' || fail "a vehicle needs too much"
for part in systemd/system/hueline@.service systemd/system/hueline-console.service udev/rules.d/60-hueline.rules sysctl.d/60-hueline.conf sysusers.d/hueline.conf \
  tmpfiles.d/hueline.conf; do
  holds hueline-capture "^./usr/lib/$part$"
done
holds hueline-tools '^./usr/bin/hueline-office$'
needs hueline-tools | grep -q libpq5 || fail "no library for the catalogue in a database"
needs hueline-tools | grep -q "hueline-capture (= " || fail "the tools may be of another version"
holds libhueline-dev '^./usr/lib/cmake/hueline/hueline-config.cmake$'
holds libhueline-dev '^./usr/include/hueline/core/packet.hpp$'
lacks libhueline-dev '/bin/|/man/'
holds hueline-doc '^./usr/share/doc/hueline-doc/docs/operating.md$'
sort hueline-*.files libhueline-dev.files | grep -v '/$' | uniq -d >twice.txt
[ ! -s twice.txt ] || fail "in two packages: $(cat twice.txt)"

# The user of the services can be made, or no installation would end.
if command -v systemd-sysusers >/dev/null; then
  mkdir root/etc
  systemd-sysusers --root="$work/root" hueline.conf >said.txt 2>&1 || fail "no user"
  grep -q '^hueline:' root/etc/passwd || fail "no user hueline"
fi

# A page for each command, which starts with its name and what it does.
PATH=$work/root/usr/bin:$PATH
for command in $(hueline --complete ""); do
  page=root/usr/share/man/man1/hueline-$command.1.gz
  zcat "$page" | grep -A1 '^\.SH NAME' | grep -q "^hueline..$command" || fail "$page"
done
[ "$(ls root/usr/share/man/man1 | wc -l)" -gt 30 ] || fail "pages of commands below others are missing"
# bash completes words of both programs, values, and the names of files.
cat >complete.sh <<'END'
source root/usr/share/bash-completion/completions/hueline
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
_hueline hueline
echo "${COMPREPLY[*]-}"
END
completes() { local want=$1; shift; [ "$(bash complete.sh "$@")" = "$want" ] || fail "'$*' is completed as '$(bash complete.sh "$@")'"; }
completes capture hueline cap
completes --threads hueline capture --th
completes targets-example hueline calibrate targets-
completes lens hueline simulate --method l
completes "" hueline replay dri

ends 0 hueline --version
says "^hueline [0-9.]+ \([0-9a-f]{7,}"
ends 0 hueline --help
ends 2 hueline-console --plain
ports="--data-port 43368 --position-port 49308 --pos-port 44001 --can-port 41000 --pps-socket $work/pps.sock --address 127.0.0.9"
ends 0 hueline simulate "$source/tests/scenarios/short.yaml" --out sim --write-rig rig.yaml $ports
hueline simulate "$source/tests/scenarios/short.yaml" --out sim --play $ports >devices.txt 2>&1 & devices=$!
hueline capture rig.yaml --out drive --until-silent --seconds 60 --quiet >said.txt 2>&1 || [ $? = 8 ] || fail "no drive"
wait $devices || { cat devices.txt; fail "devices"; }
devices=
hueline replay drive --out again >said.txt 2>&1 || [ $? = 8 ] || fail "no replay"
[ "$(stat -c %s drive/cloud.las)" -gt 10000 ] || fail "an empty cloud"
cmp drive/cloud.las again/cloud.las
cmp drive/view.mcap again/view.mcap
echo "four packages; a drive and its replay by the installed program"
