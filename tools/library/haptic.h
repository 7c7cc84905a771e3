// SPDX-License-Identifier: Apache-2.0
#ifndef HAPTIC_H_INCLUDED
#define HAPTIC_H_INCLUDED
/// The C interface of the haptic renderer (C99; libhaptic.so.0). Six groups: errors, core, servo,
/// compile, plan, session.
///
/// Units are SI: m, s, N, N m, rad. Frames: W the workspace, A the part in the hand (the frame of
/// its mesh). A pose is seven numbers: position of A's mesh frame in W, then its unit quaternion x
/// y z w (Hamilton). A wrench is six: force on the hand, then torque on the hand about the grip
/// point, both in W axes.
///
/// Every function returns an error number, HAPTIC_OK where it did what it says, and then only;
/// nothing is printed, no exception leaves the library, and there is no global state. A structure
/// begins with its size, which its INIT macro fills in: the library reads and writes no more than
/// that. A size that it does not know is HAPTIC_ERROR_VERSION.
///
/// "Any thread" below: also while another thread is in any function with the same handle. Two
/// threads that need the same thing: the second gets HAPTIC_ERROR_BUSY or waits, as the function
/// says. A pointer that never was a handle, and a handle whose memory has been given back, cannot
/// be told from a good one with certainty: do not pass them.

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define HAPTIC_API __attribute__((visibility("default")))
#else
#define HAPTIC_API
#endif

// Errors.

typedef enum haptic_error {
  HAPTIC_OK = 0,
  HAPTIC_ERROR_NULL = 1,     ///< a pointer that must not be null is null
  HAPTIC_ERROR_SIZE = 2,     ///< a size or count is 0 or too small
  HAPTIC_ERROR_VERSION = 3,  ///< struct_size is none that this library knows
  HAPTIC_ERROR_CLOSED = 4,   ///< the handle has been closed
  HAPTIC_ERROR_HANDLE = 5,   ///< the pointer is not a handle of this kind
  HAPTIC_ERROR_BUSY = 6,     ///< another thread is in a function that needs the same; or the hand
                             ///< has not yet let go of what it holds
  HAPTIC_ERROR_NUMBER = 7,   ///< a number is not finite, or outside its range
  HAPTIC_ERROR_POSE = 8,     ///< a pose is not finite, or its quaternion not of unit length
  HAPTIC_ERROR_SCENE = 9,    ///< the bytes are no scene that this library can use: compile it again
  HAPTIC_ERROR_MEMORY = 10,  ///< too little memory, or not aligned to HAPTIC_ALIGNMENT
  HAPTIC_ERROR_INPUT = 11,   ///< a file or mesh cannot be used: see the messages
  HAPTIC_ERROR_LIMIT = 12,   ///< the scene exceeds a limit of time or memory: see the messages
  HAPTIC_ERROR_DEVICE = 13,  ///< there is no such device, or it is refused; or it has no simulated
                             ///< hand
  HAPTIC_ERROR_SYSTEM = 14,  ///< the operating system refused: threads, files
  HAPTIC_ERROR_INTERNAL = 15,  ///< a fault of this library; please report it with the input
  HAPTIC_ERROR_NO_PLAN = 16,   ///< no way to the goal was found, or there is none: see the text
  HAPTIC_ERROR_PART = 17,      ///< there is no such hand, or no such part that it may hold
  HAPTIC_ERROR_COUNT = 18
} haptic_error;

/// "0.1.0". Static storage. Any thread; constant cost.
HAPTIC_API const char* haptic_version(void);

/// "HAPTIC_ERROR_NULL", and a sentence for people. Of a number that is none:
/// "HAPTIC_ERROR_UNKNOWN". Never null; static storage. Any thread; constant cost.
HAPTIC_API const char* haptic_error_name(int error);
HAPTIC_API const char* haptic_error_text(int error);

// Core: the tick, in memory of the caller. Nothing here allocates, locks or makes a system call.

/// Alignment of a scene's bytes and of a core's memory.
#define HAPTIC_ALIGNMENT 64

/// Contents of a scene.
typedef struct haptic_scene_info {
  uint32_t struct_size;
  uint32_t parts;            ///< the part in the hand and the fixed ones
  uint32_t pieces;           ///< convex pieces of all parts
  uint32_t pairs;            ///< pairs of pieces that can meet
  uint64_t memory_bytes;     ///< that a core needs
  double rate_hz;            ///< ticks per second that it was compiled for
  double start_pose[7];      ///< of A in W
  double grip_m[3];          ///< grip point in A's mesh frame
  double stiffness_n_per_m;  ///< of the spring in translation; law paper: k_F
  char name[208];            ///< of the scene, cut at 207 bytes
  char trouble[96];          ///< why the scene cannot be used, with HAPTIC_ERROR_SCENE; else empty
} haptic_scene_info;
#define HAPTIC_SCENE_INFO_INIT                                        \
  {                                                                   \
    sizeof(haptic_scene_info), 0, 0, 0, 0, 0, {0}, {0}, 0, {0}, { 0 } \
  }

/// Checks a scene and says what is in it. Any bytes are safe.
/// Any thread. Cost: one pass over the bytes.
HAPTIC_API int haptic_scene_read(const void* scene, size_t scene_bytes, haptic_scene_info* info);

/// Result of a session, gravest first. From HAPTIC_VERDICT_ENERGY on it has failed.
typedef enum haptic_verdict_code {
  HAPTIC_VERDICT_FOLLOWED = 0,    ///< the part followed the hand, but for what is counted
  HAPTIC_VERDICT_NO_TICKS = 1,    ///< there was none
  HAPTIC_VERDICT_ENERGY = 2,      ///< the rendering gave out more than 1 mJ
  HAPTIC_VERDICT_OPEN_FORCE = 3,  ///< above 0.05 N for more than 100 ticks in a row in which the
                                  ///< part touched nothing
  HAPTIC_VERDICT_STUCK = 4,       ///< free to move and pulled, it stayed for more than 100 ticks
  HAPTIC_VERDICT_INSIDE = 5,      ///< inside an obstacle for the last 100 ticks and more
  HAPTIC_VERDICT_BEHIND = 6,  ///< more than 1 % of the ticks, and of 10, ended for want of budget
  HAPTIC_VERDICT_COUNT = 7
} haptic_verdict_code;

