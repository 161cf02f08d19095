"""What Leo's processes share through memory, for ctypes: made from shared/message by
`LEO_REWRITE=1 cargo test -p leo-message`; do not edit. docs/sources.md and docs/beliefs.md say how to use it.

A topic is an iceoryx2 publish-subscribe service whose payload is a slice of entries and whose
user header is the head.
"""

import ctypes
import enum

NOBODY = 65535
STATES = 8
MAX_PERCEPTS = 12
MAX_BUSES = 16
MAX_JOINTS = 256
MAX_PERSPECTIVES = 256
MAX_SOURCES = 16
MAX_SYMBOLS = 64
LOSSES = 24
TEXT_CAPACITY = 252
NAME_CAPACITY = 64
MAX_DEPTH = 6


# Kind of an event of the learner.
class EventKind(enum.IntEnum):
    # Leo said something; the text is the sentence.
    SAID = 1
    # A lesson about a task began; the text is its name.
    TEACHING_STARTED = 2
    # An action was recognised; the text names actor and action.
    ACTION_SEEN = 3
    # A demonstration ended and became an example; the text is the task's name.
    DEMONSTRATION_ENDED = 4
    # A hypothesis with its posterior, tally and rank; the text is its computed name.
    HYPOTHESIS = 5
    # The primary hypothesis of a task was chosen; the text is its computed name.
    RULE_CHOSEN = 6
    # Why the hypotheses of two perspectives differ; the text explains it.
    EXPLAINED = 7
    # Leo began to perform a task; the text is its name.
    PERFORMANCE_STARTED = 8
    # A step of the performance began; the text names it.
    STEP_STARTED = 9
    # A step ended, and the robot's beliefs confirm it; the text names it.
    STEP_DONE = 10
    # A step ended without its expected effect; the text gives the reason.
    STEP_FAILED = 11
    # The performance ended; the text gives the result.
    PERFORMANCE_ENDED = 12
    # The continuity of the belief buffer was broken, because its process restarted.
    CONTINUITY_BROKEN = 13
    # The objects in a perspective when a demonstration or a performance begins; the text lists them.
    SEEN = 14
    # Leo refused to perform a task; the text is its reply.
    DECLINED = 15
    # Leo's question about a task was answered, and the answer became an example; the text is "yes" or "no".
    ANSWERED = 16
    # An agent's movement matched one of Leo's own movements; the text names agent and expected action.
    MOVEMENT_SEEN = 17
    # A task from memory, followed by its hypotheses; sent to new subscribers.
    REMEMBERED = 18
    # A teacher said something about a task's rule, and the sentence became an example; the text is what Leo understood.
    TOLD = 19
    # A task has another name now: the text.
    RENAMED = 20
    # A task was forgotten; the text is its name.
    FORGOTTEN = 21


# The kind of a feature, and so the meaning of its four numbers in shared memory.
class FeatureKind(enum.IntEnum):
    # No feature: the percept only classifies.
    NONE = 0
    # A symbol: the first number is its index.
    SYMBOL = 1
    # A number: the first.
    NUMBER = 2
    # A position in the frame of the perspective, or extents: the first three numbers, in metres.
    VECTOR = 3
    # An orientation in the frame of the perspective: a quaternion `[x, y, z, w]`.
    ORIENTATION = 4


# The unit of a feature's numbers.
class FeatureUnit(enum.IntEnum):
    # None: a symbol, a degree, a quaternion, or the feature of a plug-in.
    NONE = 0
    # Metres.
    METRES = 1


# A stage that a frame passes, in the direction of the data flow.
class Hop(enum.IntEnum):
    # The source published the observations.
    OBSERVED = 0
    # The sensor process started the cycle that read them.
    SENSOR_STARTED = 1
    # The sensor process published the percept buffer.
    PERCEIVED = 2
    # The belief process started its step on the percepts.
    BELIEF_STARTED = 3
    # The belief process published the belief buffers.
    BELIEVED = 4
    # The learner published the joint goals.
    DECIDED = 5
    # The motor process received the joint goals.
    COMMANDED = 6
    # The motor process published the joint states.
    MOVED = 7


# Arming state of a joint.
class JointArming(enum.IntEnum):
    # May not move until its cause is gone and an operator has acknowledged it.
    LOCKED = 0
    # May not move until an operator arms it.
    DISARMED = 1
    # May move.
    ARMED = 2


# Cause of a joint's mode.
class JointCause(enum.IntEnum):
    # Normal operation.
    NONE = 0
    # Not started yet.
    NOT_STARTED = 1
    # No new goals within the command timeout.
    COMMAND_TIMEOUT = 2
    # The servo does not reply.
    SILENT = 3
    # The servo reports a hardware alert.
    ALERT = 4
    # The servo's bus watchdog tripped.
    WATCHDOG = 5
    # The bus is lost.
    BUS_LOST = 6
    # Stopped by command.
    STOPPED = 7
    # The servo rejected an instruction, or is not the configured model.
    REFUSED = 8
    # Another joint of its group failed, and the group stops together.
    GROUP_STOPPED = 9
    # A bus is lost, and the whole body stops together.
    BODY_STOPPED = 10
    # The emergency stop.
    EMERGENCY = 11
    # The servo rebooted by itself, because of its power supply or firmware.
    RESTARTED = 12
    # Two servos reply to the same identifier on its bus.
    DUPLICATE_ID = 13
    # The servo is hot or its voltage low, so its speed is reduced.
    DERATED = 14
    # The servo replies, but its clock does not advance correctly. So its replies may be outdated.
    STALE = 15
    # The joint did not follow its command: it was blocked, or its servo is too weak.
    BLOCKED = 16
    # Further beyond its limits than the tolerance: a slipped horn, a wrong offset, or a swapped servo.
    BEYOND_LIMITS = 17


# State of the connection to a joint's servo.
class JointLink(enum.IntEnum):
    # Not contacted yet.
    UNKNOWN = 0
    # Found, and of the configured model; its settings are being read or written.
    IDENTIFIED = 1
    # Configured, and read in every cycle.
    ANSWERING = 2
    # Quarantined, and probed at intervals: it does not reply, or its replies are not trusted.
    SILENT = 3
    # Its replies arrive corrupt: two servos may reply at the same time.
    CORRUPT = 4


