/* What Leo's processes share through memory, for C and C++: made from shared/message by
 * `LEO_REWRITE=1 cargo test -p leo-message`; do not edit. docs/sources.md and docs/beliefs.md say how to use it.
 *
 * A topic is an iceoryx2 publish-subscribe service whose payload is a slice of entries and whose
 * user header is the head. The types are known by the names that the macros ..._TYPE hold. */
#ifndef LEO_MESSAGES_H
#define LEO_MESSAGES_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define LEO_ASSERT(holds, text) static_assert(holds, text)
/* The C++ binding of iceoryx2 finds the name here. */
#define LEO_NAMED(name) static constexpr const char *IOX2_TYPE_NAME = name;
#else
#define LEO_ASSERT(holds, text) _Static_assert(holds, text)
#define LEO_NAMED(name)
#endif

#define LEO_NOBODY 65535
#define LEO_STATES 8
#define LEO_MAX_PERCEPTS 12
#define LEO_MAX_BUSES 16
#define LEO_MAX_JOINTS 256
#define LEO_MAX_PERSPECTIVES 256
#define LEO_MAX_SOURCES 16
#define LEO_MAX_SYMBOLS 64
#define LEO_LOSSES 24
#define LEO_TEXT_CAPACITY 252
#define LEO_NAME_CAPACITY 64
#define LEO_MAX_DEPTH 6

/* Topics. A frame is the head and a slice of entries. */
/* `observations/<source>`: struct leo_header, struct leo_observation */
#define LEO_TOPIC_OBSERVATIONS "observations"
/* `scene`: struct leo_scene_head, struct leo_scene_object */
#define LEO_TOPIC_SCENE "scene"
/* `teacher-acts`: struct leo_header, struct leo_teacher_act */
#define LEO_TOPIC_TEACHER_ACTS "teacher-acts"
/* `acts-answered`: struct leo_header, struct leo_act_answer */
#define LEO_TOPIC_ACTS_ANSWERED "acts-answered"
/* `utterances`: struct leo_header, struct leo_utterance */
#define LEO_TOPIC_UTTERANCES "utterances"
/* `percepts`: struct leo_percept_head, struct leo_perceived */
#define LEO_TOPIC_PERCEPTS "percepts"
/* `beliefs/<perspective>`: struct leo_belief_head, struct leo_belief */
#define LEO_TOPIC_BELIEFS "beliefs"
/* `divergences/<perspective>`: struct leo_divergence_head, struct leo_difference */
#define LEO_TOPIC_DIVERGENCES "divergences"
/* `events`: struct leo_header, struct leo_event */
#define LEO_TOPIC_EVENTS "events"
/* `joint-goals`: struct leo_header, struct leo_joint_goal */
#define LEO_TOPIC_JOINT_GOALS "joint-goals"
/* `joint-states`: struct leo_header, struct leo_joint_state */
#define LEO_TOPIC_JOINT_STATES "joint-states"
/* `turns/<process>`: struct leo_header, struct leo_turn */
#define LEO_TOPIC_TURNS "turns"
/* `turns-done/<process>`: struct leo_header, struct leo_done */
#define LEO_TOPIC_TURNS_DONE "turns-done"

/* Kind of an event of the learner. */
enum leo_event_kind {
    /* Leo said something; the text is the sentence. */
    LEO_EVENT_KIND_SAID = 1,
    /* A lesson about a task began; the text is its name. */
    LEO_EVENT_KIND_TEACHING_STARTED = 2,
    /* An action was recognised; the text names actor and action. */
    LEO_EVENT_KIND_ACTION_SEEN = 3,
    /* A demonstration ended and became an example; the text is the task's name. */
    LEO_EVENT_KIND_DEMONSTRATION_ENDED = 4,
    /* A hypothesis with its posterior, tally and rank; the text is its computed name. */
    LEO_EVENT_KIND_HYPOTHESIS = 5,
    /* The primary hypothesis of a task was chosen; the text is its computed name. */
    LEO_EVENT_KIND_RULE_CHOSEN = 6,
    /* Why the hypotheses of two perspectives differ; the text explains it. */
    LEO_EVENT_KIND_EXPLAINED = 7,
    /* Leo began to perform a task; the text is its name. */
    LEO_EVENT_KIND_PERFORMANCE_STARTED = 8,
    /* A step of the performance began; the text names it. */
    LEO_EVENT_KIND_STEP_STARTED = 9,
    /* A step ended, and the robot's beliefs confirm it; the text names it. */
    LEO_EVENT_KIND_STEP_DONE = 10,
    /* A step ended without its expected effect; the text gives the reason. */
    LEO_EVENT_KIND_STEP_FAILED = 11,
    /* The performance ended; the text gives the result. */
    LEO_EVENT_KIND_PERFORMANCE_ENDED = 12,
    /* The continuity of the belief buffer was broken, because its process restarted. */
    LEO_EVENT_KIND_CONTINUITY_BROKEN = 13,
    /* The objects in a perspective when a demonstration or a performance begins; the text lists them. */
    LEO_EVENT_KIND_SEEN = 14,
    /* Leo refused to perform a task; the text is its reply. */
    LEO_EVENT_KIND_DECLINED = 15,
    /* Leo's question about a task was answered, and the answer became an example; the text is "yes" or "no". */
    LEO_EVENT_KIND_ANSWERED = 16,
    /* An agent's movement matched one of Leo's own movements; the text names agent and expected action. */
    LEO_EVENT_KIND_MOVEMENT_SEEN = 17,
    /* A task from memory, followed by its hypotheses; sent to new subscribers. */
    LEO_EVENT_KIND_REMEMBERED = 18,
    /* A teacher said something about a task's rule, and the sentence became an example; the text is what Leo understood. */
    LEO_EVENT_KIND_TOLD = 19,
    /* A task has another name now: the text. */
    LEO_EVENT_KIND_RENAMED = 20,
    /* A task was forgotten; the text is its name. */
    LEO_EVENT_KIND_FORGOTTEN = 21,
};

/* The kind of a feature, and so the meaning of its four numbers in shared memory. */
enum leo_feature_kind {
    /* No feature: the percept only classifies. */
    LEO_FEATURE_KIND_NONE = 0,
    /* A symbol: the first number is its index. */
    LEO_FEATURE_KIND_SYMBOL = 1,
    /* A number: the first. */
    LEO_FEATURE_KIND_NUMBER = 2,
    /* A position in the frame of the perspective, or extents: the first three numbers, in metres. */
    LEO_FEATURE_KIND_VECTOR = 3,
    /* An orientation in the frame of the perspective: a quaternion `[x, y, z, w]`. */
    LEO_FEATURE_KIND_ORIENTATION = 4,
};

/* The unit of a feature's numbers. */
enum leo_feature_unit {
    /* None: a symbol, a degree, a quaternion, or the feature of a plug-in. */
    LEO_FEATURE_UNIT_NONE = 0,
    /* Metres. */
    LEO_FEATURE_UNIT_METRES = 1,
};

/* A stage that a frame passes, in the direction of the data flow. */
enum leo_hop {
    /* The source published the observations. */
    LEO_HOP_OBSERVED = 0,
    /* The sensor process started the cycle that read them. */
    LEO_HOP_SENSOR_STARTED = 1,
    /* The sensor process published the percept buffer. */
    LEO_HOP_PERCEIVED = 2,
    /* The belief process started its step on the percepts. */
    LEO_HOP_BELIEF_STARTED = 3,
    /* The belief process published the belief buffers. */
    LEO_HOP_BELIEVED = 4,
    /* The learner published the joint goals. */
    LEO_HOP_DECIDED = 5,
    /* The motor process received the joint goals. */
    LEO_HOP_COMMANDED = 6,
    /* The motor process published the joint states. */
    LEO_HOP_MOVED = 7,
};

/* Arming state of a joint. */
enum leo_joint_arming {
    /* May not move until its cause is gone and an operator has acknowledged it. */
    LEO_JOINT_ARMING_LOCKED = 0,
    /* May not move until an operator arms it. */
    LEO_JOINT_ARMING_DISARMED = 1,
    /* May move. */
    LEO_JOINT_ARMING_ARMED = 2,
};

/* Cause of a joint's mode. */
enum leo_joint_cause {
    /* Normal operation. */
    LEO_JOINT_CAUSE_NONE = 0,
    /* Not started yet. */
    LEO_JOINT_CAUSE_NOT_STARTED = 1,
    /* No new goals within the command timeout. */
    LEO_JOINT_CAUSE_COMMAND_TIMEOUT = 2,
    /* The servo does not reply. */
    LEO_JOINT_CAUSE_SILENT = 3,
    /* The servo reports a hardware alert. */
    LEO_JOINT_CAUSE_ALERT = 4,
    /* The servo's bus watchdog tripped. */
    LEO_JOINT_CAUSE_WATCHDOG = 5,
    /* The bus is lost. */
    LEO_JOINT_CAUSE_BUS_LOST = 6,
    /* Stopped by command. */
    LEO_JOINT_CAUSE_STOPPED = 7,
    /* The servo rejected an instruction, or is not the configured model. */
    LEO_JOINT_CAUSE_REFUSED = 8,
    /* Another joint of its group failed, and the group stops together. */
    LEO_JOINT_CAUSE_GROUP_STOPPED = 9,
    /* A bus is lost, and the whole body stops together. */
    LEO_JOINT_CAUSE_BODY_STOPPED = 10,
    /* The emergency stop. */
    LEO_JOINT_CAUSE_EMERGENCY = 11,
    /* The servo rebooted by itself, because of its power supply or firmware. */
    LEO_JOINT_CAUSE_RESTARTED = 12,
    /* Two servos reply to the same identifier on its bus. */
    LEO_JOINT_CAUSE_DUPLICATE_ID = 13,
    /* The servo is hot or its voltage low, so its speed is reduced. */
    LEO_JOINT_CAUSE_DERATED = 14,
    /* The servo replies, but its clock does not advance correctly. So its replies may be outdated. */
    LEO_JOINT_CAUSE_STALE = 15,
    /* The joint did not follow its command: it was blocked, or its servo is too weak. */
    LEO_JOINT_CAUSE_BLOCKED = 16,
    /* Further beyond its limits than the tolerance: a slipped horn, a wrong offset, or a swapped servo. */
    LEO_JOINT_CAUSE_BEYOND_LIMITS = 17,
};

