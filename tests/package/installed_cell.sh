#!/usr/bin/env bash
# The Debian package in a scratch root: what it holds, its unit as systemd reads it, and the installed program, which
# measures a plate on the simulated devices. Called by ctest with the build tree and the source tree.
set -euo pipefail
build=$1 source=$2
. "$source/toolchain/devices.sh"
root=$scratch/root
fail() { echo "package: $1" >&2; exit 1; }

cpack --config "$build/CPackConfig.cmake" -B "$scratch/made" >"$scratch/cpack.log" 2>&1 || { cat "$scratch/cpack.log" >&2; exit 1; }
package=$(echo "$scratch"/made/moldloft_*.deb)
dpkg-deb -x "$package" "$root"

installed=$(cd "$root" && find . -type f | LC_ALL=C sort | tr '\n' ' ')
expected="./etc/moldloft/cell.toml ./usr/bin/moldloft ./usr/lib/systemd/system/moldloft@.service \
./usr/lib/sysusers.d/moldloft.conf ./usr/lib/udev/rules.d/60-moldloft.rules \
./usr/lib/udev/rules.d/91-moldloft-braille.rules ./usr/share/doc/moldloft/PROTOCOLS.md \
./usr/share/doc/moldloft/TUNING.md ./usr/share/doc/moldloft/changelog.gz ./usr/share/doc/moldloft/copyright \
./usr/share/man/man1/moldloft.1.gz "
[ "$installed" = "$expected" ] || fail "holds $installed"
cmp "$root/etc/moldloft/cell.toml" "$source/firmware_like/cell.example.toml"
[ "$(dpkg-deb -I "$package" conffiles)" = /etc/moldloft/cell.toml ] || fail "cell.toml is no conffile: an upgrade would overwrite it"
for library in libserialport0 libsqlite3-0 libtomlplusplus3; do
  dpkg-deb -f "$package" Depends | grep -q "$library" || fail "does not depend on $library"
done
for script in postinst prerm postrm; do dpkg-deb -I "$package" $script | sh -n; done

# 10 is wide open, 0 is shut; what is left are the network, the ports and the scheduling class, which the cell needs.
cp -rn /usr/lib/systemd/system/. "$root/usr/lib/systemd/system/"  # the units that ours leans on
said=$(systemd-analyze --root="$root" --man=no verify "moldloft@plate.service" 2>&1) || fail "systemd does not take the unit: $said"
[ -z "$said" ] || fail "systemd has something to say on the unit: $said"  # an unknown key is a warning to it
systemd-analyze --root="$root" --offline=true --threshold=17 security "moldloft@plate.service" >"$scratch/security" ||
  { tail -1 "$scratch/security" >&2; fail "the unit is more exposed than 1.7"; }

start_devices "$build/bin/moldloft-sim"
LD_PRELOAD=$build/lib/libpty_modem.so timeout 200 "$root/usr/bin/moldloft" run "$scratch/cell.toml" --out "$scratch/run"
grep -q '"result": "complete"' "$scratch/run/summary.json"
"$build/bin/moldloft-sim" judge "$scratch/run" --seed 1
