#!/usr/bin/env bash
# The README's way from the tree to a cell's computer, walked literally in a clean Debian: debootstrap makes the root,
# systemd-nspawn boots it, and deploy_inside.sh runs the lines of "Deploy it" there as an ordinary user, then the service, an
# upgrade, and the removal. The packages that come out must be byte for byte those of the build tree beside it.
# Called by ctest with the build tree and the source tree. Exit code 77: this machine cannot, and why.
set -euo pipefail
build=$1 source=$2
fail() { echo "deploy: $1" >&2; exit 1; }
cannot() { echo "deploy: SKIPPED: $1" >&2; exit 77; }
[ "$(id -u)" -eq 0 ] || cannot "only root makes a Debian root"
for program in debootstrap systemd-nspawn; do
  command -v $program >/dev/null || cannot "$program is missing; toolchain/setup.sh --tests installs it"
done

# Where this machine has its own packages from, the root has them from too.
suites() { apt-get indextargets --format '$(REPO_URI) $(RELEASE) $(COMPONENT)' 'Created-By: Packages' 'Origin: Debian' | sort -u; }
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
mirror=$(suites | awk -v c="$codename" '$2 == c && $3 == "main" {print $1; exit}')
[ -n "$mirror" ] || cannot "apt has no Debian $codename here (apt-get update?)"
proxy=$(apt-config dump Acquire::http::Proxy --format '%v' 2>/dev/null || true)
[ -z "$proxy" ] || export http_proxy=$proxy

# Every run has a folder, a lock in it and control groups of its own: two may run side by side. What a killed one left is swept
# by the next, which knows it by the lock that nobody holds. Only the bare root is shared, and it is renamed into place whole.
cache=$build/deploy
boot=
hierarchies=(/sys/fs/cgroup /sys/fs/cgroup/systemd /sys/fs/cgroup/unified)
remove() { # the folder of a run
  local hierarchy
  for hierarchy in "${hierarchies[@]}"; do
    [ ! -d "$hierarchy/deploy-${1##*.}" ] || find "$hierarchy/deploy-${1##*.}" -depth -type d -exec rmdir {} + 2>/dev/null || true
  done
  rm -rf --one-file-system "$1"
}
end() {
  if [ -n "$boot" ]; then kill "$boot" 2>/dev/null || true; wait "$boot" 2>/dev/null || true; fi
  remove "$run"
}
mkdir -p "$cache"
exec {sweeping}>"$cache/lock"
flock "$sweeping"
for left in "$cache"/run.*; do
  [ ! -d "$left" ] || ! flock --nonblock "$left" true || remove "$left"
done
run=$(mktemp -d "$cache/run.XXXXXX")
exec {mine}<"$run"
flock "$mine"
trap end EXIT
exec {sweeping}>&-
root=$run/root
mkdir -m 755 "$root"
if [ ! -f "$cache/base-$codename.tar" ]; then
  began=$SECONDS
  # What it mounts ends with it, also when it is killed.
  unshare --mount debootstrap --variant=minbase --include=systemd,systemd-sysv,dbus,udev,sudo "$codename" "$root" "$mirror" \
    >"$cache/debootstrap.log" 2>&1 || { tail -5 "$cache/debootstrap.log" >&2; cannot "debootstrap has no root to give"; }
  tar -C "$root" -cf "$run/base.tar" . && mv "$run/base.tar" "$cache/base-$codename.tar"
  echo "deploy: debootstrap took $((SECONDS - began)) s"
else
  tar -C "$root" -xf "$cache/base-$codename.tar"
fi

# nspawn [OPTIONS]: the root as a container, which dies with this script. Where systemd runs it gives the container a scope; else
# it has control groups of its own, because two systemd in one group would end each other's processes.
nspawn() {
  local hierarchy keep=(--keep-unit)
  if [ -d /run/systemd/system ]; then
    keep=()
  else
    for hierarchy in "${hierarchies[@]}"; do
      [ -w "$hierarchy/cgroup.procs" ] || continue
      mkdir -p "$hierarchy/deploy-${run##*.}" && echo "$BASHPID" >"$hierarchy/deploy-${run##*.}/cgroup.procs" || true
    done
  fi
  exec setpriv --pdeathsig TERM timeout -k 10 1500 setpriv --pdeathsig KILL systemd-nspawn -q --register=no "${keep[@]}" \
    --machine="deploy-${run##*.}" -D "$root" "$@"
}
(nspawn --pipe true) 2>"$run/nspawn.log" || { cat "$run/nspawn.log" >&2; cannot "systemd-nspawn does not work here"; }
suites | awk '{print "deb [check-valid-until=no] " $1 " " $2 " " $3}' >"$root/etc/apt/sources.list"
apt-config dump | grep -E '^Acquire::(http|https)::|^Acquire::Check-' >"$root/etc/apt/apt.conf.d/90host" || true