# Mode of a joint in the motor process.
class JointMode(enum.IntEnum):
    # Torque off: the joint moves freely.
    LIMP = 0
    # Being initialised: found and checked, torque still off.
    STARTING = 1
    # Following goals.
    FOLLOWING = 2
    # No goals arrive any more: decelerating.
    DECELERATING = 3
    # Holding the position where it stopped.
    HOLDING = 4
    # The servo does not reply, or its replies are not trusted. No goal is sent; it is probed at intervals.
    QUARANTINED = 5
    # Torque off was commanded, but the servo has not confirmed it.
    RELEASING = 6
    # Moving slowly back within its limits, which it slightly exceeded when torque was switched on.
    ALIGNING = 7
    # Moving slowly to its rest pose before torque is switched off.
    LOWERING = 8


# Motion state of a joint.
class JointMotion(enum.IntEnum):
    # No goal is sent: torque is off, or its servo keeps its position.
    IDLE = 0
    # Moving slowly back within its limits.
    ALIGN = 1
    # Following goals with the speed limit of the soft start.
    SOFT_START = 2
    # Following goals.
    TRACK = 3
    # Decelerating to a stop.
    DECELERATE = 4
    # Holding the position where it stopped, ready for new goals.
    HOLD = 5
    # Moving slowly to its rest pose.
    LOWER = 6


# State of the torque of a joint's servo.
class JointPower(enum.IntEnum):
    # Unknown: it may be on.
    UNKNOWN = 0
    # The servo has confirmed that it is off.
    OFF = 1
    # Found on at start-up: another process switched it on.
    FOUND = 2
    # Being switched on.
    SWITCHING_ON = 3
    # On, and the servo's bus watchdog is armed.
    ON = 4
    # Being switched off, not confirmed by the servo yet.
    SWITCHING_OFF = 5


# Why an observation of a source did not become a percept. The first six reasons concern whole frames, the
# others single observations.
class Loss(enum.IntEnum):
    # A newer frame of its source arrived before the cycle that would have processed it.
    OVERTAKEN = 0
    # Dropped before the sensor process received it: a gap of the sequence number.
    MISSED = 1
    # The middleware could not deliver it to the sensor process.
    UNREADABLE = 2
    # Its sequence number did not increase, or increased by more than a source can have sent.
    MISNUMBERED = 3
    # The stamp of `Hop::Observed` is missing, or not of the present time.
    UNSTAMPED = 4
    # The frame's time stamp is in the future, too old, or not newer than the previous one.
    UNTIMELY = 5
    # Its time stamp is in the future.
    FUTURE = 6
    # It is too old to be useful.
    PAST = 7
    # It is not newer than its source's earlier frames.
    STALE = 8
    # Its kind is unknown.
    KIND = 9
    # Its modality is unknown.
    MODALITY = 10
    # Its position is not finite, or out of range.
    POSITION = 11
    # Its orientation is not a unit quaternion, or a person or an occluder has none.
    ORIENTATION = 12
    # Its extents are negative, out of range or observed in part, or an occluder has none.
    EXTENTS = 13
    # Its colour or shape is not in [0, 1], or was observed in part.
    APPEARANCE = 14
    # Its confidence is not in [0, 1].
    CONFIDENCE = 15
    # It is of a person, but names no person.
    PERSON = 16
    # The buffer was full.
    OVER_CAPACITY = 17
    # The degree of a state is neither in [0, 1] nor NaN, which means that the object has no such state.
    STATE = 18
    # Another observation of the same person at the same instant is in the frame.
    DUPLICATE = 19
    # It is a detection of a person, and no partner is probable enough.
    UNIDENTIFIED = 20


# The sense that made an observation.
class Modality(enum.IntEnum):
    # Seen.
    VISION = 1
    # Heard.
    HEARING = 2
    # Felt, or known from the robot's own joints.
    TOUCH = 3


# Kind of the observed object.
class ObservationKind(enum.IntEnum):
    # An object on the table.
    OBJECT = 1
    # A partner, or the robot's own head; the pose is that of the eyes (x along the line of sight).
    PERSON = 2
    # An object that hides what is behind it; the extents are those of a box.
    OCCLUDER = 3
    # A hand of an agent; the position is that of the palm. What the agent holds moves with it.
    HAND = 4


# The classifier of a percept.
class PerceptKernel(enum.IntEnum):
    # The position, in the frame of the perspective.
    POSITION = 0
    # The orientation, in the frame of the perspective.
    ORIENTATION = 1
    # Half the extents along the object's own axes.
    EXTENTS = 2
    # The number of the source that observed the object.
    SOURCE = 3
    # The degree of a state, from 0 to 1.
    STATE = 4
    # The nearest prototype of shape.
    NEAREST_SHAPE = 5
    # The nearest prototype of colour.
    NEAREST_COLOUR = 6
    # The nearest prototype of size.
    NEAREST_SIZE = 7
    # 1 inside a box of the perspective's frame, 0 outside.
    REGION = 8
    # The degree to which a number of the parent's feature is within limits, from 0 to 1.
    RANGE = 9
    # A classifier of the program itself.
    PLUGIN = 10


# The role of a percept in goal beliefs.
class PerceptRole(enum.IntEnum):
    # It selects the objects that are meant.
    CRITERIA = 0
    # It describes the state that the objects are to reach.
    EXPECTATION = 1
    # Goal beliefs ignore it.
    NEITHER = 2


# A process of Leo, in the direction of the data flow. Its name is also its subcommand.
class Process(enum.IntEnum):
    # Simulates the workspace, the teacher and Leo's body.
    SIMULATOR = 0
    # Turns observations into percepts.
    SENSOR = 1
    # Turns percepts into beliefs.
    BELIEF = 2
    # Learns tasks from beliefs, and turns tasks into joint goals.
    LEARNER = 3
    # Simulates the servos at the other end of the buses.
    MOCK_BUS = 4
    # Sends joint goals to servos and publishes joint states.
    MOTOR = 5
    # Serves the page, and reports events to people.
    CONSOLE = 6
    # Starts and monitors the other processes.
    SUPERVISOR = 7
    # Transfers frames between this machine and another one.
    LINK = 8


