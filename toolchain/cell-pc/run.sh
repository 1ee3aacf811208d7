#!/usr/bin/env bash
# Boots the emulated cell PC, has it do the jobs, and leaves their results in a folder. README.md beside this file says what
# the machine is and what its figures are worth.
#
#     toolchain/cell-pc/run.sh [--build DIR] [--out DIR] [--jobs cyclictest,cell] [--cpu max] [--limit SECONDS]
#                              [--seed N] [--kernel PACKAGE] [--realtime 'KEY = VALUE'] [-- DEVICES...]
#
# --build   the build tree with moldloft and moldloft-sim; default build/release
# --out     where the results go; default build/cell-pc/results
# --jobs    in this order; default cyclictest,latency,cell. Or service, alone: the package's unit under systemd
# --cpu     QEMU's model of the processor
# --seed    of the processor's random numbers, and with them of where the kernel puts things; default 1
# --kernel  linux-image-rt-amd64 (default), or linux-image-amd64: what an ordinary one makes of it
# --realtime  one line of [realtime] for the cell's configuration, such as 'priority = 0'
# --limit   seconds of this machine's time after which the emulator is ended
# what follows -- goes to moldloft-sim devices, such as --plate dome --seed 7
#
# Exit code 77: this machine cannot emulate the PC, and why.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=build/release out=build/cell-pc/results jobs= cpu=max,-erms,-fsrm limit=900 seed=1 kernel_package=linux-image-rt-amd64 realtime=
while [ $# -gt 0 ]; do
  case $1 in
    --build) build=$2 ;;
    --out) out=$2 ;;
    --jobs) jobs=$2 ;;
    --cpu) cpu=$2 ;;
    --limit) limit=$2 ;;
    --seed) seed=$2 ;;
    --kernel) kernel_package=$2 ;;
    --realtime) realtime=$2 ;;
    --) shift; break ;;
    *) echo "cell-pc: $1 is no option; the head of $0 names them" >&2; exit 1 ;;
  esac
  shift 2
