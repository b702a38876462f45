#!/usr/bin/env bash
# hueline doctor on made computers: what is not set is named with its reason, --fix sets it and nothing else, and a computer that is set, or
# lacks the part, is left alone.
# usage: doctor_test.sh HUELINE SOURCE_DIR
set -euo pipefail
hueline=$1 source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
source "$source/tests/apps/program.sh"
# file VALUE PATH: of the made computer
file() { mkdir -p "$(dirname "pc/$2")"; echo "$1" >"pc/$2"; }
holds() { [ "$(cat "pc/$2")" = "$1" ] || fail "$2 is $(cat "pc/$2"), not $1"; }

mkdir pc
ends 0 "$hueline" doctor --root pc
says "the computer is set for a capture, as far as it can be seen: there is no /proc/sys/net/core/rmem_max"
ends 2 "$hueline" doctor --root nowhere

file 212992 proc/sys/net/core/rmem_max
file 16 sys/module/usbcore/parameters/usbfs_memory_mb
file hpet sys/devices/system/clocksource/clocksource0/current_clocksource
file "tsc hpet acpi_pm" sys/devices/system/clocksource/clocksource0/available_clocksource
file powersave sys/devices/system/cpu/cpu0/cpufreq/scaling_governor
file performance sys/devices/system/cpu/cpu1/cpufreq/scaling_governor
file "makestep 1 3" etc/chrony/chrony.conf
file "makestep 1 -1" etc/chrony/conf.d/own.conf
file 1500 sys/class/net/enp2s0/mtu
file 1000 sys/class/net/enp2s0/speed
file x sys/class/net/enp2s0/device/vendor
file 1500 sys/class/net/lo/mtu
ends 9 "$hueline" doctor --root pc
for line in "net.core.rmem_max: 212992" "usbcore.usbfs_memory_mb: 16" "clock source: hpet" "governor of cpu0: powersave" "chrony: makestep 1 -1"; do says "^$line"; done
! grep -E "cpu1|MTU" said.txt || fail "told without need"
[ "$(grep -c '^  why: ' said.txt)" = 5 ] || fail "not a reason for each"
holds 212992 proc/sys/net/core/rmem_max

# What a person must do is left.
ends 9 "$hueline" doctor --root pc --fix
holds 33554432 proc/sys/net/core/rmem_max
holds 1000 sys/module/usbcore/parameters/usbfs_memory_mb
holds tsc sys/devices/system/clocksource/clocksource0/current_clocksource
holds performance sys/devices/system/cpu/cpu0/cpufreq/scaling_governor
holds "makestep 1 -1" etc/chrony/conf.d/own.conf
file "makestep 0.1 5" etc/chrony/conf.d/own.conf
ends 0 "$hueline" doctor --root pc

# A later file is in force, a clock source without a better one and a value that the kernel refuses are told.
file acpi_pm sys/devices/system/clocksource/clocksource0/current_clocksource
file "acpi_pm" sys/devices/system/clocksource/clocksource0/available_clocksource
ends 9 "$hueline" doctor --root pc --fix
says "find in the kernel's log why tsc was given up"
file tsc sys/devices/system/clocksource/clocksource0/current_clocksource
file nonsense proc/sys/net/core/rmem_max
ends 0 "$hueline" doctor --root pc
if [ "$(id -u)" != 0 ]; then
  file 1 proc/sys/net/core/rmem_max
  chmod a-w pc/proc/sys/net/core/rmem_max
  ends 4 "$hueline" doctor --root pc --fix
  chmod u+w pc/proc/sys/net/core/rmem_max
fi
file 33554432 proc/sys/net/core/rmem_max

# A rig: its devices, and the cards where its camera may be.
ends 9 "$hueline" doctor street --root pc
says "^MTU of enp2s0: 1500"
printf 'rig: t\nsensors:\n  - {name: pps, driver: pps, device: /dev/pps7}\ncolouring: {method: lens}\n' >pps.yaml
ends 9 "$hueline" doctor pps.yaml --root pc
says "^pps: /dev/pps7: No such file"
! grep MTU said.txt || fail "no camera is on the network"
file "" dev/pps7
ends 0 "$hueline" doctor pps.yaml --root pc
ends 2 "$hueline" doctor nothing.yaml
echo "each setting found, explained and set"
