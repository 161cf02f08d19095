"""A master that is not Leo: the vendor's SDK on a mock bus. Its arguments are the path of a bus, its
speed and the identifiers of its servos; it ends with 0 when all went as it should."""

import sys
import time

from dynamixel_sdk import (
    COMM_SUCCESS,
    GroupBulkRead,
    GroupBulkWrite,
    GroupSyncRead,
    GroupSyncWrite,
    PacketHandler,
    PortHandler,
    port_handler,
)

RETURN_DELAY, TORQUE, LED, GOAL, TICK, POSITION = 9, 64, 65, 116, 120, 132


def expect(what, got, wanted):
    if got != wanted:
        sys.exit(f"{what}: {got!r}, and not {wanted!r}")


def main():
    path, baud, ids = sys.argv[1], int(sys.argv[2]), [int(number) for number in sys.argv[3:]]
    # The SDK waits for twice the latency of an adapter, which it takes for 16 ms: too little on a machine
    # that does much else.
    port_handler.LATENCY_TIMER = 250
    port, packets = PortHandler(path), PacketHandler(2.0)
    expect("open", port.openPort(), True)
    expect("speed", port.setBaudRate(baud), True)

    found, result = packets.broadcastPing(port)
    expect("scan", (result, sorted(found)), (COMM_SUCCESS, ids))
    for servo in ids:
        model, result, error = packets.ping(port, servo)
        expect(f"ping {servo}", (model in (1020, 1200), result, error), (True, COMM_SUCCESS, 0))
        expect(f"delay {servo}", packets.write1ByteTxRx(port, servo, RETURN_DELAY, 0), (COMM_SUCCESS, 0))
        expect(f"torque {servo}", packets.write1ByteTxRx(port, servo, TORQUE, 1), (COMM_SUCCESS, 0))

    # What may not be written is refused with the fault of the manual.
    _, error = packets.write1ByteTxRx(port, ids[0], RETURN_DELAY, 5)
    expect("EEPROM with torque on", error, 7)
    _, error = packets.write1ByteTxRx(port, ids[0], TORQUE, 9)
    expect("a torque of 9", error, 4)

    goals = GroupSyncWrite(port, packets, GOAL, 4)
    for servo in ids:
        goals.addParam(servo, list((2000 + servo).to_bytes(4, "little")))
    expect("sync write", goals.txPacket(), COMM_SUCCESS)

    for name, read in (("sync read", "txRxPacket"), ("fast sync read", "fastSyncRead")):
        positions = GroupSyncRead(port, packets, POSITION, 4)
        for servo in ids:
            positions.addParam(servo)
        for _ in range(200):
            expect(name, getattr(positions, read)(), COMM_SUCCESS)
            got = [positions.getData(servo, POSITION, 4) for servo in ids]
            if got == [2000 + servo for servo in ids]:
                break
            time.sleep(0.01)
        expect(name, got, [2000 + servo for servo in ids])

    lamps = GroupBulkWrite(port, packets)
    for servo in ids:
        lamps.addParam(servo, LED, 1, [servo % 2])
    expect("bulk write", lamps.txPacket(), COMM_SUCCESS)
    # The SDK finds a servo in a fast bulk read by the first byte that is its identifier, lengths
    # included: of each is asked for more bytes than there are servos on a bus.
    lamp, body = (LED, 20), (TICK, 24)
    expect("no identifier is a length or an address", set(ids) & {0, *lamp, *body}, set())
    for name, read in (("bulk read", "txRxPacket"), ("fast bulk read", "fastBulkRead")):
        mixed = GroupBulkRead(port, packets)
        for servo in ids:
            mixed.addParam(servo, *(lamp if servo % 2 else body))
        expect(name, getattr(mixed, read)(), COMM_SUCCESS)
        got = [mixed.getData(servo, LED, 1) if servo % 2 else mixed.getData(servo, POSITION, 4) for servo in ids]
        expect(name, got, [1 if servo % 2 else 2000 + servo for servo in ids])

    expect("reg write", packets.regWriteTxRx(port, ids[0], LED, 1, [0]), (COMM_SUCCESS, 0))
    expect("not yet", packets.read1ByteTxRx(port, ids[0], LED), (ids[0] % 2, COMM_SUCCESS, 0))
    expect("action", packets.action(port, ids[0]), COMM_SUCCESS)
    for _ in range(100):
        if packets.read1ByteTxRx(port, ids[0], LED) == (0, COMM_SUCCESS, 0):
            break
    expect("action done", packets.read1ByteTxRx(port, ids[0], LED), (0, COMM_SUCCESS, 0))

    # At rest, and within a turn as it is: nothing changes.
    expect("clear", packets.clearMultiTurn(port, ids[0]), (COMM_SUCCESS, 0))

    # Each says nothing for 0.4 s. Where this machine needs half of that to tell them all, the first may be
    # back too soon: they are told once more.
    for _ in range(10):
        told_at = time.monotonic()
        for servo in ids:
            expect(f"reboot {servo}", packets.reboot(port, servo), (COMM_SUCCESS, 0))
        told_in = time.monotonic() - told_at
        found, _ = packets.broadcastPing(port)
        if told_in < 0.2:
            break
    expect("silence", found, {})
    for _ in range(300):
        found, _ = packets.broadcastPing(port)
        if sorted(found) == ids:
            break
        time.sleep(0.01)
    expect("back", sorted(found), ids)
    for servo in ids:
        expect(f"limp {servo}", packets.read1ByteTxRx(port, servo, TORQUE), (0, COMM_SUCCESS, 0))
    port.closePort()


main()
