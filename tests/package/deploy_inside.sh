#!/bin/bash
# What deploy.sh has done in the clean root, under its systemd: the lines of the README as an ordinary user, one plate by the
# service, an upgrade over an edited configuration, removal and purge. Each line that begins with "deploy:" is for the test's log.
set -euo pipefail
fail() { echo "deploy: FAILED: $1"; exit 1; }
wait_until() { # SECONDS COMMAND...
  local limit=$1
  shift
  for _ in $(seq $((limit * 5))); do "$@" && return; sleep 0.2; done
  fail "waited $limit s in vain for: $*"
}

export DEBIAN_FRONTEND=noninteractive
useradd --home-dir /home/newcomer --no-create-home --shell /bin/bash newcomer
echo 'newcomer ALL=(ALL) NOPASSWD: ALL' >/etc/sudoers.d/newcomer
chown -R newcomer: /home/newcomer
as_newcomer="umask 077; cd ~/moldloft"
if [ -e /with_ccache ]; then
  apt-get update -qq && apt-get install -qq --no-install-recommends ccache >/dev/null
  as_newcomer+="; export CCACHE_DIR=/ccache CCACHE_READONLY=1 CCACHE_TEMPDIR=/tmp/ccache CCACHE_BASEDIR=\$HOME CCACHE_NOHASHDIR=1"
  as_newcomer+=" CCACHE_SLOPPINESS=include_file_ctime,include_file_mtime,pch_defines,time_macros"
  as_newcomer+=" CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache"
fi

lines=0 began=$SECONDS
while read -r line; do
  lines=$((lines + 1))
  echo "\$ $line"
  step=$SECONDS
  # `apt install` asks whether to go on; a newcomer says yes.
  yes 2>/dev/null | su newcomer -c "$as_newcomer; $line" || [ "${PIPESTATUS[1]}" -eq 0 ] || fail "$line"
  echo "deploy: $((SECONDS - step)) s: $line"
done </deploy_lines
picture=$(echo /home/newcomer/moldloft/out/run-*/overview.svg)
[ -s "$picture" ] || fail "no picture"
grep -q '"result": "complete"' "${picture%/*}/summary.json" || fail "the rehearsal is not complete"
echo "deploy: $((SECONDS - began)) s and $lines lines from the tree to the first picture"

# ---- one plate by the service, on simulated devices that run as its user
id moldloft | grep -q '(dialout)' || fail "the user moldloft is not made, or not in dialout"
install -d -o moldloft -g moldloft /run/rehearsal /etc/systemd/system/moldloft@.service.d
printf '[Service]\nEnvironment=LD_PRELOAD=/usr/lib/moldloft/libpty_modem.so\n' >/etc/systemd/system/moldloft@.service.d/rehearsal.conf
systemctl daemon-reload
su moldloft -s /bin/sh -c "exec moldloft-sim devices --scanner-port 0 --robot-pty /run/rehearsal/robot --cell /run/rehearsal/cell.toml" >/run/devices.log 2>&1 &
devices=$!
wait_until 20 grep -q ^ready /run/devices.log
cp /run/rehearsal/cell.toml /etc/moldloft/cell.toml
unit=moldloft@plate-17 control=/run/moldloft/plate-17/control
state_is() { moldloft tell status --control "$control" 2>/dev/null | grep -q "\"state\":\"$1\""; }
unit_is() { [ "$(systemctl is-active "$unit")" = "$1" ]; }
systemctl start $unit || { journalctl -u $unit | tail; fail "the service does not start"; }
wait_until 20 state_is Held
moldloft tell unhold --control $control
wait_until 120 unit_is inactive
grep -q '"result": "complete"' /var/lib/moldloft/plate-17/summary.json || { journalctl -u $unit | tail; fail "the service's plate is not complete"; }
[ "$(stat -c '%U %a' /var/lib/moldloft/plate-17)" = "moldloft 750" ] || fail "plate-17 belongs to $(stat -c '%U %a' /var/lib/moldloft/plate-17)"
echo "deploy: the service measured a plate"

# ---- an upgrade in the middle of the next one: what the operator wrote stays, the plate goes on
unit=moldloft@plate-18 control=/run/moldloft/plate-18/control
systemctl start $unit
wait_until 20 state_is Held
echo '# edited by hand' >>/etc/moldloft/cell.toml
apt-get remove -qq moldloft-sim >/dev/null 2>&1 || fail "moldloft-sim is not removed"
left=$(find /usr -xdev -name 'moldloft-sim*' -o -xdev -name 'moldloft-rehearse*' -o -xdev -name 'libpty_modem*')
[ -z "$left" ] || fail "moldloft-sim leaves $left"
dpkg-deb -R /home/newcomer/moldloft/build/release/moldloft_*.deb /newer
sed -i 's/^Version: .*/&+next/' /newer/DEBIAN/control
echo '# of the next version' >>/newer/etc/moldloft/cell.toml
(cd /newer && find . -path ./DEBIAN -prune -o -type f -printf '%P\n' | xargs md5sum) >/newer/DEBIAN/md5sums
dpkg-deb -b /newer /newer.deb >/dev/null
apt-get install -qq -o Dpkg::Options::=--force-confold /newer.deb >/dev/null 2>&1 || fail "the next version is not installed"
grep -q 'edited by hand' /etc/moldloft/cell.toml || fail "the upgrade has overwritten the configuration"
state_is Held || fail "the upgrade has ended a plate that is being measured"

# ---- removed while it runs, then purged
moldloft tell unhold --control $control
wait_until 30 state_is Execute
apt-get remove -qq moldloft >/dev/null 2>&1 || fail "moldloft is not removed"
[ "$(systemctl is-active $unit)" != active ] || fail "the service runs on without its package"
grep -q '"result": "stopped"' /var/lib/moldloft/plate-18/summary.json || fail "the plate of a removed package is not stopped and saved"
[ -f /etc/moldloft/cell.toml ] || fail "a removal takes the configuration along"
kill $devices; wait $devices || true
apt-get purge -qq moldloft moldloft-sim >/purged 2>&1 || fail "moldloft is not purged"
grep -q 'plates stay in /var/lib/moldloft' /purged || { cat /purged; fail "purge does not say what stays"; }
rm -r /etc/systemd/system/moldloft@.service.d
left=$(find /etc /usr /var /run -xdev -iname '*moldloft*' -not -path '/var/lib/moldloft*' -not -path '/var/lib/systemd/*' -not -path '/var/log/*' | sort)
[ -z "$left" ] || fail "purge leaves $left"
[ -s /var/lib/moldloft/plate-17/surface.step ] || fail "purge has taken the measured plates"
echo "deploy: removed and purged; what stays: $(ls -d /var/lib/moldloft/*) and the user moldloft"
echo "deploy: done"
