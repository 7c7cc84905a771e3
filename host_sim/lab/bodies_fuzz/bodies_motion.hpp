// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Seeded goals of several bodies, tick by tick: smooth, up to the speeds of hands and robots,
/// hands with a tremor, all of them with rests; they know nothing of each other and go right
/// through.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_scene.hpp"

namespace haptic::sim {

/// A place and an orientation in double.
struct BodyPlace {
  Vector p = Vector::Zero();
  Rotation q = Rotation::Identity();
};
/// A place that is seen from `carrier`, in W.
[[nodiscard]] BodyPlace carried_by(const BodyPlace& carrier, const BodyPlace& place);

/// Sums of sines in each coordinate of place and turn; no faster than it is allowed to be.
class BodyTrack {
 public:
  BodyTrack(const BodyRange& range, double fastest_m_per_s, double fastest_rad_per_s,
            Seeded& random);
  [[nodiscard]] BodyPlace at(double t_s) const;

 private:
  struct Wave {
    double amount, rate_rad_per_s, phase;
  };
  static constexpr std::size_t kWaves = 3;
  using Sum = std::array<Wave, kWaves>;
  Vector home_;
  Rotation turned_;
  std::array<Sum, 3> way_, turn_;
};

class BodiesMotion {
 public:
  /// The bodies start at these places. Goals of loose parts are those places for ever.
  BodiesMotion(const BodiesScene& scene, std::span<const BodyPlace> starts, std::uint64_t seed);

  /// Goals of the next tick of 1 ms; the first ones are the starts.
  [[nodiscard]] const std::vector<BodyPlace>& next();

 private:
  struct Mover {
    BodyTrack track;
    std::array<Vector, 2> tremor_m, tremor_rad;
    std::array<double, 2> tremor_hz;
    double clock_s = 0;            ///< stands still while the body rests
    std::uint32_t rest_ticks = 0;  ///< still to rest
    double settle_s = 0;           ///< the offset of the start is gone after this
    BodyPlace offset;              ///< of the start against the track
  };
  [[nodiscard]] BodyPlace place_of(const Mover& mover, bool trembles) const;

  const BodiesScene& scene_;
  Seeded random_;
  std::vector<Mover> movers_;  ///< by body
  std::vector<BodyPlace> goals_;
};

}  // namespace haptic::sim
