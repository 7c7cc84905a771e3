// SPDX-License-Identifier: Apache-2.0
// A stand-in for Force Dimension's libdhd: own code by the published reference, a simulated handle
// behind it, and misbehaviour on demand. It shares no declaration with the bridge. Axes: x towards
// the operator, y to the right, z up.
#include <mutex>

#include "tests/bridges/vendor/fake_core.hpp"

namespace {

using haptic::fake::Trace;

constexpr int kErrorNone = 0, kErrorCom = 2, kErrorNoDevice = 5, kErrorTimeout = 7,
              kErrorExpert = 9, kErrorInUse = 20;

std::mutex g_mutex;  // the real one is thread-safe
Fault g_fault;
SimulatedHandle g_handle;
bool g_is_open = false, g_is_expert = false;
int g_type = 104;
std::int64_t g_fed_us = 0;
int g_off_cause = 0;
thread_local int g_error = kErrorNone;

int failed(int error) {
  g_error = error;
  return -1;
}

/// The device's own watchdog: no wrench for so long, no force.
void pass_time() {
  Trace& t = trace();
  const int units = t.watchdog_units.load();
  if (t.force_on.load() == 0 || units == 0) return;
  if (now_us() - g_fed_us <= units * 125) return;
  for (int k = 0; k < 3; ++k) {
    t.force[k].store(0);
    t.torque[k].store(0);
  }
  t.force_on.store(0);
  t.watchdog_cuts.fetch_add(1);
  g_off_cause = 3;
}

bool is_gone() { return !g_is_open || g_fault.is("unplugged"); }

int opened(int id) {
  g_fault.load();
  const char* const type = std::getenv("HAPTIC_FAKE_TYPE");
  g_type = type != nullptr ? std::atoi(type) : 104;
  trace().frames.store(0);
  if (g_fault.is("no_device")) return failed(kErrorNoDevice);
  if (g_is_open) return failed(kErrorInUse);
  if (g_fault.is("opens_late")) std::this_thread::sleep_for(std::chrono::milliseconds(300));
  g_is_open = true;
  g_off_cause = 0;
  trace().watchdog_units.store(0);
  trace().opened.fetch_add(1);
  return id;
}

}  // namespace

FAKE_EXPORT Trace* fake_trace() { return &trace(); }

FAKE_EXPORT void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  g_fault.load();
  if (g_fault.is("silent_version")) return;
  *major = g_fault.is("version") ? 4 : 3;
  *minor = 17;
  *release = 6;
  *revision = 0;
}
FAKE_EXPORT int dhdGetDeviceCount() { return g_fault.is("no_device") ? 0 : 1; }
FAKE_EXPORT int dhdOpen() { return opened(0); }
FAKE_EXPORT int dhdOpenID(char index) { return index == 0 ? opened(0) : failed(kErrorNoDevice); }
FAKE_EXPORT int dhdOpenSerial(int serial) {
  return serial == 4711 ? opened(0) : failed(kErrorNoDevice);
}
FAKE_EXPORT int dhdClose(char /*id*/) {
  if (!g_is_open) return failed(kErrorNoDevice);
  g_is_open = false;
  trace().force_on.store(0);
  trace().closed.fetch_add(1);
  return 0;
}
FAKE_EXPORT int dhdStop(char /*id*/) {
  if (is_gone()) return failed(kErrorCom);
  trace().force_on.store(0);
  trace().stopped.fetch_add(1);
  return 0;
}
FAKE_EXPORT int dhdGetSystemType(char /*id*/) { return g_type; }
FAKE_EXPORT const char* dhdGetSystemName(char /*id*/) { return "stand-in"; }
FAKE_EXPORT int dhdGetSerialNumber(unsigned short* serial, char /*id*/) {
  *serial = 4711;
  return 0;
}
FAKE_EXPORT bool dhdHasBase(char /*id*/) { return g_type != 81; }
FAKE_EXPORT bool dhdHasWrist(char /*id*/) { return g_type == 34 || g_type >= 104; }
FAKE_EXPORT bool dhdHasActiveWrist(char /*id*/) { return g_type >= 104; }
FAKE_EXPORT bool dhdHasGripper(char /*id*/) { return g_type >= 104; }

FAKE_EXPORT int dhdGetStatus(int* status, char /*id*/) {
  const std::lock_guard lock(g_mutex);
  if (is_gone()) return failed(kErrorCom);
  pass_time();
  for (int k = 0; k < 16; ++k) status[k] = 0;
  if (g_fault.is_at("velocity")) {
    trace().force_on.store(0);
    g_off_cause = 2;
  }
  status[0] = g_fault.is("no_power") ? 0 : 1;
  status[1] = 1;
  status[2] = 1;
  status[3] = g_fault.is("not_calibrated") ? 1 : 0;
  status[5] = trace().force_on.load();
  status[12] = 1;
  status[14] = g_off_cause;
  return 0;
}

