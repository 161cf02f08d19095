"""What Leo's processes share through memory, for ctypes: made from shared/message by
`LEO_REWRITE=1 cargo test -p message`; do not edit. docs/sources.md says how to use it.

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
LOSSES = 24
TEXT_CAPACITY = 252
DEPTH_MOST = 6


# What the learner reports.
class EventKind(enum.IntEnum):
    # Leo said something; the text is what.
    SAID = 1
    # A lesson about a task began; the text is its name.
    TEACHING_STARTED = 2
    # An action was recognised; the text says whose and what.
    ACTION_SEEN = 3
    # A demonstration ended and became an example; the text is the task's name.
    DEMONSTRATION_ENDED = 4
    # A hypothesis with its posterior, tally and rank; the text is its computed name.
    HYPOTHESIS = 5
    # The primary hypothesis of a task; the text is its computed name.
    RULE_CHOSEN = 6
    # Why the hypotheses of two perspectives differ; the text explains it.
    EXPLAINED = 7
    # Leo began to perform a task; the text is its name.
    PERFORMANCE_STARTED = 8
    # A step of the performance began; the text says which.
    STEP_STARTED = 9
    # A step ended, and the belief of the robot confirms it; the text says which.
    STEP_DONE = 10
    # A step ended without the effect it should have had; the text says why.
    STEP_FAILED = 11
    # The performance ended; the text says with what result.
    PERFORMANCE_ENDED = 12
    # The belief buffer's continuity was broken: its process began anew.
    CONTINUITY_BROKEN = 13
    # What a perspective has before it as a demonstration or a performance begins; the text lists it.
    SEEN = 14
    # Leo was asked to perform a task and does not; the text is what it says about that.
    DECLINED = 15
    # What Leo asked about a task was answered, and the answer became an example; the text is "yes" or "no".
    ANSWERED = 16
    # A movement of somebody's is one of Leo's own; the text says whose, and what he is about to do.
    MOVEMENT_SEEN = 17
    # A task is remembered, and what it comes to follows: told to whoever has just begun to listen.
    REMEMBERED = 18


# A point on the way of a frame, in the direction the data flows.
class Hop(enum.IntEnum):
    # The source published the observations.
    OBSERVED = 0
    # The sensor process began the cycle that read them.
    SENSOR_STARTED = 1
    # The sensor process published the percept buffer.
    PERCEIVED = 2
    # The belief process began its step on it.
    BELIEF_STARTED = 3
    # The belief process published the belief buffers.
    BELIEVED = 4
    # The learner published the joint goals.
    DECIDED = 5
    # The motor process took the joint goals.
    COMMANDED = 6
    # The motor process published the joint states.
    MOVED = 7


# Why a joint is in its mode.
class JointCause(enum.IntEnum):
    # As it should be.
    NONE = 0
    # Not started yet.
    NOT_STARTED = 1
    # No new goals for longer than the command time-out.
    COMMAND_TIMEOUT = 2
    # The servo does not answer.
    SILENT = 3
    # The servo reports a hardware alert.
    ALERT = 4
    # The servo's own bus watchdog tripped.
    WATCHDOG = 5
    # The bus itself is lost.
    BUS_LOST = 6
    # Stopped by order.
    STOPPED = 7
    # The servo refused an instruction, or is another model than the configured one.
    REFUSED = 8
    # Another joint of its group is in trouble: the group stops together.
    GROUP_STOPPED = 9
    # A bus is lost: the body stops together.
    BODY_STOPPED = 10
    # The emergency stop.
    EMERGENCY = 11
    # The servo started anew by itself: its power or its firmware gave way for a moment.
    RESTARTED = 12
    # Two servos answer to one identifier on its bus.
    DUPLICATE_ID = 13
    # The servo is hot or short of voltage: it moves more slowly.
    DERATED = 14
    # The servo answers, and nothing shows that its answers are new: its own clock does not go right.
    UNBELIEVED = 15
    # The joint did not follow its command: something held it, or its servo is too weak.
    BLOCKED = 16
    # It stands further beyond its limits than the tolerance: a slipped horn, a wrong offset, a swapped servo.
    BEYOND_LIMITS = 17


# Whether a joint may move.
class JointLicence(enum.IntEnum):
    # Not until its cause is gone and a person has acknowledged it.
    LOCKED = 0
    # Not until a person arms it.
    DISARMED = 1
    # It may.
    ARMED = 2


# What is known of the connection to a joint's servo.
class JointLink(enum.IntEnum):
    # It has not been asked yet.
    UNKNOWN = 0
    # It is there, and is the configured model; how it is set up is being read or written.
    IDENTIFIED = 1
    # It is set up and read in every cycle.
    ANSWERING = 2
    # It does not answer, or cannot be believed: quarantined, and asked again now and then.
    SILENT = 3
    # Its answers arrive broken: two servos may answer at once.
    DOUBTED = 4


# What the motor process does with a joint.
class JointMode(enum.IntEnum):
    # No torque: the joint hangs free.
    LIMP = 0
    # Being brought up: found, checked, torque not yet on.
    STARTING = 1
    # Following goals.
    FOLLOWING = 2
    # The commander is gone: slowing down.
    DECELERATING = 3
    # Holding the position where it stopped.
    HOLDING = 4
    # Its servo does not answer, or cannot be believed: no goal is sent, it is asked again now and then.
    QUARANTINED = 5
    # Told to switch its torque off, and its servo has not confirmed it yet.
    RELEASING = 6
    # Moving slowly from where torque came on, a little beyond its limits, back within them.
    ALIGNING = 7
    # Moving slowly to its rest pose, before its torque goes off.
    LOWERING = 8


# How a joint moves.
class JointMotion(enum.IntEnum):
    # No goal is sent: it is limp, or its servo stays where it is.
    IDLE = 0
    # Slowly back within its limits.
    ALIGN = 1
    # After goals, no faster than the soft start.
    SOFT = 2
    # After goals.
    TRACK = 3
    # Slowing down to a stop.
    HALT = 4
    # Held at the place where it stopped, for goals to come.
    HOLD = 5
    # Slowly to its rest pose.
    RETREAT = 6


# What is known of the torque of a joint's servo.
class JointPower(enum.IntEnum):
    # Nothing: it may be on.
    UNKNOWN = 0
    # The servo has said that it is off.
    OFF = 1
    # It was found on: another process switched it on.
    FOUND = 2
    # It is being switched on.
    RISING = 3
    # The motor process switched it on, and the servo's bus watchdog is armed.
    ON = 4
    # The servo is told to switch it off, and has not confirmed it.
    CUTTING = 5


# Why something that a source reported did not become a percept. Frames are lost whole for
# the first six reasons, single observations for the others.
class Loss(enum.IntEnum):
    # A newer frame of its source came before the cycle that would have taken it.
    OVERTAKEN = 0
    # It was dropped before the sensor process came to take it: a gap of the sequence.
    MISSED = 1
    # The middleware could not give it to the sensor process.
    UNREADABLE = 2
    # Its number did not grow, or grew by more than a source can have sent.
    MISNUMBERED = 3
    # It bore no stamp of `Hop::Observed`, or one of another time than the present.
    UNSTAMPED = 4
    # A frame was later or much earlier than the present, or not newer than its predecessor.
    UNTIMELY = 5
    # It was later than the present.
    FUTURE = 6
    # It was so old that it says nothing of the present.
    PAST = 7
    # It was not newer than what its source reported in an earlier frame.
    STALE = 8
    # It was of no known kind.
    KIND = 9
    # It was made by no known sense.
    SENSE = 10
    # Its place was no number, or out of reach.
    PLACE = 11
    # Its orientation was no quaternion of norm one.
    ORIENTATION = 12
    # Its extents were no number, negative, or out of reach.
    EXTENTS = 13
    # Its colour or its shape was not in [0, 1].
    LOOK = 14
    # Its confidence was not in [0, 1].
    CONFIDENCE = 15
    # It was of a person who is nobody.
    PERSON = 16
    # There was no room for it.
    LEFT_OUT = 17
    # The degree of a state was neither in [0, 1] nor NaN, which says that the thing has no such state.
    STATE = 18
    # It was of a person of whom there was another one of the same instant in the frame.
    TWICE = 19


# The sense that made an observation.
class Modality(enum.IntEnum):
    # Seen.
    VISION = 1
    # Heard.
    HEARING = 2
    # Felt, or known from one's own joints.
    TOUCH = 3


# What an observation is of.
class ObservationKind(enum.IntEnum):
    # A thing on the table.
    OBJECT = 1
    # A partner, or the robot's own head; the pose is that of the eyes (x along the line of sight).
    PERSON = 2
    # A thing that hides what lies behind it; the extents are those of a box.
    OCCLUDER = 3


# A process of Leo, in the direction the data flows.
class Process(enum.IntEnum):
    # The workspace, the teacher and Leo's body.
    SIMULATOR = 0
    # Observations to percepts.
    SENSOR = 1
    # Percepts to beliefs.
    BELIEF = 2
    # Beliefs to tasks, tasks to joint goals.
    LEARNER = 3
    # The other end of the servo buses.
    MOCK_BUS = 4
    # Joint goals to servos, servos to joint states.
    MOTOR = 5
    # Tells people what happens.
    CONSOLE = 6
    # Starts and watches the others.
    SUPERVISOR = 7
    # Carries frames between this machine and another one.
    LINK = 8


# Where a process is in its life.
class ProcessState(enum.IntEnum):
    # Nothing was written yet.
    ABSENT = 0
    # Opening its ports, locking its memory.
    STARTING = 1
    # In its loop.
    RUNNING = 2
    # Told to stop.
    STOPPING = 3


# Who moves what is on the table.
class SceneMode(enum.IntEnum):
    # The lesson's script is played.
    SCRIPT = 1
    # A teacher sets the table by hand: things come, go and move as he likes.
    SET_UP = 2
    # A teacher teaches by hand: things move, and what he does is written down.
    TEACHING = 3
    # The lesson's script was played to its end; Leo may still be at work.
    OVER = 4


# A discrete state of a thing, observed as a degree in [0, 1].
class State(enum.IntEnum):
    # Its hole holds a peg.
    FILLED = 0
    # It carries a marker.
    MARKED = 1
    # It sits in a hole.
    INSERTED = 2
    # It is switched on.
    ON = 3


# What a teacher does by hand in the simulated workspace.
class TeacherActKind(enum.IntEnum):
    # Says the text.
    SAY = 1
    # Takes the thing that `text` names in his hand.
    TAKE = 2
    # Moves what is in his hand to a place.
    CARRY = 3
    # Lets go what is in his hand, at a place.
    PUT = 4
    # Puts what is in his hand back where it was taken.
    CANCEL = 5
    # Moves his eyes to a place, and looks at another.
    SEAT = 6
    # Goes away.
    LEAVE = 7
    # Comes back.
    RETURN = 8
    # Moves the occluder that `text` names, or puts up a new one.
    SCREEN = 9
    # Lays a new object of the kind `text` and the colour `colour`.
    ADD = 10
    # Takes the object or the occluder that `text` names off the table.
    REMOVE = 11
    # Begins an empty table.
    CLEAR = 12
    # Lays a table of the lesson.
    LAY = 13
    # Opens the lesson that `text` names, and plays it.
    OPEN = 14
    # Plays the open lesson from its beginning.
    PLAY = 15
    # Takes the last act back.
    UNDO = 16
    # Writes what was taught by hand as a lesson of the title `text`.
    SAVE = 17


# What a thing on the table is for.
class ThingRole(enum.IntEnum):
    # To be worked on.
    BLOCK = 1
    # To be put into a hole.
    PEG = 2
    # To mark what it is put onto.
    MARKER = 3


# What a process shall do with its turn.
class TurnKind(enum.IntEnum):
    # One step at the given instant.
    STEP = 1
    # End the process.
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


# What became of an act.
class ActAnswer(ctypes.Structure):
    _fields_ = [
        # The act's serial number.
        ("serial", ctypes.c_uint64),
        # 1 where it was refused, 0 where it was done.
        ("refused", ctypes.c_uint64),
        # Why it was refused; or what came of it: the new object's name, the file that was written.
        ("text", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/ActAnswer/1"


# One percept about which two beliefs in the same thing differ. Places and orientations are in
# the robot's base frame.
class Aspect(ctypes.Structure):
    _fields_ = [
        ("apart", ctypes.c_double),
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
        # When the newest sample behind it was taken, in nanoseconds of the clock.
        ("sampled_at_ns", ctypes.c_uint64),
        # The percept: its index in the configured set P.
        ("percept", ctypes.c_uint16),
        ("feature_kind", ctypes.c_uint16),
        # Match m' in [0, 1].
        ("matching", ctypes.c_float),
        # Confidence c' in [0, 1], decayed since the newest sample.
        ("confidence", ctypes.c_float),
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
        # When it was last perceived.
        ("perceived_at_ns", ctypes.c_uint64),
        # Observations behind it.
        ("observations", ctypes.c_uint64),
        # The agent who last was perceived to hold it at this instant, or `NOBODY`.
        ("held_by", ctypes.c_uint16),
        # The agent to whom the thing belongs in the eyes of this perspective, or `NOBODY` for what is
        # everybody's.
        ("owner", ctypes.c_uint16),
        ("count", ctypes.c_uint32),
        ("percepts", Remembered * 12),
    ]

    @staticmethod
    def type_name():
        return "leo/Belief/2"


# The beginning of every frame.
class Header(ctypes.Structure):
    _fields_ = [
        # The instant that the frame speaks about, in nanoseconds of the clock.
        ("valid_at_ns", ctypes.c_uint64),
        # Counts the writer's frames from one, without gaps: a gap at the reader is a loss.
        ("sequence", ctypes.c_uint64),
        # Counts the writer's lives from one: a change says that its memory began anew.
        ("incarnation", ctypes.c_uint64),
        # When the frame, or what it was made from, passed each hop; zero where it did not.
        ("hops_ns", ctypes.c_uint64 * 8),
        # Entries that did not fit into this frame, or into those it was made from, and were left out.
        ("left_out", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/Header/1"


# Whose perspective it is, and within whose: `[]` is the robot's own, `[1]` what it takes partner 1
# to believe, `[1, 0]` what it takes partner 1 to take the robot to believe.
#
# Nobody stands twice in a row, nor the robot first: what somebody takes himself to believe is
# what he believes.
class Path(ctypes.Structure):
    _fields_ = [
        ("depth", ctypes.c_uint32),
        ("agents", ctypes.c_uint16 * 6),
    ]

    @staticmethod
    def type_name():
        return "leo/Path/1"


# The head of a belief buffer: whose beliefs, and the frame they are in.
class BeliefHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # Which perspective's beliefs, by the number of the buffer: 0 the robot's own, n what it takes
        # partner n to believe, and from there on those nested deeper, in the order of their paths.
        ("perspective", ctypes.c_uint32),
        # Whether the perspective perceived anything possible at this instant: 1 yes, 0 the partner
        # is absent or his pose unknown, and his beliefs are frozen.
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
        # Observations of this instant that it could not.
        ("hidden", ctypes.c_uint32),
        # Observations refused because their numbers were unsound, since the process started.
        ("refused", ctypes.c_uint64),
        # Beliefs created, since the process started.
        ("created", ctypes.c_uint64),
        # Pairs of beliefs merged, since the process started.
        ("merged", ctypes.c_uint64),
        # Beliefs culled, since the process started.
        ("culled", ctypes.c_uint64),
        # Observations dropped because no belief was free, and those of occluders that hide nothing because
        # more stood there at once than are remembered, since the process started.
        ("overflowed", ctypes.c_uint64),
        # Whose beliefs, and within whose.
        ("path", Path),
    ]

    @staticmethod
    def type_name():
        return "leo/BeliefHead/2"


# A distribution of durations in nanoseconds with a bounded relative error of 1/16, in the
# log-linear layout of HDR histograms, as plain memory: recording is a handful of instructions,
# publishing is a copy, and nothing allocates.
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


# How one servo bus fares, since the motor process's life began.
class BusHealth(ctypes.Structure):
    _fields_ = [
        # What the configuration calls it.
        ("name", Text),
        # Joints on it.
        ("joints", ctypes.c_uint64),
        # Joints of it that are quarantined now.
        ("quarantined", ctypes.c_uint64),
        # Whether its line is lost now: 1 yes, 0 no.
        ("lost", ctypes.c_uint64),
        # Requests carried out.
        ("exchanges", ctypes.c_uint64),
        # Cycles in which it was still busy with the request before.
        ("skipped", ctypes.c_uint64),
        # Answers that did not come.
        ("missed", ctypes.c_uint64),
        # Answers that arrived broken.
        ("broken", ctypes.c_uint64),
        # Answers dropped because nobody awaited them, or because they were sampled too early.
        ("stale", ctypes.c_uint64),
        # Bytes that came after their time.
        ("late_bytes", ctypes.c_uint64),
        # Hardware alerts of its servos.
        ("alerts", ctypes.c_uint64),
        # Times that a servo of it began anew by itself.
        ("restarts", ctypes.c_uint64),
        # Bus watchdogs of its servos that were found to have tripped.
        ("watchdogs", ctypes.c_uint64),
        # Instructions that a servo refused by an error number.
        ("refusals", ctypes.c_uint64),
        # Identifiers to which two servos were found to answer.
        ("duplicates", ctypes.c_uint64),
        # Times that its line was lost.
        ("hang_ups", ctypes.c_uint64),
        # How long the requests took, in nanoseconds.
        ("exchange", Histogram),
    ]

    @staticmethod
    def type_name():
        return "leo/BusHealth/2"


# How the servo buses fare: the motor process writes it to a board of its own.
class Buses(ctypes.Structure):
    _fields_ = [
        # How many buses there are.
        ("count", ctypes.c_uint64),
        # Each of them, in the order of the configuration.
        ("buses", BusHealth * 16),
    ]

    @staticmethod
    def type_name():
        return "leo/Buses/2"


# An entry of a divergence buffer: how two perspectives differ about one thing.
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


# The head of a divergence buffer: which two perspectives are compared. Of the same instant and
# number as the belief buffers of both.
class DivergenceHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # The other of the two perspectives, by the number of its buffers.
        ("perspective", ctypes.c_uint32),
        # The one of the two: the perspective that the other is nested in, 0 for a partner's.
        ("within", ctypes.c_uint32),
        # Things about which the two believe the same.
        ("agreed", ctypes.c_uint32),
        # 1 where the two are compared, 0 as long as he whose the other perspective is was not
        # observed yet.
        ("compared", ctypes.c_uint32),
        # Whose the other perspective is, and within whose.
        ("path", Path),
    ]

    @staticmethod
    def type_name():
        return "leo/DivergenceHead/1"


# Lockstep: a process has done its turn.
class Done(ctypes.Structure):
    _fields_ = [
        # The turn that is done.
        ("round", ctypes.c_uint64),
        # Whether the process has nothing left to do: 1 yes, 0 no. The lesson is over when the
        # simulator says so.
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
        # Whose perspective it belongs to: 0 the robot's, n partner n's.
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
        # The task it is about.
        ("task", Text),
        # What it says.
        ("text", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/Event/1"


# The health of one process: what its loop counted, for whoever looks.
#
# It stands on a blackboard in shared memory, so that looking never touches the thread that is
# looked at.
class Health(ctypes.Structure):
    _fields_ = [
        # The operating system's process number.
        ("pid", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
        # Counts the process's lives from one.
        ("incarnation", ctypes.c_uint64),
        # Grows with every turn of the loop: a beat that stands still is a process that hangs.
        ("beat", ctypes.c_uint64),
        # When the beat last grew, in nanoseconds of the monotonic clock.
        ("beat_at_ns", ctypes.c_uint64),
        # When this life began.
        ("started_at_ns", ctypes.c_uint64),
        # Configured period of the cycle; zero for a process that is woken.
        ("period_ns", ctypes.c_uint64),
        # Cycles begun.
        ("cycles", ctypes.c_uint64),
        # Cycles that ended after their deadline.
        ("overruns", ctypes.c_uint64),
        # Releases skipped because a cycle ran past them; never made up.
        ("skipped", ctypes.c_uint64),
        # Frames lost at the process's inlets, by gaps of the sequence.
        ("drops", ctypes.c_uint64),
        # Frames that an outlet could not deliver to some reader.
        ("undelivered", ctypes.c_uint64),
        # Frames or entries refused because they were nonsense.
        ("refused", ctypes.c_uint64),
        # Frames refused because the supervisor's roster does not name the process that published them.
        ("unlisted_frames", ctypes.c_uint64),
        # The process number of the newest such publisher; zero where there was none.
        ("unlisted_pid", ctypes.c_uint64),
        # Page faults since the loop began, minor and major.
        ("page_faults", ctypes.c_uint64),
        # Rights that were asked for and not granted, one bit each: scheduling, affinity, memory.
        ("missing_rights", ctypes.c_uint64),
        # Release to start.
        ("wakeup", Histogram),
        # Start to end.
        ("execution", Histogram),
        # Age of the input when its step began: from the previous hop's publication.
        ("latency", Histogram),
    ]

    @staticmethod
    def type_name():
        return "leo/Health/2"


# Where one joint shall be, and when.
class JointGoal(ctypes.Structure):
    _fields_ = [
        # The joint: its index in the robot's configuration.
        ("joint", ctypes.c_uint32),
        # Not used; zero.
        ("reserved", ctypes.c_uint32),
        # Goal position, in radians from the joint's zero.
        ("goal_position_rad", ctypes.c_double),
        # When it shall be there, in nanoseconds of the clock; the motor process moves smoothly and
        # arrives later where the joint's limits ask for it.
        ("arrive_at_ns", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/JointGoal/1"


# What one joint does.
class JointState(ctypes.Structure):
    _fields_ = [
        # The joint: its index in the robot's configuration.
        ("joint", ctypes.c_uint32),
        ("mode", ctypes.c_uint16),
        ("cause", ctypes.c_uint16),
        # When the servo was read, in nanoseconds of the clock; zero when it never was.
        ("sampled_at_ns", ctypes.c_uint64),
        ("present_position_rad", ctypes.c_double),
        ("present_velocity_rad_s", ctypes.c_double),
        ("present_current_a", ctypes.c_double),
        ("command_position_rad", ctypes.c_double),
        ("present_temperature_c", ctypes.c_float),
        ("present_input_v", ctypes.c_float),
        ("link", ctypes.c_uint16),
        ("power", ctypes.c_uint16),
        ("licence", ctypes.c_uint16),
        ("motion", ctypes.c_uint16),
        ("licence_cause", ctypes.c_uint16),
        # Not used; zero.
        ("reserved", ctypes.c_uint16 * 3),
    ]

    @staticmethod
    def type_name():
        return "leo/JointState/3"


# The newest joint states, for whoever looks now and then: the motor process writes them to a board of
# its own. Who reads a topic is known to its writer, and costs it a page now and then; who reads a board
# is not.
class Joints(ctypes.Structure):
    _fields_ = [
        # How many joints there are.
        ("count", ctypes.c_uint64),
        # How often a joint was locked since the motor process started. An acknowledgement names the newest that
        # was seen, so that it acknowledges no other.
        ("locks", ctypes.c_uint64),
        # Goals beyond a joint's limits, which became the limit.
        ("limited", ctypes.c_uint64),
        # Goals refused: no number, or for no joint.
        ("refused", ctypes.c_uint64),
        # What each of them does.
        ("states", JointState * 256),
    ]

    @staticmethod
    def type_name():
        return "leo/Joints/2"


# One life of a process, as its supervisor knows it.
class Life(ctypes.Structure):
    _fields_ = [
        # Counts the lives of the process from one; zero where it was never started.
        ("incarnation", ctypes.c_uint64),
        # When the supervisor began to start it, in nanoseconds of the monotonic clock.
        ("began_at_ns", ctypes.c_uint64),
        # When the supervisor learned of its end; zero while it lives. No other process has its number before that.
        ("ended_at_ns", ctypes.c_uint64),
        # The operating system's process number, in the outermost namespace that can be seen; zero while it is unknown.
        ("pid", ctypes.c_uint32),
        # 1 where the process is one of this robot on this machine, else 0.
        ("is_member", ctypes.c_uint32),
    ]

    @staticmethod
    def type_name():
        return "leo/Life/1"


# How the link to another machine fares, since the link process's life began: it writes this to a board of
# its own. Delays are between the two machines, in nanoseconds.
class LinkHealth(ctypes.Structure):
    _fields_ = [
        # Whether the other machine is heard now: 1 yes, 0 no.
        ("is_heard", ctypes.c_uint64),
        # How often it came to be heard: once, and once more after each silence.
        ("hearings", ctypes.c_uint64),
        # The newest round trip to the other machine and back, without the time that it took to answer.
        ("round_trip_ns", ctypes.c_uint64),
        # By how much the instants of frames that came over the link are wrong at most: what is not known of the
        # difference between the two machines' clocks.
        ("clock_error_ns", ctypes.c_uint64),
        # Frames that were handed to the network.
        ("sent", ctypes.c_uint64),
        # Frames that were not sent because a newer one of their topic overtook them: the network is slower than
        # their writer.
        ("overtaken", ctypes.c_uint64),
        # Frames that waited for the other machine for too long, or were too many, and were given up.
        ("given_up", ctypes.c_uint64),
        # Frames that came and were published here.
        ("received", ctypes.c_uint64),
        # Bundles of frames that were sent to this machine and did not arrive.
        ("lost", ctypes.c_uint64),
        # Frames and messages from the other machine that were nonsense, or of another version.
        ("refused", ctypes.c_uint64),
        # Commands that came too late to be carried out.
        ("late", ctypes.c_uint64),
        # Bytes that were handed to the network.
        ("bytes_sent", ctypes.c_uint64),
        # Bytes that came.
        ("bytes_received", ctypes.c_uint64),
        # How long bundles of frames took from the other machine to this one, wrong by
        # `Self::clock_error_ns` at most.
        ("delay", Histogram),
    ]

    @staticmethod
    def type_name():
        return "leo/LinkHealth/1"


# What one sensory process reported of one thing at one instant, in the robot's base frame.
#
# An observation carries no identity of the thing: finding out which thing it was is the Belief
# System's work (Berlin et al. 2006, "Belief Modeling").
class Observation(ctypes.Structure):
    _fields_ = [
        # When the sensory process observed it, in nanoseconds of the clock.
        ("observed_at_ns", ctypes.c_uint64),
        # The sensory process that reported it.
        ("source", ctypes.c_uint16),
        # A `Modality`.
        ("modality", ctypes.c_uint16),
        # An `ObservationKind`.
        ("kind", ctypes.c_uint16),
        # For a person: which partner (1, 2, …), or 0 for the robot itself.
        ("partner", ctypes.c_uint16),
        # The agent who holds or moves it, or `NOBODY`.
        ("held_by", ctypes.c_uint16),
        # Not used; zero.
        ("reserved", ctypes.c_uint16),
        # How sure the sensory process is, in [0, 1].
        ("confidence", ctypes.c_float),
        # Position in the robot's base frame, in metres.
        ("position_m", ctypes.c_float * 3),
        # Orientation in the robot's base frame, quaternion `[x, y, z, w]`.
        ("orientation_xyzw", ctypes.c_float * 4),
        # Half the extents along the thing's own axes, in metres.
        ("half_extents_m", ctypes.c_float * 3),
        # Colour, linear red, green and blue in [0, 1].
        ("colour_rgb", ctypes.c_float * 3),
        # Shape descriptor: how elongated, how flat, how round, how tapered; each in [0, 1].
        ("shape", ctypes.c_float * 4),
        # Degree of each `State`; NaN where the thing has no such state.
        ("states", ctypes.c_float * 8),
    ]

    @staticmethod
    def type_name():
        return "leo/Observation/1"


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


# An entry of the percept buffer: an observation and what the robot perceives in it.
#
# The observation travels along because another perspective perceives it anew in its own frame
# (Eq. 7).
class Perceived(ctypes.Structure):
    _fields_ = [
        # What was observed.
        ("observation", Observation),
        # The robot's own percept snapshot of it.
        ("snapshot", Snapshot),
    ]

    @staticmethod
    def type_name():
        return "leo/Perceived/1"


# The head of a percept buffer: who looked.
class PerceptHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # The sources that looked: bit n for source n, the last bit for all beyond.
        ("looked", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/PerceptHead/1"


# What was computed of one perspective, since its process's life began.
class PerspectiveHealth(ctypes.Structure):
    _fields_ = [
        # Whose it is, and within whose.
        ("path", Path),
        # How often its beliefs were brought to an instant.
        ("steps", ctypes.c_uint64),
        # Beliefs that it held after each of these steps, all together.
        ("beliefs", ctypes.c_uint64),
        # Observations, beliefs and occluders for which it had no room.
        ("left_out", ctypes.c_uint64),
        # Observations and evaluations that it refused as nonsense.
        ("refused", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/PerspectiveHealth/2"


# What was computed of each perspective: the belief process writes it to a board of its own. Where
# perspective taking is off there is one, the robot's own.
class Perspectives(ctypes.Structure):
    _fields_ = [
        # How many perspectives there are.
        ("count", ctypes.c_uint64),
        # Each of them, by its number.
        ("perspectives", PerspectiveHealth * 256),
    ]

    @staticmethod
    def type_name():
        return "leo/Perspectives/2"


# Which life of each process is the newest, as the supervisor knows it: the roster names the board on which the
# `Health`(crate::Health) of that life stands, and the process that may publish.
class Roster(ctypes.Structure):
    _fields_ = [
        ("lives", Life * 16),
    ]

    @staticmethod
    def type_name():
        return "leo/Roster/3"


# The head of the simulator's scene: where the lesson is, and the robot in the world.
class SceneHead(ctypes.Structure):
    _fields_ = [
        # The frame's header.
        ("header", Header),
        # Position of the robot's base in the world, in metres.
        ("base_position_m", ctypes.c_double * 3),
        # Orientation of the robot's base in the world, quaternion `[x, y, z, w]`.
        ("base_orientation_xyzw", ctypes.c_double * 4),
        # When the script or the first table laid by hand began, in nanoseconds of the clock.
        ("began_at_ns", ctypes.c_uint64),
        # A `SceneMode`.
        ("mode", ctypes.c_uint32),
        # Which of the lesson's tables is laid, from 0, or `NO_TABLE`.
        ("table", ctypes.c_uint32),
        # Tables of the lesson: the demonstrations, and then the novel set if it has one.
        ("tables", ctypes.c_uint32),
        # Steps taught by hand that are written down.
        ("steps", ctypes.c_uint32),
        # Which lesson is open: empty for the one that the robot was started with.
        ("lesson", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/SceneHead/1"


# What the simulator knows to be true of one thing, in the world frame.
#
# For people who look on, and for checking what Leo did; no other process of the robot reads it.
class SceneObject(ctypes.Structure):
    _fields_ = [
        # Position in the world, in metres.
        ("position_m", ctypes.c_double * 3),
        # Orientation in the world, quaternion `[x, y, z, w]`.
        ("orientation_xyzw", ctypes.c_double * 4),
        # Half the extents along its own axes, in metres.
        ("half_extents_m", ctypes.c_double * 3),
        # Colour, linear red, green and blue in [0, 1].
        ("colour_rgb", ctypes.c_float * 3),
        # How elongated, flat, round and tapered it is, each in [0, 1].
        ("shape", ctypes.c_float * 4),
        # Degree of each `State`; NaN where the thing has no such state.
        ("states", ctypes.c_float * 8),
        # An `ObservationKind`.
        ("kind", ctypes.c_uint16),
        # The agent who holds it, or `NOBODY`.
        ("held_by", ctypes.c_uint16),
        # The partner that a person is, or `NOBODY`.
        ("partner", ctypes.c_uint16),
        # A `ThingRole` of an object; 0 of a person or an occluder.
        ("role", ctypes.c_uint16),
        # Its name in the lesson.
        ("name", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/SceneObject/2"


# What became of what one source reported.
class SourceHealth(ctypes.Structure):
    _fields_ = [
        # What people call it.
        ("name", Text),
        # Frames that were taken.
        ("frames", ctypes.c_uint64),
        # Observations that entered the percept buffer.
        ("observations", ctypes.c_uint64),
        # When a frame was taken last, in nanoseconds of the clock; zero where none was.
        ("heard_at_ns", ctypes.c_uint64),
        # Whether it has been silent for longer than its rate lets expect: 1 yes, 0 no.
        ("silent", ctypes.c_uint64),
        # What was lost, by the number of the `Loss`.
        ("losses", ctypes.c_uint64 * 24),
    ]

    @staticmethod
    def type_name():
        return "leo/SourceHealth/1"


# What became of what each source reported: the sensor process writes it to a board of its own.
class Sources(ctypes.Structure):
    _fields_ = [
        # How many sources there are.
        ("count", ctypes.c_uint64),
        # Each of them, by its number.
        ("sources", SourceHealth * 16),
    ]

    @staticmethod
    def type_name():
        return "leo/Sources/1"


# Something that a teacher does by hand. Places are in the world, in metres.
class TeacherAct(ctypes.Structure):
    _fields_ = [
        # Counts the acts of the console's life from one.
        ("serial", ctypes.c_uint64),
        # Where: of a thing's or an occluder's centre, or of his eyes. The height of something new is its
        # own, and that of something put down follows from what is below.
        ("position_m", ctypes.c_double * 3),
        # What he looks at, of a seat; half the extents, of a new occluder.
        ("also_m", ctypes.c_double * 3),
        # Heading, anticlockwise from the world's x axis, in radians; NaN to leave it as it is.
        ("heading_rad", ctypes.c_double),
        # A `TeacherActKind`.
        ("kind", ctypes.c_uint16),
        # Who: partner 1, 2, …
        ("teacher", ctypes.c_uint16),
        # Whose hand on the console: several people may teach at once, each with one hand.
        ("hand", ctypes.c_uint16),
        # Zero.
        ("reserved", ctypes.c_uint16),
        # Which table, of laying.
        ("table", ctypes.c_uint64),
        # What is said, named or opened.
        ("text", Text),
        # The colour's name, of something new.
        ("colour", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/TeacherAct/1"


# Lockstep: the conductor gives one process its turn at an instant of simulated time. The
# header's `valid_at_ns` is that instant.
class Turn(ctypes.Structure):
    _fields_ = [
        # A `TurnKind`.
        ("kind", ctypes.c_uint32),
        # Not used; zero.
        ("reserved", ctypes.c_uint32),
        # Counts the turns of the run from one.
        ("round", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name():
        return "leo/Turn/1"


# A sentence that somebody said.
class Utterance(ctypes.Structure):
    _fields_ = [
        # Who said it: partner 1, 2, …
        ("speaker", ctypes.c_uint32),
        # What was said.
        ("text", Text),
    ]

    @staticmethod
    def type_name():
        return "leo/Utterance/1"


_LAYOUT = [
    (Text, 256, [0, 4]),
    (ActAnswer, 272, [0, 8, 16]),
    (Aspect, 48, [0, 8, 10, 12, 14, 16, 32]),
    (Remembered, 40, [0, 8, 10, 12, 16, 20]),
    (Belief, 520, [0, 8, 16, 24, 32, 34, 36, 40]),
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
    (Health, 5384, [0, 4, 8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88, 96, 104, 112, 120, 128, 1880, 3632]),
    (JointGoal, 24, [0, 4, 8, 16]),
    (JointState, 72, [0, 4, 6, 8, 16, 24, 32, 40, 48, 52, 56, 58, 60, 62, 64, 66]),
    (Joints, 18464, [0, 8, 16, 24, 32]),
    (Life, 32, [0, 8, 16, 24, 28]),
    (LinkHealth, 1856, [0, 8, 16, 24, 32, 40, 48, 56, 64, 72, 80, 88, 96, 104]),
    (Observation, 128, [0, 8, 10, 12, 14, 16, 18, 20, 24, 36, 52, 64, 76, 92]),
    (PerceptValue, 28, [0, 2, 4, 8, 12]),
    (Snapshot, 340, [0, 4]),
    (Perceived, 472, [0, 128]),
    (PerceptHead, 104, [0, 96]),
    (PerspectiveHealth, 48, [0, 16, 24, 32, 40]),
    (Perspectives, 12296, [0, 8]),
    (Roster, 512, [0]),
    (SceneHead, 432, [0, 96, 120, 152, 160, 164, 168, 172, 176]),
    (SceneObject, 408, [0, 24, 56, 80, 92, 108, 140, 142, 144, 146, 148]),
    (SourceHealth, 480, [0, 256, 264, 272, 280, 288]),
    (Sources, 7688, [0, 8]),
    (TeacherAct, 592, [0, 8, 32, 56, 64, 66, 68, 70, 72, 80, 336]),
    (Turn, 16, [0, 4, 8]),
    (Utterance, 260, [0, 4]),
]

for _type, _size, _places in _LAYOUT:
    _is = [getattr(_type, _name).offset for _name, *_ in _type._fields_]
    if ctypes.sizeof(_type) != _size or _is != _places:
        raise ImportError(f"{_type.type_name()} is laid out otherwise on this machine")
