# SPDX-License-Identifier: Apache-2.0
# usb_loop.sh SCENE [TICKS [FAULTS [CONNECTS [HZ]]]], run by run_in_rt_guest: the reference device on the
# guest's virtual controller, and the loop on it through the guest's whole USB stack.
scene=$1 ticks=${2:-3000} faults=$3 connects=${4:-1} rate=${5:-1000}
echo "kernel $(uname -r), PREEMPT_RT $(cat /sys/kernel/realtime), clock $(cat /sys/devices/system/clocksource/clocksource0/current_clocksource)"
host_sim usb-device --scene "$scene" --hand light --priority 70 --rate "$rate" ${faults:+--faults "$faults"} >/tmp/device.log 2>&1 &
device=$!
host_sim usb-loop --scene "$scene" --ticks "$ticks" --rate "$rate" --connects "$connects"
code=$?
kill "$device"
wait "$device"
device_code=$?
cat /tmp/device.log
[ "$code" -ne 0 ] || code=$device_code
exit "$code"
