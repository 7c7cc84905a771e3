# SPDX-License-Identifier: Apache-2.0
# run_process_faults.sh {VICTIM CAUSE}..., run by run_in_rt_guest: for each pair run_device waits for the reference device,
# which is plugged into the guest's virtual controller, takes it, and the hand presses. Once the force is on, CAUSE, a
# signal, happens to VICTIM; or, for "second start", another run_device comes to open the device. Tells of each in a line,
# then what the programs said, then the device's own account from 20 periods before the fault on; all of it at the end, since
# the console may come between what happens.

force_of() { tail -n 1 /tmp/run.json | sed -n 's/.*"force_n":\([0-9]*\)\..*/\1/p'; }

# await WITHIN_DS COMMAND: until it succeeds.
await() {
  left=$1
  shift
  until "$@"; do
    left=$((left - 1))
    [ $left -gt 0 ] || return 1
    sleep 0.1
  done
}
measured() { grep -q wake-ups /tmp/run.json 2>/dev/null; }
pressed() { [ "$(force_of)" -ge 8 ] 2>/dev/null; }

# What it measures of its wake-ups before it opens a device takes two seconds.
start_second() {
  sleep 0.6
  run_device timer.toml --accept-unbudgeted --seconds 0.4 --json >/tmp/second.json 2>/tmp/second.log
  echo $? >/tmp/second.code
}

while [ $# -ge 2 ]; do
  victim=$1 cause=$2 second=- reached=no
  shift 2
  rm -f /tmp/wire.csv /tmp/run.json /tmp/second.*
  # A session of its own, so that its group is its own.
  setsid run_device timer.toml --accept-unbudgeted --status-every 0.05 --json >/tmp/run.json 2>/tmp/run.log &
  program=$!
  await 50 measured
  host_sim usb-device --scene peg.rtscene --script processes.toml --hand firm --regrip 2 --priority 90 \
    --wire /tmp/wire.csv >/tmp/device.log 2>&1 &
  device=$!
  [ "$victim" = second ] && start_second &
  second_starter=$!
  sleep 2
  await 20 pressed && reached=yes
  sleep 0.2
  [ ! -e /tmp/second.code ] || reached=too-late
  case $victim in
    servo) to=$(pidof haptic-servo) ;;
    spare-then-servo)
      kill -STOP "$(pidof haptic-spare)"
      to=$(pidof haptic-servo)
      ;;
    keeper) to=$(pidof haptic-zero) ;;
    group) to=-$program ;;
    *) to=$program ;;
  esac
  # Both by the shell itself: nothing comes between the mark and the fault.
  kill -USR1 "$device"
  [ "$victim" = second ] || kill -"$cause" "$to"
  sleep 0.5
  [ "$victim" != second ] || await 20 test -e /tmp/second.code
  then=ended
  if kill -0 "$program" 2>/dev/null; then
    then=on
    if [ "$victim $cause" = 'guardian STOP' ]; then kill -KILL "$program"; else kill -TERM "$program"; fi
  fi
  [ ! -e /tmp/second.code ] || second=$(cat /tmp/second.code)
  wait "$program"
  code=$?
  kill "$device"
  wait "$device"
  device_code=$?
  wait "$second_starter"
  {
    echo "fault $victim $cause reached $reached then $then exit $code second $second device $device_code"
    grep -v '"kind":"status"' /tmp/run.json
    cat /tmp/run.log /tmp/device.log
    [ ! -e /tmp/second.log ] || sed 's/^/second: /' /tmp/second.log
    echo 'wire begins'
    awk -F, 'NR == 1 { print; next }
      $8 == 0 { held[NR % 20] = $0; next }
      $8 > 0 && !shown { for (k = 0; k < 20; ++k) if ((NR + k) % 20 in held) print held[(NR + k) % 20] }
      $8 > 0 && shown++ < 480' /tmp/wire.csv
    echo 'wire ends'
  } >>/tmp/told
done
cat /tmp/told
