// SPDX-License-Identifier: Apache-2.0
// A stand-in for 3D Systems' libHD: own code by the published reference, with a scheduler's thread,
// a stack of errors, a simulated handle, and misbehaviour on demand. It shares no declaration with
// the bridge. Axes: x to the right, y up, z towards the operator; mm, N, mN m.
#include <cstring>
#include <mutex>
#include <vector>

#include "tests/bridges/vendor/fake_core.hpp"

namespace {

using haptic::fake::Trace;

struct ErrorInfo {
  unsigned errorCode;
  int internalErrorCode;
  unsigned hHD;
};
using Callback = unsigned (*)(void*);

std::mutex g_mutex;
std::vector<ErrorInfo> g_errors;  // the newest is taken first
Fault g_fault;
SimulatedHandle g_handle;
SimulatedHandle::Motion g_motion;
std::thread g_scheduler;
std::atomic<bool> g_is_running{false};
std::atomic<Callback> g_callback{nullptr};
void* g_user = nullptr;
unsigned long g_rate_hz = 1000;
bool g_is_open = false, g_in_frame = false, g_is_six = false;
std::atomic<unsigned> g_enabled{0};  // bit k: capability 0x4000 + k
double g_force[3] = {}, g_torque[3] = {};

constexpr unsigned kHandle = 7, kInvalidHandle = 0xffffffff;

void push(unsigned code) {
  const std::lock_guard lock(g_mutex);
  g_errors.push_back({code, 42, kHandle});
}

void run_scheduler() {
  while (g_is_running.load()) {
    const Callback callback = g_callback.load();
    if (callback != nullptr && callback(g_user) == 0) g_callback = nullptr;
    std::this_thread::sleep_for(std::chrono::microseconds(1'000'000 / g_rate_hz));
  }
}

bool needs_frame(const char* what) {
  if (!g_in_frame) push(std::strcmp(what, "set") == 0 ? 0x0401 : 0x0402);
  return g_in_frame;
}

}  // namespace

FAKE_EXPORT Trace* fake_trace() { return &trace(); }

FAKE_EXPORT unsigned hdInitDevice(const char* name) {
  g_fault.load();
  trace().frames.store(0);
  g_is_six = std::getenv("HAPTIC_FAKE_SIX") != nullptr;
  const bool is_known = name == nullptr || std::strcmp(name, "Right Hand") == 0;
  if (!is_known || g_fault.is("no_device")) {
    push(0x0302);
    return kInvalidHandle;
  }
  if (g_fault.is("no_handle")) return kInvalidHandle;
  if (g_is_open || g_fault.is("busy")) {
    push(0x0301);
    return kInvalidHandle;
  }
  g_is_open = true;
  g_enabled.store(0);
  trace().opened.fetch_add(1);
  return kHandle;
}
FAKE_EXPORT void hdDisableDevice(unsigned handle) {
  if (handle != kHandle || !g_is_open) return push(0x0104);
  g_is_open = false;
  trace().force_on.store(0);
  trace().closed.fetch_add(1);
}
FAKE_EXPORT void hdMakeCurrentDevice(unsigned handle) {
  if (handle != kHandle) push(0x0104);
}

FAKE_EXPORT void hdBeginFrame(unsigned handle) {
  trace().frames.fetch_add(1);
  g_fault.strike();
  if (handle != kHandle || !g_is_open) return push(0x0104);
  if (g_in_frame) push(0x0400);
  g_in_frame = true;
  if (g_fault.is("unplugged")) push(0x0302);
  if (g_fault.is_at("hiccup")) push(0x0302);
  g_motion = g_handle.advance();
}
FAKE_EXPORT void hdEndFrame(unsigned handle) {
  if (handle != kHandle) return push(0x0104);
  if (!g_in_frame) return push(0x0401);
  g_in_frame = false;
  if (g_fault.is_at("velocity")) push(0x0203);
  if (g_fault.is_at("warm")) push(0x0200);
  double newtons[3], newton_metres[3];
  const bool on = (g_enabled.load() & 1u) != 0 && !g_fault.is("unplugged");
  for (int k = 0; k < 3; ++k) {
    newtons[k] = on ? g_force[k] : 0;
    newton_metres[k] = on ? g_torque[k] * 1.0e-3 : 0;
  }
  set_wrench(newtons, newton_metres);
}

FAKE_EXPORT void hdEnable(unsigned capability) {
  if (capability < 0x4000 || capability > 0x4004) return push(0x0100);
  if (capability == 0x4001 && g_fault.is("no_clamping")) return;
  g_enabled.fetch_or(1u << (capability - 0x4000));
  if (capability == 0x4000) trace().force_on.store(1);
}
FAKE_EXPORT void hdDisable(unsigned capability) {
  if (capability < 0x4000 || capability > 0x4004) return push(0x0100);
  g_enabled.fetch_and(~(1u << (capability - 0x4000)));
  if (capability != 0x4000) return;
  trace().force_on.store(0);
  const double none[3] = {};
  set_wrench(none, none);
}
FAKE_EXPORT unsigned char hdIsEnabled(unsigned capability) {
  return (g_enabled.load() >> (capability - 0x4000)) & 1u;
}