/* State of the connection to a joint's servo. */
enum leo_joint_link {
    /* Not contacted yet. */
    LEO_JOINT_LINK_UNKNOWN = 0,
    /* Found, and of the configured model; its settings are being read or written. */
    LEO_JOINT_LINK_IDENTIFIED = 1,
    /* Configured, and read in every cycle. */
    LEO_JOINT_LINK_ANSWERING = 2,
    /* Quarantined, and probed at intervals: it does not reply, or its replies are not trusted. */
    LEO_JOINT_LINK_SILENT = 3,
    /* Its replies arrive corrupt: two servos may reply at the same time. */
    LEO_JOINT_LINK_CORRUPT = 4,
};

/* Mode of a joint in the motor process. */
enum leo_joint_mode {
    /* Torque off: the joint moves freely. */
    LEO_JOINT_MODE_LIMP = 0,
    /* Being initialised: found and checked, torque still off. */
    LEO_JOINT_MODE_STARTING = 1,
    /* Following goals. */
    LEO_JOINT_MODE_FOLLOWING = 2,
    /* No goals arrive any more: decelerating. */
    LEO_JOINT_MODE_DECELERATING = 3,
    /* Holding the position where it stopped. */
    LEO_JOINT_MODE_HOLDING = 4,
    /* The servo does not reply, or its replies are not trusted. No goal is sent; it is probed at intervals. */
    LEO_JOINT_MODE_QUARANTINED = 5,
    /* Torque off was commanded, but the servo has not confirmed it. */
    LEO_JOINT_MODE_RELEASING = 6,
    /* Moving slowly back within its limits, which it slightly exceeded when torque was switched on. */
    LEO_JOINT_MODE_ALIGNING = 7,
    /* Moving slowly to its rest pose before torque is switched off. */
    LEO_JOINT_MODE_LOWERING = 8,
};

/* Motion state of a joint. */
enum leo_joint_motion {
    /* No goal is sent: torque is off, or its servo keeps its position. */
    LEO_JOINT_MOTION_IDLE = 0,
    /* Moving slowly back within its limits. */
    LEO_JOINT_MOTION_ALIGN = 1,
    /* Following goals with the speed limit of the soft start. */
    LEO_JOINT_MOTION_SOFT_START = 2,
    /* Following goals. */
    LEO_JOINT_MOTION_TRACK = 3,
    /* Decelerating to a stop. */
    LEO_JOINT_MOTION_DECELERATE = 4,
    /* Holding the position where it stopped, ready for new goals. */
    LEO_JOINT_MOTION_HOLD = 5,
    /* Moving slowly to its rest pose. */
    LEO_JOINT_MOTION_LOWER = 6,
};

/* State of the torque of a joint's servo. */
enum leo_joint_power {
    /* Unknown: it may be on. */
    LEO_JOINT_POWER_UNKNOWN = 0,
    /* The servo has confirmed that it is off. */
    LEO_JOINT_POWER_OFF = 1,
    /* Found on at start-up: another process switched it on. */
    LEO_JOINT_POWER_FOUND = 2,
    /* Being switched on. */
    LEO_JOINT_POWER_SWITCHING_ON = 3,
    /* On, and the servo's bus watchdog is armed. */
    LEO_JOINT_POWER_ON = 4,
    /* Being switched off, not confirmed by the servo yet. */
    LEO_JOINT_POWER_SWITCHING_OFF = 5,
};

/* Why an observation of a source did not become a percept. The first six reasons concern whole frames, the
 * others single observations. */
enum leo_loss {
    /* A newer frame of its source arrived before the cycle that would have processed it. */
    LEO_LOSS_OVERTAKEN = 0,
    /* Dropped before the sensor process received it: a gap of the sequence number. */
    LEO_LOSS_MISSED = 1,
    /* The middleware could not deliver it to the sensor process. */
    LEO_LOSS_UNREADABLE = 2,
    /* Its sequence number did not increase, or increased by more than a source can have sent. */
    LEO_LOSS_MISNUMBERED = 3,
    /* The stamp of `Hop::Observed` is missing, or not of the present time. */
    LEO_LOSS_UNSTAMPED = 4,
    /* The frame's time stamp is in the future, too old, or not newer than the previous one. */
    LEO_LOSS_UNTIMELY = 5,
    /* Its time stamp is in the future. */
    LEO_LOSS_FUTURE = 6,
    /* It is too old to be useful. */
    LEO_LOSS_PAST = 7,
    /* It is not newer than its source's earlier frames. */
    LEO_LOSS_STALE = 8,
    /* Its kind is unknown. */
    LEO_LOSS_KIND = 9,
    /* Its modality is unknown. */
    LEO_LOSS_MODALITY = 10,
    /* Its position is not finite, or out of range. */
    LEO_LOSS_POSITION = 11,
    /* Its orientation is not a unit quaternion, or a person or an occluder has none. */
    LEO_LOSS_ORIENTATION = 12,
    /* Its extents are negative, out of range or observed in part, or an occluder has none. */
    LEO_LOSS_EXTENTS = 13,
    /* Its colour or shape is not in [0, 1], or was observed in part. */
    LEO_LOSS_APPEARANCE = 14,
    /* Its confidence is not in [0, 1]. */
    LEO_LOSS_CONFIDENCE = 15,
    /* It is of a person, but names no person. */
    LEO_LOSS_PERSON = 16,
    /* The buffer was full. */
    LEO_LOSS_OVER_CAPACITY = 17,
    /* The degree of a state is neither in [0, 1] nor NaN, which means that the object has no such state. */
    LEO_LOSS_STATE = 18,
    /* Another observation of the same person at the same instant is in the frame. */
    LEO_LOSS_DUPLICATE = 19,
    /* It is a detection of a person, and no partner is probable enough. */
    LEO_LOSS_UNIDENTIFIED = 20,
};

/* The sense that made an observation. */
enum leo_modality {
    /* Seen. */
    LEO_MODALITY_VISION = 1,
    /* Heard. */
    LEO_MODALITY_HEARING = 2,
    /* Felt, or known from the robot's own joints. */
    LEO_MODALITY_TOUCH = 3,
};

/* Kind of the observed object. */
enum leo_observation_kind {
    /* An object on the table. */
    LEO_OBSERVATION_KIND_OBJECT = 1,
    /* A partner, or the robot's own head; the pose is that of the eyes (x along the line of sight). */
    LEO_OBSERVATION_KIND_PERSON = 2,
    /* An object that hides what is behind it; the extents are those of a box. */
    LEO_OBSERVATION_KIND_OCCLUDER = 3,
    /* A hand of an agent; the position is that of the palm. What the agent holds moves with it. */
    LEO_OBSERVATION_KIND_HAND = 4,
};

/* The classifier of a percept. */
enum leo_percept_kernel {
    /* The position, in the frame of the perspective. */
    LEO_PERCEPT_KERNEL_POSITION = 0,
    /* The orientation, in the frame of the perspective. */
    LEO_PERCEPT_KERNEL_ORIENTATION = 1,
    /* Half the extents along the object's own axes. */
    LEO_PERCEPT_KERNEL_EXTENTS = 2,
    /* The number of the source that observed the object. */
    LEO_PERCEPT_KERNEL_SOURCE = 3,
    /* The degree of a state, from 0 to 1. */
    LEO_PERCEPT_KERNEL_STATE = 4,
    /* The nearest prototype of shape. */
    LEO_PERCEPT_KERNEL_NEAREST_SHAPE = 5,
    /* The nearest prototype of colour. */
    LEO_PERCEPT_KERNEL_NEAREST_COLOUR = 6,
    /* The nearest prototype of size. */
    LEO_PERCEPT_KERNEL_NEAREST_SIZE = 7,
    /* 1 inside a box of the perspective's frame, 0 outside. */
    LEO_PERCEPT_KERNEL_REGION = 8,
    /* The degree to which a number of the parent's feature is within limits, from 0 to 1. */
    LEO_PERCEPT_KERNEL_RANGE = 9,
    /* A classifier of the program itself. */
    LEO_PERCEPT_KERNEL_PLUGIN = 10,
};

/* The role of a percept in goal beliefs. */
enum leo_percept_role {
    /* It selects the objects that are meant. */
    LEO_PERCEPT_ROLE_CRITERIA = 0,
    /* It describes the state that the objects are to reach. */
    LEO_PERCEPT_ROLE_EXPECTATION = 1,
    /* Goal beliefs ignore it. */
    LEO_PERCEPT_ROLE_NEITHER = 2,
};

/* A process of Leo, in the direction of the data flow. Its name is also its subcommand. */
enum leo_process {
    /* Simulates the workspace, the teacher and Leo's body. */
    LEO_PROCESS_SIMULATOR = 0,
    /* Turns observations into percepts. */
    LEO_PROCESS_SENSOR = 1,
    /* Turns percepts into beliefs. */
    LEO_PROCESS_BELIEF = 2,
    /* Learns tasks from beliefs, and turns tasks into joint goals. */
    LEO_PROCESS_LEARNER = 3,
    /* Simulates the servos at the other end of the buses. */
    LEO_PROCESS_MOCK_BUS = 4,
    /* Sends joint goals to servos and publishes joint states. */
    LEO_PROCESS_MOTOR = 5,
    /* Serves the page, and reports events to people. */
    LEO_PROCESS_CONSOLE = 6,
    /* Starts and monitors the other processes. */
    LEO_PROCESS_SUPERVISOR = 7,
    /* Transfers frames between this machine and another one. */
    LEO_PROCESS_LINK = 8,
};

/* State of a process. */
enum leo_process_state {
    /* The board has not been written yet. */
    LEO_PROCESS_STATE_ABSENT = 0,
    /* Opening its ports and locking its memory. */
    LEO_PROCESS_STATE_STARTING = 1,
    /* In its main loop. */
    LEO_PROCESS_STATE_RUNNING = 2,
    /* Received a stop request. */
    LEO_PROCESS_STATE_STOPPING = 3,
};

/* Mode of the simulated lesson. */
enum leo_scene_mode {
    /* The lesson's script is played. */
    LEO_SCENE_MODE_SCRIPT = 1,
    /* A teacher sets up the table interactively: objects may be added, removed and moved freely. */
    LEO_SCENE_MODE_SET_UP = 2,
    /* A teacher teaches interactively: objects are moved, and the steps are recorded. */
    LEO_SCENE_MODE_TEACHING = 3,
    /* The lesson's script has ended; Leo may still be performing. */
    LEO_SCENE_MODE_OVER = 4,
};