/// The judgement of all ticks since the core was created or reset, or the session opened: the same
/// that `host_sim` and `run_device` end with. A tick followed the hand where none of the counts
/// from refused_ticks on has it; a tick may be in several.
typedef struct haptic_verdict {
  uint32_t struct_size;
  uint32_t verdict;   ///< haptic_verdict_code, the gravest
  uint32_t failures;  ///< bit set: 1 << haptic_verdict_code
  uint32_t started_inside;
  uint64_t ticks, followed_ticks;
  uint64_t contact_ticks;        ///< the part as it is felt touched something
  uint64_t refused_ticks;        ///< pose not usable; of a core: the calls with HAPTIC_ERROR_POSE
  uint64_t inside_ticks;         ///< inside an obstacle, led out without force
  uint64_t outside_ticks;        ///< after the scene's limits of motion were left, without force
  uint64_t stuck_ticks;          ///< free to move and pulled by more than 0.05 N, not moved
  uint64_t list_full_ticks;      ///< more pairs near than the scene's near_pairs
  uint64_t behind_ticks;         ///< ended for want of budget
  uint64_t saturated_ticks;      ///< the pull at its limit
  uint64_t ramped_ticks;         ///< the force ramped out or in
  uint64_t longest_open_ticks;   ///< longest run with force and without contact
  uint64_t longest_stuck_ticks;  ///< longest run of stuck ticks
  double open_force_n;           ///< largest force in a run without contact that fails
  double given_out_j;  ///< by the rendering; not a number: the scene has no observer of it
  char text[768];      ///< one line for people: what helps, by the key of the scene
} haptic_verdict;
#define HAPTIC_VERDICT_INIT                                                             \
  {                                                                                     \
    sizeof(haptic_verdict), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, { 0 } \
  }

typedef struct haptic_core haptic_core;

/// Builds a core for `scene` at the begin of `memory`. Both stay where they are until the core is
/// closed, and nobody changes them. `memory_bytes`: haptic_scene_info.memory_bytes at least. Any
/// thread. Cost: one pass over the scene, and one over the memory.
HAPTIC_API int haptic_core_create(const void* scene, size_t scene_bytes, void* memory,
                                  size_t memory_bytes, haptic_core** core);

/// Input of one tick.
typedef struct haptic_step_input {
  uint32_t struct_size;
  uint32_t clutched;  ///< not 0: the goal stays where it is, the wrench ramps out
  double time_s;      ///< when the pose was sensed; from a clock that only goes forward, below 9e9
  double pose[7];     ///< of A in W, as the hand wants it
} haptic_step_input;
#define HAPTIC_STEP_INPUT_INIT                               \
  {                                                          \
    sizeof(haptic_step_input), 0, 0, { 0, 0, 0, 0, 0, 0, 1 } \
  }

/// Output of one tick.
typedef struct haptic_step_output {
  uint32_t struct_size;
  uint32_t situation;   ///< 0 none, 1 face_vertex, 2 vertex_face, 3 edge_edge, 4 edge_face, 5
                        ///< face_face, 6 several_planes
  double wrench[6];     ///< on the hand
  double felt_pose[7];  ///< of A in W: where the part is held, free of obstacles; law proxy
  double gap_m;  ///< smallest gap of the felt pose to any fixed part: lower bound of its distance;
                 ///< law proxy
  uint32_t flags;       ///< StepFlag of rt_core/tick/step.hpp
  uint32_t near_count;  ///< contact points
  uint64_t state_hash;  ///< of this tick and all before it; equal runs have equal hashes
} haptic_step_output;
#define HAPTIC_STEP_OUTPUT_INIT \
  { sizeof(haptic_step_output), 0, {0}, {0}, 0, 0, 0, 0 }

/// One tick. HAPTIC_ERROR_POSE: the core's state is as before, `output` has a zero wrench.
/// One thread at a time; a second one gets HAPTIC_ERROR_BUSY. Cost: bounded by the scene; see
/// `scene_inspect`.
HAPTIC_API int haptic_core_step(haptic_core* core, const haptic_step_input* input,
                                haptic_step_output* output);

/// One tick of a scene with two hands (HAPTIC_HAND2), the same time for both. A hand whose input is
/// null keeps its goal: its part is held still, and its output, which may be null too, stays as it
/// is. HAPTIC_ERROR_POSE: that hand's output has a zero wrench and it keeps its goal; the other has
/// made its tick. HAPTIC_ERROR_PART: the scene has one hand. Threads as haptic_core_step. Cost:
/// bounded by the scene.
HAPTIC_API int haptic_core_step_hands(haptic_core* core, const haptic_step_input* first,
                                      const haptic_step_input* second,
                                      haptic_step_output* first_output,
                                      haptic_step_output* second_output);

/// Many ticks in one call, poses in and wrenches out, of two hands for the first; goes on from the
/// last step. Pointers to results may be null: not wanted. Nothing is copied.
typedef struct haptic_replay {
  uint32_t struct_size;
  uint32_t reserved;
  size_t count;           ///< of ticks
  const double* poses;    ///< 7 for each tick
  const double* times_s;  ///< of each tick; null: 1 / rate_hz apart, on from the last tick's time,
                          ///< of a core without ticks from 0 on
  double* wrenches;       ///< 6 for each tick
  double* felt_poses;     ///< 7 for each tick
  double* gaps_m;
  uint32_t* situations;
  uint32_t* flags;
  uint64_t* state_hashes;
  size_t done;  ///< result: ticks that were done; on an error the index of the one that was refused
} haptic_replay;
#define HAPTIC_REPLAY_INIT \
  { sizeof(haptic_replay), 0, 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, 0 }

/// Threads as haptic_core_step. Cost: `count` ticks.
HAPTIC_API int haptic_core_replay(haptic_core* core, haptic_replay* replay);

/// The verdict so far; of two hands that of the second where only it has failed. Threads as
/// haptic_core_step; constant cost.
HAPTIC_API int haptic_core_verdict(haptic_core* core, haptic_verdict* verdict);

/// Forgets all contact and the verdict: the next tick is a first tick. Of a scene whose parts are
/// held one after another each stays where it is, but for the first as long as it has not been let
/// go. Threads as haptic_core_step.
/// Cost: one pass over the memory.
HAPTIC_API int haptic_core_reset(haptic_core* core);

/// A part of a scene whose parts the hand holds one after another.
typedef struct haptic_body {
  double pose[7];    ///< of its mesh frame in W, where it is felt
  uint32_t part;     ///< its number
  uint32_t role;     ///< 1 never held, 2 held at the start, 3 may be held, 4 driven by its owner,
                     ///< 5 held by the second of two hands, 6 loose
  uint32_t held_by;  ///< 0: no hand; 1: hand 0; 2: hand 1
  uint32_t reserved;
  char name[64];  ///< cut at 63 bytes
} haptic_body;

/// Hand 0 holds `part`, which it takes where the part is, with no force. HAPTIC_ERROR_BUSY: it
/// lets go of what it holds first; step on, and call again until it is HAPTIC_OK: then the next
/// step takes the part. The pose that a step is given stays that of the first part, also while
/// another is held: each part is led by its own grip point as the first one is by its. Threads as
/// haptic_core_step. Cost: one pass over the part's scene, outside of any step.
HAPTIC_API int haptic_core_hold_part(haptic_core* core, uint32_t hand, uint32_t part);

