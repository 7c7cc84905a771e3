// SPDX-License-Identifier: Apache-2.0
#include "tests/host_sim/session/session_bench.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <span>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "tools/common/files.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::sim::test {
namespace {

constexpr std::uint32_t kDeadmanHeld = 1;
constexpr double kApart_m = 0.005, kPressed_m = -0.012;

constexpr const char* kScene =
    "format = 1\nname = \"block on plate\"\n"
    "[moving]\nshape = \"box\"\nsize_m = [0.04, 0.04, 0.02]\nposition_m = [0, 0, 0.015]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.02]\nposition_m = [0, 0, -0.01]\n"
    "[rendering]\nk_f_n_per_m = 400\n[coupling]\nk_t_n_per_m = 400\n"
    // As the device states itself, and a loop by the timer: within its passivity budget.
    "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 1\nrotor_inertia_kg_m2 = 1e-4\n"
    "rotor_damping_nms_per_rad = 1e-3\ndelay_s = 0.002\n";

}  // namespace

void sleep_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

bool comes_true_within(const std::function<bool()>& holds, int within_ms) {
  const std::int64_t end_ns = hal::monotonic_ns() + within_ms * kMs;
  while (!holds()) {
    if (hal::monotonic_ns() > end_ns) return false;
    sleep_ms(1);
  }
  return true;
}

SessionBench::SessionBench() {
  write("scene.toml", kScene);
  write("device.toml",
        "scene = \"block.rtscene\"\n[device]\ndriver = \"reference\"\n"
        "address = \"unix:device.sock\"\n[loop]\nstrict = false\n");
  scene_ = tools::compile_scene(tools::read_scene_file(file("scene.toml")), {}).bytes;
  tools::write_files({{file("block.rtscene"), scene_}});
  ReferenceModelSettings settings;
  settings.hand = *hand_named("firm");
  device_ = std::make_unique<ServedDevice>(file("device.sock"), settings);
}

void SessionBench::write(const std::string& name, const std::string& text) const {
  std::ofstream(file(name)) << text;
}

bool SessionBench::press() {
  // A tick that came too late releases it: again.
  for (int tried = 0; tried < 20; ++tried) {
    device().hold(kApart_m, 0);
    sleep_ms(150);
    device().hold(kApart_m, kDeadmanHeld);
    sleep_ms(250);
    device().hold(kPressed_m, kDeadmanHeld);
    if (comes_true_within([this] { return device().handed_n() > kFelt_n; }, 2000)) {
      sleep_ms(200);  // until the hand rests
      if (device().handed_n() > kFelt_n) return true;
    }
  }
  return false;
}

OpenedSession::OpenedSession(const SessionBench& bench, const std::string& config,
                             std::int32_t hands) {
  haptic_session_options options = HAPTIC_SESSION_OPTIONS_INIT;
  options.device = config.c_str();
  options.hands = hands;
  char text[4096];
  error_ = haptic_session_open_text(bench.scene().data(), bench.scene().size(), &options, &session_,
                                    text, sizeof text);
  text_ = text;
}

haptic_state OpenedSession::state() const {
  haptic_state state = HAPTIC_STATE_INIT;
  REQUIRE(haptic_session_state(session_, &state) == HAPTIC_OK);
  return state;
}

haptic_device_status OpenedSession::device() const {
  haptic_device_status status = HAPTIC_DEVICE_STATUS_INIT;
  REQUIRE(haptic_session_device(session_, 0, &status) == HAPTIC_OK);
  return status;
}

std::vector<haptic_event> OpenedSession::events() const {
  std::vector<haptic_event> events(64);
  std::size_t count = 0;
  REQUIRE(haptic_session_events(session_, events.data(), events.size(), sizeof events[0], &count) ==
          HAPTIC_OK);
  events.resize(count);
  return events;
}

bool OpenedSession::has_event(const std::string& name) const {
  return std::ranges::any_of(events(), [&](const haptic_event& e) { return name == e.name; });
}

Setting::Setting(const char* name, const std::string& value)
    : name_(name), was_set_(std::getenv(name) != nullptr) {
  if (was_set_) before_ = std::getenv(name);
  (void)setenv(name, value.c_str(), 1);
}

Setting::~Setting() {
  if (was_set_) {
    (void)setenv(name_, before_.c_str(), 1);
  } else {
    (void)unsetenv(name_);
  }
}

Ramp ramp_since(const WireRecord& wire, std::int64_t begin_ns) {
  Ramp ramp;
  double last_n = 0;
  for (const WireCommand& command : wire.commands) {
    const double force_n = command.drives_on ? command.wrench.force_w.norm() : 0.0;
    if (command.stamp_ns < begin_ns) {
      last_n = ramp.begin_n = force_n;
      continue;
    }
    // Drives that are taken off are zero at once.
    if (command.drives_on)
      ramp.largest_step_n = std::max(ramp.largest_step_n, std::abs(force_n - last_n));
    last_n = force_n;
    if (ramp.to_zero_ms < 0 && force_n == 0)
      ramp.to_zero_ms = 1e-6 * static_cast<double>(command.stamp_ns - begin_ns);
    if (ramp.to_zero_ms >= 0 && force_n > 0) ramp.stays = false;
  }
  return ramp;
}

}  // namespace haptic::sim::test
