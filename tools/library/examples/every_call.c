// SPDX-License-Identifier: Apache-2.0
// Presses a block onto a plate, by every function of the C interface:
//   cc -std=c99 every_call.c $(pkg-config --cflags --libs haptic) -o every_call && ./every_call
#define _POSIX_C_SOURCE 200809L
#include <haptic.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static void require(int error, const char* call) {
  if (error == HAPTIC_OK) return;
  fprintf(stderr, "every_call: %s: %s: %s\n", call, haptic_error_name(error),
          haptic_error_text(error));
  exit(1);
}
#define REQUIRE(call) require(call, #call)

static void expect(int truth, const char* what) {
  if (truth) return;
  fprintf(stderr, "every_call: not so: %s\n", what);
  exit(1);
}
#define EXPECT(truth) expect(truth, #truth)

static void sleep_ms(long ms) {
  const struct timespec time = {ms / 1000, ms % 1000 * 1000000};
  nanosleep(&time, NULL);
}

static void* aligned(size_t bytes) {
  void* memory = NULL;
  if (posix_memalign(&memory, HAPTIC_ALIGNMENT, bytes) != 0) exit(1);
  return memory;
}

// A box about its centre: half edges x, y, z.
static const uint32_t kTriangles[36] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                        2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
static void box(double x, double y, double z, double* vertices) {
  int k;
  for (k = 0; k < 8; ++k) {
    vertices[3 * k] = k & 1 ? x : -x;
    vertices[3 * k + 1] = k & 2 ? y : -y;
    vertices[3 * k + 2] = k & 4 ? z : -z;
  }
}

// The block's underside is 20 mm above the plate. With another role than HAPTIC_FIXED there is a second block 30 mm beside
// it: on the plate, for the hand to hold after the first, or at its height, for an owner to move.
static haptic_compiled* compile(haptic_role other) {
  static double block[24], plate[24];
  haptic_part moving = HAPTIC_PART_INIT, fixed[2] = {HAPTIC_PART_INIT, HAPTIC_PART_INIT};
  haptic_compile_input input = HAPTIC_COMPILE_INPUT_INIT;
  haptic_compiled* compiled = NULL;
  box(10, 10, 10, block);
  box(50, 50, 5, plate);
  moving.vertices = block;
  moving.vertex_count = 8;
  moving.triangles = kTriangles;
  moving.triangle_count = 12;
  moving.scale_to_m = 0.001;
  fixed[0] = fixed[1] = moving;
  fixed[0].vertices = plate;
  fixed[1].name = "other";
  fixed[1].may_be_held = other;
  fixed[1].pose[0] = 0.030;
  fixed[1].pose[2] = other == HAPTIC_DRIVEN ? 0.035 : 0.0151;
  moving.pose[2] = 0.035;
  input.name = other != HAPTIC_FIXED ? "blocks on plate" : "block on plate";
  input.moving = &moving;
  input.fixed = fixed;
  input.fixed_count = other != HAPTIC_FIXED ? 2 : 1;
  input.stiffness_n_per_m = 500;
  input.friction = 0.2;
  REQUIRE(haptic_compile(&input, &compiled));
  return compiled;
}

static void explain(const haptic_compiled* compiled) {
  size_t count = 0, k;
  haptic_message message = HAPTIC_MESSAGE_INIT;
  REQUIRE(haptic_compiled_message_count(compiled, &count));
  for (k = 0; k < count; ++k) {
    REQUIRE(haptic_compiled_message(compiled, k, &message));
    printf("message: file '%s', place '%s', cause '%s', remedy '%s'\n", message.file, message.place,
           message.cause, message.remedy);
  }
}

// What a compilation that fails leaves: messages.
static void compile_nothing(void) {
  haptic_compile_input input = HAPTIC_COMPILE_INPUT_INIT;
  haptic_compiled* compiled = NULL;
  const void* bytes = NULL;
  size_t count = 0;
  input.scene_file = "/nowhere/scene.toml";
  EXPECT(haptic_compile(&input, &compiled) == HAPTIC_ERROR_INPUT);
  EXPECT(haptic_compiled_bytes(compiled, &bytes, &count) == HAPTIC_ERROR_SIZE);
  explain(compiled);
  REQUIRE(haptic_compiled_free(&compiled));
}

