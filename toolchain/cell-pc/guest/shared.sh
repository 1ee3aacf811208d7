# What init and service share; sourced by both.
. /etc/cell-pc.conf
export PATH=/bin:/usr/bin
results=/tmp/results
mkdir -p $results
uptime_s() { cut -d' ' -f1 /proc/uptime; }

# The robot's port is the one on the PCI bus, the controller's is COM2.
controllers=/dev/ttyS1
for tty in /sys/class/tty/ttyS*; do
  case $(readlink $tty/device) in *0000:*) robots=/dev/${tty##*/} ;; esac
done

serve_devices() { # CONFIGURATION TO WRITE
  moldloft-sim devices --scanner-port 4014 --robot-serial $robots --controller-serial $controllers --cell $1 --force \
    --log $devices >$results/devices 2>&1 &
  server=$!
  for i in $(seq 200); do
    grep -q ^ready $results/devices && return
    usleep 50000
  done
  echo "cell-pc: the simulated devices did not come up: $(cat $results/devices)"
  hand_over
}
dismiss_devices() { kill $server; wait $server; }

# Results leave as a text between two lines of the console, and the PC goes out.
hand_over() {
  cat /proc/interrupts >$results/interrupts
  dmesg >$results/dmesg
  dmesg -n 1
  echo -----BEGIN RESULTS-----
  tar -C $results -cz . | base64
  echo -----END RESULTS-----
  poweroff -f
}
