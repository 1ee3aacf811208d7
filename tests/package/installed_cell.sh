#!/usr/bin/env bash
# The Debian packages in a scratch root: what they hold, what lintian says, the unit as systemd reads it, and the installed
# rehearsal, which measures a plate on the simulated devices. Called by ctest with the build tree and the source tree.
set -euo pipefail
build=$1 source=$2
. "$source/toolchain/devices.sh"
root="$scratch/a root"  # a blank in a path: it is in that of the preloaded library too
fail() { echo "package: $1" >&2; exit 1; }

pack() { (cd "$build" && cpack --config CPackConfig.cmake -B "$1") >"$scratch/cpack.log" 2>&1; }
pack "$scratch/made" || { cat "$scratch/cpack.log" >&2; exit 1; }
pack "$scratch/again"
(umask 077; pack "$scratch/private")
for package in "$scratch"/made/*.deb; do
  cmp "$package" "$scratch/again/${package##*/}" || fail "packed a second time it is other bytes"
done
if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error "$scratch"/made/*.deb >"$scratch/lintian" 2>&1 || { cat "$scratch/lintian" >&2; fail "lintian finds errors"; }
else
  echo "package: lintian is missing, so the packages were not asked; toolchain/setup.sh --tests installs it"
fi

# What cpack needs to know what a package needs: without it there is no package, and a line that says so.
for missing in file dpkg-shlibdeps; do
  mkdir "$scratch/without-$missing"
  for folder in /usr/bin /usr/sbin; do ln -sf "$folder"/* "$scratch/without-$missing/"; done
  rm -f "$scratch/without-$missing/$missing"
  (PATH=$scratch/without-$missing pack "$scratch/none-$missing") && fail "cpack packed without $missing"
  grep -q "$missing is missing" "$scratch/cpack.log" || { cat "$scratch/cpack.log" >&2; fail "cpack does not say that $missing is missing"; }
  [ -z "$(find "$scratch/none-$missing" -name '*.deb' 2>/dev/null)" ] || fail "cpack left a package without $missing"
done

package=$(echo "$scratch"/made/moldloft_*.deb) simulation=$(echo "$scratch"/made/moldloft-sim_*.deb)
geometry=$(echo "$scratch"/made/libmoldloft-geometry-dev_*.deb)
files_of() { dpkg-deb -c "$1" | awk '!/^d/ {print $6}' | LC_ALL=C sort; }
holds() { # PACKAGE FILE...
  local of=$1 file
  shift
  files_of "$of" >"$scratch/files"
  for file in "$@"; do grep -qxF "./$file" "$scratch/files" || fail "${of##*/} lacks $file"; done
}
holds "$package" etc/moldloft/cell.toml usr/bin/moldloft usr/lib/systemd/system/moldloft@.service usr/lib/sysusers.d/moldloft.conf \
  usr/lib/udev/rules.d/60-moldloft.rules usr/share/doc/moldloft/{PROTOCOLS.md,SECURITY.md,TROUBLESHOOTING.md,TUNING.md,changelog.gz,copyright} \
  usr/share/man/man1/moldloft.1.gz usr/share/bash-completion/completions/moldloft
holds "$simulation" usr/bin/moldloft-sim usr/bin/moldloft-rehearse usr/lib/moldloft/libpty_modem.so \
  usr/share/doc/moldloft-sim/{changelog.gz,copyright} usr/share/man/man1/{moldloft-rehearse,moldloft-sim}.1.gz \
  usr/share/bash-completion/completions/moldloft-sim
