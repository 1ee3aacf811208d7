#!/usr/bin/env bash
# The package's udev rules as udev itself reads them, on serial adapters that exist only as files: in a mount namespace of
# its own the test lays them where /sys is, and asks `udevadm test` what comes out. Called by ctest with the source tree.
#
# Exit code 77: this machine lets nobody do that (root, unshare and udevadm are needed).
set -euo pipefail
source=$1
if [ "${2:-}" != inside ]; then
  command -v udevadm >/dev/null && unshare --mount true 2>/dev/null || { echo "udev rules: skipped: needs root and udevadm" >&2; exit 77; }
  place=$(mktemp -d)
  trap 'rmdir "$place"' EXIT
  unshare --mount bash "$0" "$source" inside "$place"
  exit
fi
fail() { echo "udev rules: $1" >&2; exit 1; }

# A place of our own for all that udevadm reads and writes.
place=$3
mount -t tmpfs udev-test "$place"
mkdir -p "$place"/{dev,run,rules,etc,sys}
touch "$place/dev/null"
mount --bind /dev/null "$place/dev/null"
cp /usr/lib/udev/rules.d/{50-udev-default,60-serial,99-systemd}.rules "$source"/toolchain/package/*.rules "$place/rules/"
mount --bind "$place/rules" /usr/lib/udev/rules.d
if [ -d /etc/udev/rules.d ]; then mount --bind "$place/etc" /etc/udev/rules.d; fi
mount --bind "$place/run" /run
mkdir -p /run/systemd/system /run/udev
mount --rbind "$place/dev" /dev
mount --bind "$place/sys" /sys
export SYSTEMD_DEVICE_VERIFY_SYSFS=0  # /sys is not the kernel's

# What brltty's own rules do for a chip: its number names a driver, and systemd is told to start it.
cat >/usr/lib/udev/rules.d/85-brltty.rules <<'RULES'
SUBSYSTEM!="usb", GOTO="brltty_end"
ENV{PRODUCT}=="403/6001/*", ENV{BRLTTY_BRAILLE_DRIVER}="at,ce,hd", GOTO="brltty_run"
ENV{PRODUCT}=="1a86/7523/*", ENV{BRLTTY_BRAILLE_DRIVER}="bm", GOTO="brltty_run"
ENV{PRODUCT}=="904/3000/*", ENV{BRLTTY_BRAILLE_DRIVER}="bm", GOTO="brltty_run"
GOTO="brltty_end"
LABEL="brltty_run"
ENV{BRLTTY_BRAILLE_DEVICE}="usb:"
TAG+="systemd"
ENV{SYSTEMD_WANTS}+="brltty-device@.service"
LABEL="brltty_end"
RULES

port=1
# A USB device with one port of a kernel driver; its folder is left in $device, the port's in $tty.
plug_in() { # VENDOR PRODUCT DRIVER NAME
  local bus=/sys/devices/pci0000:00/0000:00:14.0/usb1
  device=$bus/1-$port
  local interface=$device/1-$port:1.0 serial
  serial=$interface/$4
  tty=$serial/tty/$4
  mkdir -p "$tty" /sys/{class/tty,bus/usb,"bus/usb-serial/drivers/$3","bus/usb/drivers/$3"}
  printf '%s\n' "$1" >"$device/idVendor"
  printf '%s\n' "$2" >"$device/idProduct"
  echo FT0000AA >"$device/serial"
  printf 'MAJOR=189\nMINOR=%d\nDEVNAME=bus/usb/001/%03d\nDEVTYPE=usb_device\nDRIVER=usb\nPRODUCT=%x/%x/600\nBUSNUM=001\nDEVNUM=%03d\n' \
    $port $((port + 1)) "0x$1" "0x$2" $((port + 1)) >"$device/uevent"
  printf 'DEVTYPE=usb_interface\nDRIVER=%s\n' "$3" >"$interface/uevent"
  printf 'DRIVER=%s\n' "$3" >"$serial/uevent"
  echo 16 >"$serial/latency_timer"
  printf 'MAJOR=188\nMINOR=%d\nDEVNAME=%s\n' $port "$4" >"$tty/uevent"
  ln -s /sys/bus/usb "$device/subsystem"
  ln -s /sys/bus/usb "$interface/subsystem"
  ln -s "/sys/bus/usb/drivers/$3" "$interface/driver"
  ln -s /sys/bus/usb-serial "$serial/subsystem"
  ln -s "/sys/bus/usb-serial/drivers/$3" "$serial/driver"
  ln -s /sys/class/tty "$tty/subsystem"
  ln -s "$serial" "$tty/device"
  port=$((port + 1))
}

ask() { said=$(udevadm test --action=add "$1" 2>&1) || fail "udevadm test $1: $said"; }
has() { grep -qx -- "$1" <<<"$said" || fail "$2: '$1' is missing in: $said"; }
has_not() { ! grep -q -- "$1" <<<"$said" || fail "$2: '$1' is there"; }

for chip in "0403 6001 ftdi_sio" "10c4 ea60 cp210x" "1a86 7523 ch341-uart" "067b 2303 pl2303"; do
  plug_in $chip ttyUSB$port
  ask "$tty"
  has ID_MM_DEVICE_IGNORE=1 "ModemManager, $chip"
  has ID_MM_PORT_IGNORE=1 "ModemManager, $chip"
  grep -q "60-moldloft.rules:[0-9]* GROUP" <<<"$said" || fail "group: $said"
  ! grep -v 'Unknown group' <<<"$said" | grep -E "moldloft[a-z-]*\.rules:[0-9]+.*(Invalid|Unknown|Failed|ignoring)" || fail "a rule is not understood"
done

plug_in 1199 68a2 qcserial ttyUSB$port  # a modem on the same computer is ModemManager's
ask "$tty"
has_not ID_MM_DEVICE_IGNORE "a modem"

for chip in "0403 6001 ftdi_sio" "1a86 7523 ch341-uart"; do
  plug_in $chip ttyUSB$port
  mv /usr/lib/udev/rules.d/91-moldloft-braille.rules /run/
  ask "$device"
  has SYSTEMD_WANTS=brltty-device@.service "brltty's rules, $chip"
  mv /run/91-moldloft-braille.rules /usr/lib/udev/rules.d/
  ask "$device"
  has_not brltty-device "brltty, $chip"
done
plug_in 0904 3000 none ttyUSB$port  # a braille display with numbers of its own
ask "$device"
has SYSTEMD_WANTS=brltty-device@.service "a braille display"
echo "udev rules: 4 adapters, a modem, 2 chips that brltty knows and a braille display are each treated as they should be"