/// Hand 0 lets go: the wrench fades by the ramp of the clutch while the part stays. Threads as
/// haptic_core_step; constant cost.
HAPTIC_API int haptic_core_release_part(haptic_core* core, uint32_t hand);

/// Where the parts are, by number, `capacity` of them at most; `*count` becomes how many there are.
/// HAPTIC_ERROR_PART: the scene has one moving part. `body_bytes`: sizeof(haptic_body). Threads as
/// haptic_core_step. Cost: one copy.
HAPTIC_API int haptic_core_bodies(haptic_core* core, haptic_body* bodies, size_t capacity,
                                  size_t body_bytes, size_t* count);

/// A pose of a frame that its owner moves: of the fixed parts in W, or of a driven part's mesh
/// frame in theirs.
typedef struct haptic_frame {
  uint32_t struct_size;
  uint32_t stands;  ///< not 0: it stays there, and no newer pose is waited for
  double pose[7];
  double fastest_m_per_s;    ///< the owner moves its origin no faster; 0.001 to 2
  double fastest_rad_per_s;  ///< nor turns it; 0.001 to 20
  double late_s;             ///< a newer pose comes within this time; 0.005 to 0.5
} haptic_frame;
#define HAPTIC_FRAME_INIT \
  { sizeof(haptic_frame), 0, {0, 0, 0, 0, 0, 0, 1}, 0.25, 1.0, 0.1 }

/// A part that its owner moves: a robot's fixture, a conveyor, a body of another simulator. It
/// pushes the part in the hand and does not yield, but stays behind where it would go through it.
/// Or a loose one, which yields: `commanded` is its anchor.
typedef struct haptic_driven {
  double pose[7];       ///< of its mesh frame in W, where it is felt
  double commanded[7];  ///< the same, where its owner has it now
  double lag_m;         ///< between the two
  double lag_rad;
  double wrench[6];  ///< on it by what it touches, about its mesh frame's origin, W axes
  uint32_t part;     ///< its number
  uint32_t touches;  ///< not 0: the part in the hand
  uint32_t lost;     ///< not 0: its poses are late, too fast or none, and it stands
  uint32_t reserved;
} haptic_driven;

/// The owner of driven part `part` has it there at `time_s`, the time of the steps; to be called 30
/// to 1000 times a second. Between two poses it is interpolated, an interval behind, within the
/// speeds of the scene and of `frame`, the tighter of each. A pose that is too fast, late, or none
/// (then also HAPTIC_ERROR_POSE) makes it stay where it is; where it touches the part in the hand,
/// the wrench fades meanwhile (1 << 24 in the flags). HAPTIC_ERROR_PART: no such part is driven.
/// Threads as haptic_core_step; constant cost.
HAPTIC_API int haptic_core_drive(haptic_core* core, uint32_t part, const haptic_frame* frame,
                                 double time_s);

/// The driven parts after the last step, ascending by number, `capacity` of them at most; `*count`
/// becomes how many there are. HAPTIC_ERROR_PART: none is. `driven_bytes`: sizeof(haptic_driven).
/// Threads as haptic_core_step. Cost: one copy.
HAPTIC_API int haptic_core_driven(haptic_core* core, haptic_driven* driven, size_t capacity,
                                  size_t driven_bytes, size_t* count);

/// A point at which the part in the hand touches another.
typedef struct haptic_contact {
  double point_m[3];   ///< in W
  double normal[3];    ///< unit, W axes, from the other part to the one in the hand
  double force_n[3];   ///< on the part in the hand, W axes: its share of the wrench
  uint32_t part;       ///< that it touches, by its number; the one in the hand is 0
  uint32_t situation;  ///< of its pair of convex pieces, as in haptic_step_output
} haptic_contact;

/// The contacts of the last step, `capacity` of them at most; `*count` becomes how many there are:
/// corners of the contact regions, 8 for each of 6 planes at most; none where the part is free or
/// the step was refused. A core renders one wrench and knows the planes; what each point carries is
/// not determined by that (a table on four legs), and is the share of least squares among all that
/// push, within the cone of the scene's friction (static, where there is one). Their sum, force and
/// torque about the felt pose's grip point, is the step's wrench but for `rest`: six numbers, or
/// null. `rest` is below 1e-4 of the wrench where the part is at rest without friction. It is more
/// while it moves or the force ramps: a pull that the planes do not hold; with friction, what of it
/// is beyond a pyramid of 8 sides in the cone, and torsion about the normal of a single point; a
/// second plane of one pair. HAPTIC_ERROR_SCENE: the scene's law is not proxy; HAPTIC_ERROR_PART:
/// the scene has parts that the hand holds one after another, a second hand, or parts that are
/// driven or loose. `contact_bytes`: sizeof(haptic_contact). Threads as haptic_core_step. Cost: a
/// search of each pair that touches, and at most 48 small steps of a least-squares program.
HAPTIC_API int haptic_core_contacts(haptic_core* core, haptic_contact* contacts, size_t capacity,
                                    size_t contact_bytes, size_t* count, double* rest);

/// Writes all that a core knows, so that another one of the same scene goes on from here with the
/// same bits: contact history, ramps, energy, verdict. `*count` becomes how many bytes it takes;
/// HAPTIC_ERROR_SIZE: `capacity` is less, and nothing is written; `bytes` may be null then.
/// HAPTIC_ERROR_PART: the scene has parts that the hand holds one after another, a second hand, or
/// parts that are driven or loose. The bytes are of this build of the library; they hold no
/// addresses. Threads as haptic_core_step. Cost: two passes over the memory.
HAPTIC_API int haptic_core_save(haptic_core* core, void* bytes, size_t capacity, size_t* count);

/// Goes on from bytes that haptic_core_save has written. Where they are refused the core is as
/// before, and `text`, which may be null, becomes a sentence that says why, at most text_bytes - 1
/// characters: HAPTIC_ERROR_INPUT: they are no state, or not whole; HAPTIC_ERROR_VERSION: of
/// another version, precision or build of this library; HAPTIC_ERROR_SCENE: of another scene;
/// HAPTIC_ERROR_PART as haptic_core_save. A checksum finds damage, not intent: a state that was
/// made to do harm can do as much as a program; load none from a stranger. Threads as
/// haptic_core_step. Cost: two passes over the memory.
HAPTIC_API int haptic_core_load(haptic_core* core, const void* bytes, size_t count, char* text,
                                size_t text_bytes);

/// The core is over: its memory may be used for something else. Until then every call gives
/// HAPTIC_ERROR_CLOSED. Threads as haptic_core_step; constant cost.
HAPTIC_API int haptic_core_close(haptic_core* core);