holds "$geometry" usr/lib/libmoldloft_geometry.a usr/include/moldloft/geometry/fit/surface_fit.hpp usr/lib/cmake/moldloft/moldloft-config.cmake
# What simulates is in no package of the controller, and no file is in two packages.
! files_of "$package" | grep -E 'pty_modem|moldloft-(sim|rehearse)|\.a$|\.hpp$' || fail "the controller's package holds what is not the controller's"
for each in "$package" "$simulation" "$geometry"; do files_of "$each"; done | LC_ALL=C sort | uniq -d | grep . && fail "two packages hold the same file"
for each in "$package" "$simulation" "$geometry"; do
  [ -z "$({ dpkg-deb -c "$each"; dpkg-deb -c "$scratch/private/${each##*/}"; } | awk '$1 !~ /^(drwxr-xr-x|-rw-r--r--|-rwxr-xr-x)$/ || $2 != "root/root"')" ] || fail "${each##*/}: rights depend on who built it"
done
dpkg-deb -x "$package" "$root"
dpkg-deb -x "$simulation" "$root"
cmp "$root/etc/moldloft/cell.toml" "$source/firmware_like/cell.example.toml"
[ "$(dpkg-deb -I "$package" conffiles)" = /etc/moldloft/cell.toml ] || fail "cell.toml is no conffile: an upgrade would overwrite it"
for library in libserialport0 libsqlite3-0 libtomlplusplus3; do
  dpkg-deb -f "$package" Depends | grep -q "$library" || fail "does not depend on $library"
done
dpkg-deb -f "$simulation" Depends | grep -q "^moldloft (= $(dpkg-deb -f "$package" Version))" || fail "the simulation would stand beside another controller"
for script in postinst prerm postrm; do dpkg-deb -I "$package" $script | sh -n; done

# Hardened as the distribution's own programs are: position-independent, linked before main(), the stack neither executable nor
# unguarded, copies checked.
if grep -q '^CMAKE_BUILD_TYPE:STRING=Release' "$build/CMakeCache.txt"; then
  for program in bin/moldloft bin/moldloft-sim; do
    said=$(LC_ALL=C readelf -hdlW --dyn-syms "$root/usr/$program")
    for sign in 'Flags: NOW PIE' GNU_RELRO 'GNU_STACK .* RW ' __stack_chk_fail '__[a-z]*_chk@'; do
      grep -q "$sign" <<<"$said" || fail "$program lacks $sign"
    done
  done
  # Neither the folder in which it was built nor whose it was.
  ! grep -rlF "$source" "$root/usr/bin" "$root/usr/lib/moldloft" || fail "a program tells where it was built"
fi

# 10 is wide open, 0 is shut; what is left are the network, the ports and the scheduling class, which the cell needs.
cp -rn /usr/lib/systemd/system/. "$root/usr/lib/systemd/system/"  # the units that ours leans on
said=$(systemd-analyze --root="$root" --man=no verify "moldloft@plate.service" 2>&1) || fail "systemd does not take the unit: $said"
[ -z "$said" ] || fail "systemd has something to say on the unit: $said"  # an unknown key is a warning to it
systemd-analyze --root="$root" --offline=true --threshold=17 security "moldloft@plate.service" >"$scratch/security" ||
  { tail -1 "$scratch/security" >&2; fail "the unit is more exposed than 1.7"; }

# The installed rehearsal, from another folder, with a space in the run's name.
cd "$scratch"
"$root/usr/bin/moldloft-rehearse" --out "one plate" --plate dome --seed 7 >"$scratch/rehearsal" 2>&1 || { cat "$scratch/rehearsal" >&2; fail "the rehearsal failed"; }
grep -q '"result": "complete"' "$scratch/one plate/summary.json"
grep -qxF "open this first: $scratch/one plate/overview.svg" "$scratch/rehearsal" || fail "nothing says what to open"
! "$root/usr/bin/moldloft-rehearse" --plate nonsense >"$scratch/refused" 2>&1 || fail "a plate that there is not was measured"
[ "$(wc -l <"$scratch/refused")" -eq 1 ] || fail "more than a line: $(cat "$scratch/refused")"
[ ! -e "$scratch/out" ] || fail "a rehearsal that was refused left a folder"

# Ctrl-C in the terminal reaches all of the foreground: the controller stops the arm on devices that are still there, and the
# line that it leaves goes on with the plate.
setsid "$root/usr/bin/moldloft-rehearse" --out stopped >"$scratch/stopped.log" 2>&1 &
rehearsal=$!
for _ in $(seq 300); do ! grep -qs 'boundary shots   4' "$scratch/stopped.log" || break; sleep 0.1; done
kill -INT -- -$rehearsal
code=0
wait $rehearsal || code=$?
[ $code -eq 4 ] || { cat "$scratch/stopped.log" >&2; fail "ctrl-C ends the rehearsal with $code"; }
advice=$(sed -n 's/.*to go on: moldloft-rehearse //p' "$scratch/stopped.log")
[ "$advice" = "--resume stopped" ] || { cat "$scratch/stopped.log" >&2; fail "advises '$advice'"; }
"$root/usr/bin/moldloft-rehearse" $advice >"$scratch/resumed.log" 2>&1 || { cat "$scratch/resumed.log" >&2; fail "the advice does not work"; }
grep -q '"result": "complete"' "$scratch/stopped/summary.json"
