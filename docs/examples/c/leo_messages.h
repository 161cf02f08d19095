/* What Leo's processes share through memory, for C and C++: made from shared/message by
 * `LEO_REWRITE=1 cargo test -p message`; do not edit. docs/sources.md says how to use it.
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
#define LEO_LOSSES 24
#define LEO_TEXT_CAPACITY 252
#define LEO_DEPTH_MOST 6

/* What the learner reports. */
enum leo_event_kind {
    /* Leo said something; the text is what. */
    LEO_EVENT_KIND_SAID = 1,
    /* A lesson about a task began; the text is its name. */
    LEO_EVENT_KIND_TEACHING_STARTED = 2,
    /* An action was recognised; the text says whose and what. */
    LEO_EVENT_KIND_ACTION_SEEN = 3,
    /* A demonstration ended and became an example; the text is the task's name. */
    LEO_EVENT_KIND_DEMONSTRATION_ENDED = 4,
    /* A hypothesis with its posterior, tally and rank; the text is its computed name. */
    LEO_EVENT_KIND_HYPOTHESIS = 5,
    /* The primary hypothesis of a task; the text is its computed name. */
    LEO_EVENT_KIND_RULE_CHOSEN = 6,
    /* Why the hypotheses of two perspectives differ; the text explains it. */
    LEO_EVENT_KIND_EXPLAINED = 7,
    /* Leo began to perform a task; the text is its name. */
    LEO_EVENT_KIND_PERFORMANCE_STARTED = 8,
    /* A step of the performance began; the text says which. */
    LEO_EVENT_KIND_STEP_STARTED = 9,
    /* A step ended, and the belief of the robot confirms it; the text says which. */
    LEO_EVENT_KIND_STEP_DONE = 10,
    /* A step ended without the effect it should have had; the text says why. */
    LEO_EVENT_KIND_STEP_FAILED = 11,
    /* The performance ended; the text says with what result. */
    LEO_EVENT_KIND_PERFORMANCE_ENDED = 12,
    /* The belief buffer's continuity was broken: its process began anew. */
    LEO_EVENT_KIND_CONTINUITY_BROKEN = 13,
    /* What a perspective has before it as a demonstration or a performance begins; the text lists it. */
    LEO_EVENT_KIND_SEEN = 14,
    /* Leo was asked to perform a task and does not; the text is what it says about that. */
    LEO_EVENT_KIND_DECLINED = 15,
    /* What Leo asked about a task was answered, and the answer became an example; the text is "yes" or "no". */
    LEO_EVENT_KIND_ANSWERED = 16,
    /* A movement of somebody's is one of Leo's own; the text says whose, and what he is about to do. */
    LEO_EVENT_KIND_MOVEMENT_SEEN = 17,
    /* A task is remembered, and what it comes to follows: told to whoever has just begun to listen. */
    LEO_EVENT_KIND_REMEMBERED = 18,
};

/* A point on the way of a frame, in the direction the data flows. */
enum leo_hop {
    /* The source published the observations. */
    LEO_HOP_OBSERVED = 0,
    /* The sensor process began the cycle that read them. */
    LEO_HOP_SENSOR_STARTED = 1,
    /* The sensor process published the percept buffer. */
    LEO_HOP_PERCEIVED = 2,
    /* The belief process began its step on it. */
    LEO_HOP_BELIEF_STARTED = 3,
    /* The belief process published the belief buffers. */
    LEO_HOP_BELIEVED = 4,
    /* The learner published the joint goals. */
    LEO_HOP_DECIDED = 5,
    /* The motor process took the joint goals. */
    LEO_HOP_COMMANDED = 6,
    /* The motor process published the joint states. */
    LEO_HOP_MOVED = 7,
};

/* Why a joint is in its mode. */
enum leo_joint_cause {
    /* As it should be. */
    LEO_JOINT_CAUSE_NONE = 0,
    /* Not started yet. */
    LEO_JOINT_CAUSE_NOT_STARTED = 1,
    /* No new goals for longer than the command time-out. */
    LEO_JOINT_CAUSE_COMMAND_TIMEOUT = 2,
    /* The servo does not answer. */
    LEO_JOINT_CAUSE_SILENT = 3,
    /* The servo reports a hardware alert. */
    LEO_JOINT_CAUSE_ALERT = 4,
    /* The servo's own bus watchdog tripped. */
    LEO_JOINT_CAUSE_WATCHDOG = 5,
    /* The bus itself is lost. */
    LEO_JOINT_CAUSE_BUS_LOST = 6,
    /* Stopped by order. */
    LEO_JOINT_CAUSE_STOPPED = 7,
    /* The servo refused an instruction, or is another model than the configured one. */
    LEO_JOINT_CAUSE_REFUSED = 8,
    /* Another joint of its group is in trouble: the group stops together. */
    LEO_JOINT_CAUSE_GROUP_STOPPED = 9,
    /* A bus is lost: the body stops together. */
    LEO_JOINT_CAUSE_BODY_STOPPED = 10,
    /* The emergency stop. */
    LEO_JOINT_CAUSE_EMERGENCY = 11,
    /* The servo started anew by itself: its power or its firmware gave way for a moment. */
    LEO_JOINT_CAUSE_RESTARTED = 12,
    /* Two servos answer to one identifier on its bus. */
    LEO_JOINT_CAUSE_DUPLICATE_ID = 13,
    /* The servo is hot or short of voltage: it moves more slowly. */
    LEO_JOINT_CAUSE_DERATED = 14,
    /* The servo answers, and nothing shows that its answers are new: its own clock does not go right. */
    LEO_JOINT_CAUSE_UNBELIEVED = 15,
    /* The joint did not follow its command: something held it, or its servo is too weak. */
    LEO_JOINT_CAUSE_BLOCKED = 16,
    /* It stands further beyond its limits than the tolerance: a slipped horn, a wrong offset, a swapped servo. */
    LEO_JOINT_CAUSE_BEYOND_LIMITS = 17,
};

/* Whether a joint may move. */
enum leo_joint_licence {
    /* Not until its cause is gone and a person has acknowledged it. */
    LEO_JOINT_LICENCE_LOCKED = 0,
    /* Not until a person arms it. */
    LEO_JOINT_LICENCE_DISARMED = 1,
    /* It may. */
    LEO_JOINT_LICENCE_ARMED = 2,
};

/* What is known of the connection to a joint's servo. */
enum leo_joint_link {
    /* It has not been asked yet. */
    LEO_JOINT_LINK_UNKNOWN = 0,
    /* It is there, and is the configured model; how it is set up is being read or written. */
    LEO_JOINT_LINK_IDENTIFIED = 1,
    /* It is set up and read in every cycle. */
    LEO_JOINT_LINK_ANSWERING = 2,
    /* It does not answer, or cannot be believed: quarantined, and asked again now and then. */
    LEO_JOINT_LINK_SILENT = 3,
    /* Its answers arrive broken: two servos may answer at once. */
    LEO_JOINT_LINK_DOUBTED = 4,
};