// A way of the block round a corner of the plate to its underside.
static void plan(const void* scene, size_t scene_bytes) {
  haptic_plan_input input = HAPTIC_PLAN_INPUT_INIT;
  haptic_plan_facts facts = HAPTIC_PLAN_FACTS_INIT;
  haptic_planned* planned = NULL;
  const void* bytes = NULL;
  const double* poses = NULL;
  size_t count = 0;
  input.goal_pose[2] = -0.035;
  input.shorten_work = 1000000;
  REQUIRE(haptic_plan(scene, scene_bytes, &input, &planned));
  REQUIRE(haptic_planned_facts(planned, &facts));
  printf("plan: %s\n", facts.text);
  REQUIRE(haptic_planned_bytes(planned, &bytes, &count));
  EXPECT(strncmp((const char*)bytes, "haptic-plan ", 12) == 0);
  REQUIRE(haptic_planned_poses(planned, &poses, &count));
  EXPECT(count == facts.steps + 1);
  EXPECT(fabs(poses[2] - 0.035) < 1e-9 && fabs(poses[7 * (count - 1) + 2] + 0.035) < 1e-9);
  REQUIRE(haptic_planned_free(&planned));

  input.goal_pose[2] = 0;  // within the plate
  EXPECT(haptic_plan(scene, scene_bytes, &input, &planned) == HAPTIC_ERROR_INPUT);
  EXPECT(haptic_planned_bytes(planned, &bytes, &count) == HAPTIC_ERROR_SIZE);
  REQUIRE(haptic_planned_facts(planned, &facts));
  printf("no plan: %s\n", facts.text);
  REQUIRE(haptic_planned_free(&planned));
}

// What touches, and a state that is saved and loaded: the next tick has the same bits.
static void keep_state(haptic_core* core, const haptic_step_input* last) {
  haptic_step_output once = HAPTIC_STEP_OUTPUT_INIT, again = HAPTIC_STEP_OUTPUT_INIT;
  haptic_step_input next = *last;
  haptic_contact contacts[48];
  double rest[6];
  char text[256];
  size_t count = 0;
  void* state;
  REQUIRE(haptic_core_contacts(core, contacts, 48, sizeof contacts[0], &count, rest));
  EXPECT(count == 4 && contacts[0].part == 1 && contacts[0].force_n[2] > 0 && fabs(rest[2]) < 1e-3);
  EXPECT(haptic_core_save(core, NULL, 0, &count) == HAPTIC_ERROR_SIZE);
  state = aligned(count);
  REQUIRE(haptic_core_save(core, state, count, &count));
  next.time_s += 0.001;
  REQUIRE(haptic_core_step(core, &next, &once));
  REQUIRE(haptic_core_load(core, state, count, text, sizeof text));
  REQUIRE(haptic_core_step(core, &next, &again));
  EXPECT(once.state_hash == again.state_hash);
  EXPECT(haptic_core_load(core, state, count - 1, text, sizeof text) == HAPTIC_ERROR_INPUT);
  printf("core: %s\n", text);
  free(state);
}

static void run_core(const void* scene, size_t scene_bytes) {
  haptic_scene_info info = HAPTIC_SCENE_INFO_INIT;
  haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
  haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
  haptic_replay replay = HAPTIC_REPLAY_INIT;
  haptic_verdict verdict = HAPTIC_VERDICT_INIT;
  haptic_core* core = NULL;
  void* memory;
  static double poses[7 * 1000], wrenches[6 * 1000];
  static uint64_t hashes[1000];
  int k;
  REQUIRE(haptic_scene_read(scene, scene_bytes, &info));
  printf("scene '%s': %u parts, %u pairs, %.0f N/m\n", info.name, info.parts, info.pairs,
         info.stiffness_n_per_m);
  memory = aligned(info.memory_bytes);
  REQUIRE(haptic_core_create(scene, scene_bytes, memory, info.memory_bytes, &core));
  memcpy(input.pose, info.start_pose, sizeof input.pose);
  for (k = 0; k < 1000; ++k) {  // a second: 25 mm down, 5 mm into the plate
    input.time_s = 0.001 * k;
    input.pose[2] = info.start_pose[2] - 0.025 * (k + 1) / 1000;
    memcpy(poses + 7 * k, input.pose, sizeof input.pose);
    REQUIRE(haptic_core_step(core, &input, &output));
  }
  EXPECT(fabs(output.wrench[2] - 2.5) < 0.05);  // 5 mm at 500 N/m
  EXPECT(fabs(output.felt_pose[2] - 0.015) < 1e-5);
  EXPECT(output.gap_m > -1e-6);

  REQUIRE(haptic_core_verdict(core, &verdict));
  printf("core: %s\n", verdict.text);
  EXPECT(verdict.verdict == HAPTIC_VERDICT_FOLLOWED);
  EXPECT(verdict.ticks == 1000 && verdict.contact_ticks > 150);

  REQUIRE(haptic_core_reset(core));
  replay.count = 1000;
  replay.poses = poses;
  replay.wrenches = wrenches;
  replay.state_hashes = hashes;
  REQUIRE(haptic_core_replay(core, &replay));
  EXPECT(replay.done == 1000);
  EXPECT(hashes[999] == output.state_hash);
  keep_state(core, &input);
  REQUIRE(haptic_core_close(core));
  EXPECT(haptic_core_step(core, &input, &output) == HAPTIC_ERROR_CLOSED);
  free(memory);
}

