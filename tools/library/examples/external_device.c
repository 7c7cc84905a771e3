// SPDX-License-Identifier: Apache-2.0
// A session on a device whose loop is yours: the callback of its library makes the ticks, and any
// other thread reads, stops and moves parts.
//   cc -std=c99 external_device.c $(pkg-config --cflags --libs haptic) -lm -o external_device
//   ./external_device scene.toml
#include <haptic.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

// Fill it in the callback of the device's library.
struct handle_report {
  uint64_t number;             // counts the reports: the same again where none is newer
  double time_s;               // when it came, by the clock of the callback
  double position_m[3];        // of the handle
  double orientation_xyzw[4];  // of the handle
  uint32_t buttons;            // bit 0: deadman switch, bit 1: emergency stop
  uint32_t is_ready;           // found and calibrated
  uint32_t faults;             // of the device, as DeviceFault
};

// Once, before the device's thread begins. Null: refused, and `why` says it.
static haptic_session* open_device(const void* scene, size_t scene_bytes, char why[256]) {
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  haptic_servo_options servo = HAPTIC_SERVO_OPTIONS_INIT;
  haptic_session* session = NULL;
  options.device = "external";
  options.rate_hz = 1000;  // of its callback
  servo.emergency_stop = 2;
  servo.driven_axes = 7;  // three motors: force without torque
  servo.max_force_n = 3;  // what the device's manual says
  (void)haptic_session_open_external(scene, scene_bytes, &options, &servo, &session, why, 256);
  return session;
}

// Once a period, on the device's thread. With any report, `force_n` may be sent. 0: the end.
static int session_callback(haptic_session* session, const struct handle_report* report,
                            double now_s, double force_n[3]) {
  haptic_servo_input input = HAPTIC_SERVO_INPUT_INIT;
  haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
  int error;
  input.ready = report->is_ready;
  input.switches = report->buttons;
  input.device_faults = report->faults;
  input.report = report->number;
  input.report_time_s = report->time_s;
  input.time_s = now_s;
  memcpy(input.pose, report->position_m, sizeof report->position_m);
  memcpy(input.pose + 3, report->orientation_xyzw, sizeof report->orientation_xyzw);
  error = haptic_session_tick(session, &input, &output);  // with an error the wrench is zero
  memcpy(force_n, output.wrench, 3 * sizeof force_n[0]);
  return error == HAPTIC_OK;
}

// In place of a device: a handle that is led 40 mm down and stays there, with the deadman held from
// 0.1 s on. The session is closed with the force on.
int main(int argc, char** argv) {
  haptic_compile_input input = HAPTIC_COMPILE_INPUT_INIT;
  haptic_verdict verdict = HAPTIC_VERDICT_INIT;
  struct handle_report report = {0, 0, {0, 0, 0}, {0, 0, 0, 1}, 0, 1, 0};
  haptic_compiled* compiled = NULL;
  haptic_session* session = NULL;
  haptic_contact contacts[48];
  const void* scene = NULL;
  size_t scene_bytes = 0, count = 0;
  double force_n[3] = {0, 0, 0}, last_n[3] = {0, 0, 0}, held_n = 0;
  char why[256] = "give a scene file that can be compiled";
  int k;
  input.scene_file = argc == 2 ? argv[1] : "";
  if (haptic_compile(&input, &compiled) == HAPTIC_OK &&
      haptic_compiled_bytes(compiled, &scene, &scene_bytes) == HAPTIC_OK)
    session = open_device(scene, scene_bytes, why);
  (void)haptic_compiled_free(&compiled);
  if (session == NULL) {
    fprintf(stderr, "external_device: %s\n", why);
    return 2;
  }
  for (k = 1; k <= 2000; ++k) {
    report.number = (uint64_t)k;
    report.time_s = 0.001 * k;
    report.position_m[2] = -0.020 + 0.020 * cos(3.14159265 * 0.001 * (k < 1000 ? k : 1000));
    report.buttons = k > 100 ? 1 : 0;
    if (k == 1500) {
      (void)haptic_session_contacts(session, contacts, 48, sizeof contacts[0], &count, NULL);
      held_n = force_n[2];
      (void)haptic_session_close(session);  // the ticks ramp to zero now
    }
    if (!session_callback(session, &report, report.time_s, force_n)) break;
    if (fabs(force_n[2] - last_n[2]) > 600 * 0.001 * 2) return 3;  // the slew limit
    memcpy(last_n, force_n, sizeof last_n);
  }
  (void)haptic_session_verdict(session, &verdict);
  printf("external_device: %.3f N at %u contacts; ended %d ms after the close at %.3f N; %s\n",
         held_n, (unsigned)count, k - 1500, last_n[2], verdict.text);
  (void)haptic_session_free(&session);
  return held_n > 0 && count > 0 && k < 1600 && last_n[2] == 0 ? 0 : 1;
}