/* A discrete state of an object, observed as a degree in [0, 1]. */
enum leo_state {
    /* Its hole holds a peg. */
    LEO_STATE_FILLED = 0,
    /* It carries a marker. */
    LEO_STATE_MARKED = 1,
    /* It sits in a hole. */
    LEO_STATE_INSERTED = 2,
    /* It is switched on. */
    LEO_STATE_ON = 3,
};

/* Kind of an interactive act of a teacher in the simulated workspace. */
enum leo_teacher_act_kind {
    /* Says the text. */
    LEO_TEACHER_ACT_KIND_SAY = 1,
    /* Takes the object named by `text` in hand. */
    LEO_TEACHER_ACT_KIND_TAKE = 2,
    /* Moves the object in hand to a position. */
    LEO_TEACHER_ACT_KIND_CARRY = 3,
    /* Puts the object in hand down at a position. */
    LEO_TEACHER_ACT_KIND_PUT = 4,
    /* Returns the object in hand to where it was taken. */
    LEO_TEACHER_ACT_KIND_CANCEL = 5,
    /* Moves the teacher's eyes to a position, and directs their gaze to another. */
    LEO_TEACHER_ACT_KIND_SEAT = 6,
    /* Leaves the workspace. */
    LEO_TEACHER_ACT_KIND_LEAVE = 7,
    /* Returns to the workspace. */
    LEO_TEACHER_ACT_KIND_RETURN = 8,
    /* Moves the occluder named by `text`, or creates a new one. */
    LEO_TEACHER_ACT_KIND_SCREEN = 9,
    /* Adds a new object of the kind `text` and the colour `colour`. */
    LEO_TEACHER_ACT_KIND_ADD = 10,
    /* Removes the object or occluder named by `text`. */
    LEO_TEACHER_ACT_KIND_REMOVE = 11,
    /* Starts with an empty table. */
    LEO_TEACHER_ACT_KIND_CLEAR = 12,
    /* Sets up a table of the lesson. */
    LEO_TEACHER_ACT_KIND_LAY = 13,
    /* Opens the lesson named by `text`, and plays it. */
    LEO_TEACHER_ACT_KIND_OPEN = 14,
    /* Restarts the open lesson. */
    LEO_TEACHER_ACT_KIND_PLAY = 15,
    /* Undoes the last act. */
    LEO_TEACHER_ACT_KIND_UNDO = 16,
    /* Saves the interactive lesson with the title `text`. */
    LEO_TEACHER_ACT_KIND_SAVE = 17,
};

/* Role of an object on the table. */
enum leo_thing_role {
    /* A block to work on. */
    LEO_THING_ROLE_BLOCK = 1,
    /* A peg, to be inserted into a hole. */
    LEO_THING_ROLE_PEG = 2,
    /* A marker, to be put onto an object. */
    LEO_THING_ROLE_MARKER = 3,
};

/* Kind of a turn. */
enum leo_turn_kind {
    /* Make one step at the given instant. */
    LEO_TURN_KIND_STEP = 1,
    /* Exit the process. */
    LEO_TURN_KIND_STOP = 2,
};

/* A short text of fixed capacity, UTF-8. */
#define LEO_TEXT_TYPE "leo/Text/1"
struct leo_text {
    LEO_NAMED(LEO_TEXT_TYPE)
    uint32_t length;
    uint8_t bytes[252];
};
LEO_ASSERT(sizeof(struct leo_text) == 256, "size of leo/Text/1");
LEO_ASSERT(offsetof(struct leo_text, length) == 0, "place of length");
LEO_ASSERT(offsetof(struct leo_text, bytes) == 4, "place of bytes");

/* Result of an act. */
#define LEO_ACT_ANSWER_TYPE "leo/ActAnswer/1"
struct leo_act_answer {
    LEO_NAMED(LEO_ACT_ANSWER_TYPE)
    /* The act's serial number. */
    uint64_t serial;
    /* 1 if the act was refused, 0 if it was done. */
    uint64_t refused;
    /* Reason for the refusal, or the result: the new object's name, the file written. */
    struct leo_text text;
};
LEO_ASSERT(sizeof(struct leo_act_answer) == 272, "size of leo/ActAnswer/1");
LEO_ASSERT(offsetof(struct leo_act_answer, serial) == 0, "place of serial");
LEO_ASSERT(offsetof(struct leo_act_answer, refused) == 8, "place of refused");
LEO_ASSERT(offsetof(struct leo_act_answer, text) == 16, "place of text");

/* One percept in which two beliefs about the same object differ. Positions and orientations are in the robot's
 * base frame. */
#define LEO_ASPECT_TYPE "leo/Aspect/1"
struct leo_aspect {
    LEO_NAMED(LEO_ASPECT_TYPE)
    double distance;
    /* The percept: its index in the configured set P. */
    uint16_t percept;
    uint16_t one_kind;
    uint16_t other_kind;
    uint16_t reserved;
    float one[4];
    float other[4];
};
LEO_ASSERT(sizeof(struct leo_aspect) == 48, "size of leo/Aspect/1");
LEO_ASSERT(offsetof(struct leo_aspect, distance) == 0, "place of distance");
LEO_ASSERT(offsetof(struct leo_aspect, percept) == 8, "place of percept");
LEO_ASSERT(offsetof(struct leo_aspect, one_kind) == 10, "place of one_kind");
LEO_ASSERT(offsetof(struct leo_aspect, other_kind) == 12, "place of other_kind");
LEO_ASSERT(offsetof(struct leo_aspect, reserved) == 14, "place of reserved");
LEO_ASSERT(offsetof(struct leo_aspect, one) == 16, "place of one");
LEO_ASSERT(offsetof(struct leo_aspect, other) == 32, "place of other");

/* The remembered evaluation of one percept at the frame's instant: h(t) = (m', c', d') (Eq. 3). */
#define LEO_REMEMBERED_TYPE "leo/Remembered/1"
struct leo_remembered {
    LEO_NAMED(LEO_REMEMBERED_TYPE)
    /* Time stamp of its newest sample, in nanoseconds of the clock. */
    uint64_t sampled_at_ns;
    /* The percept: its index in the configured set P. */
    uint16_t percept;
    /* The `FeatureKind` of its feature. */
    uint16_t feature_kind;
    /* Match m' in [0, 1]. */
    float matching;
    /* Confidence c' in [0, 1], decayed since the newest sample. */
    float confidence;
    /* The feature d' by its kind; unused numbers are zero. */
    float feature[4];
};
LEO_ASSERT(sizeof(struct leo_remembered) == 40, "size of leo/Remembered/1");
LEO_ASSERT(offsetof(struct leo_remembered, sampled_at_ns) == 0, "place of sampled_at_ns");
LEO_ASSERT(offsetof(struct leo_remembered, percept) == 8, "place of percept");
LEO_ASSERT(offsetof(struct leo_remembered, feature_kind) == 10, "place of feature_kind");
LEO_ASSERT(offsetof(struct leo_remembered, matching) == 12, "place of matching");
LEO_ASSERT(offsetof(struct leo_remembered, confidence) == 16, "place of confidence");
LEO_ASSERT(offsetof(struct leo_remembered, feature) == 20, "place of feature");

/* An entry of a belief buffer: one remembered object (Eq. 3), evaluated at the frame's instant. */
#define LEO_BELIEF_TYPE "leo/Belief/3"
struct leo_belief {
    LEO_NAMED(LEO_BELIEF_TYPE)
    /* Identity within its belief system; the older one survives a merge. */
    uint64_t id;
    /* When the object was first perceived, in nanoseconds of the clock. */
    uint64_t born_at_ns;
    /* When it was last perceived, in nanoseconds of the clock. */
    uint64_t perceived_at_ns;
    /* Number of observations merged into it. */
    uint64_t observations;
    /* The agent last perceived to hold it, as of this instant, or `NOBODY`. */
    uint16_t held_by;
    /* The owner according to this perspective, or `NOBODY` for a shared object. */
    uint16_t owner;
    /* The number of its percepts. */
    uint32_t count;
    /* Where the object is expected at the frame's instant, in metres in the perspective's frame. The position percept
     * is what the perspective remembers instead. */
    float expected_position_m[3];
    /* Its expected velocity, in metres per second in the perspective's frame. */
    float velocity_m_s[3];
    /* Variance of the expected position along each axis, in square metres; zero if positions are not predicted. */
    float position_variance_m2[3];
    /* Variance of the velocity along each axis, in (m/s)²; zero if positions are not predicted. */
    float velocity_variance_m2_s2[3];
    /* Its percepts, in ascending order of their numbers. */
    struct leo_remembered percepts[12];
};
LEO_ASSERT(sizeof(struct leo_belief) == 568, "size of leo/Belief/3");
LEO_ASSERT(offsetof(struct leo_belief, id) == 0, "place of id");
LEO_ASSERT(offsetof(struct leo_belief, born_at_ns) == 8, "place of born_at_ns");
LEO_ASSERT(offsetof(struct leo_belief, perceived_at_ns) == 16, "place of perceived_at_ns");
LEO_ASSERT(offsetof(struct leo_belief, observations) == 24, "place of observations");
LEO_ASSERT(offsetof(struct leo_belief, held_by) == 32, "place of held_by");
LEO_ASSERT(offsetof(struct leo_belief, owner) == 34, "place of owner");
LEO_ASSERT(offsetof(struct leo_belief, count) == 36, "place of count");
LEO_ASSERT(offsetof(struct leo_belief, expected_position_m) == 40, "place of expected_position_m");
LEO_ASSERT(offsetof(struct leo_belief, velocity_m_s) == 52, "place of velocity_m_s");
LEO_ASSERT(offsetof(struct leo_belief, position_variance_m2) == 64, "place of position_variance_m2");
LEO_ASSERT(offsetof(struct leo_belief, velocity_variance_m2_s2) == 76, "place of velocity_variance_m2_s2");
LEO_ASSERT(offsetof(struct leo_belief, percepts) == 88, "place of percepts");