// Servo: the tick of `run_device` in memory of the caller, for a program that has a device and its
// loop: checks of the device's state, the map from the device to the scene, arming by the deadman
// switch, limits, ramps. Nothing here allocates, locks or makes a system call.

/// Relation of the device to the scene, and what it may exert. A number that is 0 is the default in
/// brackets. D: the device's base frame.
typedef struct haptic_servo_options {
  uint32_t struct_size;
  uint32_t deadman;         ///< mask of switches: force only while all of them are held; not 0
  uint32_t clutch;          ///< mask: while any is held the handle moves without the part
  uint32_t emergency_stop;  ///< mask: any of them ramps the force to zero, latched
  uint32_t driven_axes;     ///< that have motors: bits x y z, turns about x y z
  /// 0: the part begins where the scene has it start, wherever the handle stands, and again after
  /// each fault; offset_m and part_rotation are found. Not 0: the part is where the handle is.
  uint32_t is_absolute;
  double rate_hz;              ///< of the ticks, 50 to 10 000 (the scene's)
  double scale;                ///< metres in the scene per metre at the device; 1e-3 to 1e3
  double rotation[4];          ///< x y z w, from axes of D to those of W
  double offset_m[3];          ///< D's origin in W
  double part_rotation[4];     ///< x y z w, from A's axes to those of the handle
  double max_force_n;          ///< norm (3); at most 1000
  double max_torque_nm;        ///< norm (0.05); at most 100
  double slew_n_per_s;         ///< largest change for any reason (600); at most 1e6
  double slew_nm_per_s;        ///< (10); at most 1e5
  double ramp_in_s;            ///< after arming (0.1); 0.05 to 10
  double jump_speed_m_per_s;   ///< no hand is as fast: an encoder jumped (10); at most 1000
  double jump_turn_rad_per_s;  ///< (200); at most 1e5
} haptic_servo_options;
#define HAPTIC_SERVO_OPTIONS_INIT                                                                \
  {                                                                                              \
    sizeof(haptic_servo_options), 1, 0, 0, 0x3f, 0, 0, 1, {0, 0, 0, 1}, {0}, {0, 0, 0, 1}, 0, 0, \
        0, 0, 0, 0, 0                                                                            \
  }

/// Memory that it takes, and the bounds of a tick.
typedef struct haptic_servo_bounds {
  uint32_t struct_size;
  uint32_t held_periods;  ///< without a new report or a tick: no effect
  uint32_t lost_periods;  ///< up to these the last wrench fades; beyond, a fault
  uint32_t most_work;  ///< plane gaps and feature evaluations of a tick (haptic_servo_output.work)
  uint64_t memory_bytes;  ///< that haptic_servo_begin needs
  double period_s;
  double longest_ramp_s;  ///< from the largest wrench to zero: the device's own watchdog is longer
} haptic_servo_bounds;
#define HAPTIC_SERVO_BOUNDS_INIT \
  { sizeof(haptic_servo_bounds), 0, 0, 0, 0, 0, 0 }

/// Any thread. HAPTIC_ERROR_NUMBER: a number of the options is outside its range;
/// HAPTIC_ERROR_POSE: a rotation is not of unit length; HAPTIC_ERROR_PART: the scene has two hands.
/// Cost: one pass over the scene.
HAPTIC_API int haptic_servo_bounds_of(const void* scene, size_t scene_bytes,
                                      const haptic_servo_options* options,
                                      haptic_servo_bounds* bounds);

typedef struct haptic_servo haptic_servo;

/// Builds it at the begin of `memory`, disarmed. Scene and memory stay where they are until
/// haptic_servo_close, and nobody changes them. Errors as haptic_servo_bounds_of. Of a scene whose
/// parts are held one after another the first is held all through. Any thread. Cost: one pass over
/// the scene.
HAPTIC_API int haptic_servo_begin(const void* scene, size_t scene_bytes, void* memory,
                                  size_t memory_bytes, const haptic_servo_options* options,
                                  haptic_servo** servo);

/// Input of one tick: the device's newest report.
typedef struct haptic_servo_input {
  uint32_t struct_size;
  uint32_t ready;           ///< not 0: the device is there, calibrated, and reports
  uint32_t switches;        ///< bit set: pressed
  uint32_t has_twist;       ///< not 0: `twist` is measured; else it is found from the poses
  uint32_t emergency_stop;  ///< not 0: a call for it, latched
  uint32_t device_faults;   ///< of the device, as DeviceFault; any of them is a fault, latched
  uint64_t report;       ///< counts the reports, from 1 on; unchanged while there is no newer one
  double report_time_s;  ///< when it came; by the clock of time_s
  double time_s;         ///< at the begin of the tick; from a clock that only goes forward
  double pose[7];        ///< of the handle in D
  double twist[6];       ///< of the handle in axes of D: m/s, then rad/s
} haptic_servo_input;
#define HAPTIC_SERVO_INPUT_INIT                                                      \
  {                                                                                  \
    sizeof(haptic_servo_input), 0, 0, 0, 0, 0, 0, 0, 0, {0, 0, 0, 0, 0, 0, 1}, { 0 } \
  }

/// Output of one tick.
typedef struct haptic_servo_output {
  uint32_t struct_size;
  uint32_t arming;          ///< 0 disarmed, 1 arming, 2 armed, 3 disarming, 4 faulted
  double wrench[6];         ///< for the device: at the handle's point, in axes of D; always finite
  double rendered[6];       ///< before arming, limits and ramps: about the grip point, axes of W
  double felt_pose[7];      ///< of A in W, free of obstacles
  double goal_pose[7];      ///< of A in W, as the handle wants it
  double gap_m;             ///< as in haptic_step_output
  uint64_t state_hash;      ///< as in haptic_step_output
  uint32_t safety_faults;   ///< SafetyFault of rt_core/safety/arming.hpp, latched
  uint32_t present_faults;  ///< the same, causes that are there now
  uint32_t waits;           ///< ArmingWait of that file: why it does not arm; 0: it is armed
  uint32_t limited;         ///< LimiterFlag of rt_core/safety/output_limiter.hpp
  uint32_t situation, flags, near_count;  ///< as in haptic_step_output
  uint32_t armings;                       ///< so far
  uint32_t work, reserved;
} haptic_servo_output;
#define HAPTIC_SERVO_OUTPUT_INIT \
  { sizeof(haptic_servo_output), 0, {0}, {0}, {0}, {0}, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0 }

