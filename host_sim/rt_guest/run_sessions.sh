# SPDX-License-Identifier: Apache-2.0
# run_sessions.sh [--unbudgeted] {CONFIG TICKS FAULTS RATE}..., run by run_in_rt_guest: for each four
# (FAULTS - is none, RATE reports per second) the reference device is plugged into the guest's virtual
# controller, and run_device closes the loop on it through the guest's whole USB stack. With --unbudgeted
# the first scene is first tried without --accept-unbudgeted, and must be refused. Prints a line for each,
# followed by the summary; at the end, since what the emulator does for the console may come between what
# is measured.
echo "kernel $(uname -r), PREEMPT_RT $(cat /sys/kernel/realtime), clock $(cat /sys/devices/system/clocksource/clocksource0/current_clocksource)"
# The peg is compiled without [device], and without a hand beyond the budget of this one.
if [ "$1" = --unbudgeted ]; then
  shift
  host_sim usb-device --scene peg.rtscene --priority 70 >/dev/null 2>&1 &
  device=$!
  run_device "$1" --seconds 20 >/tmp/refused 2>&1
  code=$?
  grep -q 'refused: beyond the passivity budget of this device' /tmp/refused && why=budget || why=other
  echo "unbudgeted exit $code, $why" >>/tmp/told
  kill "$device"
  wait "$device"
fi
while [ $# -ge 4 ]; do
  config=$1 ticks=$2 faults=$3 rate=$4
  shift 4
  scene="$(sed -n 's/^scene = "\(.*\)"$/\1/p' "$config")"
  [ "$faults" = - ] && script= || script="--faults $faults"
  run_device "$config" --accept-unbudgeted --ticks "$ticks" --seconds 60 --json >/tmp/run.json 2>/tmp/run.log &
  run=$!
  sleep 2.1 # it measures its own wake-ups before it looks for a device
  host_sim usb-device --scene "$scene" --rate "$rate" --priority 70 $script >/tmp/device.log 2>&1 &
  device=$!
  wait "$run"
  code=$?
  kill "$device"
  wait "$device"
  {
    echo "session $config $ticks $faults $rate exit $code device $?"
    tail -n 1 /tmp/run.json
    cat /tmp/run.log /tmp/device.log
  } >>/tmp/told
done
cat /tmp/told
