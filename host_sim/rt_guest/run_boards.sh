# SPDX-License-Identifier: Apache-2.0
# run_boards.sh REPORTS TICKS {usb|bridge}.., run by run_in_rt_guest: devices whose firmware is the core in C, as a board of full
# speed over USB/IP (usb) and behind a bridge (bridge). For each the checks of `run_device conform` over REPORTS reports, then
# TICKS ticks of run_device. All that is found is told at the end, since the console may come between what is measured.
reports=$1 ticks=$2
shift 2

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
plugged() { grep -qs 1209 /sys/bus/usb/devices/*/idVendor; }

start_device() {
  if [ "$1" = usb ]; then
    guest_board usbip peg.rtscene 70 >/tmp/board.log 2>&1 &
  else
    guest_board bridge peg.rtscene 70 /tmp/board.sock >/tmp/board.log 2>&1 &
  fi
  board=$!
}
end_device() {
  kill "$board"
  wait "$board"
}

for kind in "$@"; do
  config=timer.toml address=1209:0001
  [ "$kind" = usb ] || config=bridge.toml address=unix:/tmp/board.sock
  start_device "$kind"
  if [ "$kind" = usb ]; then await 50 plugged; else await 50 test -S /tmp/board.sock; fi
  for each in /sys/bus/usb/devices/*/idVendor; do
    grep -qs 1209 "$each" && found=${each%/idVendor}
  done
  [ "$kind" != usb ] ||
    echo "bus speed $(cat "$found/speed") packet $((0x$(cat "$found":1.0/ep_81/wMaxPacketSize))) interval $(cat "$found":1.0/ep_81/interval)" >>/tmp/told
  run_device conform --device $address --reports "$reports" --json >/tmp/conform.json 2>/tmp/conform.log
  code=$?
  end_device
  {
    echo "conform $kind exit $code device $?"
    tr -d '\n' </tmp/conform.json | sed 's/},/},\n/g'
    echo
  } >>/tmp/told
  sleep 0.5

  rm -f /tmp/board.sock
  # Over USB the device comes when the program has measured its wake-ups; a bridge is there before.
  [ "$kind" = usb ] || start_device "$kind"
  run_device $config --accept-unbudgeted --ticks "$ticks" --seconds 60 --status-every 0.05 --json \
    >/tmp/run.json 2>/tmp/run.log &
  program=$!
  if [ "$kind" = usb ]; then
    sleep 2.1
    start_device usb
  fi
  wait $program
  code=$?
  end_device
  {
    echo "session $kind exit $code device $?"
    tail -n 1 /tmp/run.json
    cat /tmp/board.log
    sed 's/^/run_device: /' /tmp/run.log
  } >>/tmp/told
done
cat /tmp/told
