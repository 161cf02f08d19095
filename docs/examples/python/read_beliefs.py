#!/usr/bin/env python3
"""Prints what a running robot believes, and what it takes its partners to believe, with names.

The robot must run; docs/beliefs.md explains the frames and the board of names.

    pip install iceoryx2==0.10.0
    python3 docs/examples/python/read_beliefs.py --rounds 5
"""

import argparse
import ctypes
import os
import sys

import iceoryx2 as iox2

from leo_messages import (
    MAX_PERCEPTS,
    MAX_PERSPECTIVES,
    MAX_SYMBOLS,
    Belief,
    BeliefHead,
    FeatureKind,
    PerceptKernel,
    Symbols,
)
from observe import find_domain, stop_on_signals


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--domain", help="the robot's domain, where several run: /dev/shm/leo-NAME")
    parser.add_argument("--period", type=float, default=0.5, help="seconds between two rounds [default: 0.5]")
    parser.add_argument("--rounds", type=int, help="stop after so many rounds")
    return parser.parse_args()


def join(root):
    """Joins the robot's domain. A process can join one domain only."""
    iox2.set_log_level(iox2.LogLevel.Fatal)
    iox2.config.setup_global_config_from_file(iox2.FilePath.new(os.path.join(root, "iceoryx2.toml")))
    return (
        iox2.NodeBuilder.new()
        .name(iox2.NodeName.new("read-beliefs"))
        # Python handles Ctrl-C.
        .signal_handling_mode(iox2.SignalHandlingMode.Disabled)
        .create(iox2.ServiceType.Ipc)
    )


def open_subscriber(node, perspective):
    """Opens a subscriber of `beliefs/<perspective>`; None while the belief process has not created the topic."""
    topic = iox2.ServiceName.new(f"beliefs/{perspective}")
    try:
        service = node.service_builder(topic).publish_subscribe(iox2.Slice[Belief]).user_header(BeliefHead).open()
    except iox2.PublishSubscribeOpenError:
        return None
    # One frame: an older one than the newest is of no interest.
    return service.subscriber_builder().buffer_size(1).create()


def read_symbols(node, incarnation):
    """Reads the names that beliefs of an incarnation of the belief process refer to.

    The process writes them before its first beliefs. None if it has ended since.
    """
    board = node.service_builder(iox2.ServiceName.new(f"symbols/belief/{incarnation}"))
    try:
        reader = board.blackboard_opener(ctypes.c_uint64).open().reader_builder().create()
    except iox2.BlackboardOpenError:
        return None
    return reader.entry(ctypes.c_uint64(0), Symbols).get().decode_as(Symbols)


def receive(subscriber):
    """Returns head and beliefs of the newest frame, as copies; None if there is no new one."""
    sample = subscriber.receive()
    if sample is None:
        return None
    # With iceoryx2 0.10, the `len` of a received slice is its number of bytes, not of elements.
    count = sample.header.number_of_elements
    payload = sample.payload()
    head = BeliefHead.from_buffer_copy(sample.user_header().contents)
    return head, [Belief.from_buffer_copy(payload[index]) for index in range(count)]


def text(name):
    """Returns a name of fixed size as a string; "" if it is damaged."""
    if name.length > len(name.bytes):
        return ""
    try:
        return bytes(name.bytes[: name.length]).decode("utf-8")
    except UnicodeDecodeError:
        return ""


def remembered(symbols, belief, kernel):
    """Returns the first percept of a belief with this kernel, and its description; (None, None) if there is none."""
    for percept in belief.percepts[: min(belief.count, MAX_PERCEPTS)]:
        if percept.percept < min(symbols.percept_count, MAX_PERCEPTS):
            description = symbols.percepts[percept.percept]
            if description.kernel == kernel:
                return percept, description
    return None, None


def symbol_name(symbols, belief, kernel):
    """Returns the name of the symbol of a percept with this kernel, or None."""
    percept, description = remembered(symbols, belief, kernel)
    if percept is None or percept.feature_kind != FeatureKind.SYMBOL:
        return None
    number = int(percept.feature[0])
    if number < min(description.symbol_count, MAX_SYMBOLS):
        return text(description.symbols[number])
    return f"{text(description.name)} {number}"


def describe(symbols, head, belief):
    """Returns a belief in words: "yellow square at (0.50, 0.10, 0.02), seen 12 times, 0.1 s ago"."""
    kernels = (PerceptKernel.NEAREST_COLOUR, PerceptKernel.NEAREST_SHAPE)
    words = [name for kernel in kernels if (name := symbol_name(symbols, belief, kernel))]
    said = " ".join(words) or "thing"
    position, _ = remembered(symbols, belief, PerceptKernel.POSITION)
    if position is not None and position.feature_kind == FeatureKind.VECTOR:
        # In metres, in the frame of the perspective; `head` has its pose.
        x, y, z = position.feature[:3]
        said += f" at ({x:.2f}, {y:.2f}, {z:.2f})"
    age_s = (head.header.valid_at_ns - belief.perceived_at_ns) * 1e-9
    return f"{said}, seen {belief.observations} times, {age_s:.1f} s ago"


def print_frame(symbols, perspective, frame):
    head, beliefs = frame
    print(f"{text(symbols.agents[perspective])}:")
    for belief in beliefs:
        print(f"  {belief.id}: {describe(symbols, head, belief)}")


def main():
    options = arguments()
    stop = stop_on_signals()
    root = find_domain(options.domain)
    node = join(root)
    subscribers, symbols, incarnation = {}, None, None
    rounds = 0
    while not stop.is_set() and (options.rounds is None or rounds < options.rounds):
        if not os.path.isdir(root):
            sys.exit("the robot has ended")
        agents = min(symbols.agent_count, MAX_PERSPECTIVES) if symbols else 1
        for perspective in range(agents):
            if subscribers.get(perspective) is None:
                subscribers[perspective] = open_subscriber(node, perspective)
            subscriber = subscribers[perspective]
            frame = receive(subscriber) if subscriber else None
            if frame is None:
                continue
            head, _ = frame
            # Another incarnation is a restarted process, with a board of its own.
            if head.header.incarnation != incarnation:
                symbols, incarnation = read_symbols(node, head.header.incarnation), head.header.incarnation
            if symbols is None:
                incarnation = None
                break
            print_frame(symbols, perspective, frame)
            rounds += perspective == 0
        sys.stdout.flush()
        stop.wait(options.period)


if __name__ == "__main__":
    main()
