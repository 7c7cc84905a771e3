// SPDX-License-Identifier: Apache-2.0
// Up to the rim of the envelope the marks leave out nothing that has weight.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "tests/support/shapes.hpp"
#include "tools/graph_compiler/pruning/scene_pruning.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

/// Slope of one of the hill's ridges [rad], and the direction in which it falls, from x: the block
/// lies along it when turned as far that way.
const double kSlope_rad = std::atan2(0.005, std::hypot(0.02, 0.01));
const double kRidge_rad = std::atan2(-0.01, 0.02);
/// The envelope ends this far before that; the ridge's lower end comes within 0.04 mm.
constexpr double kShort_rad = 1.5e-3;

tools::SceneDescription block_on_hill(double max_angle_rad) {
  tools::SceneDescription d = scene_of(
      box({-0.03, -0.02, -0.02}, {0.03, 0.02, 0.02}),
      {tetrahedron({0, 0, 0}, {0.02, -0.01, -0.005}, {0.02, 0.01, -0.005}, {-0.02, 0, -0.02})});
  d.parameters.law = LawId::kPaper;
  d.parameters.epsilon_m = 1e-4;
  d.orientation = tools::OrientationEnvelope{{0, 0, 0, 1}, max_angle_rad};
  return d;
}

/// Pruned as if only what is nearer than `epsilon_m` had weight.
tools::SceneDescription pruned_for(tools::SceneDescription d, double epsilon_m) {
  const double epsilon = d.parameters.epsilon_m;
  d.parameters.epsilon_m = epsilon_m;
  prune_scene(d);
  d.parameters.epsilon_m = epsilon;
  return d;
}

struct Comparison {
  int contacts = 0, differences = 0;
};

/// Turns at the rim of the envelope, each pressed 0.1 mm into the hill's top.
Comparison compare(const tools::SceneDescription& description, double max_angle_rad) {
  tools::SceneDescription open = description;
  open.marks.clear();
  LoadedScene all(open), pruned(description);
  constexpr std::uint64_t kSeed = 91;
  CAPTURE(kSeed);
  Random random(kSeed);
  Comparison found;
  for (int k = 0; k < 2000; ++k) {
    // Towards the rim so slowly that the core does not see it passed in the next tick.
    const double angle = max_angle_rad * (1 - 1e-5 * (1 - 0.0004 * k));
    const double heading = -kRidge_rad + random.uniform(-0.01, 0.01);
    const Eigen::Quaternion<double> q(
        Eigen::AngleAxis<double>(angle, Eigen::Vector3d(std::sin(heading), std::cos(heading), 0)));
    const Eigen::Vector3d up = q * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d p = 0.0199 * up + q * Eigen::Vector3d(random.uniform(-0.01, 0.0), 0, 0);
    const Point at = {p.x(), p.y(), p.z()};
    const std::array<double, 4> turn = {q.w(), q.x(), q.y(), q.z()};
    const StepResult a = all.step(at, turn), b = pruned.step(at, turn);
    REQUIRE((b.flags & kFlagOutsideEnvelope) == 0);
    found.contacts += a.d_near_m < 0 ? 1 : 0;
    found.differences += std::memcmp(&a.wrench_w, &b.wrench_w, sizeof a.wrench_w) != 0 ? 1 : 0;
  }
  return found;
}

}  // namespace

TEST_SUITE("tools.pruning_rim") {
  TEST_CASE("at the rim of the envelope every bit of the wrench is the unpruned one") {
    for (const double max_angle_rad : {kSlope_rad - kShort_rad, 0.1, 0.5}) {
      CAPTURE(max_angle_rad);
      const tools::SceneDescription d = block_on_hill(max_angle_rad);
      const Comparison found = compare(pruned_for(d, d.parameters.epsilon_m), max_angle_rad);
      CHECK(found.contacts > 1000);
      CHECK(found.differences == 0);
    }
  }

  TEST_CASE("marks of what applies alone would be felt there") {
    const double max_angle_rad = kSlope_rad - kShort_rad;
    const Comparison found = compare(pruned_for(block_on_hill(max_angle_rad), 1e-9), max_angle_rad);
    CHECK(found.differences > 100);
  }

  TEST_CASE("a larger epsilon keeps more, the account counts what applies") {
    std::size_t last = 0;
    std::size_t counted = 0;
    for (const double epsilon_m : {1e-9, 1e-4, 1e-3}) {
      tools::SceneDescription d = block_on_hill(kSlope_rad - kShort_rad);
      d.parameters.epsilon_m = epsilon_m;
      const std::size_t account = prune_scene(d).counts.reachable.all();
      CHECK((counted == 0 || account == counted));
      counted = account;
      std::size_t kept = 0;
      for (const bool node : d.marks[0].reachable) kept += node ? 1u : 0u;
      CHECK(kept >= counted);
      CHECK(kept >= last);
      last = kept;
    }
    CHECK(last > counted);
  }
}