// Until the hand has come to the end of a goal.
static void wait_for(const haptic_session* session, uint64_t goal, haptic_state* state) {
  int k;
  for (k = 0; k < 10000; ++k) {
    REQUIRE(haptic_session_state(session, state));
    if (state->goals_reached >= goal) return;
    sleep_ms(2);
  }
  EXPECT(!"the hand came to the end of its goal");
}

// The plate rises by 2 mm in 0.4 s, a pose every 20 ms, and stands there.
static void move_plate(haptic_session* session) {
  haptic_frame frame = HAPTIC_FRAME_INIT;
  haptic_state state = HAPTIC_STATE_INIT;
  int k;
  for (k = 0; k <= 20; ++k) {
    frame.pose[2] = 0.0001 * k;
    frame.stands = k == 20;
    REQUIRE(haptic_session_frame(session, &frame));
    sleep_ms(20);
  }
  for (k = 0; k < 10000 && !(state.felt_pose[2] > 0.0165); ++k) {
    REQUIRE(haptic_session_state(session, &state));
    sleep_ms(2);
  }
  EXPECT(fabs(state.felt_pose[2] - 0.017) < 0.0005);
}

// The hand lays the first block down and takes the other.
static void hold_parts(void) {
  haptic_scene_info info = HAPTIC_SCENE_INFO_INIT;
  haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
  haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  haptic_compiled* compiled = compile(HAPTIC_PLACED);
  haptic_core* core = NULL;
  haptic_session* session = NULL;
  haptic_body bodies[3];
  const void* scene = NULL;
  void* memory;
  size_t scene_bytes = 0, count = 0;
  int k, error;
  REQUIRE(haptic_compiled_bytes(compiled, &scene, &scene_bytes));
  REQUIRE(haptic_scene_read(scene, scene_bytes, &info));
  memory = aligned(info.memory_bytes);
  REQUIRE(haptic_core_create(scene, scene_bytes, memory, info.memory_bytes, &core));
  memcpy(input.pose, info.start_pose, sizeof input.pose);
  for (k = 0; k < 300; ++k) {
    input.time_s = 0.001 * k;
    input.pose[2] -= 1e-4;
    REQUIRE(haptic_core_step(core, &input, &output));
  }
  while ((error = haptic_core_hold_part(core, 0, 2)) == HAPTIC_ERROR_BUSY) {  // it lets go first
    input.time_s = 0.001 * k++;
    REQUIRE(haptic_core_step(core, &input, &output));
  }
  REQUIRE(error);
  input.time_s = 0.001 * k;
  REQUIRE(haptic_core_step(core, &input, &output));
  REQUIRE(haptic_core_bodies(core, bodies, 3, sizeof bodies[0], &count));
  EXPECT(count == 3 && bodies[2].held_by == 1 && fabs(bodies[0].pose[2] - 0.015) < 1e-4);
  printf("core: holds '%s' after %d ticks, %.3f N\n", bodies[2].name, k, output.wrench[2]);
  REQUIRE(haptic_core_release_part(core, 0));
  REQUIRE(haptic_core_close(core));
  free(memory);

  REQUIRE(haptic_session_open(scene, scene_bytes, &options, &session));
  REQUIRE(haptic_session_hold_part(session, 0, 2));
  REQUIRE(haptic_session_release_part(session, 0));
  REQUIRE(haptic_session_bodies(session, bodies, 3, sizeof bodies[0], &count));
  EXPECT(count == 3 && fabs(bodies[2].pose[2] - 0.0151) < 1e-4);
  REQUIRE(haptic_session_free(&session));
  REQUIRE(haptic_compiled_free(&compiled));
}

