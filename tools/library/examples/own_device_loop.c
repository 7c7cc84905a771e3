// SPDX-License-Identifier: Apache-2.0
// The servo tick in a device loop of your own: a callback of OpenHaptics, a game engine, a robot.
//   cc -std=c99 own_device_loop.c $(pkg-config --cflags --libs haptic) -lm -o own_device_loop
//   ./own_device_loop scene.toml
#define _POSIX_C_SOURCE 200809L
#include <haptic.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Fill it in the callback of the device's library.
struct device_report {
  uint64_t number;             // counts the reports: the same again where none is newer
  double time_s;               // when it came, by the clock of the callback
  double position_m[3];        // of the handle
  double orientation_xyzw[4];  // of the handle
  uint32_t buttons;            // bit 0: deadman switch, bit 1: emergency stop
  uint32_t is_ready;           // found and calibrated
  uint32_t faults;             // of the device, as DeviceFault
};

// Once, before the device's thread begins. Null: the scene or the options are refused.
static haptic_servo* begin_loop(const void* scene, size_t scene_bytes, void** memory) {
  haptic_servo_options options = HAPTIC_SERVO_OPTIONS_INIT;
  haptic_servo_bounds bounds = HAPTIC_SERVO_BOUNDS_INIT;
  haptic_servo* servo = NULL;
  options.emergency_stop = 2;
  options.driven_axes = 7;  // three motors: force without torque
  options.max_force_n = 3;  // what the device's manual says
  options.rate_hz = 1000;   // of its callback
  if (haptic_servo_bounds_of(scene, scene_bytes, &options, &bounds) != HAPTIC_OK) return NULL;
  if (posix_memalign(memory, HAPTIC_ALIGNMENT, bounds.memory_bytes) != 0) return NULL;
  (void)haptic_servo_begin(scene, scene_bytes, *memory, bounds.memory_bytes, &options, &servo);
  return servo;
}

// Once a period, on the device's thread. With any report, `force_n` may be sent.
static void device_callback(haptic_servo* servo, const struct device_report* report, double now_s,
                            double force_n[3]) {
  haptic_servo_input input = HAPTIC_SERVO_INPUT_INIT;
  haptic_servo_output output = HAPTIC_SERVO_OUTPUT_INIT;
  input.ready = report->is_ready;
  input.switches = report->buttons;
  input.device_faults = report->faults;
  input.report = report->number;
  input.report_time_s = report->time_s;
  input.time_s = now_s;
  memcpy(input.pose, report->position_m, sizeof report->position_m);
  memcpy(input.pose + 3, report->orientation_xyzw, sizeof report->orientation_xyzw);
  (void)haptic_servo_tick(servo, &input, &output);  // with an error the wrench is zero
  memcpy(force_n, output.wrench, 3 * sizeof force_n[0]);
}

// In place of a device: a handle that is led 40 mm down and up again, with the deadman held from
// 0.1 s on.
int main(int argc, char** argv) {
  haptic_compile_input input = HAPTIC_COMPILE_INPUT_INIT;
  haptic_verdict verdict = HAPTIC_VERDICT_INIT;
  struct device_report report = {0, 0, {0, 0, 0}, {0, 0, 0, 1}, 0, 1, 0};
  haptic_compiled* compiled = NULL;
  haptic_servo* servo;
  const void* scene = NULL;
  void *memory = NULL, *copy = NULL;
  size_t scene_bytes = 0;
  double force_n[3], largest_n = 0;
  int k;
  input.scene_file = argc == 2 ? argv[1] : "";
  if (haptic_compile(&input, &compiled) != HAPTIC_OK ||
      haptic_compiled_bytes(compiled, &scene, &scene_bytes) != HAPTIC_OK ||
      posix_memalign(&copy, HAPTIC_ALIGNMENT, scene_bytes) != 0) {
    fprintf(stderr, "own_device_loop: give a scene file that can be compiled\n");
    return 2;
  }
  memcpy(copy, scene, scene_bytes);
  servo = begin_loop(copy, scene_bytes, &memory);
  if (servo == NULL) return 3;
  for (k = 1; k <= 2000; ++k) {
    report.number = (uint64_t)k;
    report.time_s = 0.001 * k;
    report.position_m[2] = -0.020 + 0.020 * cos(3.14159265 * 0.001 * k);
    report.buttons = k > 100 ? 1 : 0;
    device_callback(servo, &report, report.time_s, force_n);
    largest_n = fmax(largest_n, sqrt(force_n[0] * force_n[0] + force_n[1] * force_n[1] +
                                     force_n[2] * force_n[2]));
  }
  (void)haptic_servo_verdict(servo, &verdict);
  printf("own_device_loop: at most %.3f N; %s\n", largest_n, verdict.text);
  (void)haptic_servo_close(servo);
  free(memory);
  free(copy);
  (void)haptic_compiled_free(&compiled);
  return largest_n > 0 ? 0 : 1;
}