/// One tick. Any numbers in the input are safe: for each of them `wrench` is finite, within the
/// limits, and differs from that of the tick before by at most the slew limit times the time since,
/// of which two periods count; the return value is HAPTIC_OK. A pose that is not finite, not of
/// unit length or farther away than a hand moves, a report or a tick that is late by more than
/// lost_periods, a time that is none or goes back, a device that is not ready, a stop: the wrench
/// ramps to zero at once and stays there until the cause is gone, and the deadman switch has been
/// released and pressed again. With an error, `wrench` is zero: end the loop. The servo's own
/// thread (one at a time: a second one gets HAPTIC_ERROR_BUSY). Cost: bounded, most_work and a
/// constant.
HAPTIC_API int haptic_servo_tick(haptic_servo* servo, const haptic_servo_input* input,
                                 haptic_servo_output* output);

/// Stop by software, of the next tick: as haptic_servo_input.emergency_stop. Any thread, also
/// during a tick; constant cost.
HAPTIC_API int haptic_servo_stop(haptic_servo* servo);

/// The verdict of all ticks so far. Threads as haptic_servo_tick. Cost: one copy and a line of
/// text.
HAPTIC_API int haptic_servo_verdict(haptic_servo* servo, haptic_verdict* verdict);

/// The servo is over: its memory may be used for something else. Until then every call gives
/// HAPTIC_ERROR_CLOSED. Threads as haptic_servo_tick; constant cost.
HAPTIC_API int haptic_servo_close(haptic_servo* servo);

// Compile: meshes to the bytes of a scene.

/// Role of a part beside the first.
typedef enum haptic_role {
  HAPTIC_FIXED = 0,   ///< it stands
  HAPTIC_PLACED = 1,  ///< the hand may hold it after the first, and it stays where it is let go
  HAPTIC_DRIVEN = 2,  ///< its owner moves it: haptic_core_drive, haptic_session_drive
  HAPTIC_HAND2 =
      3,  ///< a second hand holds it all the time, and none is PLACED: haptic_core_step_hands; it
          ///< is part 1, and the others come behind it in their order
  HAPTIC_LOOSE =
      4  ///< what moves pushes it with 0.5 N, and it stays where that leaves it; none is PLACED
} haptic_role;

/// One part: a mesh file, or arrays.
typedef struct haptic_part {
  uint32_t struct_size;
  uint32_t may_be_held;    ///< haptic_role, of a part beside the first
  const char* file;        ///< path of an STL, OBJ or OFF file; null: the arrays are the mesh
  const char* name;        ///< for messages; null: the file's, or "moving", "fixed 0", ..
  const double* vertices;  ///< 3 for each vertex, in units of the file
  size_t vertex_count;
  const uint32_t* triangles;  ///< 3 indices of vertices each, counter-clockwise seen from outside
  size_t triangle_count;
  double scale_to_m;  ///< metres per unit: 0.001 for millimetres
  double pose[7];     ///< of the mesh frame in W; of the part in the hand: where it starts
  double simplify_m;  ///< bevels, fillets and small rounds below are removed; 0: none
} haptic_part;
#define HAPTIC_PART_INIT \
  { sizeof(haptic_part), 0, NULL, NULL, NULL, 0, NULL, 0, 1.0, {0, 0, 0, 0, 0, 0, 1}, 0 }

/// A scene: a scene file (TOML), or parts and numbers.
typedef struct haptic_compile_input {
  uint32_t struct_size;
  uint32_t has_grip;       ///< not 0: grip_m is meant; 0: the centre of volume
  const char* scene_file;  ///< path; not null: nothing else of this structure is looked at
  const char* name;        ///< of the scene; null: "scene"
  const haptic_part* moving;
  const haptic_part* fixed;  ///< array of fixed_count
  size_t fixed_count;
  double stiffness_n_per_m;  ///< that the hand feels
  double friction;           ///< Coulomb, between the part in the hand and all others; 0 to 2
  double rate_hz;            ///< 1 to 100 000
  double grip_m[3];          ///< in A's mesh frame
} haptic_compile_input;
#define HAPTIC_COMPILE_INPUT_INIT                                                         \
  {                                                                                       \
    sizeof(haptic_compile_input), 0, NULL, NULL, NULL, NULL, 0, 800.0, 0.0, 1000.0, { 0 } \
  }

typedef struct haptic_compiled haptic_compiled;

/// Compiles. `*compiled` is there after success and after HAPTIC_ERROR_INPUT, _LIMIT, _SYSTEM and
/// _INTERNAL, where it has the messages and no bytes; after any other error it is null. Any thread.
/// Cost: milliseconds for a box, minutes for a part of hundreds of reflex edges; allocates.
HAPTIC_API int haptic_compile(const haptic_compile_input* input, haptic_compiled** compiled);

/// The scene, aligned to HAPTIC_ALIGNMENT; it lives until haptic_compiled_free. HAPTIC_ERROR_SIZE:
/// there is none, as the compilation failed. Any thread; constant cost.
HAPTIC_API int haptic_compiled_bytes(const haptic_compiled* compiled, const void** bytes,
                                     size_t* count);

typedef enum haptic_severity {
  HAPTIC_NOTE = 0,
  HAPTIC_WARNING = 1,
  HAPTIC_SEVERE = 2  ///< why there is no scene
} haptic_severity;

/// One message in its parts. Texts live until haptic_compiled_free; one that the message does not
/// have is empty.
typedef struct haptic_message {
  uint32_t struct_size;
  uint32_t severity;  ///< haptic_severity
  const char* file;   ///< file or part
  const char* place;  ///< "41", "12:3" (line, column), "byte 812"
  const char* cause;
  const char* remedy;
  const char* text;  ///< the whole
} haptic_message;
#define HAPTIC_MESSAGE_INIT \
  { sizeof(haptic_message), 0, NULL, NULL, NULL, NULL, NULL }

/// Any thread; constant cost.
HAPTIC_API int haptic_compiled_message_count(const haptic_compiled* compiled, size_t* count);
/// HAPTIC_ERROR_NUMBER: there is no message of that index. Any thread; constant cost.
HAPTIC_API int haptic_compiled_message(const haptic_compiled* compiled, size_t index,
                                       haptic_message* message);

/// Gives the memory back and sets `*compiled` to null; null already: nothing happens. No other call
/// with this handle may be running or come after.
HAPTIC_API int haptic_compiled_free(haptic_compiled** compiled);

// Plan: a motion of the part in the hand to a goal, with a proof that each step of it is free.

/// From where to where, and how long to look.
typedef struct haptic_plan_input {
  uint32_t struct_size;
  uint32_t has_start;     ///< not 0: start_pose is meant; 0: the scene's start
  double start_pose[7];   ///< of A in W
  double goal_pose[7];    ///< of A in W
  double seconds;         ///< for the search; 0.001 to 1e9
  uint64_t seed;          ///< of the random pushes; the same seed gives the same plan
  uint64_t shorten_work;  ///< on making it shorter, counted: vertices that it may look at
} haptic_plan_input;
#define HAPTIC_PLAN_INPUT_INIT                                                            \
  {                                                                                       \
    sizeof(haptic_plan_input), 0, {0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 0, 1}, 120.0, 1, \
        6000000000u                                                                       \
  }

