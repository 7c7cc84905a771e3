// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a stand-in for a vendor's library lets a test see and set. It lies in the file that
/// HAPTIC_FAKE_TRACE names, so that another process may look, or in the library itself. Numbers are
/// in the vendor's axes and SI units.
///
/// HAPTIC_FAKE_FAULT=NAME[@COUNT] makes the library misbehave from its COUNT-th frame on, else from
/// the start; HAPTIC_FAKE_BLOCK_MS is how long a call blocks that does.

#include <atomic>
#include <cstdint>

namespace haptic::fake {

inline constexpr unsigned kHistory = 65536;

struct Trace {
  std::atomic<std::uint64_t> frames{0};    ///< poses asked for
  std::atomic<std::uint64_t> wrenches{0};  ///< set
  std::atomic<std::uint64_t> opened{0}, closed{0}, stopped{0};
  std::atomic<int> force_on{0};  ///< the device's own switch
  std::atomic<int> watchdog_cuts{0};
  std::atomic<int> watchdog_units{0};
  std::atomic<int> gravity{-1};
  std::atomic<int> rate_hz{0};
  std::atomic<int> updates{0};                  ///< of the calibration
  std::atomic<double> force[3]{}, torque[3]{};  ///< that act
  std::atomic<float> history_n[kHistory]{};     ///< norms of the forces that were set
  std::atomic<float> history_xyz_n[kHistory][3]{};
  std::atomic<std::int64_t> history_us[kHistory]{};  ///< of CLOCK_MONOTONIC
  // What a test sets.
  std::atomic<int> is_fixed{0};  ///< the pose below, instead of the simulated one
  std::atomic<double> position_m[3]{};
  std::atomic<double> rotation[9]{{1}, {0}, {0}, {0}, {1}, {0}, {0}, {0}, {1}};  ///< by rows
  std::atomic<double> velocity[3]{}, angular_velocity[3]{};
  std::atomic<double> hand_m[3]{};  ///< where the hand holds the handle
  std::atomic<unsigned> buttons{0};
  std::atomic<double> gripper_rad{0.3};
  std::atomic<int> needs_update{0};   ///< of the calibration, until it is updated
  std::atomic<double> updated_n{-1};  ///< the force that acted at that moment
  std::atomic<int> crash{0};          ///< 1: in the next frame
};

}  // namespace haptic::fake

extern "C" {
/// For dlsym.
using FakeTraceFunction = haptic::fake::Trace*();
}
