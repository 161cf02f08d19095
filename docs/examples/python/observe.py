#!/usr/bin/env python3
"""A sensory source for Leo in Python: reports a red block that moves in a circle.

Replace `look` by your own perception. The robot must run, and its leo.toml must have an external
source; docs/sources.md explains both.

    pip install iceoryx2==0.10.0
    python3 docs/examples/python/observe.py --source 1 --rate 30
"""

import argparse
import ctypes
import glob
import math
import os
import signal
import sys
import threading
import time

import iceoryx2 as iox2

from leo_messages import NOBODY, STATES, Header, Hop, Modality, Observation, ObservationKind


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--domain", help="the robot's domain, where several run: /dev/shm/leo-NAME")
    parser.add_argument("--source", type=int, default=1, help="the number of the source [default: 1]")
    parser.add_argument("--rate", type=float, default=30.0, help="frames per second [default: 30]")
    parser.add_argument("--centre", type=float, nargs=3, default=[0.6, 0.0, 0.3], metavar=("X", "Y", "Z"),
                        help="centre of the circle in the source's frame, in metres [default: 0.6 0 0.3]")
    parser.add_argument("--frames", type=int, help="stop after so many frames")
    return parser.parse_args()


def find_domain(named):
    """Returns the domain of a robot: a directory of shared memory with the middleware's configuration."""
    found = [named] if named else sorted(glob.glob("/dev/shm/leo-*"))
    found = [root for root in found if os.path.isfile(os.path.join(root, "iceoryx2.toml"))]
    if not found:
        sys.exit("no robot runs here: start one with `leo run`" if not named else f"{named} is no domain of Leo")
    if len(found) > 1:
        sys.exit(f"{len(found)} robots run here: name one with --domain {' or --domain '.join(found)}")
    return found[0]


def stop_on_signals():
    """Returns an event that Ctrl-C and SIGTERM set.

    A KeyboardInterrupt could come in the middle of a call of the middleware, and be lost. So the loop ends after a
    whole frame.
    """
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    return stop


def open_publisher(root, source, capacity):
    """Joins the domain and opens a publisher of `observations/<source>`."""
    iox2.set_log_level(iox2.LogLevel.Fatal)
    iox2.config.setup_global_config_from_file(iox2.FilePath.new(os.path.join(root, "iceoryx2.toml")))
    node = (
        iox2.NodeBuilder.new()
        .name(iox2.NodeName.new(f"source-{source}"))
        # Python handles Ctrl-C.
        .signal_handling_mode(iox2.SignalHandlingMode.Disabled)
        .create(iox2.ServiceType.Ipc)
    )
    topic = f"observations/{source}"
    try:
        # The sensor process creates the topic; `open` uses its settings.
        service = (
            node.service_builder(iox2.ServiceName.new(topic))
            .publish_subscribe(iox2.Slice[Observation])
            .user_header(Header)
            .open()
        )
    except iox2.PublishSubscribeOpenError as error:
        sys.exit(
            f"cannot open `{topic}` in {root}: {error}\n"
            f"Does the robot's leo.toml have a [[sensor.source]] number {source} (from 0) of the kind "
            '"external", and is leo_messages.py from the same version of Leo?'
        )
    for attempt in range(2):
        try:
            publisher = service.publisher_builder().initial_max_slice_len(capacity).create()
            return node, publisher
        except iox2.PublisherCreateError as error:
            if attempt > 0:
                sys.exit(f"cannot write `{topic}`: {error}\nDoes another process publish it already?")
            # A killed publisher keeps its slot until the cleanup.
            node.blocking_cleanup_dead_nodes(iox2.Duration.from_millis(500))


def look(now_ns, centre):
    """Returns the observations of an instant: one red block on a circle of 10 cm radius, once around in 4 s."""
    angle = now_ns * 1e-9 * math.tau / 4.0
    block = Observation()
    block.observed_at_ns = now_ns
    block.kind = ObservationKind.OBJECT
    block.modality = Modality.VISION
    block.partner = NOBODY
    block.held_by = NOBODY
    block.confidence = 0.95
    block.position_m[:] = (centre[0] + 0.1 * math.cos(angle), centre[1] + 0.1 * math.sin(angle), centre[2])
    block.orientation_xyzw[:] = (0.0, 0.0, 0.0, 1.0)
    block.half_extents_m[:] = (0.03, 0.03, 0.03)
    block.colour_rgb[:] = (0.80, 0.05, 0.05)
    block.shape[:] = (0.0, 0.0, 0.0, 0.0)
    # A state that the block does not have is NaN; so are all components of an attribute that was not observed.
    block.states[:] = [math.nan] * STATES
    return [block]


def main():
    options = arguments()
    stop = stop_on_signals()
    root = find_domain(options.domain)
    node, publisher = open_publisher(root, options.source, capacity=16)
    print(f"publishes observations/{options.source} in {root}; Ctrl-C ends it", flush=True)
    # A number that differs in every incarnation of this process.
    incarnation = time.monotonic_ns()
    sequence = 0
    release = time.monotonic()
    while not stop.is_set() and (options.frames is None or sequence < options.frames):
        # The instant of the observation: the exposure of the image, not the end of its processing.
        # time.monotonic_ns() is CLOCK_MONOTONIC, the clock of all processes.
        now_ns = time.monotonic_ns()
        seen = look(now_ns, options.centre)
        sequence += 1
        sample = publisher.loan_slice_uninit(len(seen))
        header = sample.user_header().contents
        # The memory is not cleared: fields that are not written keep old bytes.
        ctypes.memset(ctypes.addressof(header), 0, ctypes.sizeof(Header))
        header.valid_at_ns = now_ns
        header.sequence = sequence
        header.incarnation = incarnation
        payload = sample.payload()
        for index, observation in enumerate(seen):
            payload[index] = observation
        header.hops_ns[Hop.OBSERVED] = time.monotonic_ns()
        sample.assume_init().send()
        if not os.path.isdir(root):
            sys.exit("the robot has ended")
        release += 1.0 / options.rate
        stop.wait(max(0.0, release - time.monotonic()))


if __name__ == "__main__":
    main()
