// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_fuzz/bodies_motion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace haptic::sim {
namespace {

constexpr double kBodyPeriod_s = 1e-3;
constexpr double kFastest_m_per_s = 0.5, kHandFastest_rad_per_s = 5, kDriverFastest_rad_per_s = 4;
constexpr double kSlowestWave_hz = 0.2, kFastestWave_hz = 1.5;
/// Speed of the way from the start to the track, while the track goes on.
constexpr double kSettling_m_per_s = 0.15, kSettling_rad_per_s = 1.5, kShortestSettling_s = 0.2;
/// Shares of the stated speed of a goal: both together, the second at 1.5 times its mean, keep to
/// it.
constexpr double kTrackShare = 0.5, kSettlingShare = 0.3;
constexpr double kTremor_m = 5e-5, kTremor_rad = 2e-3, kSlowTremor_hz = 8, kFastTremor_hz = 12;
constexpr std::uint32_t kRestTicks = 100;
/// One tick of so many begins a rest of a body, and of all.
constexpr std::uint32_t kTicksPerRest = 1500, kTicksPerCommonRest = 4000;

Rotation turn_by(const Vector& turn_rad) {
  const double angle = turn_rad.norm();
  if (!(angle > 0)) return Rotation::Identity();
  return Rotation(Eigen::AngleAxisd(angle, turn_rad / angle));
}

double full_turns(double hz) { return 2 * std::numbers::pi * hz; }

}  // namespace

BodyPlace carried_by(const BodyPlace& carrier, const BodyPlace& place) {
  return {carrier.p + carrier.q * place.p, (carrier.q * place.q).normalized()};
}

BodyTrack::BodyTrack(const BodyRange& range, double fastest_m_per_s, double fastest_rad_per_s,
                     Seeded& random)
    : home_(range.home), turned_(range.turn) {
  // Every run is fast or slow on its own: the bound holds where all sines are in phase.
  const double share = random.uniform(0.2, 1);
  const auto draw = [&](std::array<Sum, 3>& sums, const Vector& reach, double fastest) {
    double square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double left = reach[static_cast<Eigen::Index>(axis)], speed = 0;
      for (std::size_t k = 0; k < kWaves; ++k) {
        Wave& wave = sums[axis][k];
        wave.amount = k + 1 == kWaves ? left : left * random.uniform(0.3, 0.7);
        left -= wave.amount;
        wave.rate_rad_per_s = full_turns(random.uniform(kSlowestWave_hz, kFastestWave_hz));
        wave.phase = random.uniform(0, full_turns(1));
        speed += wave.amount * wave.rate_rad_per_s;
      }
      square += speed * speed;
    }
    const double speed = std::sqrt(square);
    if (!(speed > share * fastest)) return;
    for (Sum& sum : sums) {
      for (Wave& wave : sum) wave.rate_rad_per_s *= share * fastest / speed;
    }
  };
  draw(way_, range.reach_m, fastest_m_per_s);
  const double tilt = range.tilt_rad / std::sqrt(3.0);
  draw(turn_, Vector(tilt, tilt, tilt), fastest_rad_per_s);
}

BodyPlace BodyTrack::at(double t_s) const {
  const auto value = [&](const std::array<Sum, 3>& sums) {
    Vector v = Vector::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const Wave& w : sums[axis]) {
        v[static_cast<Eigen::Index>(axis)] += w.amount * std::sin(w.rate_rad_per_s * t_s + w.phase);
      }
    }
    return v;
  };
  return {home_ + value(way_), turn_by(value(turn_)) * turned_};
}

BodiesMotion::BodiesMotion(const BodiesScene& scene, std::span<const BodyPlace> starts,
                           std::uint64_t seed)
    : scene_(scene), random_(seed), goals_(starts.begin(), starts.end()) {
  for (std::size_t k = 0; k < scene.bodies.size(); ++k) {
    const FuzzBody& body = scene.bodies[k];
    const bool drives = body.role == BodyRole::kDriver;
    const double fastest_rad_per_s = drives ? kDriverFastest_rad_per_s : kHandFastest_rad_per_s;
    const auto part_of = [](double share, double own, double common) {
      return own > 0 ? std::min(share * own, common) : common;
    };
    Mover mover{BodyTrack(body.range, part_of(kTrackShare, body.fastest_m_per_s, kFastest_m_per_s),
                          part_of(kTrackShare, body.fastest_rad_per_s, fastest_rad_per_s), random_),
                {},
                {},
                {},
                0,
                0,
                0,
                {}};
    for (std::size_t i = 0; i < 2; ++i) {
      const double on = drives ? 0 : 1;
      mover.tremor_m[i] = on * kTremor_m * random_.direction();
      mover.tremor_rad[i] = on * kTremor_rad * random_.direction();
      mover.tremor_hz[i] = random_.uniform(kSlowTremor_hz, kFastTremor_hz);
    }
    BodyPlace start = goals_[k];
    if (body.range.carrier != kNoCarrier) {
      const BodyPlace& carrier = goals_[body.range.carrier];
      start = {carrier.q.conjugate() * (start.p - carrier.p),
               (carrier.q.conjugate() * start.q).normalized()};
    }
    const BodyPlace first = mover.track.at(0);
    mover.offset = {start.p - first.p, (start.q * first.q.conjugate()).normalized()};
    const double turn_rad = mover.offset.q.angularDistance(Rotation::Identity());
    mover.settle_s = std::max(
        {kShortestSettling_s,
         mover.offset.p.norm() / part_of(kSettlingShare, body.fastest_m_per_s, kSettling_m_per_s),
         turn_rad / part_of(kSettlingShare, body.fastest_rad_per_s, kSettling_rad_per_s)});
    movers_.push_back(std::move(mover));
  }
}

BodyPlace BodiesMotion::place_of(const Mover& mover, bool trembles) const {
  const double t = mover.clock_s;
  BodyPlace place = mover.track.at(t);
  // From 1 to 0, level at both ends.
  const double share = std::min(1.0, t / mover.settle_s);
  const double left = 1 - share * share * (3 - 2 * share);
  place.p += left * mover.offset.p;
  place.q = Rotation::Identity().slerp(left, mover.offset.q) * place.q;
  if (trembles) {
    Vector turn = Vector::Zero();
    for (std::size_t i = 0; i < 2; ++i) {
      const double swing = (1 - left) * std::sin(full_turns(mover.tremor_hz[i]) * t);
      place.p += swing * mover.tremor_m[i];
      turn += swing * mover.tremor_rad[i];
    }
    place.q = turn_by(turn) * place.q;
  }
  place.q.normalize();
  return place;
}

const std::vector<BodyPlace>& BodiesMotion::next() {
  const bool all_rest = random_.below(kTicksPerCommonRest) == 0;
  for (std::size_t k = 0; k < movers_.size(); ++k) {
    Mover& mover = movers_[k];
    const FuzzBody& body = scene_.bodies[k];
    if (all_rest || random_.below(kTicksPerRest) == 0) mover.rest_ticks = kRestTicks;
    if (body.role == BodyRole::kLoose) continue;
    const BodyPlace place = place_of(mover, body.role == BodyRole::kHand);
    const std::size_t carrier = body.range.carrier;
    goals_[k] = carrier == kNoCarrier ? place : carried_by(goals_[carrier], place);
    if (mover.rest_ticks > 0) {
      --mover.rest_ticks;
    } else {
      mover.clock_s += kBodyPeriod_s;
    }
  }
  return goals_;
}

}  // namespace haptic::sim