# State of a process.
class ProcessState(enum.IntEnum):
    # The board has not been written yet.
    ABSENT = 0
    # Opening its ports and locking its memory.
    STARTING = 1
    # In its main loop.
    RUNNING = 2
    # Received a stop request.
    STOPPING = 3


# Mode of the simulated lesson.
class SceneMode(enum.IntEnum):
    # The lesson's script is played.
    SCRIPT = 1
    # A teacher sets up the table interactively: objects may be added, removed and moved freely.
    SET_UP = 2
    # A teacher teaches interactively: objects are moved, and the steps are recorded.
    TEACHING = 3
    # The lesson's script has ended; Leo may still be performing.
    OVER = 4


# A discrete state of an object, observed as a degree in [0, 1].
class State(enum.IntEnum):
    # Its hole holds a peg.
    FILLED = 0
    # It carries a marker.
    MARKED = 1
    # It sits in a hole.
    INSERTED = 2
    # It is switched on.
    ON = 3


# Kind of an interactive act of a teacher in the simulated workspace.
class TeacherActKind(enum.IntEnum):
    # Says the text.
    SAY = 1
    # Takes the object named by `text` in hand.
    TAKE = 2
    # Moves the object in hand to a position.
    CARRY = 3
    # Puts the object in hand down at a position.
    PUT = 4
    # Returns the object in hand to where it was taken.
    CANCEL = 5
    # Moves the teacher's eyes to a position, and directs their gaze to another.
    SEAT = 6
    # Leaves the workspace.
    LEAVE = 7
    # Returns to the workspace.
    RETURN = 8
    # Moves the occluder named by `text`, or creates a new one.
    SCREEN = 9
    # Adds a new object of the kind `text` and the colour `colour`.
    ADD = 10
    # Removes the object or occluder named by `text`.
    REMOVE = 11
    # Starts with an empty table.
    CLEAR = 12
    # Sets up a table of the lesson.
    LAY = 13
    # Opens the lesson named by `text`, and plays it.
    OPEN = 14
    # Restarts the open lesson.
    PLAY = 15
    # Undoes the last act.
    UNDO = 16
    # Saves the interactive lesson with the title `text`.
    SAVE = 17


# Role of an object on the table.
class ThingRole(enum.IntEnum):
    # A block to work on.
    BLOCK = 1
    # A peg, to be inserted into a hole.
    PEG = 2
    # A marker, to be put onto an object.
    MARKER = 3


# Kind of a turn.
class TurnKind(enum.IntEnum):
    # Make one step at the given instant.
    STEP = 1
    # Exit the process.
    STOP = 2


# A short text of fixed capacity, UTF-8.
class Text(ctypes.Structure):
    _fields_ = [
        ("length", ctypes.c_uint32),
        ("bytes", ctypes.c_uint8 * 252),
    ]

    @staticmethod
    def type_name():
        return "leo/Text/1"


