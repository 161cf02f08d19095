"""A master that is not Leo reads with the vendor's SDK whether servos have torque, and their bus watchdogs. Its arguments
are a speed, and for each bus a path and the identifiers of its servos, such as `/dev/pts/3=1,2,3`. It writes a line for
each servo: path, identifier, torque enable (item 64), bus watchdog (item 98)."""

import sys

from dynamixel_sdk import COMM_SUCCESS, PacketHandler, PortHandler, port_handler

TORQUE_ENABLE, BUS_WATCHDOG = 64, 98


def read(packets, port, servo, item):
    for _ in range(5):
        value, result, error = packets.read1ByteTxRx(port, servo, item)
        if result == COMM_SUCCESS:
            # Bit 7 is an alert, and the value is right all the same.
            if error & 0x7F:
                sys.exit(f"servo {servo}, item {item}: error {error}")
            return value
    sys.exit(f"servo {servo} does not answer")


def main():
    # The SDK waits for twice the latency of an adapter, which it takes for 16 ms: too little on a machine that does
    # much else.
    port_handler.LATENCY_TIMER = 250
    packets = PacketHandler(2.0)
    for bus in sys.argv[2:]:
        path, ids = bus.split("=")
        port = PortHandler(path)
        if not (port.openPort() and port.setBaudRate(int(sys.argv[1]))):
            sys.exit(f"{path} does not open")
        for servo in map(int, ids.split(",")):
            print(path, servo, read(packets, port, servo, TORQUE_ENABLE), read(packets, port, servo, BUS_WATCHDOG))
        port.closePort()


main()