typedef struct haptic_planned haptic_planned;

/// Plans. `*planned` is there after success and after HAPTIC_ERROR_NO_PLAN, _INPUT, _LIMIT and
/// _INTERNAL, where its facts have a text that says why, and it has no bytes; after any other error
/// it is null. HAPTIC_ERROR_INPUT: start or goal is beyond the scene's limits or not free, or both
/// are one. Any thread. Cost: at most input->seconds, and for the default shorten_work about half a
/// minute more; allocates.
HAPTIC_API int haptic_plan(const void* scene, size_t scene_bytes, const haptic_plan_input* input,
                           haptic_planned** planned);

/// The plan as a file has it, for `scene_inspect --plan` and for [guide] of a scene file; it lives
/// until haptic_planned_free. HAPTIC_ERROR_SIZE: there is none. Any thread; constant cost.
HAPTIC_API int haptic_planned_bytes(const haptic_planned* planned, const void** bytes,
                                    size_t* count);

/// Its poses from start to goal, 7 numbers for each, of A in W; from each to the next the grip
/// point moves straight, and the part turns, at constant speed. They live until
/// haptic_planned_free. HAPTIC_ERROR_SIZE: there are none. Any thread; constant cost.
HAPTIC_API int haptic_planned_poses(const haptic_planned* planned, const double** poses,
                                    size_t* count);

/// What the planning has come to.
typedef struct haptic_plan_facts {
  uint32_t struct_size;
  uint32_t reserved;
  uint64_t steps;     ///< each proved free
  uint64_t stations;  ///< that a guide leads along
  double length_m;    ///< a turn of 1 rad counts as the largest distance from the grip point
  double least_m;     ///< least distance that the proof leaves; below 0: depth that counts as free
  double search_s;    ///< that the search took
  double nearest_m;  ///< HAPTIC_ERROR_NO_PLAN: how near poses came that were reached from both ends
  char text[512];    ///< one line for people
} haptic_plan_facts;
#define HAPTIC_PLAN_FACTS_INIT                            \
  {                                                       \
    sizeof(haptic_plan_facts), 0, 0, 0, 0, 0, 0, 0, { 0 } \
  }

/// Any thread. Cost: one copy.
HAPTIC_API int haptic_planned_facts(const haptic_planned* planned, haptic_plan_facts* facts);

/// As haptic_compiled_free.
HAPTIC_API int haptic_planned_free(haptic_planned** planned);

// Session: a device, and the servo loop in a thread of the library.

typedef struct haptic_session haptic_session;

/// Use of the deadman switch by the simulated hand. On a machine that is busy a tick comes too late
/// now and then, which takes the force away until the switch is pressed again.
typedef enum haptic_hold {
  HAPTIC_RELEASE = 0,
  HAPTIC_HOLD = 1,
  HAPTIC_HOLD_AGAIN = 2  ///< and presses it again after a fault, but not after haptic_session_stop
} haptic_hold;

typedef struct haptic_session_options {
  uint32_t struct_size;
  uint32_t hold;       ///< haptic_hold, from the start
  const char* device;  ///< "sim": a simulated handle and hand; "external": a device whose loop is
                       ///< the caller's; or the path of a configuration of run_device, which ends
                       ///< in ".toml"
  double rate_hz;      ///< of the loop, 50 to 10 000; 0: the scene's
  double history_s;    ///< of haptic_session_history; 0 to 3600
  int32_t priority;    ///< SCHED_FIFO of the servo thread, 1 to 99; 0: ordinary
  int32_t hands;  ///< led, each on such a device of its own: 1, or 2 in a scene with two hands;
                  ///< 0: 1, and a second one holds its part still
} haptic_session_options;
#define HAPTIC_SESSION_OPTIONS_INIT \
  { sizeof(haptic_session_options), HAPTIC_HOLD_AGAIN, "sim", 0.0, 10.0, 0, 0 }

/// Opens the device and begins the loop: driver, link, output guard, safety and tick are those of
/// `run_device`, in two threads of this process instead of processes of their own. The handle
/// stands where the scene's start pose is. The scene is copied. HAPTIC_ERROR_SYSTEM: no thread, or
/// `priority` was not granted. HAPTIC_ERROR_PART: options.hands is 2, and the scene has one; give a
/// part role = "hand2" and compile it again. Any thread. Cost: milliseconds; allocates.
///
/// Two hands are moved in one tick, so that one feels of the other what that feels of it. Each has
/// its device, thread, arming, limits and ramps: where one is released its part is held still.
/// After a fault a part is led on from where it is. haptic_session_stop is of both.
///
/// With a configuration the library starts `run_device`, the supervised program, which holds the
/// device: if this program dies, by SIGKILL too, or closes the session, the force ramps to zero at
/// once. It is the program that HAPTIC_RUN_DEVICE names, else the one in the folder bin beside that
/// of the library, else the one of PATH. The scene of the configuration must be the same bytes as
/// `scene`; rate, priority, limits and switches are the configuration's, options.hold counts for
/// nothing, and hands is the number of its devices, or 0. The device need not be there yet:
/// haptic_session_device says. A process that is forked from this one does not have the session:
/// HAPTIC_ERROR_CLOSED. HAPTIC_ERROR_SYSTEM: no run_device; HAPTIC_ERROR_VERSION: it is of another
/// version; HAPTIC_ERROR_INPUT: the configuration is refused; HAPTIC_ERROR_DEVICE: the machine or
/// the device is. Cost: up to some seconds.
HAPTIC_API int haptic_session_open(const void* scene, size_t scene_bytes,
                                   const haptic_session_options* options, haptic_session** session);

/// The same; where it fails `text` becomes a sentence or some that say why, at most text_bytes - 1
/// characters: of a configuration with file, line and fix.
HAPTIC_API int haptic_session_open_text(const void* scene, size_t scene_bytes,
                                        const haptic_session_options* options,
                                        haptic_session** session, char* text, size_t text_bytes);

/// A session on a device whose loop is the caller's: the callback of a vendor's library, a game
/// engine, a robot's controller. options.device is "external"; haptic_session_open opens the same
/// with HAPTIC_SERVO_OPTIONS_INIT. There is no thread: each haptic_session_tick is one tick, and
/// the limits are those of `servo`. options.rate_hz or servo.rate_hz, not both; options.hold counts
/// for nothing. Also HAPTIC_ERROR_NUMBER and HAPTIC_ERROR_POSE as haptic_servo_bounds_of,
/// HAPTIC_ERROR_PART: the scene has two hands. Threads and cost as haptic_session_open.
HAPTIC_API int haptic_session_open_external(const void* scene, size_t scene_bytes,
                                            const haptic_session_options* options,
                                            const haptic_servo_options* servo,
                                            haptic_session** session, char* text,
                                            size_t text_bytes);