/* What the motor process does with a joint. */
enum leo_joint_mode {
    /* No torque: the joint hangs free. */
    LEO_JOINT_MODE_LIMP = 0,
    /* Being brought up: found, checked, torque not yet on. */
    LEO_JOINT_MODE_STARTING = 1,
    /* Following goals. */
    LEO_JOINT_MODE_FOLLOWING = 2,
    /* The commander is gone: slowing down. */
    LEO_JOINT_MODE_DECELERATING = 3,
    /* Holding the position where it stopped. */
    LEO_JOINT_MODE_HOLDING = 4,
    /* Its servo does not answer, or cannot be believed: no goal is sent, it is asked again now and then. */
    LEO_JOINT_MODE_QUARANTINED = 5,
    /* Told to switch its torque off, and its servo has not confirmed it yet. */
    LEO_JOINT_MODE_RELEASING = 6,
    /* Moving slowly from where torque came on, a little beyond its limits, back within them. */
    LEO_JOINT_MODE_ALIGNING = 7,
    /* Moving slowly to its rest pose, before its torque goes off. */
    LEO_JOINT_MODE_LOWERING = 8,
};

/* How a joint moves. */
enum leo_joint_motion {
    /* No goal is sent: it is limp, or its servo stays where it is. */
    LEO_JOINT_MOTION_IDLE = 0,
    /* Slowly back within its limits. */
    LEO_JOINT_MOTION_ALIGN = 1,
    /* After goals, no faster than the soft start. */
    LEO_JOINT_MOTION_SOFT = 2,
    /* After goals. */
    LEO_JOINT_MOTION_TRACK = 3,
    /* Slowing down to a stop. */
    LEO_JOINT_MOTION_HALT = 4,
    /* Held at the place where it stopped, for goals to come. */
    LEO_JOINT_MOTION_HOLD = 5,
    /* Slowly to its rest pose. */
    LEO_JOINT_MOTION_RETREAT = 6,
};

/* What is known of the torque of a joint's servo. */
enum leo_joint_power {
    /* Nothing: it may be on. */
    LEO_JOINT_POWER_UNKNOWN = 0,
    /* The servo has said that it is off. */
    LEO_JOINT_POWER_OFF = 1,
    /* It was found on: another process switched it on. */
    LEO_JOINT_POWER_FOUND = 2,
    /* It is being switched on. */
    LEO_JOINT_POWER_RISING = 3,
    /* The motor process switched it on, and the servo's bus watchdog is armed. */
    LEO_JOINT_POWER_ON = 4,
    /* The servo is told to switch it off, and has not confirmed it. */
    LEO_JOINT_POWER_CUTTING = 5,
};

/* Why something that a source reported did not become a percept. Frames are lost whole for
 * the first six reasons, single observations for the others. */
enum leo_loss {
    /* A newer frame of its source came before the cycle that would have taken it. */
    LEO_LOSS_OVERTAKEN = 0,
    /* It was dropped before the sensor process came to take it: a gap of the sequence. */
    LEO_LOSS_MISSED = 1,
    /* The middleware could not give it to the sensor process. */
    LEO_LOSS_UNREADABLE = 2,
    /* Its number did not grow, or grew by more than a source can have sent. */
    LEO_LOSS_MISNUMBERED = 3,
    /* It bore no stamp of `Hop::Observed`, or one of another time than the present. */
    LEO_LOSS_UNSTAMPED = 4,
    /* A frame was later or much earlier than the present, or not newer than its predecessor. */
    LEO_LOSS_UNTIMELY = 5,
    /* It was later than the present. */
    LEO_LOSS_FUTURE = 6,
    /* It was so old that it says nothing of the present. */
    LEO_LOSS_PAST = 7,
    /* It was not newer than what its source reported in an earlier frame. */
    LEO_LOSS_STALE = 8,
    /* It was of no known kind. */
    LEO_LOSS_KIND = 9,
    /* It was made by no known sense. */
    LEO_LOSS_SENSE = 10,
    /* Its place was no number, or out of reach. */
    LEO_LOSS_PLACE = 11,
    /* Its orientation was no quaternion of norm one. */
    LEO_LOSS_ORIENTATION = 12,
    /* Its extents were no number, negative, or out of reach. */
    LEO_LOSS_EXTENTS = 13,
    /* Its colour or its shape was not in [0, 1]. */
    LEO_LOSS_LOOK = 14,
    /* Its confidence was not in [0, 1]. */
    LEO_LOSS_CONFIDENCE = 15,
    /* It was of a person who is nobody. */
    LEO_LOSS_PERSON = 16,
    /* There was no room for it. */
    LEO_LOSS_LEFT_OUT = 17,
    /* The degree of a state was neither in [0, 1] nor NaN, which says that the thing has no such state. */
    LEO_LOSS_STATE = 18,
    /* It was of a person of whom there was another one of the same instant in the frame. */
    LEO_LOSS_TWICE = 19,
};

/* The sense that made an observation. */
enum leo_modality {
    /* Seen. */
    LEO_MODALITY_VISION = 1,
    /* Heard. */
    LEO_MODALITY_HEARING = 2,
    /* Felt, or known from one's own joints. */
    LEO_MODALITY_TOUCH = 3,
};

/* What an observation is of. */
enum leo_observation_kind {
    /* A thing on the table. */
    LEO_OBSERVATION_KIND_OBJECT = 1,
    /* A partner, or the robot's own head; the pose is that of the eyes (x along the line of sight). */
    LEO_OBSERVATION_KIND_PERSON = 2,
    /* A thing that hides what lies behind it; the extents are those of a box. */
    LEO_OBSERVATION_KIND_OCCLUDER = 3,
};

/* A process of Leo, in the direction the data flows. */
enum leo_process {
    /* The workspace, the teacher and Leo's body. */
    LEO_PROCESS_SIMULATOR = 0,
    /* Observations to percepts. */
    LEO_PROCESS_SENSOR = 1,
    /* Percepts to beliefs. */
    LEO_PROCESS_BELIEF = 2,
    /* Beliefs to tasks, tasks to joint goals. */
    LEO_PROCESS_LEARNER = 3,
    /* The other end of the servo buses. */
    LEO_PROCESS_MOCK_BUS = 4,
    /* Joint goals to servos, servos to joint states. */
    LEO_PROCESS_MOTOR = 5,
    /* Tells people what happens. */
    LEO_PROCESS_CONSOLE = 6,
    /* Starts and watches the others. */
    LEO_PROCESS_SUPERVISOR = 7,
    /* Carries frames between this machine and another one. */
    LEO_PROCESS_LINK = 8,
};