/* The beginning of every frame. */
#define LEO_HEADER_TYPE "leo/Header/1"
struct leo_header {
    LEO_NAMED(LEO_HEADER_TYPE)
    /* Time stamp of the frame's content, in nanoseconds of the clock. */
    uint64_t valid_at_ns;
    /* Sequence number of the writer's frames, from one without gaps. A gap at the reader means lost frames. */
    uint64_t sequence;
    /* Incarnation of the writer, from one. A change means that the writer restarted and lost its state. */
    uint64_t incarnation;
    /* When the frame or its inputs passed each hop; zero for hops not passed. */
    uint64_t hops_ns[8];
    /* Number of entries left out for lack of space, in this frame or its inputs. */
    uint64_t over_capacity;
};
LEO_ASSERT(sizeof(struct leo_header) == 96, "size of leo/Header/1");
LEO_ASSERT(offsetof(struct leo_header, valid_at_ns) == 0, "place of valid_at_ns");
LEO_ASSERT(offsetof(struct leo_header, sequence) == 8, "place of sequence");
LEO_ASSERT(offsetof(struct leo_header, incarnation) == 16, "place of incarnation");
LEO_ASSERT(offsetof(struct leo_header, hops_ns) == 24, "place of hops_ns");
LEO_ASSERT(offsetof(struct leo_header, over_capacity) == 88, "place of over_capacity");

/* Path of a perspective: `[]` is the robot's own, `[1]` is partner 1's as the robot models it. `[1, 0]` is the
 * robot's as partner 1 models it, according to the robot.
 * 
 * Consecutive agents differ, and the robot is never first: an agent's model of itself is its own perspective. */
#define LEO_PATH_TYPE "leo/Path/1"
struct leo_path {
    LEO_NAMED(LEO_PATH_TYPE)
    uint32_t depth;
    uint16_t agents[6];
};
LEO_ASSERT(sizeof(struct leo_path) == 16, "size of leo/Path/1");
LEO_ASSERT(offsetof(struct leo_path, depth) == 0, "place of depth");
LEO_ASSERT(offsetof(struct leo_path, agents) == 4, "place of agents");

