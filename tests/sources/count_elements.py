"""Prints the length of a received slice, the number of its elements, and the size of one, in a frame with beliefs."""

import ctypes
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../../docs/examples/python"))

from leo_messages import Belief
from read_beliefs import join, open_subscriber

node = join(sys.argv[1])
subscriber = open_subscriber(node, 0)
end = time.monotonic() + 60.0
while time.monotonic() < end:
    sample = subscriber.receive()
    if sample is not None and sample.header.number_of_elements > 1:
        print(sample.payload().len(), sample.header.number_of_elements, ctypes.sizeof(Belief))
        sys.exit()
    time.sleep(0.01)
sys.exit("no frame with beliefs came")