/* Where a process is in its life. */
enum leo_process_state {
    /* Nothing was written yet. */
    LEO_PROCESS_STATE_ABSENT = 0,
    /* Opening its ports, locking its memory. */
    LEO_PROCESS_STATE_STARTING = 1,
    /* In its loop. */
    LEO_PROCESS_STATE_RUNNING = 2,
    /* Told to stop. */
    LEO_PROCESS_STATE_STOPPING = 3,
};

/* Who moves what is on the table. */
enum leo_scene_mode {
    /* The lesson's script is played. */
    LEO_SCENE_MODE_SCRIPT = 1,
    /* A teacher sets the table by hand: things come, go and move as he likes. */
    LEO_SCENE_MODE_SET_UP = 2,
    /* A teacher teaches by hand: things move, and what he does is written down. */
    LEO_SCENE_MODE_TEACHING = 3,
    /* The lesson's script was played to its end; Leo may still be at work. */
    LEO_SCENE_MODE_OVER = 4,
};

/* A discrete state of a thing, observed as a degree in [0, 1]. */
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

/* What a teacher does by hand in the simulated workspace. */
enum leo_teacher_act_kind {
    /* Says the text. */
    LEO_TEACHER_ACT_KIND_SAY = 1,
    /* Takes the thing that `text` names in his hand. */
    LEO_TEACHER_ACT_KIND_TAKE = 2,
    /* Moves what is in his hand to a place. */
    LEO_TEACHER_ACT_KIND_CARRY = 3,
    /* Lets go what is in his hand, at a place. */
    LEO_TEACHER_ACT_KIND_PUT = 4,
    /* Puts what is in his hand back where it was taken. */
    LEO_TEACHER_ACT_KIND_CANCEL = 5,
    /* Moves his eyes to a place, and looks at another. */
    LEO_TEACHER_ACT_KIND_SEAT = 6,
    /* Goes away. */
    LEO_TEACHER_ACT_KIND_LEAVE = 7,
    /* Comes back. */
    LEO_TEACHER_ACT_KIND_RETURN = 8,
    /* Moves the occluder that `text` names, or puts up a new one. */
    LEO_TEACHER_ACT_KIND_SCREEN = 9,
    /* Lays a new object of the kind `text` and the colour `colour`. */
    LEO_TEACHER_ACT_KIND_ADD = 10,
    /* Takes the object or the occluder that `text` names off the table. */
    LEO_TEACHER_ACT_KIND_REMOVE = 11,
    /* Begins an empty table. */
    LEO_TEACHER_ACT_KIND_CLEAR = 12,
    /* Lays a table of the lesson. */
    LEO_TEACHER_ACT_KIND_LAY = 13,
    /* Opens the lesson that `text` names, and plays it. */
    LEO_TEACHER_ACT_KIND_OPEN = 14,
    /* Plays the open lesson from its beginning. */
    LEO_TEACHER_ACT_KIND_PLAY = 15,
    /* Takes the last act back. */
    LEO_TEACHER_ACT_KIND_UNDO = 16,
    /* Writes what was taught by hand as a lesson of the title `text`. */
    LEO_TEACHER_ACT_KIND_SAVE = 17,
};

/* What a thing on the table is for. */
enum leo_thing_role {
    /* To be worked on. */
    LEO_THING_ROLE_BLOCK = 1,
    /* To be put into a hole. */
    LEO_THING_ROLE_PEG = 2,
    /* To mark what it is put onto. */
    LEO_THING_ROLE_MARKER = 3,
};