done
devices=("$@")
[ ${#devices[@]} -gt 0 ] || devices=(--seed 1)

cannot() { echo "cell-pc: skipped: $1" >&2; exit 77; }
for program in qemu-system-x86_64 cyclictest cpio busybox dpkg-deb; do
  command -v $program >/dev/null || cannot "$program is missing; toolchain/setup.sh --tests installs what there is"
done
for program in systemctl udevadm; do
  [ "$jobs" != service ] || command -v $program >/dev/null || cannot "$program is missing; toolchain/setup.sh --tests installs it"
done
[ "$(dpkg --print-architecture)" = amd64 ] || cannot "the emulated PC is an amd64 machine and runs this machine's programs"

scratch=$(mktemp -d)
emulator=
end() {
  if [ -n "$emulator" ]; then kill "$emulator" 2>/dev/null || true; wait "$emulator" 2>/dev/null || true; fi
  rm -rf "$scratch"
}
trap end EXIT

# The distribution's own kernel, taken out of its package; nothing is installed on this machine.
kernel_of_the_distribution() {
  local package
  package=$(LC_ALL=C apt-cache depends "$kernel_package" 2>/dev/null | sed -n 's/^ *Depends: \(linux-image-[0-9].*-amd64\)$/\1/p' | head -1)
  [ -n "$package" ] || cannot "apt knows no $kernel_package; is its list of packages there (apt-get update)?"
  kernel=build/cell-pc/$package/vmlinuz
  [ -f "$kernel" ] && return
  echo "cell-pc: fetching $package"
  (cd "$scratch" && apt-get download "$package" >/dev/null 2>&1) || cannot "$package cannot be downloaded"
  dpkg-deb --fsys-tarfile "$scratch"/linux-image-*.deb | tar -x -C "$scratch" --wildcards './boot/vmlinuz-*'
  mkdir -p "$(dirname "$kernel")"
  # Two that fetch at once do not meet halfway: each has a file of its own until it is whole.
  mv "$scratch"/boot/vmlinuz-* "$kernel.$$" && mv "$kernel.$$" "$kernel"
}

# systemd and udev as they are installed here, with nothing to start but the two daemons and the test itself.
add_systemd() {
  local root=$1 unit
  mkdir -p "$root"/etc/systemd/system "$root"/usr/lib/{systemd/system,sysusers.d,udev/rules.d}
  cp /usr/bin/{systemctl,journalctl,systemd-sysusers,udevadm,chrt} "$root/usr/bin/"
  cp -a /usr/lib/systemd/{systemd,systemd-journald,systemd-shutdown,systemd-udevd} "$root/usr/lib/systemd/"
  cp -a --no-clobber /usr/lib/systemd/system/. "$root/usr/lib/systemd/system/"
  rm -rf "$root"/usr/lib/systemd/system/*.{wants,requires}
  for unit in systemd-journald.service systemd-udevd.service systemd-udev-trigger.service; do
    install -d "$root/etc/systemd/system/sysinit.target.wants"
    ln -s "/usr/lib/systemd/system/$unit" "$root/etc/systemd/system/sysinit.target.wants/"
  done
  for unit in systemd-journald{,-dev-log}.socket systemd-udevd-{control,kernel}.socket; do
    install -d "$root/etc/systemd/system/sockets.target.wants"
    ln -s "/usr/lib/systemd/system/$unit" "$root/etc/systemd/system/sockets.target.wants/"
  done
  cp /usr/lib/udev/rules.d/{50-udev-default,60-serial}.rules "$root/usr/lib/udev/rules.d/"
  cp /usr/share/base-passwd/passwd.master "$root/etc/passwd"
  cp /usr/share/base-passwd/group.master "$root/etc/group"
  cp /etc/os-release "$root/etc/os-release"
  echo 0123456789abcdef0123456789abcdef >"$root/etc/machine-id"
  install -m 644 toolchain/cell-pc/guest/cell-pc.service "$root/etc/systemd/system/"
  install -m 755 toolchain/cell-pc/guest/service "$root/service"
}

# The root of the PC: the package as dpkg unpacks it, and beside it what does not ship: the simulated devices.
make_root() {
  local root=$scratch/root library program
  cpack --config "$build/CPackConfig.cmake" -D CPACK_COMPONENTS_ALL=controller -B "$scratch/package" >"$scratch/cpack.log" || { cat "$scratch/cpack.log" >&2; exit 1; }
  mkdir -p "$root"/{dev,proc,sys,tmp,run,root,var} "$root"/usr/{bin,sbin,lib,lib64}
  for program in bin sbin lib lib64; do ln -s usr/$program "$root/$program"; done
  if [ "$jobs" = service ]; then  # the PC installs it itself, while systemd runs
    cp "$scratch"/package/moldloft_*.deb "$root/moldloft.deb"
    dpkg-deb -x "$scratch"/package/moldloft_*.deb "$scratch/unpacked"
    add_systemd "$root"
  else
    dpkg-deb -x "$scratch"/package/moldloft_*.deb "$root"
  fi
  strip -o "$root/usr/bin/moldloft-sim" "$build/bin/moldloft-sim"
  cp "$(command -v cyclictest)" "$root/usr/bin/"
  cp "$(command -v busybox)" "$root/bin/busybox"
  install -m 755 toolchain/cell-pc/guest/init "$root/init"
  install -m 644 toolchain/cell-pc/guest/shared.sh "$root/shared.sh"
  printf '%s\n' "jobs='$jobs'" "devices='${devices[*]}'" "realtime='$realtime'" >"$root/etc/cell-pc.conf"
  for library in $(find "$root/usr" "$scratch/unpacked/usr" -type f -perm -u+x -exec ldd {} + 2>/dev/null | grep -o '/[^ ]*\.so[^ ]*' | sort -u); do
    install -D -m 755 "$library" "$root$library"
  done
  # The same files make the same bytes: no order of the directory, no date and no inode of this machine is in them.
  find "$root" -exec touch --no-dereference --date=@0 {} +
  (cd "$root" && find . -print0 | LC_ALL=C sort -z | cpio --null --create --format=newc --reproducible --quiet --owner=0:0 | gzip -n -1) \
    >"$scratch/initramfs"
}

# Time is the count of instructions: one takes 2 ns, and when the processor idles time jumps to what comes next, so the
# figures do not depend on what else this machine does. The calendar follows that time too, and the processor's random
# numbers are seeded: until bytes cross the cable, two runs of the same root are the same run. COM1 is the console, COM2
# the controller's port; the robot's server has a 16550 on the PCI bus, for COM3 and COM4 would have to share lines with
# them. The two are crossed by a socket.
#
# The record (rr=record) is not wanted and goes to /dev/null; the lock that comes with it is. The emulator has two threads: one
# executes instructions, the other moves the clock on when the processor idles. Without the lock the second may look when the
# processor has halted and its last instructions are not counted yet. The clock then goes too far by these, some hundredths of a
# microsecond. Each interrupt of a timer may wake the second at such a moment; a busy host makes it likely.
boot() {
  local pc=(
    qemu-system-x86_64 -accel tcg -icount shift=1,sleep=off,rr=record,rrfile=/dev/null
    -rtc base=2026-01-01,clock=vm -seed "$seed" -cpu "$cpu" -m 512
    -nodefaults -display none -no-reboot -net none
    -kernel "$kernel" -initrd "$scratch/initramfs" -append "console=ttyS0 quiet panic=1"
    -chardev "file,id=console,path=$scratch/console" -device isa-serial,index=0,chardev=console
    -chardev "socket,id=controller,path=$scratch/cable,server=on,wait=off" -device isa-serial,index=1,chardev=controller
    -chardev "socket,id=robot,path=$scratch/cable" -device pci-serial,chardev=robot
  )
  timeout "$limit" "${pc[@]}" </dev/null &
  emulator=$!
  local code=0
  wait "$emulator" || code=$?
  emulator=
  [ $code -eq 0 ] && return
  tail -20 "$scratch/console" >&2 || true
  echo "cell-pc: the emulator ended with $code (124: it did not finish within $limit s)" >&2
  exit 1
}

# The guest prints its results as a text between two lines of the console.
collect() {
  rm -rf "$out" && mkdir -p "$out"
  tr -d '\r' <"$scratch/console" | sed '/^-----BEGIN RESULTS-----$/,/^-----END RESULTS-----$/d' >"$out/console"
  tr -d '\r' <"$scratch/console" | sed -n '/^-----BEGIN RESULTS-----$/,/^-----END RESULTS-----$/p' | sed '1d;$d' |
    base64 -d | tar -xz -C "$out" --warning=no-timestamp ||
    { tail -20 "$out/console" >&2; echo "cell-pc: no results came out of the machine" >&2; exit 1; }
}

kernel_of_the_distribution
make_root
began=$(date +%s)
boot
collect
grep '^cell-pc:' "$out/console"
echo "cell-pc: results in $out; $(($(date +%s) - began)) s of this machine's time"
