#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The official DYNAMIXEL SDK (PyPI: dynamixel-sdk) as a client of our emulated servos at PORT.

Exit code 77: the SDK is not there. It reads and writes as its examples do.
"""
import sys

try:
    from dynamixel_sdk import (COMM_SUCCESS, GroupSyncRead, GroupSyncWrite, PacketHandler,
                               PortHandler)
    from dynamixel_sdk import port_handler
except ImportError:
    sys.exit(77)

port_handler.LATENCY_TIMER = 500  # it gives an answer 34 ms, which a loaded machine has not


def main(path, count):
    port, packets = PortHandler(path), PacketHandler(2.0)
    assert port.openPort() and port.setBaudRate(1000000)
    for servo in range(1, count + 1):
        model, result, error = packets.ping(port, servo)
        assert (model, result, error) == (1220, COMM_SUCCESS, 0), (servo, model, result, error)
        assert packets.write1ByteTxRx(port, servo, 11, 0) == (COMM_SUCCESS, 0)
        assert packets.write1ByteTxRx(port, servo, 64, 1) == (COMM_SUCCESS, 0)
        assert packets.read1ByteTxRx(port, servo, 64) == (1, COMM_SUCCESS, 0)
        # In EEPROM, with torque on: access error.
        assert packets.write1ByteTxRx(port, servo, 11, 3) == (COMM_SUCCESS, 7)
        # Beyond the current limit: data limit error.
        assert packets.write2ByteTxRx(port, servo, 102, 2000) == (COMM_SUCCESS, 6)
        assert packets.write1ByteTxRx(port, servo, 98, 1) == (COMM_SUCCESS, 0)
        # A word that has to be stuffed.
        assert packets.write4ByteTxRx(port, servo, 104, 0x01FDFFFF) == (COMM_SUCCESS, 0)
        assert packets.read4ByteTxRx(port, servo, 104) == (0x01FDFFFF, COMM_SUCCESS, 0)
    goals = GroupSyncWrite(port, packets, 102, 2)
    for servo in range(1, count + 1):
        assert goals.addParam(servo, [10 * servo, 0])
    assert goals.txPacket() == COMM_SUCCESS
    for fast in (False, True):
        reader = GroupSyncRead(port, packets, 102, 2)
        position = GroupSyncRead(port, packets, 126, 10)
        for each in (reader, position):
            for servo in range(1, count + 1):
                assert each.addParam(servo)
            result = each.fastSyncRead() if fast else each.txRxPacket()
            assert result == COMM_SUCCESS, (fast, packets.getTxRxResult(result))
        for servo in range(1, count + 1):
            assert reader.getData(servo, 102, 2) == 10 * servo, (fast, servo)
            assert position.getData(servo, 132, 4) == 2048 + servo, (fast, servo)
    for servo in range(1, count + 1):
        assert packets.write1ByteTxRx(port, servo, 64, 0) == (COMM_SUCCESS, 0)
    port.closePort()
    print("the official SDK has read and written", count, "servos")


main(sys.argv[1], int(sys.argv[2]))