// An owner moves the other block against the one in the hand, 100 poses a second at 50 mm/s.
static void drive_parts(void) {
  haptic_scene_info info = HAPTIC_SCENE_INFO_INIT;
  haptic_step_input input = HAPTIC_STEP_INPUT_INIT;
  haptic_step_output output = HAPTIC_STEP_OUTPUT_INIT;
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  haptic_frame pose = HAPTIC_FRAME_INIT;
  haptic_compiled* compiled = compile(HAPTIC_DRIVEN);
  haptic_core* core = NULL;
  haptic_session* session = NULL;
  haptic_driven driven;
  const void* scene = NULL;
  void* memory;
  size_t scene_bytes = 0, count = 0;
  int k;
  REQUIRE(haptic_compiled_bytes(compiled, &scene, &scene_bytes));
  REQUIRE(haptic_scene_read(scene, scene_bytes, &info));
  memory = aligned(info.memory_bytes);
  REQUIRE(haptic_core_create(scene, scene_bytes, memory, info.memory_bytes, &core));
  memcpy(input.pose, info.start_pose, sizeof input.pose);
  pose.pose[2] = 0.035;
  for (k = 1; k <= 300; ++k) {
    input.time_s = 0.001 * k;
    pose.pose[0] = 0.030 - 0.00005 * k;
    if (k % 10 == 0) REQUIRE(haptic_core_drive(core, 2, &pose, input.time_s));
    REQUIRE(haptic_core_step(core, &input, &output));
  }
  REQUIRE(haptic_core_driven(core, &driven, 1, sizeof driven, &count));
  // An interval behind: at 15.5 mm, and the block in the hand 20 mm from it.
  EXPECT(count == 1 && driven.part == 2 && driven.touches == 1 && driven.lost == 0);
  EXPECT(output.felt_pose[0] < -0.002 && output.wrench[0] < -0.5);
  EXPECT(fabs(driven.wrench[0] + output.wrench[0]) < 0.05 && driven.lag_m < 1e-6);
  EXPECT(haptic_core_drive(core, 1, &pose, 0.3) == HAPTIC_ERROR_PART);
  printf("core: pushed by %.3f N, which pushes back by %.3f N\n", output.wrench[0], driven.wrench[0]);
  REQUIRE(haptic_core_close(core));
  free(memory);

  REQUIRE(haptic_session_open(scene, scene_bytes, &options, &session));
  pose.pose[0] = 0.030;
  pose.stands = 1;
  REQUIRE(haptic_session_drive(session, 2, &pose));
  sleep_ms(50);
  REQUIRE(haptic_session_driven(session, &driven, 1, sizeof driven, &count));
  EXPECT(count == 1 && fabs(driven.pose[0] - 0.030) < 1e-6 && driven.lost == 0);
  REQUIRE(haptic_session_free(&session));
  REQUIRE(haptic_compiled_free(&compiled));
}

static void run_session(const void* scene, size_t scene_bytes) {
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  haptic_hand_goal goal = HAPTIC_HAND_GOAL_INIT;
  haptic_state state = HAPTIC_STATE_INIT;
  haptic_gains gains = HAPTIC_GAINS_INIT;
  haptic_verdict verdict = HAPTIC_VERDICT_INIT;
  haptic_device_status device = HAPTIC_DEVICE_STATUS_INIT;
  haptic_session* session = NULL;
  static haptic_event events[64];
  static haptic_tick ticks[2000];
  char text[512];
  uint64_t number = 0;
  size_t count = 0, k;
  double largest_n = 0;
  options.device = "none";
  EXPECT(haptic_session_open_text(scene, scene_bytes, &options, &session, text, sizeof text) == HAPTIC_ERROR_DEVICE);
  printf("session: %s\n", text);
  options.device = "sim";  // or the path of a configuration of run_device
  options.history_s = 2;
  REQUIRE(haptic_session_open(scene, scene_bytes, &options, &session));
  REQUIRE(haptic_session_device(session, 0, &device));
  EXPECT(device.phase == HAPTIC_DEVICE_RUNS);
  REQUIRE(haptic_session_events(session, events, 64, sizeof events[0], &count));
  REQUIRE(haptic_session_state(session, &state));
  EXPECT(fabs(state.hand_pose[2] - 0.035) < 1e-3);
  REQUIRE(haptic_session_gains(session, &gains));
  EXPECT(gains.stiffness_n_per_m == gains.asked_n_per_m && gains.lowered == 0);
  goal.pose[2] = 0.005;
  goal.seconds = 0.5;
  REQUIRE(haptic_session_move_hand(session, &goal, &number));
  wait_for(session, number, &state);
  printf("session: %llu ticks, armed %d, %.3f N\n", (unsigned long long)state.tick,
         state.arming == 2, state.wrench[2]);
  REQUIRE(haptic_session_history(session, ticks, 2000, sizeof ticks[0], &count));
  for (k = 0; k < count; ++k) largest_n = fmax(largest_n, ticks[k].wrench[2]);
  EXPECT(count > 0);
  EXPECT(largest_n > 0.5);
  move_plate(session);
  REQUIRE(haptic_session_stop(session));
  REQUIRE(haptic_session_hold(session, 0));
  REQUIRE(haptic_session_hold_of(session, 0, 0));
  REQUIRE(haptic_session_close(session));
  EXPECT(haptic_session_hold(session, 1) == HAPTIC_ERROR_CLOSED);
  REQUIRE(haptic_session_state(session, &state));
  REQUIRE(haptic_session_verdict(session, &verdict));
  REQUIRE(haptic_session_state_of(session, 0, &state)); /* of each of two hands, with options.hands = 2 */
  REQUIRE(haptic_session_verdict_of(session, 0, &verdict));
  REQUIRE(haptic_session_history_of(session, 0, ticks, 2000, sizeof ticks[0], &count));
  printf("session: %s\n", verdict.text);
  EXPECT(verdict.failures == 0);
  REQUIRE(haptic_session_free(&session));
  EXPECT(session == NULL);
}

