"""A network of two namespaces, made of two TUN devices and this process between them: it delays, drops and cuts.

    network.py NAMESPACE ADDRESS NAMESPACE ADDRESS

Says "ready" when both ends are up. Each line of standard input says how packets fare from then on, in both directions:
"MILLISECONDS SHARE": so long under way, and that share of them lost; "cut": none comes. It ends with its input.
"""

import ctypes
import fcntl
import heapq
import os
import random
import selectors
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
CLONE_NEWNET = 0x40000000
# Packets under way in one direction at most, as in a router's queue.
QUEUED = 4000


def tun_in(namespace, address):
    """A TUN device in a namespace: its file, which stays what it is when this process moves on."""
    libc = ctypes.CDLL(None, use_errno=True)
    with open(f"/run/netns/{namespace}") as place:
        if libc.setns(place.fileno(), CLONE_NEWNET) != 0:
            raise OSError(ctypes.get_errno(), "setns")
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH", b"leo0", IFF_TUN | IFF_NO_PI))
    for words in (["addr", "add", f"{address}/24", "dev", "leo0"], ["link", "set", "leo0", "up"], ["link", "set", "lo", "up"]):
        subprocess.run(["ip", *words], check=True)
    return device


def main():
    ends = [tun_in(*sys.argv[1:3]), tun_in(*sys.argv[3:5])]
    chance = random.Random(2006)
    selector = selectors.DefaultSelector()
    for end, other in (ends, ends[::-1]):
        selector.register(end, selectors.EVENT_READ, other)
    selector.register(sys.stdin.fileno(), selectors.EVENT_READ, None)
    delay_s, lost, is_cut = 0.0, 0.0, False
    under_way, count = [], 0
    print("ready", flush=True)
    while True:
        wait = max(0.0, under_way[0][0] - time.monotonic()) if under_way else None
        for key, _ in selector.select(wait):
            if key.data is None:
                line = os.read(key.fd, 4096).decode().split("\n")[0]
                if not line:
                    return
                is_cut = line == "cut"
                if not is_cut:
                    milliseconds, share = line.split()
                    delay_s, lost = float(milliseconds) / 1e3, float(share)
                print("so", flush=True)
                continue
            for _ in range(64):
                try:
                    packet = os.read(key.fd, 65536)
                except BlockingIOError:
                    break
                if not is_cut and chance.random() >= lost and len(under_way) < QUEUED:
                    count += 1
                    heapq.heappush(under_way, (time.monotonic() + delay_s, count, key.data, packet))
        while under_way and under_way[0][0] <= time.monotonic():
            _, _, to, packet = heapq.heappop(under_way)
            try:
                os.write(to, packet)
            except OSError:
                pass


main()
