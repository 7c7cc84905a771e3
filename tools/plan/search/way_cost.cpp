// SPDX-License-Identifier: Apache-2.0
#include "tools/plan/search/way_cost.hpp"

#include <algorithm>

namespace haptic::tools {
namespace {

/// The weight is 2 where this clearance is left, and no clearance counts for less than the other;
/// in lengths of a turn of 1 rad.
constexpr double kRoomy = 0.03, kLeastRoom = 1.0e-4;
/// Length of the parts of a way, in the same lengths, and how many there are at the most.
constexpr double kPart = 0.02;
constexpr double kMostParts = 64;

}  // namespace

double WayCost::length_m(const PlanPose& from, const PlanPose& to) const {
  return step_length_m(from, to, turn_m_);
}

double WayCost::weight(const PlanPose& pose) const {
  const double room = std::max(prover_.clearance(pose).gap_m / turn_m_, 0.0);
  return 1 + kRoomy / (room + kLeastRoom);
}

double WayCost::of(const PlanPose& from, const PlanPose& to) const {
  const double way_m = length_m(from, to);
  const double parts = std::clamp(std::ceil(way_m / (kPart * turn_m_)), 1.0, kMostParts);
  double sum = 0;
  for (double part = 0.5; part < parts; ++part) sum += weight(between(from, to, part / parts));
  return way_m * sum / parts;
}

}  // namespace haptic::tools