FAKE_EXPORT ErrorInfo hdGetError() {
  const std::lock_guard lock(g_mutex);
  if (g_fault.is("endless_errors")) return {0x0103, 0, kHandle};
  if (g_errors.empty()) return {0, 0, kHandle};
  const ErrorInfo newest = g_errors.back();
  g_errors.pop_back();
  return newest;
}
FAKE_EXPORT const char* hdGetErrorString(unsigned code) {
  switch (code) {
    case 0x0101:
      return "HD_INVALID_VALUE";
    case 0x0301:
      return "HD_DEVICE_ALREADY_INITIATED";
    case 0x0302:
      return "HD_COMM_ERROR";
    default:
      return "";
  }
}
FAKE_EXPORT const char* hdGetString(unsigned parameter) {
  switch (parameter) {
    case 0x2500:
      return g_fault.is("version") ? "2.0.24" : "3.4.0";
    case 0x2501:
      return "stand-in";
    case 0x2504:
      return "4711";
    default:
      push(0x0100);
      return nullptr;
  }
}
FAKE_EXPORT void hdGetIntegerv(unsigned parameter, int* value) {
  switch (parameter) {
    case 0x2000:
      *value = static_cast<int>(trace().buttons.load());
      return;
    case 0x2553:
      *value = 6;
      return;
    case 0x2554:
      *value = g_is_six ? 6 : 3;
      return;
    case 0x2555:
      *value = 4;
      return;
    default:
      push(0x0100);
  }
}
FAKE_EXPORT void hdGetDoublev(unsigned parameter, double* value) {
  Trace& t = trace();
  switch (parameter) {
    case 0x2051:
      for (int k = 0; k < 3; ++k) value[k] = g_motion.velocity[static_cast<std::size_t>(k)] * 1000;
      return;
    case 0x2052:
      if (!needs_frame("get")) return;
      for (int k = 0; k < 16; ++k) value[k] = k == 15 ? 1 : 0;
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
          value[4 * column + row] = t.rotation[3 * row + column].load();
        value[12 + row] = g_motion.position_m[static_cast<std::size_t>(row)] * 1000;
      }
      if (g_fault.is("nan")) value[13] = std::nan("");
      return;
    case 0x2053:
      for (int k = 0; k < 3; ++k) value[k] = t.angular_velocity[k].load();
      return;
    case 0x2551: {
      const double box[6] = {-160, -120, -70, 160, 120, 70};
      std::memcpy(value, box, sizeof box);
      return;
    }
    case 0x2602:
      *value = 1.02;
      return;
    case 0x2603:
      *value = g_fault.is("no_limits") ? 0 : 3.3;
      return;
    case 0x2604:
      *value = 0.88;
      return;
    case 0x2609:
      *value = 0.003;
      return;
    case 0x2622:
      *value = g_is_six ? 188 : 0;
      return;
    default:
      push(0x0100);
  }
}
FAKE_EXPORT void hdSetDoublev(unsigned parameter, const double* value) {
  if (!needs_frame("set")) return;
  if (parameter == 0x2700)
    std::memcpy(g_force, value, sizeof g_force);
  else if (parameter == 0x2701)
    std::memcpy(g_torque, value, sizeof g_torque);
  else
    push(0x0100);
}

FAKE_EXPORT unsigned hdCheckCalibration() {
  if (g_fault.is("needs_input")) return 0x5002;
  return trace().needs_update.load() != 0 ? 0x5001 : 0x5000;
}
FAKE_EXPORT void hdUpdateCalibration(unsigned style) {
  if (style != 4) return push(0x0101);
  Trace& t = trace();
  t.updated_n.store(std::hypot(t.force[0].load(), t.force[1].load(), t.force[2].load()));
  t.updates.fetch_add(1);
  t.needs_update.store(0);
}

FAKE_EXPORT void hdSetSchedulerRate(unsigned long rate) {
  if (g_fault.is("rate")) return push(0x0101);
  g_rate_hz = rate;
  trace().rate_hz.store(static_cast<int>(rate));
}
FAKE_EXPORT unsigned long hdScheduleAsynchronous(Callback callback, void* user,
                                                 unsigned short /*priority*/) {
  g_callback = callback;
  g_user = user;
  return 1;
}
FAKE_EXPORT void hdUnschedule(unsigned long handle) {
  if (handle != 1) return push(0x0104);
  g_callback = nullptr;
}
FAKE_EXPORT void hdStartScheduler() {
  if (g_is_running.exchange(true)) return push(0x0304);
  g_scheduler = std::thread(run_scheduler);
}
#ifndef HAPTIC_FAKE_LACKS
FAKE_EXPORT void hdStopScheduler() {
  g_is_running.store(false);
  if (g_scheduler.joinable()) g_scheduler.join();
  trace().stopped.fetch_add(1);
}
#endif
