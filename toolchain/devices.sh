# Sourced by the scripts that need the simulated devices in real time: start_devices SIM [options of moldloft-sim devices]
# serves the scanner on a free port and the robot on a pseudo-terminal, waits until both can be reached, and leaves in
# $scratch the configuration that fits them (cell.toml) and what they print (devices.log). At the end of the script the
# devices end and $scratch is gone.
scratch=$(mktemp -d)
devices=
end_devices() {
  if [ -n "$devices" ]; then kill "$devices" 2>/dev/null || true; wait "$devices" 2>/dev/null || true; fi
  rm -rf "$scratch"
}
trap end_devices EXIT

start_devices() {
  local sim=$1
  shift
  "$sim" devices --scanner-port 0 --robot-pty "$scratch/robot" --cell "$scratch/cell.toml" "$@" \
    >"$scratch/devices.log" 2>&1 &
  devices=$!
  for _ in $(seq 200); do
    grep '^ready' "$scratch/devices.log" && return
    kill -0 "$devices" 2>/dev/null || { cat "$scratch/devices.log" >&2; devices=; exit 1; }
    sleep 0.1
  done
  echo "the simulated devices did not come up" >&2
  cat "$scratch/devices.log" >&2
  exit 1
}