# Result of an act.
class ActAnswer(ctypes.Structure):
    _fields_ = [
        # The act's serial number.
        ("serial", ctypes.c_uint64),
        # 1 if the act was refused, 0 if it was done.
        ("refused", ctypes.c_uint64),
        # Reason for the refusal, or the result: the new object's name, the file written.
        ("text", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/ActAnswer/1"


# One percept in which two beliefs about the same object differ. Positions and orientations are in the robot's
# base frame.
class Aspect(ctypes.Structure):
    _fields_ = [
        ("distance", ctypes.c_double),
        # The percept: its index in the configured set P.
        ("percept", ctypes.c_uint16),
        ("one_kind", ctypes.c_uint16),
        ("other_kind", ctypes.c_uint16),
        ("reserved", ctypes.c_uint16),
        ("one", ctypes.c_float * 4),
        ("other", ctypes.c_float * 4),
    ]

    @staticmethod
    def type_name():
        return "leo/Aspect/1"


# The remembered evaluation of one percept at the frame's instant: h(t) = (m', c', d') (Eq. 3).
class Remembered(ctypes.Structure):
    _fields_ = [
        # Time stamp of its newest sample, in nanoseconds of the clock.
        ("sampled_at_ns", ctypes.c_uint64),
        # The percept: its index in the configured set P.
        ("percept", ctypes.c_uint16),
        # The `FeatureKind` of its feature.
        ("feature_kind", ctypes.c_uint16),
        # Match m' in [0, 1].
        ("matching", ctypes.c_float),
        # Confidence c' in [0, 1], decayed since the newest sample.
        ("confidence", ctypes.c_float),
        # The feature d' by its kind; unused numbers are zero.
        ("feature", ctypes.c_float * 4),
    ]

    @staticmethod
    def type_name():
        return "leo/Remembered/1"


# An entry of a belief buffer: one remembered object (Eq. 3), evaluated at the frame's instant.
class Belief(ctypes.Structure):
    _fields_ = [
        # Identity within its belief system; the older one survives a merge.
        ("id", ctypes.c_uint64),
        # When the object was first perceived, in nanoseconds of the clock.
        ("born_at_ns", ctypes.c_uint64),
        # When it was last perceived, in nanoseconds of the clock.
        ("perceived_at_ns", ctypes.c_uint64),
        # Number of observations merged into it.
        ("observations", ctypes.c_uint64),
        # The agent last perceived to hold it, as of this instant, or `NOBODY`.
        ("held_by", ctypes.c_uint16),
        # The owner according to this perspective, or `NOBODY` for a shared object.
        ("owner", ctypes.c_uint16),
        # The number of its percepts.
        ("count", ctypes.c_uint32),
        # Where the object is expected at the frame's instant, in metres in the perspective's frame. The position percept
        # is what the perspective remembers instead.
        ("expected_position_m", ctypes.c_float * 3),
        # Its expected velocity, in metres per second in the perspective's frame.
        ("velocity_m_s", ctypes.c_float * 3),
        # Variance of the expected position along each axis, in square metres; zero if positions are not predicted.
        ("position_variance_m2", ctypes.c_float * 3),
        # Variance of the velocity along each axis, in (m/s)²; zero if positions are not predicted.
        ("velocity_variance_m2_s2", ctypes.c_float * 3),
        # Its percepts, in ascending order of their numbers.
        ("percepts", Remembered * 12),
    ]

    @staticmethod
    def type_name():
        return "leo/Belief/3"


# The beginning of every frame.
class Header(ctypes.Structure):
    _fields_ = [
        # Time stamp of the frame's content, in nanoseconds of the clock.
        ("valid_at_ns", ctypes.c_uint64),
        # Sequence number of the writer's frames, from one without gaps. A gap at the reader means lost frames.
        ("sequence", ctypes.c_uint64),
        # Incarnation of the writer, from one. A change means that the writer restarted and lost its state.
        ("incarnation", ctypes.c_uint64),
        # When the frame or its inputs passed each hop; zero for hops not passed.
        ("hops_ns", ctypes.c_uint64 * 8),
        # Number of entries left out for lack of space, in this frame or its inputs.
        ("over_capacity", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/Header/1"


# Path of a perspective: `[]` is the robot's own, `[1]` is partner 1's as the robot models it. `[1, 0]` is the
# robot's as partner 1 models it, according to the robot.
#
# Consecutive agents differ, and the robot is never first: an agent's model of itself is its own perspective.
class Path(ctypes.Structure):
    _fields_ = [
        ("depth", ctypes.c_uint32),
        ("agents", ctypes.c_uint16 * 6),
    ]

    @staticmethod
    def type_name():
        return "leo/Path/1"


# Head of a belief buffer: the perspective and its coordinate frame.
class BeliefHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # Number of the perspective's buffer: 0 is the robot's own, n is that of partner n. Nested perspectives follow
        # in the order of their paths.
        ("perspective", ctypes.c_uint32),
        # Whether the perspective could perceive at this instant: 1 yes, 0 no. With 0 the partner is absent or their
        # pose unknown, and the beliefs are frozen.
        ("present", ctypes.c_uint32),
        # Position of the perspective's frame in the robot's base frame, in metres.
        ("frame_position_m", ctypes.c_double * 3),
        # Orientation of that frame, quaternion `[x, y, z, w]`.
        ("frame_orientation_xyzw", ctypes.c_double * 4),
        # Position of the perspective's eye in the robot's base frame, in metres.
        ("eye_position_m", ctypes.c_double * 3),
        # Orientation of that eye (x along the line of sight), quaternion `[x, y, z, w]`.
        ("eye_orientation_xyzw", ctypes.c_double * 4),
        # Observations of this instant that the perspective could perceive.
        ("perceivable", ctypes.c_uint32),
        # Observations of this instant that the perspective could not perceive.
        ("hidden", ctypes.c_uint32),
        # Observations refused because of invalid numbers, since the process started.
        ("refused", ctypes.c_uint64),
        # Beliefs created, since the process started.
        ("created", ctypes.c_uint64),
        # Pairs of beliefs merged, since the process started.
        ("merged", ctypes.c_uint64),
        # Beliefs culled, since the process started.
        ("culled", ctypes.c_uint64),
        # Observations dropped since the process started: no belief was free, or the occluder memory was full.
        ("overflowed", ctypes.c_uint64),
        # Path of the perspective.
        ("path", Path),
    ]

    @staticmethod
    def type_name():
        return "leo/BeliefHead/2"


# Histogram of durations in nanoseconds with a relative error of at most 1/16, in the log-linear layout of HDR
# histograms. It is plain memory: recording takes a few instructions, publishing is a copy, and nothing allocates.
class Histogram(ctypes.Structure):
    _fields_ = [
        ("count", ctypes.c_uint64),
        ("max_ns", ctypes.c_uint64),
        ("buckets", ctypes.c_uint32 * 433),
        ("reserved", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name():
        return "leo/Histogram/1"


# Health of one servo bus, counted since this incarnation of the motor process started.
class BusHealth(ctypes.Structure):
    _fields_ = [
        # Its name in the configuration.
        ("name", Text),
        # Joints on it.
        ("joints", ctypes.c_uint64),
        # Joints on it that are quarantined now.
        ("quarantined", ctypes.c_uint64),
        # Whether its serial line is lost now: 1 yes, 0 no.
        ("lost", ctypes.c_uint64),
        # Requests completed.
        ("exchanges", ctypes.c_uint64),
        # Cycles skipped because the bus was still busy with the previous request.
        ("skipped", ctypes.c_uint64),
        # Status packets that did not arrive.
        ("missed", ctypes.c_uint64),
        # Status packets that arrived corrupt.
        ("corrupt", ctypes.c_uint64),
        # Status packets dropped because they were not expected, or because they were sampled too early.
        ("stale", ctypes.c_uint64),
        # Bytes that arrived after the reply timeout.
        ("late_bytes", ctypes.c_uint64),
        # Hardware alerts of its servos.
        ("alerts", ctypes.c_uint64),
        # Unexpected reboots of its servos.
        ("restarts", ctypes.c_uint64),
        # Bus watchdogs of its servos that have tripped.
        ("watchdogs", ctypes.c_uint64),
        # Instructions that a servo rejected with an error number.
        ("refusals", ctypes.c_uint64),
        # Identifiers to which two servos replied.
        ("duplicates", ctypes.c_uint64),
        # Times that its serial line was lost.
        ("hang_ups", ctypes.c_uint64),
        # Duration of the requests, in nanoseconds.
        ("exchange", Histogram),
    ]

    @staticmethod
    def type_name():
        return "leo/BusHealth/2"


# Health of all servo buses. The motor process writes it to its board.
class Buses(ctypes.Structure):
    _fields_ = [
        # Number of buses.
        ("count", ctypes.c_uint64),
        # The buses, in the order of the configuration.
        ("buses", BusHealth * 16),
    ]

    @staticmethod
    def type_name():
        return "leo/Buses/2"


# An entry of a divergence buffer: the differences of two perspectives about one object.
class Difference(ctypes.Structure):
    _fields_ = [
        ("one", ctypes.c_uint64),
        ("other", ctypes.c_uint64),
        ("count", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
        ("aspects", Aspect * 12),
    ]

    @staticmethod
    def type_name():
        return "leo/Difference/1"


# Head of a divergence buffer: the two perspectives compared. Has the same time stamp and sequence number as their
# belief buffers.
class DivergenceHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # The `other` perspective, by the number of its buffers.
        ("perspective", ctypes.c_uint32),
        # The `one` perspective, which the other is nested in; 0 for a partner's.
        ("within", ctypes.c_uint32),
        # Number of objects about which the two agree.
        ("agreed", ctypes.c_uint32),
        # 1 if the two are compared, 0 until the agent of the other perspective is first observed.
        ("compared", ctypes.c_uint32),
        # Path of the other perspective.
        ("path", Path),
    ]

    @staticmethod
    def type_name():
        return "leo/DivergenceHead/1"


# Lockstep: a process has completed its turn.
class Done(ctypes.Structure):
    _fields_ = [
        # The number of the completed turn.
        ("round", ctypes.c_uint64),
        # Whether the process has nothing left to do: 1 yes, 0 no. The simulator ends the lesson.
        ("finished", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/Done/1"


# An event of the learner.
class Event(ctypes.Structure):
    _fields_ = [
        # Posterior probability of a hypothesis within its perspective, in [0, 1].
        ("posterior", ctypes.c_double),
        # An `EventKind`.
        ("kind", ctypes.c_uint16),
        # The perspective it belongs to: 0 the robot's, n partner n's.
        ("perspective", ctypes.c_uint16),
        # Rank of a hypothesis from 1; hypotheses that tie share their rank.
        ("rank", ctypes.c_uint32),
        # Examples that a hypothesis is consistent with.
        ("tally", ctypes.c_uint32),
        # Examples seen.
        ("examples", ctypes.c_uint32),
        # Whether it is a high-likelihood hypothesis: 1 yes, 0 no.
        ("high_likelihood", ctypes.c_uint32),
        # Steps of a performance that succeeded.
        ("succeeded", ctypes.c_uint32),
        # The task that the event is about.
        ("task", Text),
        # The text of the event.
        ("text", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/Event/1"


# Health of one process: the counters of its main loop.
#
# It is on a board in shared memory, so that reading it never blocks the monitored thread.
class Health(ctypes.Structure):
    _fields_ = [
        # The operating system's process id.
        ("pid", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
        # Incarnation of the process, from one.
        ("incarnation", ctypes.c_uint64),
        # Heartbeat: incremented in every iteration of the main loop.
        ("beat", ctypes.c_uint64),
        # Time of the last heartbeat, in nanoseconds of the monotonic clock.
        ("beat_at_ns", ctypes.c_uint64),
        # Start time of this incarnation, in nanoseconds of the monotonic clock.
        ("started_at_ns", ctypes.c_uint64),
        # Configured cycle period; zero for an event-driven process.
        ("period_ns", ctypes.c_uint64),
        # Cycles started.
        ("cycles", ctypes.c_uint64),
        # Cycles that missed their deadline.
        ("overruns", ctypes.c_uint64),
        # Releases skipped because of an overrun; they are not made up for.
        ("skipped", ctypes.c_uint64),
        # Frames lost at the process's subscribers, by gaps of the sequence number.
        ("drops", ctypes.c_uint64),
        # Frames that a publisher could not deliver to some subscriber.
        ("undelivered", ctypes.c_uint64),
        # Frames or entries refused as invalid.
        ("refused", ctypes.c_uint64),
        # Frames refused because their publisher is not on the supervisor's roster.
        ("unlisted_frames", ctypes.c_uint64),
        # Process id of the last such publisher; zero if there was none.
        ("unlisted_pid", ctypes.c_uint64),
        # Failed checks of invariants since the process started; any value above zero is a bug.
        ("broken_invariants", ctypes.c_uint64),
        # Minor and major page faults since the main loop started.
        ("page_faults", ctypes.c_uint64),
        # Rights that were requested and not granted, one bit each: scheduling, affinity, memory.
        ("missing_rights", ctypes.c_uint64),
        # Wake-up latency: from release to start.
        ("wakeup", Histogram),
        # Execution time: from start to end.
        ("execution", Histogram),
        # Age of the input when its step started, measured from its publication by the previous hop.
        ("latency", Histogram),
    ]

    @staticmethod
    def type_name():
        return "leo/Health/3"


# Goal position of one joint, with arrival time.
class JointGoal(ctypes.Structure):
    _fields_ = [
        # The joint: its index in the robot's configuration.
        ("joint", ctypes.c_uint32),
        # Not used; zero.
        ("reserved", ctypes.c_uint32),
        # Goal position, in radians from the joint's zero.
        ("goal_position_rad", ctypes.c_double),
        # Requested arrival time, in nanoseconds of the clock. The motor process moves smoothly, and arrives later if
        # the joint's limits require it.
        ("arrive_at_ns", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/JointGoal/1"


# State of one joint.
class JointState(ctypes.Structure):
    _fields_ = [
        # The joint: its index in the robot's configuration.
        ("joint", ctypes.c_uint32),
        ("mode", ctypes.c_uint16),
        ("cause", ctypes.c_uint16),
        # When the servo was read, in nanoseconds of the clock; zero if never.
        ("sampled_at_ns", ctypes.c_uint64),
        ("present_position_rad", ctypes.c_double),
        ("present_velocity_rad_s", ctypes.c_double),
        ("present_current_a", ctypes.c_double),
        ("command_position_rad", ctypes.c_double),
        ("present_temperature_c", ctypes.c_float),
        ("present_input_v", ctypes.c_float),
        ("link", ctypes.c_uint16),
        ("power", ctypes.c_uint16),
        ("arming", ctypes.c_uint16),
        ("motion", ctypes.c_uint16),
        ("arming_cause", ctypes.c_uint16),
        # Not used; zero.
        ("reserved", ctypes.c_uint16 * 3),
    ]

    @staticmethod
    def type_name():
        return "leo/JointState/3"


# The newest joint states, on a board of the motor process, for occasional readers. Unlike a subscriber to the
# topic, a reader of a board costs the writer no memory.
class Joints(ctypes.Structure):
    _fields_ = [
        # Number of joints.
        ("count", ctypes.c_uint64),
        # Number of times that a joint was locked since the motor process started. An acknowledgement contains the last
        # value read, so that it never covers a newer lock.
        ("locks", ctypes.c_uint64),
        # Goals beyond a joint's limits, which were clamped.
        ("limited", ctypes.c_uint64),
        # Goals refused: not a number, or for an unknown joint.
        ("refused", ctypes.c_uint64),
        # The joint states.
        ("states", JointState * 256),
    ]

    @staticmethod
    def type_name():
        return "leo/Joints/2"


# One incarnation of a process, as recorded by the supervisor.
class Life(ctypes.Structure):
    _fields_ = [
        # Number of the incarnation, from one; zero if the process was never started.
        ("incarnation", ctypes.c_uint64),
        # When the supervisor began to start it, in nanoseconds of the monotonic clock.
        ("began_at_ns", ctypes.c_uint64),
        # When the supervisor detected its end; zero while it runs. Until then its process id is not reused.
        ("ended_at_ns", ctypes.c_uint64),
        # The operating system's process id in the outermost visible namespace; zero while unknown.
        ("pid", ctypes.c_uint32),
        # 1 if the process belongs to this robot on this machine, else 0.
        ("is_member", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name():
        return "leo/Life/1"


# Health of the link to another machine, counted since this incarnation of the link process started. The link
# process writes it to its board. Delays are between the two machines, in nanoseconds.
class LinkHealth(ctypes.Structure):
    _fields_ = [
        # Whether the link to the other machine is up: 1 yes, 0 no.
        ("is_up", ctypes.c_uint64),
        # Number of times that the link came up: once, and once more after each interruption.
        ("sessions", ctypes.c_uint64),
        # The last round-trip time, without the processing time of the other machine.
        ("round_trip_ns", ctypes.c_uint64),
        # Bound on the error of time stamps received over the link, from the uncertainty of the clock offset.
        ("clock_error_ns", ctypes.c_uint64),
        # Frames passed to the network.
        ("sent", ctypes.c_uint64),
        # Frames replaced by a newer one of their topic before they were sent, because the network is slower than their
        # writer.
        ("overtaken", ctypes.c_uint64),
        # Frames dropped while the link was down, because of their age or number.
        ("expired", ctypes.c_uint64),
        # Frames received and published here.
        ("received", ctypes.c_uint64),
        # Batches sent to this machine that did not arrive.
        ("lost", ctypes.c_uint64),
        # Frames and messages of the other machine that were malformed or of another version.
        ("refused", ctypes.c_uint64),
        # Commands that arrived too late to be executed.
        ("late", ctypes.c_uint64),
        # Bytes passed to the network.
        ("bytes_sent", ctypes.c_uint64),
        # Bytes received.
        ("bytes_received", ctypes.c_uint64),
        # One-way delay of batches from the other machine, with an error of at most `Self::clock_error_ns`.
        ("delay", Histogram),
    ]

    @staticmethod
    def type_name():
        return "leo/LinkHealth/1"


# A short name of fixed capacity, UTF-8.
class Name(ctypes.Structure):
    _fields_ = [
        # Its length in bytes.
        ("length", ctypes.c_uint32),
        # Its bytes; those beyond its length are zero.
        ("bytes", ctypes.c_uint8 * 64),
    ]

    @staticmethod
    def type_name():
        return "leo/Name/1"


# An observation of one object by one sensory source at one instant, in the robot's base frame.
#
# An observation carries no object identity; association is the Belief System's task (Berlin et al. 2006, "Belief
# Modeling").
#
# Orientation, half extents, colour and shape are NaN in all components if they were not observed.
class Observation(ctypes.Structure):
    _fields_ = [
        # When the source observed it, in nanoseconds of the clock.
        ("observed_at_ns", ctypes.c_uint64),
        # The sensory source that reported it.
        ("source", ctypes.c_uint16),
        # A `Modality`.
        ("modality", ctypes.c_uint16),
        # An `ObservationKind`.
        ("kind", ctypes.c_uint16),
        # For a person or a hand: which partner (1, 2, …), or 0 for the robot itself; `NOBODY` if the source does not
        # know it.
        ("partner", ctypes.c_uint16),
        # The agent that holds or moves it, or `NOBODY`.
        ("held_by", ctypes.c_uint16),
        # For a person or a hand: the source's own number of a face, a body or a voice that it tracks (1, 2, …); zero for
        # none. The sensor process finds out which partner it is.
        ("detection", ctypes.c_uint16),
        # Confidence of the source, in [0, 1].
        ("confidence", ctypes.c_float),
        # Position in the robot's base frame, in metres.
        ("position_m", ctypes.c_float * 3),
        # Standard deviation of the position along each axis of that frame, in metres; zero if the source states none.
        ("position_sd_m", ctypes.c_float * 3),
        # Orientation in the robot's base frame, quaternion `[x, y, z, w]`; NaN if not observed.
        ("orientation_xyzw", ctypes.c_float * 4),
        # Half extents along the object's own axes, in metres; NaN if not observed.
        ("half_extents_m", ctypes.c_float * 3),
        # Colour, linear red, green and blue in [0, 1]; NaN if not observed.
        ("colour_rgb", ctypes.c_float * 3),
        # Shape descriptor: elongation, flatness, roundness, taper; each in [0, 1]; NaN if not observed.
        ("shape", ctypes.c_float * 4),
        # Degree of each `State`; NaN if the object has no such state.
        ("states", ctypes.c_float * 8),
    ]

    @staticmethod
    def type_name():
        return "leo/Observation/2"


# One percept's evaluation of one observation: p(o) = (m, c, d) (Eq. 1).
class PerceptValue(ctypes.Structure):
    _fields_ = [
        # The percept: its index in the configured set P.
        ("percept", ctypes.c_uint16),
        ("feature_kind", ctypes.c_uint16),
        # Match m in [0, 1].
        ("matching", ctypes.c_float),
        # Confidence c in [0, 1].
        ("confidence", ctypes.c_float),
        ("feature", ctypes.c_float * 4),
    ]

    @staticmethod
    def type_name():
        return "leo/PerceptValue/1"


# The percepts of one observation that passed the threshold (Eq. 2).
class Snapshot(ctypes.Structure):
    _fields_ = [
        ("count", ctypes.c_uint32),
        ("values", PerceptValue * 12),
    ]

    @staticmethod
    def type_name():
        return "leo/Snapshot/1"


# An entry of the percept buffer: an observation and the robot's percept snapshot of it.
#
# It includes the observation, because other perspectives perceive it anew in their own frames (Eq. 7).
class Perceived(ctypes.Structure):
    _fields_ = [
        # The observation.
        ("observation", Observation),
        # The robot's own percept snapshot of it.
        ("snapshot", Snapshot),
    ]

    @staticmethod
    def type_name():
        return "leo/Perceived/1"


# What a percept number in beliefs and snapshots means.
class PerceptDescription(ctypes.Structure):
    _fields_ = [
        # Its unique name in `percepts.toml`.
        ("name", Name),
        # Its `PerceptRole`.
        ("role", ctypes.c_uint16),
        # Its `PerceptKernel`.
        ("kernel", ctypes.c_uint16),
        # The `FeatureKind` of its features; 65535 if a plug-in decides it.
        ("feature_kind", ctypes.c_uint16),
        # The `FeatureUnit` of its features.
        ("unit", ctypes.c_uint16),
        # The number of the percept that gates it; 65535 if there is none.
        ("parent", ctypes.c_uint16),
        # Zero.
        ("reserved", ctypes.c_uint16),
        # The number of its named symbols.
        ("symbol_count", ctypes.c_uint32),
        # Their names, by number. A symbol beyond the count has no name.
        ("symbols", Name * 64),
    ]

    @staticmethod
    def type_name():
        return "leo/PerceptDescription/1"


# Head of a percept buffer: the sources that delivered a frame.
class PerceptHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # Sources that delivered a frame: bit n for source n, the last bit for all beyond.
        ("active_sources", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/PerceptHead/1"


# Counters of one perspective, since this incarnation of the process started.
class PerspectiveHealth(ctypes.Structure):
    _fields_ = [
        # Its path.
        ("path", Path),
        # Number of update steps.
        ("steps", ctypes.c_uint64),
        # Sum over these steps of the number of beliefs after the step.
        ("beliefs", ctypes.c_uint64),
        # Observations, beliefs and occluders dropped for lack of space.
        ("over_capacity", ctypes.c_uint64),
        # Observations and evaluations refused as invalid.
        ("refused", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/PerspectiveHealth/2"


# Counters of all perspectives. The belief process writes them to its board. Without perspective taking there is
# one, the robot's own.
class Perspectives(ctypes.Structure):
    _fields_ = [
        # Number of perspectives.
        ("count", ctypes.c_uint64),
        # The perspectives, by number.
        ("perspectives", PerspectiveHealth * 256),
    ]

    @staticmethod
    def type_name():
        return "leo/Perspectives/2"


# The newest incarnation of each process, as recorded by the supervisor. It determines the board of that
# incarnation's `Health`(crate::Health), and the process that may publish.
class Roster(ctypes.Structure):
    _fields_ = [
        ("lives", Life * 16),
    ]

    @staticmethod
    def type_name():
        return "leo/Roster/3"


# Head of the simulator's scene: progress of the lesson, and pose of the robot in the world.
class SceneHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # Position of the robot's base in the world, in metres.
        ("base_position_m", ctypes.c_double * 3),
        # Orientation of the robot's base in the world, quaternion `[x, y, z, w]`.
        ("base_orientation_xyzw", ctypes.c_double * 4),
        # When the script or the first interactive table began, in nanoseconds of the clock.
        ("began_at_ns", ctypes.c_uint64),
        # A `SceneMode`.
        ("mode", ctypes.c_uint32),
        # Number of the lesson's current table, from 0, or `NO_TABLE`.
        ("table", ctypes.c_uint32),
        # Number of tables of the lesson: the demonstrations, then the novel set if there is one.
        ("tables", ctypes.c_uint32),
        # Number of recorded interactive steps.
        ("steps", ctypes.c_uint32),
        # The open lesson; empty for the one that the robot was started with.
        ("lesson", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/SceneHead/1"


# Ground truth of one object in the simulator, in the world frame.
#
# For visualisation and for checking Leo's actions; no other process of the robot reads it.
class SceneObject(ctypes.Structure):
    _fields_ = [
        # Position in the world, in metres.
        ("position_m", ctypes.c_double * 3),
        # Orientation in the world, quaternion `[x, y, z, w]`.
        ("orientation_xyzw", ctypes.c_double * 4),
        # Half extents along its own axes, in metres.
        ("half_extents_m", ctypes.c_double * 3),
        # Colour, linear red, green and blue in [0, 1].
        ("colour_rgb", ctypes.c_float * 3),
        # Shape descriptor: elongation, flatness, roundness, taper; each in [0, 1].
        ("shape", ctypes.c_float * 4),
        # Degree of each `State`; NaN if the object has no such state.
        ("states", ctypes.c_float * 8),
        # An `ObservationKind`.
        ("kind", ctypes.c_uint16),
        # The agent that holds it, or `NOBODY`.
        ("held_by", ctypes.c_uint16),
        # The partner number of a person, or `NOBODY`.
        ("partner", ctypes.c_uint16),
        # A `ThingRole` of an object; 0 for a person or an occluder.
        ("role", ctypes.c_uint16),
        # Its name in the lesson.
        ("name", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/SceneObject/2"


# Counters of the frames and observations of one source.
class SourceHealth(ctypes.Structure):
    _fields_ = [
        # Its display name.
        ("name", Text),
        # Frames accepted.
        ("frames", ctypes.c_uint64),
        # Observations added to the percept buffer.
        ("observations", ctypes.c_uint64),
        # When a frame was last accepted, in nanoseconds of the clock; zero if never.
        ("last_frame_at_ns", ctypes.c_uint64),
        # Whether it has been silent for longer than its rate allows: 1 yes, 0 no.
        ("silent", ctypes.c_uint64),
        # Number of losses, indexed by `Loss`.
        ("losses", ctypes.c_uint64 * 24),
    ]

    @staticmethod
    def type_name():
        return "leo/SourceHealth/1"


# Counters of all sources. The sensor process writes them to its board.
class Sources(ctypes.Structure):
    _fields_ = [
        # Number of sources.
        ("count", ctypes.c_uint64),
        # The sources, by number.
        ("sources", SourceHealth * 16),
    ]

    @staticmethod
    def type_name():
        return "leo/Sources/1"


# The names of what beliefs refer to by number: percepts, their symbols, and agents.
#
# The belief process writes it to its board once, before its first beliefs. The board's name contains the
# incarnation that the headers of these beliefs contain.
class Symbols(ctypes.Structure):
    _fields_ = [
        # The number of percepts; zero until the board has been written.
        ("percept_count", ctypes.c_uint32),
        # The number of agents: the robot and its partners.
        ("agent_count", ctypes.c_uint32),
        # The percepts, by number.
        ("percepts", PerceptDescription * 12),
        # The names of the agents, by number: 0 the robot, n partner n.
        ("agents", Name * 256),
    ]

    @staticmethod
    def type_name():
        return "leo/Symbols/1"


# An interactive act of a teacher. Positions are in the world frame, in metres.
class TeacherAct(ctypes.Structure):
    _fields_ = [
        # Serial number of the act, from one in each incarnation of the console.
        ("serial", ctypes.c_uint64),
        # Target position: centre of an object or occluder, or the teacher's eyes. Heights of added and put down
        # objects are computed.
        ("position_m", ctypes.c_double * 3),
        # Point that the teacher looks at, for a seat; half extents, for a new occluder.
        ("second_vector_m", ctypes.c_double * 3),
        # Heading, anticlockwise from the world's x axis, in radians; NaN keeps the current heading.
        ("heading_rad", ctypes.c_double),
        # A `TeacherActKind`.
        ("kind", ctypes.c_uint16),
        # The teacher: partner 1, 2, …
        ("teacher", ctypes.c_uint16),
        # Hand on the console; several people may teach at once, each with one hand.
        ("hand", ctypes.c_uint16),
        # Not used; zero.
        ("reserved", ctypes.c_uint16),
        # Number of the table to set up.
        ("table", ctypes.c_uint64),
        # Sentence, name or lesson, depending on the kind.
        ("text", Text),
        # Name of the colour of a new object.
        ("colour", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/TeacherAct/1"


# Lockstep: the conductor gives one process a turn at an instant of simulated time. The header's `valid_at_ns` is
# that instant.
class Turn(ctypes.Structure):
    _fields_ = [
        # A `TurnKind`.
        ("kind", ctypes.c_uint32),
        # Not used; zero.
        ("reserved", ctypes.c_uint32),
        # Number of the turn in the run, from one.
        ("round", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/Turn/1"


# A sentence of a teacher.
class Utterance(ctypes.Structure):
    _fields_ = [
        # The speaker: partner 1, 2, …
        ("speaker", ctypes.c_uint32),
        # The sentence.
        ("text", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/Utterance/1"


# Topics: the head and the entries of a frame.
TOPICS = {
    "observations/<source>": (Header, Observation),
    "scene": (SceneHead, SceneObject),
    "teacher-acts": (Header, TeacherAct),
    "acts-answered": (Header, ActAnswer),
    "utterances": (Header, Utterance),
    "percepts": (PerceptHead, Perceived),
    "beliefs/<perspective>": (BeliefHead, Belief),
    "divergences/<perspective>": (DivergenceHead, Difference),
    "events": (Header, Event),
    "joint-goals": (Header, JointGoal),
    "joint-states": (Header, JointState),
    "turns/<process>": (Header, Turn),
    "turns-done/<process>": (Header, Done),
}

_LAYOUT = [
    (Text, 256, [0, 4]),
    (ActAnswer, 272, [0, 8, 16]),
    (Aspect, 48, [0, 8, 10, 12, 14, 16, 32]),
    (Remembered, 40, [0, 8, 10, 12, 16, 20]),
    (Belief, 568, [0, 8, 16, 24, 32, 34, 36, 40, 52, 64, 76, 88]),
    (Header, 96, [0, 8, 16, 24, 88]),
    (Path, 16, [0, 4]),
    (BeliefHead, 280, [0, 96, 100, 104, 128, 160, 184, 216, 220, 224, 232, 240, 248, 256, 264]),
    (Histogram, 1752, [0, 8, 16, 1748]),
    (BusHealth, 2128, [0, 256, 264, 272, 280, 288, 296, 304, 312, 320, 328, 336, 344, 352, 360, 368, 376]),
    (Buses, 34056, [0, 8]),
    (Difference, 600, [0, 8, 16, 20, 24]),
    (DivergenceHead, 128, [0, 96, 100, 104, 108, 112]),
    (Done, 16, [0, 8]),
    (Event, 544, [0, 8, 10, 12, 16, 20, 24, 28, 32, 288]),
    (Health, 5392, [0, 4, 8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88, 96, 104, 112, 120, 128, 136, 1888, 3640]),
    (JointGoal, 24, [0, 4, 8, 16]),
    (JointState, 72, [0, 4, 6, 8, 16, 24, 32, 40, 48, 52, 56, 58, 60, 62, 64, 66]),
    (Joints, 18464, [0, 8, 16, 24, 32]),
    (Life, 32, [0, 8, 16, 24, 28]),
    (LinkHealth, 1856, [0, 8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88, 96, 104]),
    (Name, 68, [0, 4]),
    (Observation, 136, [0, 8, 10, 12, 14, 16, 18, 20, 24, 36, 48, 64, 76, 88, 104]),
    (PerceptValue, 28, [0, 2, 4, 8, 12]),
    (Snapshot, 340, [0, 4]),
    (Perceived, 480, [0, 136]),
    (PerceptDescription, 4436, [0, 68, 70, 72, 74, 76, 78, 80, 84]),
    (PerceptHead, 104, [0, 96]),
    (PerspectiveHealth, 48, [0, 16, 24, 32, 40]),
    (Perspectives, 12296, [0, 8]),
    (Roster, 512, [0]),
    (SceneHead, 432, [0, 96, 120, 152, 160, 164, 168, 172, 176]),
    (SceneObject, 408, [0, 24, 56, 80, 92, 108, 140, 142, 144, 146, 148]),
    (SourceHealth, 480, [0, 256, 264, 272, 280, 288]),
    (Sources, 7688, [0, 8]),
    (Symbols, 70648, [0, 4, 8, 53240]),
    (TeacherAct, 592, [0, 8, 32, 56, 64, 66, 68, 70, 72, 80, 336]),
    (Turn, 16, [0, 4, 8]),
    (Utterance, 260, [0, 4]),
]

for _type, _size, _places in _LAYOUT:
    _is = [getattr(_type, _name).offset for _name, *_ in _type._fields_]
    if ctypes.sizeof(_type) != _size or _is != _places:
        raise ImportError(f"{_type.type_name()} is laid out otherwise on this machine")