/* What a process shall do with its turn. */
enum leo_turn_kind {
    /* One step at the given instant. */
    LEO_TURN_KIND_STEP = 1,
    /* End the process. */
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

/* What became of an act. */
#define LEO_ACT_ANSWER_TYPE "leo/ActAnswer/1"
struct leo_act_answer {
    LEO_NAMED(LEO_ACT_ANSWER_TYPE)
    /* The act's serial number. */
    uint64_t serial;
    /* 1 where it was refused, 0 where it was done. */
    uint64_t refused;
    /* Why it was refused; or what came of it: the new object's name, the file that was written. */
    struct leo_text text;
};
LEO_ASSERT(sizeof(struct leo_act_answer) == 272, "size of leo/ActAnswer/1");
LEO_ASSERT(offsetof(struct leo_act_answer, serial) == 0, "place of serial");
LEO_ASSERT(offsetof(struct leo_act_answer, refused) == 8, "place of refused");
LEO_ASSERT(offsetof(struct leo_act_answer, text) == 16, "place of text");

/* One percept about which two beliefs in the same thing differ. Places and orientations are in
 * the robot's base frame. */
#define LEO_ASPECT_TYPE "leo/Aspect/1"
struct leo_aspect {
    LEO_NAMED(LEO_ASPECT_TYPE)
    double apart;
    /* The percept: its index in the configured set P. */
    uint16_t percept;
    uint16_t one_kind;
    uint16_t other_kind;
    uint16_t reserved;
    float one[4];
    float other[4];
};
LEO_ASSERT(sizeof(struct leo_aspect) == 48, "size of leo/Aspect/1");
LEO_ASSERT(offsetof(struct leo_aspect, apart) == 0, "place of apart");
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
    /* When the newest sample behind it was taken, in nanoseconds of the clock. */
    uint64_t sampled_at_ns;
    /* The percept: its index in the configured set P. */
    uint16_t percept;
    uint16_t feature_kind;
    /* Match m' in [0, 1]. */
    float matching;
    /* Confidence c' in [0, 1], decayed since the newest sample. */
    float confidence;
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
#define LEO_BELIEF_TYPE "leo/Belief/2"
struct leo_belief {
    LEO_NAMED(LEO_BELIEF_TYPE)
    /* Identity within its belief system; the older one survives a merge. */
    uint64_t id;
    /* When the object was first perceived, in nanoseconds of the clock. */
    uint64_t born_at_ns;
    /* When it was last perceived. */
    uint64_t perceived_at_ns;
    /* Observations behind it. */
    uint64_t observations;
    /* The agent who last was perceived to hold it at this instant, or `NOBODY`. */
    uint16_t held_by;
    /* The agent to whom the thing belongs in the eyes of this perspective, or `NOBODY` for what is
     * everybody's. */
    uint16_t owner;
    uint32_t count;
    struct leo_remembered percepts[12];
};
LEO_ASSERT(sizeof(struct leo_belief) == 520, "size of leo/Belief/2");
LEO_ASSERT(offsetof(struct leo_belief, id) == 0, "place of id");
LEO_ASSERT(offsetof(struct leo_belief, born_at_ns) == 8, "place of born_at_ns");
LEO_ASSERT(offsetof(struct leo_belief, perceived_at_ns) == 16, "place of perceived_at_ns");
LEO_ASSERT(offsetof(struct leo_belief, observations) == 24, "place of observations");
LEO_ASSERT(offsetof(struct leo_belief, held_by) == 32, "place of held_by");
LEO_ASSERT(offsetof(struct leo_belief, owner) == 34, "place of owner");
LEO_ASSERT(offsetof(struct leo_belief, count) == 36, "place of count");
LEO_ASSERT(offsetof(struct leo_belief, percepts) == 40, "place of percepts");

/* The beginning of every frame. */
#define LEO_HEADER_TYPE "leo/Header/1"
struct leo_header {
    LEO_NAMED(LEO_HEADER_TYPE)
    /* The instant that the frame speaks about, in nanoseconds of the clock. */
    uint64_t valid_at_ns;
    /* Counts the writer's frames from one, without gaps: a gap at the reader is a loss. */
    uint64_t sequence;
    /* Counts the writer's lives from one: a change says that its memory began anew. */
    uint64_t incarnation;
    /* When the frame, or what it was made from, passed each hop; zero where it did not. */
    uint64_t hops_ns[8];
    /* Entries that did not fit into this frame, or into those it was made from, and were left out. */
    uint64_t left_out;
};
LEO_ASSERT(sizeof(struct leo_header) == 96, "size of leo/Header/1");
LEO_ASSERT(offsetof(struct leo_header, valid_at_ns) == 0, "place of valid_at_ns");
LEO_ASSERT(offsetof(struct leo_header, sequence) == 8, "place of sequence");
LEO_ASSERT(offsetof(struct leo_header, incarnation) == 16, "place of incarnation");
LEO_ASSERT(offsetof(struct leo_header, hops_ns) == 24, "place of hops_ns");
LEO_ASSERT(offsetof(struct leo_header, left_out) == 88, "place of left_out");

/* Whose perspective it is, and within whose: `[]` is the robot's own, `[1]` what it takes partner 1
 * to believe, `[1, 0]` what it takes partner 1 to take the robot to believe.
 * 
 * Nobody stands twice in a row, nor the robot first: what somebody takes himself to believe is
 * what he believes. */
#define LEO_PATH_TYPE "leo/Path/1"
struct leo_path {
    LEO_NAMED(LEO_PATH_TYPE)
    uint32_t depth;
    uint16_t agents[6];
};
LEO_ASSERT(sizeof(struct leo_path) == 16, "size of leo/Path/1");
LEO_ASSERT(offsetof(struct leo_path, depth) == 0, "place of depth");
LEO_ASSERT(offsetof(struct leo_path, agents) == 4, "place of agents");

/* The head of a belief buffer: whose beliefs, and the frame they are in. */
#define LEO_BELIEF_HEAD_TYPE "leo/BeliefHead/2"
struct leo_belief_head {
    LEO_NAMED(LEO_BELIEF_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* Which perspective's beliefs, by the number of the buffer: 0 the robot's own, n what it takes
     * partner n to believe, and from there on those nested deeper, in the order of their paths. */
    uint32_t perspective;
    /* Whether the perspective perceived anything possible at this instant: 1 yes, 0 the partner
     * is absent or his pose unknown, and his beliefs are frozen. */
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
    /* Observations of this instant that it could not. */
    uint32_t hidden;
    /* Observations refused because their numbers were unsound, since the process started. */
    uint64_t refused;
    /* Beliefs created, since the process started. */
    uint64_t created;
    /* Pairs of beliefs merged, since the process started. */
    uint64_t merged;
    /* Beliefs culled, since the process started. */
    uint64_t culled;
    /* Observations dropped because no belief was free, and those of occluders that hide nothing because
     * more stood there at once than are remembered, since the process started. */
    uint64_t overflowed;
    /* Whose beliefs, and within whose. */
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

/* A distribution of durations in nanoseconds with a bounded relative error of 1/16, in the
 * log-linear layout of HDR histograms, as plain memory: recording is a handful of instructions,
 * publishing is a copy, and nothing allocates. */
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

/* How one servo bus fares, since the motor process's life began. */
#define LEO_BUS_HEALTH_TYPE "leo/BusHealth/2"
struct leo_bus_health {
    LEO_NAMED(LEO_BUS_HEALTH_TYPE)
    /* What the configuration calls it. */
    struct leo_text name;
    /* Joints on it. */
    uint64_t joints;
    /* Joints of it that are quarantined now. */
    uint64_t quarantined;
    /* Whether its line is lost now: 1 yes, 0 no. */
    uint64_t lost;
    /* Requests carried out. */
    uint64_t exchanges;
    /* Cycles in which it was still busy with the request before. */
    uint64_t skipped;
    /* Answers that did not come. */
    uint64_t missed;
    /* Answers that arrived broken. */
    uint64_t broken;
    /* Answers dropped because nobody awaited them, or because they were sampled too early. */
    uint64_t stale;
    /* Bytes that came after their time. */
    uint64_t late_bytes;
    /* Hardware alerts of its servos. */
    uint64_t alerts;
    /* Times that a servo of it began anew by itself. */
    uint64_t restarts;
    /* Bus watchdogs of its servos that were found to have tripped. */
    uint64_t watchdogs;
    /* Instructions that a servo refused by an error number. */
    uint64_t refusals;
    /* Identifiers to which two servos were found to answer. */
    uint64_t duplicates;
    /* Times that its line was lost. */
    uint64_t hang_ups;
    /* How long the requests took, in nanoseconds. */
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
LEO_ASSERT(offsetof(struct leo_bus_health, broken) == 304, "place of broken");
LEO_ASSERT(offsetof(struct leo_bus_health, stale) == 312, "place of stale");
LEO_ASSERT(offsetof(struct leo_bus_health, late_bytes) == 320, "place of late_bytes");
LEO_ASSERT(offsetof(struct leo_bus_health, alerts) == 328, "place of alerts");
LEO_ASSERT(offsetof(struct leo_bus_health, restarts) == 336, "place of restarts");
LEO_ASSERT(offsetof(struct leo_bus_health, watchdogs) == 344, "place of watchdogs");
LEO_ASSERT(offsetof(struct leo_bus_health, refusals) == 352, "place of refusals");
LEO_ASSERT(offsetof(struct leo_bus_health, duplicates) == 360, "place of duplicates");
LEO_ASSERT(offsetof(struct leo_bus_health, hang_ups) == 368, "place of hang_ups");
LEO_ASSERT(offsetof(struct leo_bus_health, exchange) == 376, "place of exchange");

/* How the servo buses fare: the motor process writes it to a board of its own. */
#define LEO_BUSES_TYPE "leo/Buses/2"
struct leo_buses {
    LEO_NAMED(LEO_BUSES_TYPE)
    /* How many buses there are. */
    uint64_t count;
    /* Each of them, in the order of the configuration. */
    struct leo_bus_health buses[16];
};
LEO_ASSERT(sizeof(struct leo_buses) == 34056, "size of leo/Buses/2");
LEO_ASSERT(offsetof(struct leo_buses, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_buses, buses) == 8, "place of buses");

/* An entry of a divergence buffer: how two perspectives differ about one thing. */
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

/* The head of a divergence buffer: which two perspectives are compared. Of the same instant and
 * number as the belief buffers of both. */
#define LEO_DIVERGENCE_HEAD_TYPE "leo/DivergenceHead/1"
struct leo_divergence_head {
    LEO_NAMED(LEO_DIVERGENCE_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* The other of the two perspectives, by the number of its buffers. */
    uint32_t perspective;
    /* The one of the two: the perspective that the other is nested in, 0 for a partner's. */
    uint32_t within;
    /* Things about which the two believe the same. */
    uint32_t agreed;
    /* 1 where the two are compared, 0 as long as he whose the other perspective is was not
     * observed yet. */
    uint32_t compared;
    /* Whose the other perspective is, and within whose. */
    struct leo_path path;
};
LEO_ASSERT(sizeof(struct leo_divergence_head) == 128, "size of leo/DivergenceHead/1");
LEO_ASSERT(offsetof(struct leo_divergence_head, header) == 0, "place of header");
LEO_ASSERT(offsetof(struct leo_divergence_head, perspective) == 96, "place of perspective");
LEO_ASSERT(offsetof(struct leo_divergence_head, within) == 100, "place of within");
LEO_ASSERT(offsetof(struct leo_divergence_head, agreed) == 104, "place of agreed");
LEO_ASSERT(offsetof(struct leo_divergence_head, compared) == 108, "place of compared");
LEO_ASSERT(offsetof(struct leo_divergence_head, path) == 112, "place of path");

/* Lockstep: a process has done its turn. */
#define LEO_DONE_TYPE "leo/Done/1"
struct leo_done {
    LEO_NAMED(LEO_DONE_TYPE)
    /* The turn that is done. */
    uint64_t round;
    /* Whether the process has nothing left to do: 1 yes, 0 no. The lesson is over when the
     * simulator says so. */
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
    /* Whose perspective it belongs to: 0 the robot's, n partner n's. */
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
    /* The task it is about. */
    struct leo_text task;
    /* What it says. */
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

/* The health of one process: what its loop counted, for whoever looks.
 * 
 * It stands on a blackboard in shared memory, so that looking never touches the thread that is
 * looked at. */
#define LEO_HEALTH_TYPE "leo/Health/2"
struct leo_health {
    LEO_NAMED(LEO_HEALTH_TYPE)
    /* The operating system's process number. */
    uint32_t pid;
    uint32_t state;
    /* Counts the process's lives from one. */
    uint64_t incarnation;
    /* Grows with every turn of the loop: a beat that stands still is a process that hangs. */
    uint64_t beat;
    /* When the beat last grew, in nanoseconds of the monotonic clock. */
    uint64_t beat_at_ns;
    /* When this life began. */
    uint64_t started_at_ns;
    /* Configured period of the cycle; zero for a process that is woken. */
    uint64_t period_ns;
    /* Cycles begun. */
    uint64_t cycles;
    /* Cycles that ended after their deadline. */
    uint64_t overruns;
    /* Releases skipped because a cycle ran past them; never made up. */
    uint64_t skipped;
    /* Frames lost at the process's inlets, by gaps of the sequence. */
    uint64_t drops;
    /* Frames that an outlet could not deliver to some reader. */
    uint64_t undelivered;
    /* Frames or entries refused because they were nonsense. */
    uint64_t refused;
    /* Frames refused because the supervisor's roster does not name the process that published them. */
    uint64_t unlisted_frames;
    /* The process number of the newest such publisher; zero where there was none. */
    uint64_t unlisted_pid;
    /* Page faults since the loop began, minor and major. */
    uint64_t page_faults;
    /* Rights that were asked for and not granted, one bit each: scheduling, affinity, memory. */
    uint64_t missing_rights;
    /* Release to start. */
    struct leo_histogram wakeup;
    /* Start to end. */
    struct leo_histogram execution;
    /* Age of the input when its step began: from the previous hop's publication. */
    struct leo_histogram latency;
};
LEO_ASSERT(sizeof(struct leo_health) == 5384, "size of leo/Health/2");
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
LEO_ASSERT(offsetof(struct leo_health, page_faults) == 112, "place of page_faults");
LEO_ASSERT(offsetof(struct leo_health, missing_rights) == 120, "place of missing_rights");
LEO_ASSERT(offsetof(struct leo_health, wakeup) == 128, "place of wakeup");
LEO_ASSERT(offsetof(struct leo_health, execution) == 1880, "place of execution");
LEO_ASSERT(offsetof(struct leo_health, latency) == 3632, "place of latency");

/* Where one joint shall be, and when. */
#define LEO_JOINT_GOAL_TYPE "leo/JointGoal/1"
struct leo_joint_goal {
    LEO_NAMED(LEO_JOINT_GOAL_TYPE)
    /* The joint: its index in the robot's configuration. */
    uint32_t joint;
    /* Not used; zero. */
    uint32_t reserved;
    /* Goal position, in radians from the joint's zero. */
    double goal_position_rad;
    /* When it shall be there, in nanoseconds of the clock; the motor process moves smoothly and
     * arrives later where the joint's limits ask for it. */
    uint64_t arrive_at_ns;
};
LEO_ASSERT(sizeof(struct leo_joint_goal) == 24, "size of leo/JointGoal/1");
LEO_ASSERT(offsetof(struct leo_joint_goal, joint) == 0, "place of joint");
LEO_ASSERT(offsetof(struct leo_joint_goal, reserved) == 4, "place of reserved");
LEO_ASSERT(offsetof(struct leo_joint_goal, goal_position_rad) == 8, "place of goal_position_rad");
LEO_ASSERT(offsetof(struct leo_joint_goal, arrive_at_ns) == 16, "place of arrive_at_ns");

/* What one joint does. */
#define LEO_JOINT_STATE_TYPE "leo/JointState/3"
struct leo_joint_state {
    LEO_NAMED(LEO_JOINT_STATE_TYPE)
    /* The joint: its index in the robot's configuration. */
    uint32_t joint;
    uint16_t mode;
    uint16_t cause;
    /* When the servo was read, in nanoseconds of the clock; zero when it never was. */
    uint64_t sampled_at_ns;
    double present_position_rad;
    double present_velocity_rad_s;
    double present_current_a;
    double command_position_rad;
    float present_temperature_c;
    float present_input_v;
    uint16_t link;
    uint16_t power;
    uint16_t licence;
    uint16_t motion;
    uint16_t licence_cause;
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
LEO_ASSERT(offsetof(struct leo_joint_state, licence) == 60, "place of licence");
LEO_ASSERT(offsetof(struct leo_joint_state, motion) == 62, "place of motion");
LEO_ASSERT(offsetof(struct leo_joint_state, licence_cause) == 64, "place of licence_cause");
LEO_ASSERT(offsetof(struct leo_joint_state, reserved) == 66, "place of reserved");

/* The newest joint states, for whoever looks now and then: the motor process writes them to a board of
 * its own. Who reads a topic is known to its writer, and costs it a page now and then; who reads a board
 * is not. */
#define LEO_JOINTS_TYPE "leo/Joints/2"
struct leo_joints {
    LEO_NAMED(LEO_JOINTS_TYPE)
    /* How many joints there are. */
    uint64_t count;
    /* How often a joint was locked since the motor process started. An acknowledgement names the newest that
     * was seen, so that it acknowledges no other. */
    uint64_t locks;
    /* Goals beyond a joint's limits, which became the limit. */
    uint64_t limited;
    /* Goals refused: no number, or for no joint. */
    uint64_t refused;
    /* What each of them does. */
    struct leo_joint_state states[256];
};
LEO_ASSERT(sizeof(struct leo_joints) == 18464, "size of leo/Joints/2");
LEO_ASSERT(offsetof(struct leo_joints, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_joints, locks) == 8, "place of locks");
LEO_ASSERT(offsetof(struct leo_joints, limited) == 16, "place of limited");
LEO_ASSERT(offsetof(struct leo_joints, refused) == 24, "place of refused");
LEO_ASSERT(offsetof(struct leo_joints, states) == 32, "place of states");

/* One life of a process, as its supervisor knows it. */
#define LEO_LIFE_TYPE "leo/Life/1"
struct leo_life {
    LEO_NAMED(LEO_LIFE_TYPE)
    /* Counts the lives of the process from one; zero where it was never started. */
    uint64_t incarnation;
    /* When the supervisor began to start it, in nanoseconds of the monotonic clock. */
    uint64_t began_at_ns;
    /* When the supervisor learned of its end; zero while it lives. No other process has its number before that. */
    uint64_t ended_at_ns;
    /* The operating system's process number, in the outermost namespace that can be seen; zero while it is unknown. */
    uint32_t pid;
    /* 1 where the process is one of this robot on this machine, else 0. */
    uint32_t is_member;
};
LEO_ASSERT(sizeof(struct leo_life) == 32, "size of leo/Life/1");
LEO_ASSERT(offsetof(struct leo_life, incarnation) == 0, "place of incarnation");
LEO_ASSERT(offsetof(struct leo_life, began_at_ns) == 8, "place of began_at_ns");
LEO_ASSERT(offsetof(struct leo_life, ended_at_ns) == 16, "place of ended_at_ns");
LEO_ASSERT(offsetof(struct leo_life, pid) == 24, "place of pid");
LEO_ASSERT(offsetof(struct leo_life, is_member) == 28, "place of is_member");

/* How the link to another machine fares, since the link process's life began: it writes this to a board of
 * its own. Delays are between the two machines, in nanoseconds. */
#define LEO_LINK_HEALTH_TYPE "leo/LinkHealth/1"
struct leo_link_health {
    LEO_NAMED(LEO_LINK_HEALTH_TYPE)
    /* Whether the other machine is heard now: 1 yes, 0 no. */
    uint64_t is_heard;
    /* How often it came to be heard: once, and once more after each silence. */
    uint64_t hearings;
    /* The newest round trip to the other machine and back, without the time that it took to answer. */
    uint64_t round_trip_ns;
    /* By how much the instants of frames that came over the link are wrong at most: what is not known of the
     * difference between the two machines' clocks. */
    uint64_t clock_error_ns;
    /* Frames that were handed to the network. */
    uint64_t sent;
    /* Frames that were not sent because a newer one of their topic overtook them: the network is slower than
     * their writer. */
    uint64_t overtaken;
    /* Frames that waited for the other machine for too long, or were too many, and were given up. */
    uint64_t given_up;
    /* Frames that came and were published here. */
    uint64_t received;
    /* Bundles of frames that were sent to this machine and did not arrive. */
    uint64_t lost;
    /* Frames and messages from the other machine that were nonsense, or of another version. */
    uint64_t refused;
    /* Commands that came too late to be carried out. */
    uint64_t late;
    /* Bytes that were handed to the network. */
    uint64_t bytes_sent;
    /* Bytes that came. */
    uint64_t bytes_received;
    /* How long bundles of frames took from the other machine to this one, wrong by
     * `Self::clock_error_ns` at most. */
    struct leo_histogram delay;
};
LEO_ASSERT(sizeof(struct leo_link_health) == 1856, "size of leo/LinkHealth/1");
LEO_ASSERT(offsetof(struct leo_link_health, is_heard) == 0, "place of is_heard");
LEO_ASSERT(offsetof(struct leo_link_health, hearings) == 8, "place of hearings");
LEO_ASSERT(offsetof(struct leo_link_health, round_trip_ns) == 16, "place of round_trip_ns");
LEO_ASSERT(offsetof(struct leo_link_health, clock_error_ns) == 24, "place of clock_error_ns");
LEO_ASSERT(offsetof(struct leo_link_health, sent) == 32, "place of sent");
LEO_ASSERT(offsetof(struct leo_link_health, overtaken) == 40, "place of overtaken");
LEO_ASSERT(offsetof(struct leo_link_health, given_up) == 48, "place of given_up");
LEO_ASSERT(offsetof(struct leo_link_health, received) == 56, "place of received");
LEO_ASSERT(offsetof(struct leo_link_health, lost) == 64, "place of lost");
LEO_ASSERT(offsetof(struct leo_link_health, refused) == 72, "place of refused");
LEO_ASSERT(offsetof(struct leo_link_health, late) == 80, "place of late");
LEO_ASSERT(offsetof(struct leo_link_health, bytes_sent) == 88, "place of bytes_sent");
LEO_ASSERT(offsetof(struct leo_link_health, bytes_received) == 96, "place of bytes_received");
LEO_ASSERT(offsetof(struct leo_link_health, delay) == 104, "place of delay");

/* What one sensory process reported of one thing at one instant, in the robot's base frame.
 * 
 * An observation carries no identity of the thing: finding out which thing it was is the Belief
 * System's work (Berlin et al. 2006, "Belief Modeling"). */
#define LEO_OBSERVATION_TYPE "leo/Observation/1"
struct leo_observation {
    LEO_NAMED(LEO_OBSERVATION_TYPE)
    /* When the sensory process observed it, in nanoseconds of the clock. */
    uint64_t observed_at_ns;
    /* The sensory process that reported it. */
    uint16_t source;
    /* A `Modality`. */
    uint16_t modality;
    /* An `ObservationKind`. */
    uint16_t kind;
    /* For a person: which partner (1, 2, …), or 0 for the robot itself. */
    uint16_t partner;
    /* The agent who holds or moves it, or `NOBODY`. */
    uint16_t held_by;
    /* Not used; zero. */
    uint16_t reserved;
    /* How sure the sensory process is, in [0, 1]. */
    float confidence;
    /* Position in the robot's base frame, in metres. */
    float position_m[3];
    /* Orientation in the robot's base frame, quaternion `[x, y, z, w]`. */
    float orientation_xyzw[4];
    /* Half the extents along the thing's own axes, in metres. */
    float half_extents_m[3];
    /* Colour, linear red, green and blue in [0, 1]. */
    float colour_rgb[3];
    /* Shape descriptor: how elongated, how flat, how round, how tapered; each in [0, 1]. */
    float shape[4];
    /* Degree of each `State`; NaN where the thing has no such state. */
    float states[8];
};
LEO_ASSERT(sizeof(struct leo_observation) == 128, "size of leo/Observation/1");
LEO_ASSERT(offsetof(struct leo_observation, observed_at_ns) == 0, "place of observed_at_ns");
LEO_ASSERT(offsetof(struct leo_observation, source) == 8, "place of source");
LEO_ASSERT(offsetof(struct leo_observation, modality) == 10, "place of modality");
LEO_ASSERT(offsetof(struct leo_observation, kind) == 12, "place of kind");
LEO_ASSERT(offsetof(struct leo_observation, partner) == 14, "place of partner");
LEO_ASSERT(offsetof(struct leo_observation, held_by) == 16, "place of held_by");
LEO_ASSERT(offsetof(struct leo_observation, reserved) == 18, "place of reserved");
LEO_ASSERT(offsetof(struct leo_observation, confidence) == 20, "place of confidence");
LEO_ASSERT(offsetof(struct leo_observation, position_m) == 24, "place of position_m");
LEO_ASSERT(offsetof(struct leo_observation, orientation_xyzw) == 36, "place of orientation_xyzw");
LEO_ASSERT(offsetof(struct leo_observation, half_extents_m) == 52, "place of half_extents_m");
LEO_ASSERT(offsetof(struct leo_observation, colour_rgb) == 64, "place of colour_rgb");
LEO_ASSERT(offsetof(struct leo_observation, shape) == 76, "place of shape");
LEO_ASSERT(offsetof(struct leo_observation, states) == 92, "place of states");

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

/* An entry of the percept buffer: an observation and what the robot perceives in it.
 * 
 * The observation travels along because another perspective perceives it anew in its own frame
 * (Eq. 7). */
#define LEO_PERCEIVED_TYPE "leo/Perceived/1"
struct leo_perceived {
    LEO_NAMED(LEO_PERCEIVED_TYPE)
    /* What was observed. */
    struct leo_observation observation;
    /* The robot's own percept snapshot of it. */
    struct leo_snapshot snapshot;
};
LEO_ASSERT(sizeof(struct leo_perceived) == 472, "size of leo/Perceived/1");
LEO_ASSERT(offsetof(struct leo_perceived, observation) == 0, "place of observation");
LEO_ASSERT(offsetof(struct leo_perceived, snapshot) == 128, "place of snapshot");

/* The head of a percept buffer: who looked. */
#define LEO_PERCEPT_HEAD_TYPE "leo/PerceptHead/1"
struct leo_percept_head {
    LEO_NAMED(LEO_PERCEPT_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* The sources that looked: bit n for source n, the last bit for all beyond. */
    uint64_t looked;
};
LEO_ASSERT(sizeof(struct leo_percept_head) == 104, "size of leo/PerceptHead/1");
LEO_ASSERT(offsetof(struct leo_percept_head, header) == 0, "place of header");
LEO_ASSERT(offsetof(struct leo_percept_head, looked) == 96, "place of looked");

/* What was computed of one perspective, since its process's life began. */
#define LEO_PERSPECTIVE_HEALTH_TYPE "leo/PerspectiveHealth/2"
struct leo_perspective_health {
    LEO_NAMED(LEO_PERSPECTIVE_HEALTH_TYPE)
    /* Whose it is, and within whose. */
    struct leo_path path;
    /* How often its beliefs were brought to an instant. */
    uint64_t steps;
    /* Beliefs that it held after each of these steps, all together. */
    uint64_t beliefs;
    /* Observations, beliefs and occluders for which it had no room. */
    uint64_t left_out;
    /* Observations and evaluations that it refused as nonsense. */
    uint64_t refused;
};
LEO_ASSERT(sizeof(struct leo_perspective_health) == 48, "size of leo/PerspectiveHealth/2");
LEO_ASSERT(offsetof(struct leo_perspective_health, path) == 0, "place of path");
LEO_ASSERT(offsetof(struct leo_perspective_health, steps) == 16, "place of steps");
LEO_ASSERT(offsetof(struct leo_perspective_health, beliefs) == 24, "place of beliefs");
LEO_ASSERT(offsetof(struct leo_perspective_health, left_out) == 32, "place of left_out");
LEO_ASSERT(offsetof(struct leo_perspective_health, refused) == 40, "place of refused");

/* What was computed of each perspective: the belief process writes it to a board of its own. Where
 * perspective taking is off there is one, the robot's own. */
#define LEO_PERSPECTIVES_TYPE "leo/Perspectives/2"
struct leo_perspectives {
    LEO_NAMED(LEO_PERSPECTIVES_TYPE)
    /* How many perspectives there are. */
    uint64_t count;
    /* Each of them, by its number. */
    struct leo_perspective_health perspectives[256];
};
LEO_ASSERT(sizeof(struct leo_perspectives) == 12296, "size of leo/Perspectives/2");
LEO_ASSERT(offsetof(struct leo_perspectives, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_perspectives, perspectives) == 8, "place of perspectives");

/* Which life of each process is the newest, as the supervisor knows it: the roster names the board on which the
 * `Health`(crate::Health) of that life stands, and the process that may publish. */
#define LEO_ROSTER_TYPE "leo/Roster/3"
struct leo_roster {
    LEO_NAMED(LEO_ROSTER_TYPE)
    struct leo_life lives[16];
};
LEO_ASSERT(sizeof(struct leo_roster) == 512, "size of leo/Roster/3");
LEO_ASSERT(offsetof(struct leo_roster, lives) == 0, "place of lives");

/* The head of the simulator's scene: where the lesson is, and the robot in the world. */
#define LEO_SCENE_HEAD_TYPE "leo/SceneHead/1"
struct leo_scene_head {
    LEO_NAMED(LEO_SCENE_HEAD_TYPE)
    /* The frame's header. */
    struct leo_header header;
    /* Position of the robot's base in the world, in metres. */
    double base_position_m[3];
    /* Orientation of the robot's base in the world, quaternion `[x, y, z, w]`. */
    double base_orientation_xyzw[4];
    /* When the script or the first table laid by hand began, in nanoseconds of the clock. */
    uint64_t began_at_ns;
    /* A `SceneMode`. */
    uint32_t mode;
    /* Which of the lesson's tables is laid, from 0, or `NO_TABLE`. */
    uint32_t table;
    /* Tables of the lesson: the demonstrations, and then the novel set if it has one. */
    uint32_t tables;
    /* Steps taught by hand that are written down. */
    uint32_t steps;
    /* Which lesson is open: empty for the one that the robot was started with. */
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

/* What the simulator knows to be true of one thing, in the world frame.
 * 
 * For people who look on, and for checking what Leo did; no other process of the robot reads it. */
#define LEO_SCENE_OBJECT_TYPE "leo/SceneObject/2"
struct leo_scene_object {
    LEO_NAMED(LEO_SCENE_OBJECT_TYPE)
    /* Position in the world, in metres. */
    double position_m[3];
    /* Orientation in the world, quaternion `[x, y, z, w]`. */
    double orientation_xyzw[4];
    /* Half the extents along its own axes, in metres. */
    double half_extents_m[3];
    /* Colour, linear red, green and blue in [0, 1]. */
    float colour_rgb[3];
    /* How elongated, flat, round and tapered it is, each in [0, 1]. */
    float shape[4];
    /* Degree of each `State`; NaN where the thing has no such state. */
    float states[8];
    /* An `ObservationKind`. */
    uint16_t kind;
    /* The agent who holds it, or `NOBODY`. */
    uint16_t held_by;
    /* The partner that a person is, or `NOBODY`. */
    uint16_t partner;
    /* A `ThingRole` of an object; 0 of a person or an occluder. */
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

/* What became of what one source reported. */
#define LEO_SOURCE_HEALTH_TYPE "leo/SourceHealth/1"
struct leo_source_health {
    LEO_NAMED(LEO_SOURCE_HEALTH_TYPE)
    /* What people call it. */
    struct leo_text name;
    /* Frames that were taken. */
    uint64_t frames;
    /* Observations that entered the percept buffer. */
    uint64_t observations;
    /* When a frame was taken last, in nanoseconds of the clock; zero where none was. */
    uint64_t heard_at_ns;
    /* Whether it has been silent for longer than its rate lets expect: 1 yes, 0 no. */
    uint64_t silent;
    /* What was lost, by the number of the `Loss`. */
    uint64_t losses[24];
};
LEO_ASSERT(sizeof(struct leo_source_health) == 480, "size of leo/SourceHealth/1");
LEO_ASSERT(offsetof(struct leo_source_health, name) == 0, "place of name");
LEO_ASSERT(offsetof(struct leo_source_health, frames) == 256, "place of frames");
LEO_ASSERT(offsetof(struct leo_source_health, observations) == 264, "place of observations");
LEO_ASSERT(offsetof(struct leo_source_health, heard_at_ns) == 272, "place of heard_at_ns");
LEO_ASSERT(offsetof(struct leo_source_health, silent) == 280, "place of silent");
LEO_ASSERT(offsetof(struct leo_source_health, losses) == 288, "place of losses");

/* What became of what each source reported: the sensor process writes it to a board of its own. */
#define LEO_SOURCES_TYPE "leo/Sources/1"
struct leo_sources {
    LEO_NAMED(LEO_SOURCES_TYPE)
    /* How many sources there are. */
    uint64_t count;
    /* Each of them, by its number. */
    struct leo_source_health sources[16];
};
LEO_ASSERT(sizeof(struct leo_sources) == 7688, "size of leo/Sources/1");
LEO_ASSERT(offsetof(struct leo_sources, count) == 0, "place of count");
LEO_ASSERT(offsetof(struct leo_sources, sources) == 8, "place of sources");

/* Something that a teacher does by hand. Places are in the world, in metres. */
#define LEO_TEACHER_ACT_TYPE "leo/TeacherAct/1"
struct leo_teacher_act {
    LEO_NAMED(LEO_TEACHER_ACT_TYPE)
    /* Counts the acts of the console's life from one. */
    uint64_t serial;
    /* Where: of a thing's or an occluder's centre, or of his eyes. The height of something new is its
     * own, and that of something put down follows from what is below. */
    double position_m[3];
    /* What he looks at, of a seat; half the extents, of a new occluder. */
    double also_m[3];
    /* Heading, anticlockwise from the world's x axis, in radians; NaN to leave it as it is. */
    double heading_rad;
    /* A `TeacherActKind`. */
    uint16_t kind;
    /* Who: partner 1, 2, … */
    uint16_t teacher;
    /* Whose hand on the console: several people may teach at once, each with one hand. */
    uint16_t hand;
    /* Zero. */
    uint16_t reserved;
    /* Which table, of laying. */
    uint64_t table;
    /* What is said, named or opened. */
    struct leo_text text;
    /* The colour's name, of something new. */
    struct leo_text colour;
};
LEO_ASSERT(sizeof(struct leo_teacher_act) == 592, "size of leo/TeacherAct/1");
LEO_ASSERT(offsetof(struct leo_teacher_act, serial) == 0, "place of serial");
LEO_ASSERT(offsetof(struct leo_teacher_act, position_m) == 8, "place of position_m");
LEO_ASSERT(offsetof(struct leo_teacher_act, also_m) == 32, "place of also_m");
LEO_ASSERT(offsetof(struct leo_teacher_act, heading_rad) == 56, "place of heading_rad");
LEO_ASSERT(offsetof(struct leo_teacher_act, kind) == 64, "place of kind");
LEO_ASSERT(offsetof(struct leo_teacher_act, teacher) == 66, "place of teacher");
LEO_ASSERT(offsetof(struct leo_teacher_act, hand) == 68, "place of hand");
LEO_ASSERT(offsetof(struct leo_teacher_act, reserved) == 70, "place of reserved");
LEO_ASSERT(offsetof(struct leo_teacher_act, table) == 72, "place of table");
LEO_ASSERT(offsetof(struct leo_teacher_act, text) == 80, "place of text");
LEO_ASSERT(offsetof(struct leo_teacher_act, colour) == 336, "place of colour");

/* Lockstep: the conductor gives one process its turn at an instant of simulated time. The
 * header's `valid_at_ns` is that instant. */
#define LEO_TURN_TYPE "leo/Turn/1"
struct leo_turn {
    LEO_NAMED(LEO_TURN_TYPE)
    /* A `TurnKind`. */
    uint32_t kind;
    /* Not used; zero. */
    uint32_t reserved;
    /* Counts the turns of the run from one. */
    uint64_t round;
};
LEO_ASSERT(sizeof(struct leo_turn) == 16, "size of leo/Turn/1");
LEO_ASSERT(offsetof(struct leo_turn, kind) == 0, "place of kind");
LEO_ASSERT(offsetof(struct leo_turn, reserved) == 4, "place of reserved");
LEO_ASSERT(offsetof(struct leo_turn, round) == 8, "place of round");

/* A sentence that somebody said. */
#define LEO_UTTERANCE_TYPE "leo/Utterance/1"
struct leo_utterance {
    LEO_NAMED(LEO_UTTERANCE_TYPE)
    /* Who said it: partner 1, 2, … */
    uint32_t speaker;
    /* What was said. */
    struct leo_text text;
};
LEO_ASSERT(sizeof(struct leo_utterance) == 260, "size of leo/Utterance/1");
LEO_ASSERT(offsetof(struct leo_utterance, speaker) == 0, "place of speaker");
LEO_ASSERT(offsetof(struct leo_utterance, text) == 4, "place of text");

#endif