/// One tick of such a session, of the device's loop: all that haptic_servo_tick says of numbers,
/// wrench, faults and ramps holds. Other threads may be in any other function of the session, but
/// haptic_session_free. What other threads do takes effect in the next tick: a stop, the pose of
/// fixed or driven parts (stamped with the time of the newest tick), another part in the hand. A
/// loop that calls no more gets no new wrench: the device's own watchdog takes the last one away
/// (haptic_servo_bounds.longest_ramp_s), and haptic_session_device says it. After
/// haptic_session_close the ticks ramp to zero; once it is reached they give HAPTIC_ERROR_CLOSED:
/// end the loop. With any error `wrench` is zero. HAPTIC_ERROR_BUSY: another thread is in this
/// function; HAPTIC_ERROR_DEVICE: the session's loop is its own. Cost: bounded, as
/// haptic_servo_tick; nothing is allocated.
HAPTIC_API int haptic_session_tick(haptic_session* session, const haptic_servo_input* input,
                                   haptic_servo_output* output);

/// As haptic_core_contacts, of the newest tick of a device whose loop is the caller's and of what
/// is rendered there, before arming and limits; in W, where the fixed parts have been moved too.
/// HAPTIC_ERROR_DEVICE: another device, whose ticks are in another thread or process. Threads as
/// haptic_session_tick: a second one, or a tick meanwhile, gets HAPTIC_ERROR_BUSY.
HAPTIC_API int haptic_session_contacts(haptic_session* session, haptic_contact* contacts,
                                       size_t capacity, size_t contact_bytes, size_t* count,
                                       double* rest);

/// The newest tick.
typedef struct haptic_state {
  uint32_t struct_size;
  uint32_t link;          ///< 0 absent, 1 starting, 2 ready
  uint64_t tick;          ///< from 1 on; 0: none yet
  double time_s;          ///< since the session was opened
  double hand_pose[7];    ///< of A in W, as the handle stands
  double felt_pose[7];    ///< of A in W, free of obstacles
  double wrench[6];       ///< rendered, in W axes
  double sent_wrench[6];  ///< after arming, limits and ramps: what the device gets
  double gap_m;           ///< as in haptic_step_output
  uint64_t state_hash;
  uint32_t situation, flags;  ///< as in haptic_step_output
  uint32_t arming;            ///< 0 disarmed, 1 arming, 2 armed, 3 disarming, 4 faulted
  uint32_t safety_faults;     ///< SafetyFault of rt_core/safety/arming.hpp, latched
  uint32_t device_faults;     ///< DeviceFault of rt_core/exchange/device_exchange.hpp
  uint32_t hand_held;         ///< the deadman switch is held
  uint32_t armings;           ///< so far
  uint32_t reserved;
  uint64_t goals_reached;  ///< number of the last goal of the hand that it has come to the end of
  uint64_t late_ticks;     ///< woken a period late or more
  uint64_t missed_periods;
  double longest_tick_s;
} haptic_state;
#define HAPTIC_STATE_INIT \
  { sizeof(haptic_state), 0, 0, 0, {0}, {0}, {0}, {0}, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0 }

/// Never waits, for nothing and nobody. After haptic_session_close: the last one. Any thread. Cost:
/// one copy.
HAPTIC_API int haptic_session_state(const haptic_session* session, haptic_state* state);

/// The same of `hand`, from 0 on; HAPTIC_ERROR_PART: it is not led (options.hands). What is of the
/// loop is the same for both.
HAPTIC_API int haptic_session_state_of(const haptic_session* session, uint32_t hand,
                                       haptic_state* state);

/// Phase of a session's device.
typedef enum haptic_device_phase {
  HAPTIC_DEVICE_STARTS = 0,  ///< the loop has not ticked yet
  HAPTIC_DEVICE_RUNS = 1,    ///< the loop ticks; the device may be away: haptic_device_status.link
  HAPTIC_DEVICE_ENDED = 2    ///< for good: closed, refused or lost; there is no force any more
} haptic_device_phase;

/// The device of a hand.
typedef struct haptic_device_status {
  uint32_t struct_size;
  uint32_t phase;      ///< haptic_device_phase
  uint32_t link;       ///< 0 absent, 1 starting, 2 ready
  uint32_t faults;     ///< DeviceFault of rt_core/exchange/device_exchange.hpp
  uint32_t is_silent;  ///< not 0: the process that renders does not answer; the force ramps to zero
  int32_t exit_code;   ///< of run_device, once it has ended
  uint64_t connects;   ///< so far
  uint64_t reports;    ///< so far
  double force_n;      ///< that the device may have now: never less than it has
  double torque_nm;
  char waits_for[256];  ///< why it does not arm; empty: it is armed, or nothing is known yet
  char trouble[256];    ///< of the link
  char why[512];        ///< it has ended
} haptic_device_status;
#define HAPTIC_DEVICE_STATUS_INIT                                            \
  {                                                                          \
    sizeof(haptic_device_status), 0, 0, 0, 0, 0, 0, 0, 0, 0, {0}, {0}, { 0 } \
  }

/// Never waits. After haptic_session_close: the last one. Any thread. Cost: one copy.
HAPTIC_API int haptic_session_device(const haptic_session* session, uint32_t hand,
                                     haptic_device_status* status);

/// Something that has happened: as `run_device` says it.
typedef struct haptic_event {
  uint64_t number;  ///< from 1 on; one that is missing was overwritten
  double time_s;    ///< since the device is held
  uint32_t device;  ///< 1 and 2 of two; 0: of the run, or of the only one
  uint32_t level;   ///< as in sd-daemon(3): 3 error, 4 warning, 5 notice
  char name[24];    ///< "connected", "armed", "fault", "servo ended", .. (tools/run_device)
  char text[464];   ///< one line for people
} haptic_event;

/// The newest events, oldest first, `capacity` of them at most and no more than 64; `*count`
/// becomes how many. None of "sim". `event_bytes`: sizeof(haptic_event). Never waits; any thread.
/// Cost: one copy.
HAPTIC_API int haptic_session_events(const haptic_session* session, haptic_event* events,
                                     size_t capacity, size_t event_bytes, size_t* count);

/// The stiffness that a session renders. A scene without a [device] is rendered with what the
/// simulated handle, the hand on it and the delay of the loop hold.
typedef struct haptic_gains {
  uint32_t struct_size;
  uint32_t lowered;             ///< not 0: less than the scene asks for
  double stiffness_n_per_m;     ///< rendered
  double stiffness_nm_per_rad;  ///< law proxy; else 0
  double asked_n_per_m;         ///< by the scene
  double asked_nm_per_rad;
  char text[512];  ///< where it is lowered: a sentence, with the way to have it otherwise; else
                   ///< empty
} haptic_gains;
#define HAPTIC_GAINS_INIT                      \
  {                                            \
    sizeof(haptic_gains), 0, 0, 0, 0, 0, { 0 } \
  }

