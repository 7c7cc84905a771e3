// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A bridge's device on a stand-in of its vendor's library, driven as the bridge's service drives
/// it: a look and an order each millisecond.

#include <dlfcn.h>
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "hal/bridge/bridged_device.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/driver_registry.hpp"
#include "tests/bridges/vendor/fake_trace.hpp"

namespace haptic::test {

/// Variables of the environment for as long as this lives.
class FakeEnvironment {
 public:
  explicit FakeEnvironment(const std::string& fault, const std::string& type = "",
                           int block_ms = 1000) {
    set("HAPTIC_FAKE_FAULT", fault);
    set("HAPTIC_FAKE_TYPE", type);
    set("HAPTIC_FAKE_BLOCK_MS", std::to_string(block_ms));
  }
  ~FakeEnvironment() {
    for (const char* name : {"HAPTIC_FAKE_FAULT", "HAPTIC_FAKE_TYPE", "HAPTIC_FAKE_BLOCK_MS"})
      unsetenv(name);
  }
  FakeEnvironment(const FakeEnvironment&) = delete;
  FakeEnvironment& operator=(const FakeEnvironment&) = delete;

 private:
  static void set(const char* name, const std::string& value) {
    if (value.empty())
      unsetenv(name);
    else
      setenv(name, value.c_str(), 1);
  }
};

/// From nothing to `top` in 60 ms, then held.
inline Wrench ramp(int ms, const Wrench& top) {
  const Real share = static_cast<Real>(std::min(ms, 60)) / 60;
  return {share * top.force_w, share * top.torque_w};
}
/// The same along x.
inline Wrench ramp(int ms, Real top_n) { return ramp(ms, Wrench{Vec3(top_n, 0, 0), Vec3::Zero()}); }

inline bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

using VendorMake = std::unique_ptr<hal::BridgedDevice>(const hal::DriverOptions&,
                                                       hal::DriverDefect&);

class VendorBench {
 public:
  using Value = std::variant<std::string, bool, double>;

  VendorBench(VendorMake* make, const std::string& library,
              std::vector<std::pair<std::string_view, Value>> keys = {}) {
    hal::DriverOptions options;
    options.values = std::move(keys);
    options.values.emplace_back("library", library);
    hal::DriverDefect defect;
    device = make(options, defect);
    REQUIRE(device != nullptr);
    void* const loaded = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (loaded == nullptr) return;
    const auto function = reinterpret_cast<FakeTraceFunction*>(dlsym(loaded, "fake_trace"));
    if (function != nullptr) trace = function();
    if (trace == nullptr) return;
    trace->is_fixed.store(0);
    for (int k = 0; k < 9; ++k) trace->rotation[k].store(k % 4 == 0 ? 1 : 0);
    for (int k = 0; k < 3; ++k) trace->hand_m[k].store(0);
    trace->buttons.store(0);
    trace->updates.store(0);
    trace->needs_update.store(0);
    trace->gripper_rad.store(0.3);
  }
  ~VendorBench() { device->close(); }

  [[nodiscard]] bool open() { return device->open(why); }
  /// What the refusal says; empty: it was opened.
  [[nodiscard]] std::string refusal() { return open() ? "" : why; }

  /// Looks each millisecond, and orders: null: nothing is ordered; else the wrench at each
  /// millisecond from 0 on. @return kNew, or what the last look said.
  hal::BridgeRead run(int ms, const std::function<Wrench(int)>& wrench = nullptr) {
    hal::BridgeRead last = hal::BridgeRead::kSame;
    std::int64_t due_ns = hal::monotonic_ns();
    writes_refused = news = 0;
    for (int k = 0; k < ms; ++k) {
      last = look();
      if (wrench && !device->write(hal::monotonic_ns(), wrench(k))) ++writes_refused;
      due_ns += 1'000'000;
      (void)hal::sleep_until(due_ns);
    }
    return last;
  }
  hal::BridgeRead look() {
    hal::BridgeSample next;
    const hal::BridgeRead read = device->read(hal::monotonic_ns(), next);
    if (read == hal::BridgeRead::kNew) {
      sample = next;
      ++news;
    }
    return read;
  }
  /// Until `done`, a minute at most: patience, not a time.
  bool run_until(const std::function<bool()>& done) {
    for (int k = 0; k < 60'000; ++k) {
      if (done()) return true;
      run(1);
    }
    return false;
  }
  bool release() {
    return run_until([&] { return device->release(hal::monotonic_ns()); });
  }

  /// Ramps up to `top` and is there. A machine that holds one of the threads up for too long
  /// cuts the force off: the next try counts.
  bool reach(const Wrench& top) {
    for (int k = 0; k < 200; ++k) {
      run(80, [&](int ms) { return ramp(ms, top); });
      if (std::abs(force().norm() - top.force_w.norm()) < 1.0e-6_r) return true;
      (void)release();
    }
    return false;
  }

  bool reach(Real top_n) { return reach(Wrench{Vec3(top_n, 0, 0), Vec3::Zero()}); }

  [[nodiscard]] Vec3 force() const {
    return {static_cast<Real>(trace->force[0]), static_cast<Real>(trace->force[1]),
            static_cast<Real>(trace->force[2])};
  }
  [[nodiscard]] Vec3 torque() const {
    return {static_cast<Real>(trace->torque[0]), static_cast<Real>(trace->torque[1]),
            static_cast<Real>(trace->torque[2])};
  }
  /// Largest rise between two forces in a row since wrench number `from`.
  [[nodiscard]] float largest_rise_n(std::uint64_t from) const {
    float largest = 0;
    const std::uint64_t to = trace->wrenches.load();
    REQUIRE(to - from < fake::kHistory);
    for (std::uint64_t k = from + 1; k < to; ++k)
      largest = std::max(largest, trace->history_n[k % fake::kHistory].load() -
                                      trace->history_n[(k - 1) % fake::kHistory].load());
    return largest;
  }

  std::unique_ptr<hal::BridgedDevice> device;
  fake::Trace* trace = nullptr;
  hal::BridgeSample sample;
  std::string why;
  int writes_refused = 0, news = 0;
};

}  // namespace haptic::test