// A session on a device whose loop is the program's own (external_device.c has more): one tick, and none after the end.
static void run_external(const void* scene, size_t scene_bytes) {
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  haptic_servo_options servo = HAPTIC_SERVO_OPTIONS_INIT;
  haptic_servo_input input = HAPTIC_SERVO_INPUT_INIT;
  haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
  haptic_session* session = NULL;
  haptic_contact contact;
  size_t count = 1;
  char text[256];
  options.device = "external";
  REQUIRE(haptic_session_open_external(scene, scene_bytes, &options, &servo, &session, text, sizeof text));
  input.ready = 1;
  input.report = 1;
  REQUIRE(haptic_session_tick(session, &input, &output));
  REQUIRE(haptic_session_contacts(session, &contact, 1, sizeof contact, &count, NULL));
  EXPECT(count == 0 && output.arming == 0);
  REQUIRE(haptic_session_close(session));
  REQUIRE(haptic_session_tick(session, &input, &output));  // the force is zero: the last one
  EXPECT(haptic_session_tick(session, &input, &output) == HAPTIC_ERROR_CLOSED);
  REQUIRE(haptic_session_free(&session));
}

// The servo tick in a loop of the program's own: pressed by a handle that is moved here (own_device_loop.c has more).
static void run_servo(const void* scene, size_t scene_bytes) {
  haptic_servo_options options = HAPTIC_SERVO_OPTIONS_INIT;
  haptic_servo_bounds bounds = HAPTIC_SERVO_BOUNDS_INIT;
  haptic_servo_input input = HAPTIC_SERVO_INPUT_INIT;
  haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
  haptic_verdict verdict = HAPTIC_VERDICT_INIT;
  haptic_servo* servo = NULL;
  void* memory;
  int k;
  REQUIRE(haptic_servo_bounds_of(scene, scene_bytes, &options, &bounds));
  memory = aligned(bounds.memory_bytes);
  REQUIRE(haptic_servo_begin(scene, scene_bytes, memory, bounds.memory_bytes, &options, &servo));
  input.ready = 1;
  for (k = 1; k <= 400; ++k) {
    input.report = (uint64_t)k;
    input.report_time_s = input.time_s = 0.001 * k;
    input.pose[2] = -0.0001 * fmin(k, 240);
    input.switches = k > 100;  // held from the start it would not count
    REQUIRE(haptic_servo_tick(servo, &input, &output));
    EXPECT(output.work <= bounds.most_work);
  }
  printf("servo: armed %d, %.3f N\n", output.arming == 2, output.wrench[2]);
  EXPECT(output.arming == 2 && output.wrench[2] > 1);
  REQUIRE(haptic_servo_stop(servo));
  REQUIRE(haptic_servo_verdict(servo, &verdict));
  EXPECT(verdict.failures == 0);
  REQUIRE(haptic_servo_close(servo));
  free(memory);
}

int main(void) {
  const void* scene = NULL;
  size_t scene_bytes = 0;
  haptic_compiled* compiled = compile(HAPTIC_FIXED);
  printf("haptic %s\n", haptic_version());
  explain(compiled);
  REQUIRE(haptic_compiled_bytes(compiled, &scene, &scene_bytes));
  plan(scene, scene_bytes);
  run_core(scene, scene_bytes);
  run_servo(scene, scene_bytes);
  run_external(scene, scene_bytes);
  run_session(scene, scene_bytes);
  hold_parts();
  drive_parts();
  REQUIRE(haptic_compiled_free(&compiled));
  compile_nothing();
  return 0;
}
