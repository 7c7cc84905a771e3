#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The official Feetech SDK (PyPI: ftservo-python-sdk) as a client of our emulated servos at PORT.

Exit code 77: the SDK is not there. It reads and writes as its examples do.
"""
import sys

try:
    from scservo_sdk import COMM_SUCCESS, GroupSyncRead, PortHandler, sms_sts
    from scservo_sdk import port_handler
except ImportError:
    sys.exit(77)

port_handler.LATENCY_TIMER = 500  # milliseconds: a loaded machine is late


def main(path, count):
    port = PortHandler(path)
    servos = sms_sts(port)
    assert port.openPort() and port.setBaudRate(1000000)
    for servo in range(1, count + 1):
        model, result, error = servos.ping(servo)
        assert (model, result, error) == (777, COMM_SUCCESS, 0), (servo, model, result, error)
        position, speed, result, error = servos.ReadPosSpeed(servo)
        assert (position, result, error) == (2048 - 700 * servo, COMM_SUCCESS, 0), (servo, position)
        assert servos.write1ByteTxRx(servo, 41, 50) == (COMM_SUCCESS, 0)
        assert servos.read1ByteTxRx(servo, 41) == (50, COMM_SUCCESS, 0)
    reader = GroupSyncRead(servos, 56, 6)
    for servo in range(1, count + 1):
        assert reader.addParam(servo)
    assert reader.txRxPacket() == COMM_SUCCESS
    for servo in range(1, count + 1):
        available, error = reader.isAvailable(servo, 56, 2)
        assert available and error == 0
        assert servos.scs_tohost(reader.getData(servo, 56, 2), 15) == 2048 - 700 * servo
    port.closePort()
    print("the official SDK has read and written", count, "servos")


main(sys.argv[1], int(sys.argv[2]))