FAKE_EXPORT int dhdGetPositionAndOrientationFrame(double* px, double* py, double* pz,
                                                  double matrix[3][3], char /*id*/) {
  trace().frames.fetch_add(1);
  g_fault.strike();
  const std::lock_guard lock(g_mutex);
  if (is_gone()) return failed(kErrorCom);
  if (g_fault.is("fails")) return failed(kErrorTimeout);
  if (g_fault.is_at("fails_once")) return failed(kErrorTimeout);
  pass_time();
  const auto motion = g_handle.advance();
  *px = g_fault.is("nan") ? std::nan("") : motion.position_m[0];
  *py = motion.position_m[1];
  *pz = g_fault.is("far") ? 1.0e6 : motion.position_m[2];
  for (std::size_t k = 0; k < 9; ++k)
    matrix[k / 3][k % 3] = g_fault.is("no_rotation") ? 0.5 : trace().rotation[k].load();
  return 0;
}
FAKE_EXPORT int dhdGetLinearVelocity(double* vx, double* vy, double* vz, char /*id*/) {
  const std::lock_guard lock(g_mutex);
  const auto motion = g_handle.advance();
  *vx = motion.velocity[0];
  *vy = motion.velocity[1];
  *vz = motion.velocity[2];
  return 0;
}
FAKE_EXPORT int dhdGetAngularVelocityRad(double* wx, double* wy, double* wz, char /*id*/) {
  *wx = trace().angular_velocity[0].load();
  *wy = trace().angular_velocity[1].load();
  *wz = trace().angular_velocity[2].load();
  return 0;
}
FAKE_EXPORT unsigned dhdGetButtonMask(char /*id*/) { return trace().buttons.load(); }
FAKE_EXPORT int dhdGetGripperAngleRad(double* angle, char /*id*/) {
  *angle = trace().gripper_rad.load();
  return 0;
}

FAKE_EXPORT int dhdEnableForce(unsigned char on, char /*id*/) {
  const std::lock_guard lock(g_mutex);
  if (is_gone()) return failed(kErrorCom);
  trace().force_on.store(on);
  g_fed_us = now_us();
  if (on != 0) g_off_cause = 0;
  return 0;
}
FAKE_EXPORT int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx,
                                                    double ty, double tz, double /*fg*/,
                                                    char /*id*/) {
  const std::lock_guard lock(g_mutex);
  if (is_gone()) return failed(kErrorCom);
  if (g_fault.is("force_fails")) return failed(kErrorTimeout);
  pass_time();
  const double f[3] = {fx, fy, fz}, t[3] = {tx, ty, tz}, none[3] = {};
  const bool on = trace().force_on.load() != 0;
  set_wrench(on ? f : none, on ? t : none);
  g_fed_us = now_us();
  return g_fault.is("saturated") ? 2 : 0;
}
FAKE_EXPORT int dhdSetGravityCompensation(int on, char /*id*/) {
  trace().gravity.store(on);
  return 0;
}

FAKE_EXPORT int dhdEnableExpertMode() {
  g_is_expert = true;
  return 0;
}
FAKE_EXPORT int dhdDisableExpertMode() {
  g_is_expert = false;
  return 0;
}
FAKE_EXPORT int dhdSetWatchdog(unsigned char units, char /*id*/) {
  if (!g_is_expert) return failed(kErrorExpert);
  if (g_fault.is("watchdog_refused")) return failed(10);
  trace().watchdog_units.store(g_fault.is("watchdog_not_kept") ? 0 : units);
  return 0;
}
#ifndef HAPTIC_FAKE_LACKS
FAKE_EXPORT int dhdGetWatchdog(unsigned char* units, char /*id*/) {
  if (!g_is_expert) return failed(kErrorExpert);
  *units = static_cast<unsigned char>(trace().watchdog_units.load());
  return 0;
}
#endif

FAKE_EXPORT double dhdGetMaxForce(char /*id*/) { return g_fault.is("max_force") ? 5.0 : -1.0; }
FAKE_EXPORT double dhdGetMaxTorque(char /*id*/) { return -1.0; }
FAKE_EXPORT int dhdErrorGetLast() { return g_error; }
FAKE_EXPORT const char* dhdErrorGetLastStr() {
  switch (g_error) {
    case kErrorCom:
      return "communication error";
    case kErrorNoDevice:
      return "no device found";
    case kErrorTimeout:
      return "timeout";
    case kErrorExpert:
      return "expert mode disabled";
    case kErrorInUse:
      return "device already in use";
    default:
      return "error";
  }
}
