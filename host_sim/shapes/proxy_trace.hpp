// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A scene with its coupling, a path of the device in time, and what the core makes of it: the
/// wrench of every tick with the proxy behind it. Paths of the proxy begin free of obstacles.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host_sim/shapes/contact_path.hpp"
#include "rt_core/haptic_core.hpp"

namespace haptic::sim {

/// Bodies and coupling; the grip point is A's origin.
struct CoupledScene {
  tools::Body moving;
  std::vector<tools::Body> statics;
  double k_t_n_per_m = 1000, k_r_nm_per_rad = 1;
  double friction = 0;           ///< of every static body
  double epsilon_m = 1e-4;       ///< width of the near set, for the laws that render it
  double max_rotation_rad = 1;   ///< theta_sat
  double max_translation_m = 0;  ///< 0: no limit
  std::uint32_t passes = 0;      ///< of the proxy; 0: the default
  double tolerance_m = 0;        ///< of the proxy; 0: from the size of the part
};

/// Bytes of the compiled scene. @throws tools::InputError when a body is refused.
[[nodiscard]] std::vector<std::byte> compiled(const CoupledScene& scene, LawId law);

/// Where the device stands at a time.
using TimedPose = std::function<PathPose(double t_s)>;

/// From `retreat_w` from its first pose, which must be free, the device comes to it in
/// `approach_s` along a straight line and then follows the path.
struct TimedPath {
  TimedPose pose;
  double duration_s = 1;
  Vector retreat_w = Vector(0, 0, 0.008);
  double approach_s = 0.4;
};

struct TraceTick {
  PathPose device, proxy;
  Vector force_n = Vector::Zero(), torque_nm = Vector::Zero();  ///< on the hand, W axes, about x0
  double gap_m = 0, potential_j = 0;
  std::uint32_t flags = 0;
  StepCounters counters;
};

/// Ticks of a run; those before `begin` are the approach.
struct Trace {
  std::vector<TraceTick> ticks;
  std::size_t begin = 0;
  [[nodiscard]] std::span<const TraceTick> path() const { return std::span(ticks).subspan(begin); }
};

inline constexpr double kTracePeriod_s = 1e-3;

/// Runs the core over the path, one tick per `period_s`, from a first tick on.
/// @throws tools::InputError when scene or pose is refused.
[[nodiscard]] Trace run_trace(const CoupledScene& scene, LawId law, const TimedPath& path,
                              double period_s = kTracePeriod_s);

/// Largest change of the wrench from one tick to the next.
struct WrenchSteps {
  double force_n = 0, torque_nm = 0;
};
[[nodiscard]] WrenchSteps largest_steps(std::span<const TraceTick> ticks);

/// Index of the first tick whose force or torque differs from the tick before by more than these;
/// the number of ticks when there is none.
[[nodiscard]] std::size_t first_jump(std::span<const TraceTick> ticks, double force_n,
                                     double torque_nm);

/// Work that the hand has put in, by the trapezoidal rule over device motion [J].
[[nodiscard]] double hand_work_j(std::span<const TraceTick> ticks);

/// Smallest gap of the proxy over the ticks [m].
[[nodiscard]] double worst_gap_m(std::span<const TraceTick> ticks);

/// Largest distance of a force from the first one of the ticks [N].
[[nodiscard]] double force_ripple_n(std::span<const TraceTick> ticks);

}  // namespace haptic::sim
