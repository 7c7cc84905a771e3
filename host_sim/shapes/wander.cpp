// SPDX-License-Identifier: Apache-2.0
#include "host_sim/shapes/wander.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace haptic::sim {

TimedPose wander(const Wander& shape, Seeded& random) {
  struct Wave {
    double share, frequency_hz, phase;
  };
  std::array<Wave, 18> waves;
  for (Wave& w : waves) {
    w.share = random.uniform(0.1, 0.33);
    w.frequency_hz = random.uniform(0.1, 0.8);
    w.phase = random.uniform(0, 2 * std::numbers::pi);
  }
  return [shape, waves](double t) -> PathPose {
    std::array<double, 6> value{};
    for (std::size_t k = 0; k < waves.size(); ++k) {
      const Wave& w = waves[k];
      value[k / 3] += w.share * std::sin(2 * std::numbers::pi * w.frequency_hz * t + w.phase);
    }
    const auto turn = [](double angle_rad, const Vector& axis) {
      return Rotation(Eigen::AngleAxisd(angle_rad, axis));
    };
    return {shape.centre + shape.reach_m.cwiseProduct(Vector(value[0], value[1], value[2])),
            turn(shape.turn_rad * value[3], Vector::UnitX()) *
                turn(shape.turn_rad * value[4], Vector::UnitY()) *
                turn(2 * shape.turn_rad * value[5], Vector::UnitZ()) * shape.about};
  };
}

}  // namespace haptic::sim