echo "127.0.0.1 localhost cell" >"$root/etc/hosts"
echo cell >"$root/etc/hostname"

# The tree as a tarball holds it, without .git; what is not committed yet is in it too, and then the commit is unknown there.
tree=$root/home/newcomer/moldloft
mkdir -p "$tree"
repository=(git -c safe.directory=* -C "$source")
committed=
if [ -e "$source/.git" ] && [ -z "$("${repository[@]}" status --porcelain --untracked-files=no)" ]; then
  committed=yes
  "${repository[@]}" archive HEAD | tar -C "$tree" -x
else
  tar -C "$source" --exclude=./build --exclude=./out --exclude=./.git -c . | tar -C "$tree" -x
fi
cp "$source/tests/package/deploy_inside.sh" "$root/deploy_inside"
awk '/^## /{inside = ($0 == "## Deploy it")} inside && /^       [^ ]/{sub(/^ +/, ""); print}' "$source/README.md" >"$root/deploy_lines"
[ "$(grep -cE 'package.sh|apt install|moldloft-rehearse' "$root/deploy_lines")" -eq 3 ] || fail "README's Deploy section has lost its lines: $(cat "$root/deploy_lines")"

# A cache of compiled objects that the developer uses already serves here too; continuous integration has none.
binds=()
if [[ ${CMAKE_CXX_COMPILER_LAUNCHER:-} == *ccache ]]; then
  binds=("--bind-ro=$(ccache -k cache_dir):/ccache")
  touch "$root/with_ccache"
fi
cat >"$root/etc/systemd/system/deploy.service" <<'UNIT'
[Unit]
After=multi-user.target
SuccessAction=exit-force
FailureAction=exit-force
[Service]
Type=oneshot
ExecStart=/deploy_inside
StandardOutput=file:/deploy.log
StandardError=file:/deploy.log
[Install]
WantedBy=default.target
UNIT
ln -s ../deploy.service "$root/etc/systemd/system/multi-user.target.wants/deploy.service"
# One at a time from here: the containers share this machine's network, where the claims on ports are made, and number their
# pseudo-terminals alike.
exec {turn}>/tmp/moldloft-deploy.lock
flock --nonblock "$turn" || { echo "deploy: waits for another run on this machine"; flock "$turn"; }
nspawn --hostname=cell --resolv-conf=copy-host "${binds[@]}" --boot --console=read-only </dev/null >"$run/boot.log" 2>&1 &
boot=$!
wait $boot || true
boot=
cp "$run/boot.log" "$cache/"
cp "$root/deploy.log" "$cache/" 2>/dev/null || { tail -20 "$run/boot.log" >&2; fail "the root did not boot"; }
grep '^deploy:' "$root/deploy.log" || true
grep -qx 'deploy: done' "$root/deploy.log" || { tail -30 "$root/deploy.log" >&2; fail "see $cache/deploy.log"; }

# Two builds, in two folders, by two users: the same bytes. Only of the same compiler, and of a build tree that is deployed.
compiler() { dpkg-query "$@" -W -f='${Version}' g++-12 libc6-dev libstdc++-12-dev libeigen3-dev nlohmann-json3-dev libcli11-dev 2>/dev/null; }
if [ -z "$committed" ]; then
  echo "deploy: not all is committed, so the packages of the two builds were not compared"
elif grep -q -e -ffile-prefix-map "$build/compile_commands.json" && [ "$(compiler)" = "$(compiler --admindir="$root/var/lib/dpkg")" ]; then
  (cd "$build" && cpack --config CPackConfig.cmake -B "$run/here") >/dev/null
  for package in "$run"/here/*.deb; do
    case ${package##*/} in moldloft-cad_*) continue ;; esac  # nobody there has OpenCASCADE
    cmp "$package" "$tree/build/release/${package##*/}" || fail "${package##*/} depends on where it was built"
  done
  echo "deploy: built twice, in two folders: the same $(ls "$run/here" | grep -c deb$) packages"
  [ ! -e "$root/with_ccache" ] || echo "deploy: ... of objects from one compiler cache, so only linking and packing were compared"
else
  echo "deploy: the packages were not compared: another compiler, or a build that holds its own path"
fi