/// The same all through the session. Any thread. Cost: one copy.
HAPTIC_API int haptic_session_gains(const haptic_session* session, haptic_gains* gains);

/// The verdict so far, up to the newest tick; after haptic_session_close of the whole session.
/// Never waits. Any thread. Cost: one copy and a line of text.
HAPTIC_API int haptic_session_verdict(const haptic_session* session, haptic_verdict* verdict);

/// The same of `hand`, as haptic_session_state_of.
HAPTIC_API int haptic_session_verdict_of(const haptic_session* session, uint32_t hand,
                                         haptic_verdict* verdict);

/// One tick of the past.
typedef struct haptic_tick {
  uint64_t tick;
  double time_s;
  double hand_pose[7];
  double wrench[6];  ///< rendered, in the axes of the fixed parts (haptic_session_frame)
  double sent_wrench[6];
  uint32_t situation, flags, arming, safety_faults;
} haptic_tick;

/// The newest ticks, oldest first, `capacity` of them at most and no more than options.history_s
/// had room for; `*count` becomes how many. `tick_bytes`: sizeof(haptic_tick). Also after
/// haptic_session_close. Any thread; a second one waits. Cost: one copy of the history; allocates.
HAPTIC_API int haptic_session_history(const haptic_session* session, haptic_tick* ticks,
                                      size_t capacity, size_t tick_bytes, size_t* count);

/// The same of `hand`, as haptic_session_state_of.
HAPTIC_API int haptic_session_history_of(const haptic_session* session, uint32_t hand,
                                         haptic_tick* ticks, size_t capacity, size_t tick_bytes,
                                         size_t* count);

/// Where a simulated hand goes; a hand on a device is a person's (HAPTIC_ERROR_DEVICE).
typedef struct haptic_hand_goal {
  uint32_t struct_size;
  uint32_t hand;   ///< which, from 0 on
  double pose[7];  ///< of A in W
  double seconds;  ///< that it takes, from where the last goal has led it; 0.001 to 3600
} haptic_hand_goal;
#define HAPTIC_HAND_GOAL_INIT \
  { sizeof(haptic_hand_goal), 0, {0, 0, 0, 0, 0, 0, 1}, 1.0 }

/// The hand sets out at once, without a jerk, also from the middle of another way; it presses where
/// it is kept from going. `*number` becomes the number of the goal, from 1 on
/// (haptic_state.goals_reached); it may be null. HAPTIC_ERROR_PART: goal.hand is not led. Any
/// thread; a second one waits, the servo thread never does. Constant cost.
HAPTIC_API int haptic_session_move_hand(haptic_session* session, const haptic_hand_goal* goal,
                                        uint64_t* number);

/// Each hand holds or releases its deadman switch: `hold` is of haptic_hold. After a fault:
/// release, then hold again. Threads and cost as haptic_session_move_hand.
HAPTIC_API int haptic_session_hold(haptic_session* session, int hold);

/// The same of `hand` alone, as haptic_session_state_of.
HAPTIC_API int haptic_session_hold_of(haptic_session* session, uint32_t hand, int hold);

/// Hand 0 holds `part`: it lets go of what it holds, and takes the part where it is, with no force.
/// Back when the hand is empty, the next tick takes the part. HAPTIC_ERROR_BUSY: it has not let go
/// within 2 s, as the device gives no pose. Any thread. Cost: 50 ms of the clutch's ramp, and one
/// pass over the part's scene.
HAPTIC_API int haptic_session_hold_part(haptic_session* session, uint32_t hand, uint32_t part);

/// Hand 0 lets go: the wrench fades by the ramp of the clutch while the part stays. Any thread;
/// constant cost.
HAPTIC_API int haptic_session_release_part(haptic_session* session, uint32_t hand);

/// As haptic_core_bodies, after the newest tick. Any thread; a second one waits. Cost: one copy.
HAPTIC_API int haptic_session_bodies(const haptic_session* session, haptic_body* bodies,
                                     size_t capacity, size_t body_bytes, size_t* count);

/// Moves the fixed parts: `frame` is the one in which the scene has them, in W. They are moved by
/// the caller: a robot, or a simulator. To be called 30 to 200 times a second, from the time of the
/// first call on. Between two poses the frame is interpolated, an interval behind. A pose that is
/// too fast, late, or none (then also HAPTIC_ERROR_POSE) never makes the force jump: the parts stay
/// where they are, the force ramps to zero (haptic_state.safety_faults, 1 << 13), and once it is
/// zero they are at the newest pose; the deadman switch must be pressed again. A first pose that is
/// far from W does the same where the hand is held: give it before, with options.hold
/// HAPTIC_RELEASE. HAPTIC_ERROR_DEVICE: the device of a configuration has ended for good. Any
/// thread; a second one waits, the servo thread never does. Constant cost.
HAPTIC_API int haptic_session_frame(haptic_session* session, const haptic_frame* frame);

/// As haptic_core_drive, now. A lost one that touches the part in the hand is the same cause for
/// the device as a lost frame of the fixed parts (haptic_state.safety_faults, 1 << 13). Any thread;
/// a second one waits, the servo thread never does. Constant cost.
HAPTIC_API int haptic_session_drive(haptic_session* session, uint32_t part,
                                    const haptic_frame* frame);

/// As haptic_core_driven, after the newest tick. Any thread; a second one waits. Cost: one copy.
HAPTIC_API int haptic_session_driven(const haptic_session* session, haptic_driven* driven,
                                     size_t capacity, size_t driven_bytes, size_t* count);

/// Stop by software: the force ramps to zero at once, on both sides of the link, and stays there
/// until the deadman switch has been released and is held again. Any thread; constant cost.
HAPTIC_API int haptic_session_stop(haptic_session* session);

/// Orderly end: the force ramps to zero, the device is closed, the threads end. State and history
/// can still be read; every other call gives HAPTIC_ERROR_CLOSED. Of a device whose loop is the
/// caller's it waits for the ticks that ramp to zero, where that loop is another thread's and goes
/// on; else they come after it (haptic_session_tick). Any thread; a second one waits. Cost: up to
/// half a second; of a configuration up to 5 s where run_device has to be killed.
HAPTIC_API int haptic_session_close(haptic_session* session);

/// Closes, gives the memory back and sets `*session` to null; null already: nothing happens. No
/// other call with this handle may be running or come after.
HAPTIC_API int haptic_session_free(haptic_session** session);

#ifdef __cplusplus
}
#endif
#endif