/* Head of a belief buffer: the perspective and its coordinate frame. */
#define LEO_BELIEF_HEAD_TYPE "leo/BeliefHead/2"
struct leo_belief_head {
    LEO_NAMED(LEO_BELIEF_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* Number of the perspective's buffer: 0 is the robot's own, n is that of partner n. Nested perspectives follow
     * in the order of their paths. */
    uint32_t perspective;
    /* Whether the perspective could perceive at this instant: 1 yes, 0 no. With 0 the partner is absent or their
     * pose unknown, and the beliefs are frozen. */
    uint32_t present;
    /* Position of the perspective's frame in the robot's base frame, in metres. */
    double frame_position_m[3];
    /* Orientation of that frame, quaternion `[x, y, z, w]`. */
    double frame_orientation_xyzw[4];
    /* Position of the perspective's eye in the robot's base frame, in metres. */
    double eye_position_m[3];
    /* Orientation of that eye (x along the line of sight), quaternion `[x, y, z, w]`. */
    double eye_orientation_xyzw[4];
    /* Observations of this instant that the perspective could perceive. */
    uint32_t perceivable;
    /* Observations of this instant that the perspective could not perceive. */
    uint32_t hidden;
    /* Observations refused because of invalid numbers, since the process started. */
    uint64_t refused;
    /* Beliefs created, since the process started. */
    uint64_t created;
    /* Pairs of beliefs merged, since the process started. */
    uint64_t merged;
    /* Beliefs culled, since the process started. */
    uint64_t culled;
    /* Observations dropped since the process started: no belief was free, or the occluder memory was full. */
    uint64_t overflowed;
    /* Path of the perspective. */
    struct leo_path path;
};
LEO_ASSERT(sizeof(struct leo_belief_head) == 280, "size of leo/BeliefHead/2");
LEO_ASSERT(offsetof(struct leo_belief_head, header) == 0, "place of header");
LEO_ASSERT(offsetof(struct leo_belief_head, perspective) == 96, "place of perspective");
LEO_ASSERT(offsetof(struct leo_belief_head, present) == 100, "place of present");
LEO_ASSERT(offsetof(struct leo_belief_head, frame_position_m) == 104, "place of frame_position_m");
LEO_ASSERT(offsetof(struct leo_belief_head, frame_orientation_xyzw) == 128, "place of frame_orientation_xyzw");
LEO_ASSERT(offsetof(struct leo_belief_head, eye_position_m) == 160, "place of eye_position_m");
LEO_ASSERT(offsetof(struct leo_belief_head, eye_orientation_xyzw) == 184, "place of eye_orientation_xyzw");
LEO_ASSERT(offsetof(struct leo_belief_head, perceivable) == 216, "place of perceivable");
LEO_ASSERT(offsetof(struct leo_belief_head, hidden) == 220, "place of hidden");
LEO_ASSERT(offsetof(struct leo_belief_head, refused) == 224, "place of refused");
LEO_ASSERT(offsetof(struct leo_belief_head, created) == 232, "place of created");
LEO_ASSERT(offsetof(struct leo_belief_head, merged) == 240, "place of merged");
LEO_ASSERT(offsetof(struct leo_belief_head, culled) == 248, "place of culled");
LEO_ASSERT(offsetof(struct leo_belief_head, overflowed) == 256, "place of overflowed");
LEO_ASSERT(offsetof(struct leo_belief_head, path) == 264, "place of path");

/* Histogram of durations in nanoseconds with a relative error of at most 1/16, in the log-linear layout of HDR
 * histograms. It is plain memory: recording takes a few instructions, publishing is a copy, and nothing allocates. */
#define LEO_HISTOGRAM_TYPE "leo/Histogram/1"
struct leo_histogram {
    LEO_NAMED(LEO_HISTOGRAM_TYPE)
    uint64_t count;
    uint64_t max_ns;
    uint32_t buckets[433];
    uint32_t reserved;
};
LEO_ASSERT(sizeof(struct leo_histogram) == 1752, "size of leo/Histogram/1");
LEO_ASSERT(offsetof(struct leo_histogram, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_histogram, max_ns) == 8, "place of max_ns");
LEO_ASSERT(offsetof(struct leo_histogram, buckets) == 16, "place of buckets");
LEO_ASSERT(offsetof(struct leo_histogram, reserved) == 1748, "place of reserved");

/* Health of one servo bus, counted since this incarnation of the motor process started. */
#define LEO_BUS_HEALTH_TYPE "leo/BusHealth/2"
struct leo_bus_health {
    LEO_NAMED(LEO_BUS_HEALTH_TYPE)
    /* Its name in the configuration. */
    struct leo_text name;
    /* Joints on it. */
    uint64_t joints;
    /* Joints on it that are quarantined now. */
    uint64_t quarantined;
    /* Whether its serial line is lost now: 1 yes, 0 no. */
    uint64_t lost;
    /* Requests completed. */
    uint64_t exchanges;
    /* Cycles skipped because the bus was still busy with the previous request. */
    uint64_t skipped;
    /* Status packets that did not arrive. */
    uint64_t missed;
    /* Status packets that arrived corrupt. */
    uint64_t corrupt;
    /* Status packets dropped because they were not expected, or because they were sampled too early. */
    uint64_t stale;
    /* Bytes that arrived after the reply timeout. */
    uint64_t late_bytes;
    /* Hardware alerts of its servos. */
    uint64_t alerts;
    /* Unexpected reboots of its servos. */
    uint64_t restarts;
    /* Bus watchdogs of its servos that have tripped. */
    uint64_t watchdogs;
    /* Instructions that a servo rejected with an error number. */
    uint64_t refusals;
    /* Identifiers to which two servos replied. */
    uint64_t duplicates;
    /* Times that its serial line was lost. */
    uint64_t hang_ups;
    /* Duration of the requests, in nanoseconds. */
    struct leo_histogram exchange;
};
LEO_ASSERT(sizeof(struct leo_bus_health) == 2128, "size of leo/BusHealth/2");
LEO_ASSERT(offsetof(struct leo_bus_health, name) == 0, "place of name");
LEO_ASSERT(offsetof(struct leo_bus_health, joints) == 256, "place of joints");
LEO_ASSERT(offsetof(struct leo_bus_health, quarantined) == 264, "place of quarantined");
LEO_ASSERT(offsetof(struct leo_bus_health, lost) == 272, "place of lost");
LEO_ASSERT(offsetof(struct leo_bus_health, exchanges) == 280, "place of exchanges");
LEO_ASSERT(offsetof(struct leo_bus_health, skipped) == 288, "place of skipped");
LEO_ASSERT(offsetof(struct leo_bus_health, missed) == 296, "place of missed");
LEO_ASSERT(offsetof(struct leo_bus_health, corrupt) == 304, "place of corrupt");
LEO_ASSERT(offsetof(struct leo_bus_health, stale) == 312, "place of stale");
LEO_ASSERT(offsetof(struct leo_bus_health, late_bytes) == 320, "place of late_bytes");
LEO_ASSERT(offsetof(struct leo_bus_health, alerts) == 328, "place of alerts");
LEO_ASSERT(offsetof(struct leo_bus_health, restarts) == 336, "place of restarts");
LEO_ASSERT(offsetof(struct leo_bus_health, watchdogs) == 344, "place of watchdogs");
LEO_ASSERT(offsetof(struct leo_bus_health, refusals) == 352, "place of refusals");
LEO_ASSERT(offsetof(struct leo_bus_health, duplicates) == 360, "place of duplicates");
LEO_ASSERT(offsetof(struct leo_bus_health, hang_ups) == 368, "place of hang_ups");
LEO_ASSERT(offsetof(struct leo_bus_health, exchange) == 376, "place of exchange");

/* Health of all servo buses. The motor process writes it to its board. */
#define LEO_BUSES_TYPE "leo/Buses/2"
struct leo_buses {
    LEO_NAMED(LEO_BUSES_TYPE)
    /* Number of buses. */
    uint64_t count;
    /* The buses, in the order of the configuration. */
    struct leo_bus_health buses[16];
};
LEO_ASSERT(sizeof(struct leo_buses) == 34056, "size of leo/Buses/2");
LEO_ASSERT(offsetof(struct leo_buses, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_buses, buses) == 8, "place of buses");

/* An entry of a divergence buffer: the differences of two perspectives about one object. */
#define LEO_DIFFERENCE_TYPE "leo/Difference/1"
struct leo_difference {
    LEO_NAMED(LEO_DIFFERENCE_TYPE)
    uint64_t one;
    uint64_t other;
    uint32_t count;
    uint32_t reserved;
    struct leo_aspect aspects[12];
};
LEO_ASSERT(sizeof(struct leo_difference) == 600, "size of leo/Difference/1");
LEO_ASSERT(offsetof(struct leo_difference, one) == 0, "place of one");
LEO_ASSERT(offsetof(struct leo_difference, other) == 8, "place of other");
LEO_ASSERT(offsetof(struct leo_difference, count) == 16, "place of count");
LEO_ASSERT(offsetof(struct leo_difference, reserved) == 20, "place of reserved");
LEO_ASSERT(offsetof(struct leo_difference, aspects) == 24, "place of aspects");

/* Head of a divergence buffer: the two perspectives compared. Has the same time stamp and sequence number as their
 * belief buffers. */
#define LEO_DIVERGENCE_HEAD_TYPE "leo/DivergenceHead/1"
struct leo_divergence_head {
    LEO_NAMED(LEO_DIVERGENCE_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* The `other` perspective, by the number of its buffers. */
    uint32_t perspective;
    /* The `one` perspective, which the other is nested in; 0 for a partner's. */
    uint32_t within;
    /* Number of objects about which the two agree. */
    uint32_t agreed;
    /* 1 if the two are compared, 0 until the agent of the other perspective is first observed. */
    uint32_t compared;
    /* Path of the other perspective. */
    struct leo_path path;
};
LEO_ASSERT(sizeof(struct leo_divergence_head) == 128, "size of leo/DivergenceHead/1");
LEO_ASSERT(offsetof(struct leo_divergence_head, header) == 0, "place of header");
LEO_ASSERT(offsetof(struct leo_divergence_head, perspective) == 96, "place of perspective");
LEO_ASSERT(offsetof(struct leo_divergence_head, within) == 100, "place of within");
LEO_ASSERT(offsetof(struct leo_divergence_head, agreed) == 104, "place of agreed");
LEO_ASSERT(offsetof(struct leo_divergence_head, compared) == 108, "place of compared");
LEO_ASSERT(offsetof(struct leo_divergence_head, path) == 112, "place of path");

/* Lockstep: a process has completed its turn. */
#define LEO_DONE_TYPE "leo/Done/1"
struct leo_done {
    LEO_NAMED(LEO_DONE_TYPE)
    /* The number of the completed turn. */
    uint64_t round;
    /* Whether the process has nothing left to do: 1 yes, 0 no. The simulator ends the lesson. */
    uint64_t finished;
};
LEO_ASSERT(sizeof(struct leo_done) == 16, "size of leo/Done/1");
LEO_ASSERT(offsetof(struct leo_done, round) == 0, "place of round");
LEO_ASSERT(offsetof(struct leo_done, finished) == 8, "place of finished");

/* An event of the learner. */
#define LEO_EVENT_TYPE "leo/Event/1"
struct leo_event {
    LEO_NAMED(LEO_EVENT_TYPE)
    /* Posterior probability of a hypothesis within its perspective, in [0, 1]. */
    double posterior;
    /* An `EventKind`. */
    uint16_t kind;
    /* The perspective it belongs to: 0 the robot's, n partner n's. */
    uint16_t perspective;
    /* Rank of a hypothesis from 1; hypotheses that tie share their rank. */
    uint32_t rank;
    /* Examples that a hypothesis is consistent with. */
    uint32_t tally;
    /* Examples seen. */
    uint32_t examples;
    /* Whether it is a high-likelihood hypothesis: 1 yes, 0 no. */
    uint32_t high_likelihood;
    /* Steps of a performance that succeeded. */
    uint32_t succeeded;
    /* The task that the event is about. */
    struct leo_text task;
    /* The text of the event. */
    struct leo_text text;
};
LEO_ASSERT(sizeof(struct leo_event) == 544, "size of leo/Event/1");
LEO_ASSERT(offsetof(struct leo_event, posterior) == 0, "place of posterior");
LEO_ASSERT(offsetof(struct leo_event, kind) == 8, "place of kind");
LEO_ASSERT(offsetof(struct leo_event, perspective) == 10, "place of perspective");
LEO_ASSERT(offsetof(struct leo_event, rank) == 12, "place of rank");
LEO_ASSERT(offsetof(struct leo_event, tally) == 16, "place of tally");
LEO_ASSERT(offsetof(struct leo_event, examples) == 20, "place of examples");
LEO_ASSERT(offsetof(struct leo_event, high_likelihood) == 24, "place of high_likelihood");
LEO_ASSERT(offsetof(struct leo_event, succeeded) == 28, "place of succeeded");
LEO_ASSERT(offsetof(struct leo_event, task) == 32, "place of task");
LEO_ASSERT(offsetof(struct leo_event, text) == 288, "place of text");

/* Health of one process: the counters of its main loop.
 * 
 * It is on a board in shared memory, so that reading it never blocks the monitored thread. */
#define LEO_HEALTH_TYPE "leo/Health/3"
struct leo_health {
    LEO_NAMED(LEO_HEALTH_TYPE)
    /* The operating system's process id. */
    uint32_t pid;
    uint32_t state;
    /* Incarnation of the process, from one. */
    uint64_t incarnation;
    /* Heartbeat: incremented in every iteration of the main loop. */
    uint64_t beat;
    /* Time of the last heartbeat, in nanoseconds of the monotonic clock. */
    uint64_t beat_at_ns;
    /* Start time of this incarnation, in nanoseconds of the monotonic clock. */
    uint64_t started_at_ns;
    /* Configured cycle period; zero for an event-driven process. */
    uint64_t period_ns;
    /* Cycles started. */
    uint64_t cycles;
    /* Cycles that missed their deadline. */
    uint64_t overruns;
    /* Releases skipped because of an overrun; they are not made up for. */
    uint64_t skipped;
    /* Frames lost at the process's subscribers, by gaps of the sequence number. */
    uint64_t drops;
    /* Frames that a publisher could not deliver to some subscriber. */
    uint64_t undelivered;
    /* Frames or entries refused as invalid. */
    uint64_t refused;
    /* Frames refused because their publisher is not on the supervisor's roster. */
    uint64_t unlisted_frames;
    /* Process id of the last such publisher; zero if there was none. */
    uint64_t unlisted_pid;
    /* Failed checks of invariants since the process started; any value above zero is a bug. */
    uint64_t broken_invariants;
    /* Minor and major page faults since the main loop started. */
    uint64_t page_faults;
    /* Rights that were requested and not granted, one bit each: scheduling, affinity, memory. */
    uint64_t missing_rights;
    /* Wake-up latency: from release to start. */
    struct leo_histogram wakeup;
    /* Execution time: from start to end. */
    struct leo_histogram execution;
    /* Age of the input when its step started, measured from its publication by the previous hop. */
    struct leo_histogram latency;
};
LEO_ASSERT(sizeof(struct leo_health) == 5392, "size of leo/Health/3");
LEO_ASSERT(offsetof(struct leo_health, pid) == 0, "place of pid");
LEO_ASSERT(offsetof(struct leo_health, state) == 4, "place of state");
LEO_ASSERT(offsetof(struct leo_health, incarnation) == 8, "place of incarnation");
LEO_ASSERT(offsetof(struct leo_health, beat) == 16, "place of beat");
LEO_ASSERT(offsetof(struct leo_health, beat_at_ns) == 24, "place of beat_at_ns");
LEO_ASSERT(offsetof(struct leo_health, started_at_ns) == 32, "place of started_at_ns");
LEO_ASSERT(offsetof(struct leo_health, period_ns) == 40, "place of period_ns");
LEO_ASSERT(offsetof(struct leo_health, cycles) == 48, "place of cycles");
LEO_ASSERT(offsetof(struct leo_health, overruns) == 56, "place of overruns");
LEO_ASSERT(offsetof(struct leo_health, skipped) == 64, "place of skipped");
LEO_ASSERT(offsetof(struct leo_health, drops) == 72, "place of drops");
LEO_ASSERT(offsetof(struct leo_health, undelivered) == 80, "place of undelivered");
LEO_ASSERT(offsetof(struct leo_health, refused) == 88, "place of refused");
LEO_ASSERT(offsetof(struct leo_health, unlisted_frames) == 96, "place of unlisted_frames");
LEO_ASSERT(offsetof(struct leo_health, unlisted_pid) == 104, "place of unlisted_pid");
LEO_ASSERT(offsetof(struct leo_health, broken_invariants) == 112, "place of broken_invariants");
LEO_ASSERT(offsetof(struct leo_health, page_faults) == 120, "place of page_faults");
LEO_ASSERT(offsetof(struct leo_health, missing_rights) == 128, "place of missing_rights");
LEO_ASSERT(offsetof(struct leo_health, wakeup) == 136, "place of wakeup");
LEO_ASSERT(offsetof(struct leo_health, execution) == 1888, "place of execution");
LEO_ASSERT(offsetof(struct leo_health, latency) == 3640, "place of latency");

/* Goal position of one joint, with arrival time. */
#define LEO_JOINT_GOAL_TYPE "leo/JointGoal/1"
struct leo_joint_goal {
    LEO_NAMED(LEO_JOINT_GOAL_TYPE)
    /* The joint: its index in the robot's configuration. */
    uint32_t joint;
    /* Not used; zero. */
    uint32_t reserved;
    /* Goal position, in radians from the joint's zero. */
    double goal_position_rad;
    /* Requested arrival time, in nanoseconds of the clock. The motor process moves smoothly, and arrives later if
     * the joint's limits require it. */
    uint64_t arrive_at_ns;
};
LEO_ASSERT(sizeof(struct leo_joint_goal) == 24, "size of leo/JointGoal/1");
LEO_ASSERT(offsetof(struct leo_joint_goal, joint) == 0, "place of joint");
LEO_ASSERT(offsetof(struct leo_joint_goal, reserved) == 4, "place of reserved");
LEO_ASSERT(offsetof(struct leo_joint_goal, goal_position_rad) == 8, "place of goal_position_rad");
LEO_ASSERT(offsetof(struct leo_joint_goal, arrive_at_ns) == 16, "place of arrive_at_ns");

/* State of one joint. */
#define LEO_JOINT_STATE_TYPE "leo/JointState/3"
struct leo_joint_state {
    LEO_NAMED(LEO_JOINT_STATE_TYPE)
    /* The joint: its index in the robot's configuration. */
    uint32_t joint;
    uint16_t mode;
    uint16_t cause;
    /* When the servo was read, in nanoseconds of the clock; zero if never. */
    uint64_t sampled_at_ns;
    double present_position_rad;
    double present_velocity_rad_s;
    double present_current_a;
    double command_position_rad;
    float present_temperature_c;
    float present_input_v;
    uint16_t link;
    uint16_t power;
    uint16_t arming;
    uint16_t motion;
    uint16_t arming_cause;
    /* Not used; zero. */
    uint16_t reserved[3];
};
LEO_ASSERT(sizeof(struct leo_joint_state) == 72, "size of leo/JointState/3");
LEO_ASSERT(offsetof(struct leo_joint_state, joint) == 0, "place of joint");
LEO_ASSERT(offsetof(struct leo_joint_state, mode) == 4, "place of mode");
LEO_ASSERT(offsetof(struct leo_joint_state, cause) == 6, "place of cause");
LEO_ASSERT(offsetof(struct leo_joint_state, sampled_at_ns) == 8, "place of sampled_at_ns");
LEO_ASSERT(offsetof(struct leo_joint_state, present_position_rad) == 16, "place of present_position_rad");
LEO_ASSERT(offsetof(struct leo_joint_state, present_velocity_rad_s) == 24, "place of present_velocity_rad_s");
LEO_ASSERT(offsetof(struct leo_joint_state, present_current_a) == 32, "place of present_current_a");
LEO_ASSERT(offsetof(struct leo_joint_state, command_position_rad) == 40, "place of command_position_rad");
LEO_ASSERT(offsetof(struct leo_joint_state, present_temperature_c) == 48, "place of present_temperature_c");
LEO_ASSERT(offsetof(struct leo_joint_state, present_input_v) == 52, "place of present_input_v");
LEO_ASSERT(offsetof(struct leo_joint_state, link) == 56, "place of link");
LEO_ASSERT(offsetof(struct leo_joint_state, power) == 58, "place of power");
LEO_ASSERT(offsetof(struct leo_joint_state, arming) == 60, "place of arming");
LEO_ASSERT(offsetof(struct leo_joint_state, motion) == 62, "place of motion");
LEO_ASSERT(offsetof(struct leo_joint_state, arming_cause) == 64, "place of arming_cause");
LEO_ASSERT(offsetof(struct leo_joint_state, reserved) == 66, "place of reserved");

/* The newest joint states, on a board of the motor process, for occasional readers. Unlike a subscriber to the
 * topic, a reader of a board costs the writer no memory. */
#define LEO_JOINTS_TYPE "leo/Joints/2"
struct leo_joints {
    LEO_NAMED(LEO_JOINTS_TYPE)
    /* Number of joints. */
    uint64_t count;
    /* Number of times that a joint was locked since the motor process started. An acknowledgement contains the last
     * value read, so that it never covers a newer lock. */
    uint64_t locks;
    /* Goals beyond a joint's limits, which were clamped. */
    uint64_t limited;
    /* Goals refused: not a number, or for an unknown joint. */
    uint64_t refused;
    /* The joint states. */
    struct leo_joint_state states[256];
};
LEO_ASSERT(sizeof(struct leo_joints) == 18464, "size of leo/Joints/2");
LEO_ASSERT(offsetof(struct leo_joints, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_joints, locks) == 8, "place of locks");
LEO_ASSERT(offsetof(struct leo_joints, limited) == 16, "place of limited");
LEO_ASSERT(offsetof(struct leo_joints, refused) == 24, "place of refused");
LEO_ASSERT(offsetof(struct leo_joints, states) == 32, "place of states");

/* One incarnation of a process, as recorded by the supervisor. */
#define LEO_LIFE_TYPE "leo/Life/1"
struct leo_life {
    LEO_NAMED(LEO_LIFE_TYPE)
    /* Number of the incarnation, from one; zero if the process was never started. */
    uint64_t incarnation;
    /* When the supervisor began to start it, in nanoseconds of the monotonic clock. */
    uint64_t began_at_ns;
    /* When the supervisor detected its end; zero while it runs. Until then its process id is not reused. */
    uint64_t ended_at_ns;
    /* The operating system's process id in the outermost visible namespace; zero while unknown. */
    uint32_t pid;
    /* 1 if the process belongs to this robot on this machine, else 0. */
    uint32_t is_member;
};
LEO_ASSERT(sizeof(struct leo_life) == 32, "size of leo/Life/1");
LEO_ASSERT(offsetof(struct leo_life, incarnation) == 0, "place of incarnation");
LEO_ASSERT(offsetof(struct leo_life, began_at_ns) == 8, "place of began_at_ns");
LEO_ASSERT(offsetof(struct leo_life, ended_at_ns) == 16, "place of ended_at_ns");
LEO_ASSERT(offsetof(struct leo_life, pid) == 24, "place of pid");
LEO_ASSERT(offsetof(struct leo_life, is_member) == 28, "place of is_member");

/* Health of the link to another machine, counted since this incarnation of the link process started. The link
 * process writes it to its board. Delays are between the two machines, in nanoseconds. */
#define LEO_LINK_HEALTH_TYPE "leo/LinkHealth/1"
struct leo_link_health {
    LEO_NAMED(LEO_LINK_HEALTH_TYPE)
    /* Whether the link to the other machine is up: 1 yes, 0 no. */
    uint64_t is_up;
    /* Number of times that the link came up: once, and once more after each interruption. */
    uint64_t sessions;
    /* The last round-trip time, without the processing time of the other machine. */
    uint64_t round_trip_ns;
    /* Bound on the error of time stamps received over the link, from the uncertainty of the clock offset. */
    uint64_t clock_error_ns;
    /* Frames passed to the network. */
    uint64_t sent;
    /* Frames replaced by a newer one of their topic before they were sent, because the network is slower than their
     * writer. */
    uint64_t overtaken;
    /* Frames dropped while the link was down, because of their age or number. */
    uint64_t expired;
    /* Frames received and published here. */
    uint64_t received;
    /* Batches sent to this machine that did not arrive. */
    uint64_t lost;
    /* Frames and messages of the other machine that were malformed or of another version. */
    uint64_t refused;
    /* Commands that arrived too late to be executed. */
    uint64_t late;
    /* Bytes passed to the network. */
    uint64_t bytes_sent;
    /* Bytes received. */
    uint64_t bytes_received;
    /* One-way delay of batches from the other machine, with an error of at most `Self::clock_error_ns`. */
    struct leo_histogram delay;
};
LEO_ASSERT(sizeof(struct leo_link_health) == 1856, "size of leo/LinkHealth/1");
LEO_ASSERT(offsetof(struct leo_link_health, is_up) == 0, "place of is_up");
LEO_ASSERT(offsetof(struct leo_link_health, sessions) == 8, "place of sessions");
LEO_ASSERT(offsetof(struct leo_link_health, round_trip_ns) == 16, "place of round_trip_ns");
LEO_ASSERT(offsetof(struct leo_link_health, clock_error_ns) == 24, "place of clock_error_ns");
LEO_ASSERT(offsetof(struct leo_link_health, sent) == 32, "place of sent");
LEO_ASSERT(offsetof(struct leo_link_health, overtaken) == 40, "place of overtaken");
LEO_ASSERT(offsetof(struct leo_link_health, expired) == 48, "place of expired");
LEO_ASSERT(offsetof(struct leo_link_health, received) == 56, "place of received");
LEO_ASSERT(offsetof(struct leo_link_health, lost) == 64, "place of lost");
LEO_ASSERT(offsetof(struct leo_link_health, refused) == 72, "place of refused");
LEO_ASSERT(offsetof(struct leo_link_health, late) == 80, "place of late");
LEO_ASSERT(offsetof(struct leo_link_health, bytes_sent) == 88, "place of bytes_sent");
LEO_ASSERT(offsetof(struct leo_link_health, bytes_received) == 96, "place of bytes_received");
LEO_ASSERT(offsetof(struct leo_link_health, delay) == 104, "place of delay");

/* A short name of fixed capacity, UTF-8. */
#define LEO_NAME_TYPE "leo/Name/1"
struct leo_name {
    LEO_NAMED(LEO_NAME_TYPE)
    /* Its length in bytes. */
    uint32_t length;
    /* Its bytes; those beyond its length are zero. */
    uint8_t bytes[64];
};
LEO_ASSERT(sizeof(struct leo_name) == 68, "size of leo/Name/1");
LEO_ASSERT(offsetof(struct leo_name, length) == 0, "place of length");
LEO_ASSERT(offsetof(struct leo_name, bytes) == 4, "place of bytes");

/* An observation of one object by one sensory source at one instant, in the robot's base frame.
 * 
 * An observation carries no object identity; association is the Belief System's task (Berlin et al. 2006, "Belief
 * Modeling").
 * 
 * Orientation, half extents, colour and shape are NaN in all components if they were not observed. */
#define LEO_OBSERVATION_TYPE "leo/Observation/2"
struct leo_observation {
    LEO_NAMED(LEO_OBSERVATION_TYPE)
    /* When the source observed it, in nanoseconds of the clock. */
    uint64_t observed_at_ns;
    /* The sensory source that reported it. */
    uint16_t source;
    /* A `Modality`. */
    uint16_t modality;
    /* An `ObservationKind`. */
    uint16_t kind;
    /* For a person or a hand: which partner (1, 2, …), or 0 for the robot itself; `NOBODY` if the source does not
     * know it. */
    uint16_t partner;
    /* The agent that holds or moves it, or `NOBODY`. */
    uint16_t held_by;
    /* For a person or a hand: the source's own number of a face, a body or a voice that it tracks (1, 2, …); zero for
     * none. The sensor process finds out which partner it is. */
    uint16_t detection;
    /* Confidence of the source, in [0, 1]. */
    float confidence;
    /* Position in the robot's base frame, in metres. */
    float position_m[3];
    /* Standard deviation of the position along each axis of that frame, in metres; zero if the source states none. */
    float position_sd_m[3];
    /* Orientation in the robot's base frame, quaternion `[x, y, z, w]`; NaN if not observed. */
    float orientation_xyzw[4];
    /* Half extents along the object's own axes, in metres; NaN if not observed. */
    float half_extents_m[3];
    /* Colour, linear red, green and blue in [0, 1]; NaN if not observed. */
    float colour_rgb[3];
    /* Shape descriptor: elongation, flatness, roundness, taper; each in [0, 1]; NaN if not observed. */
    float shape[4];
    /* Degree of each `State`; NaN if the object has no such state. */
    float states[8];
};
LEO_ASSERT(sizeof(struct leo_observation) == 136, "size of leo/Observation/2");
LEO_ASSERT(offsetof(struct leo_observation, observed_at_ns) == 0, "place of observed_at_ns");
LEO_ASSERT(offsetof(struct leo_observation, source) == 8, "place of source");
LEO_ASSERT(offsetof(struct leo_observation, modality) == 10, "place of modality");
LEO_ASSERT(offsetof(struct leo_observation, kind) == 12, "place of kind");
LEO_ASSERT(offsetof(struct leo_observation, partner) == 14, "place of partner");
LEO_ASSERT(offsetof(struct leo_observation, held_by) == 16, "place of held_by");
LEO_ASSERT(offsetof(struct leo_observation, detection) == 18, "place of detection");
LEO_ASSERT(offsetof(struct leo_observation, confidence) == 20, "place of confidence");
LEO_ASSERT(offsetof(struct leo_observation, position_m) == 24, "place of position_m");
LEO_ASSERT(offsetof(struct leo_observation, position_sd_m) == 36, "place of position_sd_m");
LEO_ASSERT(offsetof(struct leo_observation, orientation_xyzw) == 48, "place of orientation_xyzw");
LEO_ASSERT(offsetof(struct leo_observation, half_extents_m) == 64, "place of half_extents_m");
LEO_ASSERT(offsetof(struct leo_observation, colour_rgb) == 76, "place of colour_rgb");
LEO_ASSERT(offsetof(struct leo_observation, shape) == 88, "place of shape");
LEO_ASSERT(offsetof(struct leo_observation, states) == 104, "place of states");

/* One percept's evaluation of one observation: p(o) = (m, c, d) (Eq. 1). */
#define LEO_PERCEPT_VALUE_TYPE "leo/PerceptValue/1"
struct leo_percept_value {
    LEO_NAMED(LEO_PERCEPT_VALUE_TYPE)
    /* The percept: its index in the configured set P. */
    uint16_t percept;
    uint16_t feature_kind;
    /* Match m in [0, 1]. */
    float matching;
    /* Confidence c in [0, 1]. */
    float confidence;
    float feature[4];
};
LEO_ASSERT(sizeof(struct leo_percept_value) == 28, "size of leo/PerceptValue/1");
LEO_ASSERT(offsetof(struct leo_percept_value, percept) == 0, "place of percept");
LEO_ASSERT(offsetof(struct leo_percept_value, feature_kind) == 2, "place of feature_kind");
LEO_ASSERT(offsetof(struct leo_percept_value, matching) == 4, "place of matching");
LEO_ASSERT(offsetof(struct leo_percept_value, confidence) == 8, "place of confidence");
LEO_ASSERT(offsetof(struct leo_percept_value, feature) == 12, "place of feature");

/* The percepts of one observation that passed the threshold (Eq. 2). */
#define LEO_SNAPSHOT_TYPE "leo/Snapshot/1"
struct leo_snapshot {
    LEO_NAMED(LEO_SNAPSHOT_TYPE)
    uint32_t count;
    struct leo_percept_value values[12];
};
LEO_ASSERT(sizeof(struct leo_snapshot) == 340, "size of leo/Snapshot/1");
LEO_ASSERT(offsetof(struct leo_snapshot, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_snapshot, values) == 4, "place of values");

/* An entry of the percept buffer: an observation and the robot's percept snapshot of it.
 * 
 * It includes the observation, because other perspectives perceive it anew in their own frames (Eq. 7). */
#define LEO_PERCEIVED_TYPE "leo/Perceived/1"
struct leo_perceived {
    LEO_NAMED(LEO_PERCEIVED_TYPE)
    /* The observation. */
    struct leo_observation observation;
    /* The robot's own percept snapshot of it. */
    struct leo_snapshot snapshot;
};
LEO_ASSERT(sizeof(struct leo_perceived) == 480, "size of leo/Perceived/1");
LEO_ASSERT(offsetof(struct leo_perceived, observation) == 0, "place of observation");
LEO_ASSERT(offsetof(struct leo_perceived, snapshot) == 136, "place of snapshot");

/* What a percept number in beliefs and snapshots means. */
#define LEO_PERCEPT_DESCRIPTION_TYPE "leo/PerceptDescription/1"
struct leo_percept_description {
    LEO_NAMED(LEO_PERCEPT_DESCRIPTION_TYPE)
    /* Its unique name in `percepts.toml`. */
    struct leo_name name;
    /* Its `PerceptRole`. */
    uint16_t role;
    /* Its `PerceptKernel`. */
    uint16_t kernel;
    /* The `FeatureKind` of its features; 65535 if a plug-in decides it. */
    uint16_t feature_kind;
    /* The `FeatureUnit` of its features. */
    uint16_t unit;
    /* The number of the percept that gates it; 65535 if there is none. */
    uint16_t parent;
    /* Zero. */
    uint16_t reserved;
    /* The number of its named symbols. */
    uint32_t symbol_count;
    /* Their names, by number. A symbol beyond the count has no name. */
    struct leo_name symbols[64];
};
LEO_ASSERT(sizeof(struct leo_percept_description) == 4436, "size of leo/PerceptDescription/1");
LEO_ASSERT(offsetof(struct leo_percept_description, name) == 0, "place of name");
LEO_ASSERT(offsetof(struct leo_percept_description, role) == 68, "place of role");
LEO_ASSERT(offsetof(struct leo_percept_description, kernel) == 70, "place of kernel");
LEO_ASSERT(offsetof(struct leo_percept_description, feature_kind) == 72, "place of feature_kind");
LEO_ASSERT(offsetof(struct leo_percept_description, unit) == 74, "place of unit");
LEO_ASSERT(offsetof(struct leo_percept_description, parent) == 76, "place of parent");
LEO_ASSERT(offsetof(struct leo_percept_description, reserved) == 78, "place of reserved");
LEO_ASSERT(offsetof(struct leo_percept_description, symbol_count) == 80, "place of symbol_count");
LEO_ASSERT(offsetof(struct leo_percept_description, symbols) == 84, "place of symbols");

/* Head of a percept buffer: the sources that delivered a frame. */
#define LEO_PERCEPT_HEAD_TYPE "leo/PerceptHead/1"
struct leo_percept_head {
    LEO_NAMED(LEO_PERCEPT_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* Sources that delivered a frame: bit n for source n, the last bit for all beyond. */
    uint64_t active_sources;
};
LEO_ASSERT(sizeof(struct leo_percept_head) == 104, "size of leo/PerceptHead/1");
LEO_ASSERT(offsetof(struct leo_percept_head, header) == 0, "place of header");
LEO_ASSERT(offsetof(struct leo_percept_head, active_sources) == 96, "place of active_sources");

/* Counters of one perspective, since this incarnation of the process started. */
#define LEO_PERSPECTIVE_HEALTH_TYPE "leo/PerspectiveHealth/2"
struct leo_perspective_health {
    LEO_NAMED(LEO_PERSPECTIVE_HEALTH_TYPE)
    /* Its path. */
    struct leo_path path;
    /* Number of update steps. */
    uint64_t steps;
    /* Sum over these steps of the number of beliefs after the step. */
    uint64_t beliefs;
    /* Observations, beliefs and occluders dropped for lack of space. */
    uint64_t over_capacity;
    /* Observations and evaluations refused as invalid. */
    uint64_t refused;
};
LEO_ASSERT(sizeof(struct leo_perspective_health) == 48, "size of leo/PerspectiveHealth/2");
LEO_ASSERT(offsetof(struct leo_perspective_health, path) == 0, "place of path");
LEO_ASSERT(offsetof(struct leo_perspective_health, steps) == 16, "place of steps");
LEO_ASSERT(offsetof(struct leo_perspective_health, beliefs) == 24, "place of beliefs");
LEO_ASSERT(offsetof(struct leo_perspective_health, over_capacity) == 32, "place of over_capacity");
LEO_ASSERT(offsetof(struct leo_perspective_health, refused) == 40, "place of refused");

/* Counters of all perspectives. The belief process writes them to its board. Without perspective taking there is
 * one, the robot's own. */
#define LEO_PERSPECTIVES_TYPE "leo/Perspectives/2"
struct leo_perspectives {
    LEO_NAMED(LEO_PERSPECTIVES_TYPE)
    /* Number of perspectives. */
    uint64_t count;
    /* The perspectives, by number. */
    struct leo_perspective_health perspectives[256];
};
LEO_ASSERT(sizeof(struct leo_perspectives) == 12296, "size of leo/Perspectives/2");
LEO_ASSERT(offsetof(struct leo_perspectives, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_perspectives, perspectives) == 8, "place of perspectives");

/* The newest incarnation of each process, as recorded by the supervisor. It determines the board of that
 * incarnation's `Health`(crate::Health), and the process that may publish. */
#define LEO_ROSTER_TYPE "leo/Roster/3"
struct leo_roster {
    LEO_NAMED(LEO_ROSTER_TYPE)
    struct leo_life lives[16];
};
LEO_ASSERT(sizeof(struct leo_roster) == 512, "size of leo/Roster/3");
LEO_ASSERT(offsetof(struct leo_roster, lives) == 0, "place of lives");

/* Head of the simulator's scene: progress of the lesson, and pose of the robot in the world. */
#define LEO_SCENE_HEAD_TYPE "leo/SceneHead/1"
struct leo_scene_head {
    LEO_NAMED(LEO_SCENE_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* Position of the robot's base in the world, in metres. */
    double base_position_m[3];
    /* Orientation of the robot's base in the world, quaternion `[x, y, z, w]`. */
    double base_orientation_xyzw[4];
    /* When the script or the first interactive table began, in nanoseconds of the clock. */
    uint64_t began_at_ns;
    /* A `SceneMode`. */
    uint32_t mode;
    /* Number of the lesson's current table, from 0, or `NO_TABLE`. */
    uint32_t table;
    /* Number of tables of the lesson: the demonstrations, then the novel set if there is one. */
    uint32_t tables;
    /* Number of recorded interactive steps. */
    uint32_t steps;
    /* The open lesson; empty for the one that the robot was started with. */
    struct leo_text lesson;
};
LEO_ASSERT(sizeof(struct leo_scene_head) == 432, "size of leo/SceneHead/1");
LEO_ASSERT(offsetof(struct leo_scene_head, header) == 0, "place of header");
LEO_ASSERT(offsetof(struct leo_scene_head, base_position_m) == 96, "place of base_position_m");
LEO_ASSERT(offsetof(struct leo_scene_head, base_orientation_xyzw) == 120, "place of base_orientation_xyzw");
LEO_ASSERT(offsetof(struct leo_scene_head, began_at_ns) == 152, "place of began_at_ns");
LEO_ASSERT(offsetof(struct leo_scene_head, mode) == 160, "place of mode");
LEO_ASSERT(offsetof(struct leo_scene_head, table) == 164, "place of table");
LEO_ASSERT(offsetof(struct leo_scene_head, tables) == 168, "place of tables");
LEO_ASSERT(offsetof(struct leo_scene_head, steps) == 172, "place of steps");
LEO_ASSERT(offsetof(struct leo_scene_head, lesson) == 176, "place of lesson");

/* Ground truth of one object in the simulator, in the world frame.
 * 
 * For visualisation and for checking Leo's actions; no other process of the robot reads it. */
#define LEO_SCENE_OBJECT_TYPE "leo/SceneObject/2"
struct leo_scene_object {
    LEO_NAMED(LEO_SCENE_OBJECT_TYPE)
    /* Position in the world, in metres. */
    double position_m[3];
    /* Orientation in the world, quaternion `[x, y, z, w]`. */
    double orientation_xyzw[4];
    /* Half extents along its own axes, in metres. */
    double half_extents_m[3];
    /* Colour, linear red, green and blue in [0, 1]. */
    float colour_rgb[3];
    /* Shape descriptor: elongation, flatness, roundness, taper; each in [0, 1]. */
    float shape[4];
    /* Degree of each `State`; NaN if the object has no such state. */
    float states[8];
    /* An `ObservationKind`. */
    uint16_t kind;
    /* The agent that holds it, or `NOBODY`. */
    uint16_t held_by;
    /* The partner number of a person, or `NOBODY`. */
    uint16_t partner;
    /* A `ThingRole` of an object; 0 for a person or an occluder. */
    uint16_t role;
    /* Its name in the lesson. */
    struct leo_text name;
};
LEO_ASSERT(sizeof(struct leo_scene_object) == 408, "size of leo/SceneObject/2");
LEO_ASSERT(offsetof(struct leo_scene_object, position_m) == 0, "place of position_m");
LEO_ASSERT(offsetof(struct leo_scene_object, orientation_xyzw) == 24, "place of orientation_xyzw");
LEO_ASSERT(offsetof(struct leo_scene_object, half_extents_m) == 56, "place of half_extents_m");
LEO_ASSERT(offsetof(struct leo_scene_object, colour_rgb) == 80, "place of colour_rgb");
LEO_ASSERT(offsetof(struct leo_scene_object, shape) == 92, "place of shape");
LEO_ASSERT(offsetof(struct leo_scene_object, states) == 108, "place of states");
LEO_ASSERT(offsetof(struct leo_scene_object, kind) == 140, "place of kind");
LEO_ASSERT(offsetof(struct leo_scene_object, held_by) == 142, "place of held_by");
LEO_ASSERT(offsetof(struct leo_scene_object, partner) == 144, "place of partner");
LEO_ASSERT(offsetof(struct leo_scene_object, role) == 146, "place of role");
LEO_ASSERT(offsetof(struct leo_scene_object, name) == 148, "place of name");

/* Counters of the frames and observations of one source. */
#define LEO_SOURCE_HEALTH_TYPE "leo/SourceHealth/1"
struct leo_source_health {
    LEO_NAMED(LEO_SOURCE_HEALTH_TYPE)
    /* Its display name. */
    struct leo_text name;
    /* Frames accepted. */
    uint64_t frames;
    /* Observations added to the percept buffer. */
    uint64_t observations;
    /* When a frame was last accepted, in nanoseconds of the clock; zero if never. */
    uint64_t last_frame_at_ns;
    /* Whether it has been silent for longer than its rate allows: 1 yes, 0 no. */
    uint64_t silent;
    /* Number of losses, indexed by `Loss`. */
    uint64_t losses[24];
};
LEO_ASSERT(sizeof(struct leo_source_health) == 480, "size of leo/SourceHealth/1");
LEO_ASSERT(offsetof(struct leo_source_health, name) == 0, "place of name");
LEO_ASSERT(offsetof(struct leo_source_health, frames) == 256, "place of frames");
LEO_ASSERT(offsetof(struct leo_source_health, observations) == 264, "place of observations");
LEO_ASSERT(offsetof(struct leo_source_health, last_frame_at_ns) == 272, "place of last_frame_at_ns");
LEO_ASSERT(offsetof(struct leo_source_health, silent) == 280, "place of silent");
LEO_ASSERT(offsetof(struct leo_source_health, losses) == 288, "place of losses");

/* Counters of all sources. The sensor process writes them to its board. */
#define LEO_SOURCES_TYPE "leo/Sources/1"
struct leo_sources {
    LEO_NAMED(LEO_SOURCES_TYPE)
    /* Number of sources. */
    uint64_t count;
    /* The sources, by number. */
    struct leo_source_health sources[16];
};
LEO_ASSERT(sizeof(struct leo_sources) == 7688, "size of leo/Sources/1");
LEO_ASSERT(offsetof(struct leo_sources, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_sources, sources) == 8, "place of sources");

/* The names of what beliefs refer to by number: percepts, their symbols, and agents.
 * 
 * The belief process writes it to its board once, before its first beliefs. The board's name contains the
 * incarnation that the headers of these beliefs contain. */
#define LEO_SYMBOLS_TYPE "leo/Symbols/1"
struct leo_symbols {
    LEO_NAMED(LEO_SYMBOLS_TYPE)
    /* The number of percepts; zero until the board has been written. */
    uint32_t percept_count;
    /* The number of agents: the robot and its partners. */
    uint32_t agent_count;
    /* The percepts, by number. */
    struct leo_percept_description percepts[12];
    /* The names of the agents, by number: 0 the robot, n partner n. */
    struct leo_name agents[256];
};
LEO_ASSERT(sizeof(struct leo_symbols) == 70648, "size of leo/Symbols/1");
LEO_ASSERT(offsetof(struct leo_symbols, percept_count) == 0, "place of percept_count");
LEO_ASSERT(offsetof(struct leo_symbols, agent_count) == 4, "place of agent_count");
LEO_ASSERT(offsetof(struct leo_symbols, percepts) == 8, "place of percepts");
LEO_ASSERT(offsetof(struct leo_symbols, agents) == 53240, "place of agents");

/* An interactive act of a teacher. Positions are in the world frame, in metres. */
#define LEO_TEACHER_ACT_TYPE "leo/TeacherAct/1"
struct leo_teacher_act {
    LEO_NAMED(LEO_TEACHER_ACT_TYPE)
    /* Serial number of the act, from one in each incarnation of the console. */
    uint64_t serial;
    /* Target position: centre of an object or occluder, or the teacher's eyes. Heights of added and put down
     * objects are computed. */
    double position_m[3];
    /* Point that the teacher looks at, for a seat; half extents, for a new occluder. */
    double second_vector_m[3];
    /* Heading, anticlockwise from the world's x axis, in radians; NaN keeps the current heading. */
    double heading_rad;
    /* A `TeacherActKind`. */
    uint16_t kind;
    /* The teacher: partner 1, 2, … */
    uint16_t teacher;
    /* Hand on the console; several people may teach at once, each with one hand. */
    uint16_t hand;
    /* Not used; zero. */
    uint16_t reserved;
    /* Number of the table to set up. */
    uint64_t table;
    /* Sentence, name or lesson, depending on the kind. */
    struct leo_text text;
    /* Name of the colour of a new object. */
    struct leo_text colour;
};
LEO_ASSERT(sizeof(struct leo_teacher_act) == 592, "size of leo/TeacherAct/1");
LEO_ASSERT(offsetof(struct leo_teacher_act, serial) == 0, "place of serial");
LEO_ASSERT(offsetof(struct leo_teacher_act, position_m) == 8, "place of position_m");
LEO_ASSERT(offsetof(struct leo_teacher_act, second_vector_m) == 32, "place of second_vector_m");
LEO_ASSERT(offsetof(struct leo_teacher_act, heading_rad) == 56, "place of heading_rad");
LEO_ASSERT(offsetof(struct leo_teacher_act, kind) == 64, "place of kind");
LEO_ASSERT(offsetof(struct leo_teacher_act, teacher) == 66, "place of teacher");
LEO_ASSERT(offsetof(struct leo_teacher_act, hand) == 68, "place of hand");
LEO_ASSERT(offsetof(struct leo_teacher_act, reserved) == 70, "place of reserved");
LEO_ASSERT(offsetof(struct leo_teacher_act, table) == 72, "place of table");
LEO_ASSERT(offsetof(struct leo_teacher_act, text) == 80, "place of text");
LEO_ASSERT(offsetof(struct leo_teacher_act, colour) == 336, "place of colour");

/* Lockstep: the conductor gives one process a turn at an instant of simulated time. The header's `valid_at_ns` is
 * that instant. */
#define LEO_TURN_TYPE "leo/Turn/1"
struct leo_turn {
    LEO_NAMED(LEO_TURN_TYPE)
    /* A `TurnKind`. */
    uint32_t kind;
    /* Not used; zero. */
    uint32_t reserved;
    /* Number of the turn in the run, from one. */
    uint64_t round;
};
LEO_ASSERT(sizeof(struct leo_turn) == 16, "size of leo/Turn/1");
LEO_ASSERT(offsetof(struct leo_turn, kind) == 0, "place of kind");
LEO_ASSERT(offsetof(struct leo_turn, reserved) == 4, "place of reserved");
LEO_ASSERT(offsetof(struct leo_turn, round) == 8, "place of round");

/* A sentence of a teacher. */
#define LEO_UTTERANCE_TYPE "leo/Utterance/1"
struct leo_utterance {
    LEO_NAMED(LEO_UTTERANCE_TYPE)
    /* The speaker: partner 1, 2, … */
    uint32_t speaker;
    /* The sentence. */
    struct leo_text text;
};
LEO_ASSERT(sizeof(struct leo_utterance) == 260, "size of leo/Utterance/1");
LEO_ASSERT(offsetof(struct leo_utterance, speaker) == 0, "place of speaker");
LEO_ASSERT(offsetof(struct leo_utterance, text) == 4, "place of text");

#endif
