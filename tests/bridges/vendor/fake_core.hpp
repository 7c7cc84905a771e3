// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Common part of the stand-ins for vendors' libraries: the trace, the misbehaviour, a handle. Each
/// library has its own, although all of them may be loaded into one process.

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <thread>

#include "tests/bridges/vendor/fake_trace.hpp"

#define FAKE_EXPORT extern "C" __attribute__((visibility("default")))

namespace {

inline haptic::fake::Trace& trace() {
  static haptic::fake::Trace own;
  static haptic::fake::Trace* const shared = [] {
    const char* const path = std::getenv("HAPTIC_FAKE_TRACE");
    const int file = path != nullptr ? open(path, O_RDWR | O_CLOEXEC) : -1;
    if (file < 0) return &own;
    void* const at =
        mmap(nullptr, sizeof(haptic::fake::Trace), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    (void)close(file);
    return at == MAP_FAILED ? &own : static_cast<haptic::fake::Trace*>(at);
  }();
  return *shared;
}

inline std::int64_t now_us() {
  using namespace std::chrono;
  return duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
}

/// Misbehaviour, as the environment has it when the device is opened.
class Fault {
 public:
  void load() {
    const char* const text = std::getenv("HAPTIC_FAKE_FAULT");
    name_ = text != nullptr ? text : "";
    from_ = 0;
    if (const std::size_t at = name_.find('@'); at != std::string::npos) {
      from_ = std::strtoull(name_.c_str() + at + 1, nullptr, 10);
      name_.resize(at);
    }
    const char* const block = std::getenv("HAPTIC_FAKE_BLOCK_MS");
    block_ms_ = block != nullptr ? std::atoi(block) : 1000;
    has_blocked_ = false;
  }
  /// The fault of this name is on in this frame.
  [[nodiscard]] bool is(const char* name) const {
    return name_ == name && trace().frames.load() >= from_;
  }
  /// Exactly in one frame.
  [[nodiscard]] bool is_at(const char* name) const {
    return name_ == name && trace().frames.load() == from_;
  }
  /// Blocks once, or dies, where the fault says so.
  void strike() {
    if (is("crashes") || trace().crash.load() != 0) {
      (void)std::raise(SIGSEGV);
    }
    if (is("blocks") && !has_blocked_.exchange(true))
      std::this_thread::sleep_for(std::chrono::milliseconds(block_ms_));
  }

 private:
  std::string name_;
  std::uint64_t from_ = 0;
  int block_ms_ = 1000;
  std::atomic<bool> has_blocked_{false};
};

/// A handle of 0.2 kg in a hand of 300 N/m and 10 N s/m, moved by the force that acts.
class SimulatedHandle {
 public:
  struct Motion {
    std::array<double, 3> position_m{}, velocity{};
  };

  Motion advance() {
    haptic::fake::Trace& t = trace();
    const std::int64_t now = now_us();
    if (last_us_ == 0) last_us_ = now;
    // Steps of 0.1 ms; what is longer than 50 ms is not caught up.
    constexpr std::int64_t kStep_us = 100, kMost_us = 50'000;
    if (now - last_us_ > kMost_us) last_us_ = now - kMost_us;
    for (; last_us_ + kStep_us <= now; last_us_ += kStep_us) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double pull = 300 * (t.hand_m[k].load() - motion_.position_m[k]);
        const double a = (t.force[k].load() + pull - 10 * motion_.velocity[k]) / 0.2;
        motion_.velocity[k] += a * 1.0e-4;
        motion_.position_m[k] += motion_.velocity[k] * 1.0e-4;
      }
    }
    Motion seen = motion_;
    if (t.is_fixed.load() != 0) {
      for (std::size_t k = 0; k < 3; ++k) {
        seen.position_m[k] = t.position_m[k].load();
        seen.velocity[k] = t.velocity[k].load();
      }
    }
    return seen;
  }

 private:
  Motion motion_;
  std::int64_t last_us_ = 0;
};

/// The wrench that acts from now on.
inline void set_wrench(const double* f, const double* t) {
  haptic::fake::Trace& all = trace();
  for (int k = 0; k < 3; ++k) {
    all.force[k].store(f[k]);
    all.torque[k].store(t[k]);
  }
  const auto norm = static_cast<float>(std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]));
  const std::uint64_t at = all.wrenches.load() % haptic::fake::kHistory;
  all.history_n[at].store(norm);
  for (int k = 0; k < 3; ++k) all.history_xyz_n[at][k].store(static_cast<float>(f[k]));
  all.history_us[at].store(now_us());
  all.wrenches.fetch_add(1);
}

}  // namespace
