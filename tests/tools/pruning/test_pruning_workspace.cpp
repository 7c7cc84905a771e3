// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

#include "tests/tools/polyhedron/families.hpp"
#include "tests/tools/pruning/contact_sampling.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools::test {
namespace {

constexpr std::uint64_t kWorkspaceSeed = 4711;
constexpr AffineMap kThousandth{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, 1000};

/// A small L above a plate of 100 mm with a square hole, and a block far to the side.
SceneDescription l_above_plate() {
  FlatBody l = l_prism(general_map(3000));
  FlatBody plate = empty_body();
  add_solid(plate, prism(plate,
                         {{{-50, -50}, {50, -50}, {50, 50}, {-50, 50}},
                          {{-15, -15}, {-15, 15}, {15, 15}, {15, -15}}},
                         0, 20, kThousandth));
  add_solid(plate, prism(plate, {{{400, 0}, {420, 0}, {420, 20}, {400, 20}}}, 0, 20, kThousandth));
  SceneDescription description = scene_of(prepared(l, "l"), prepared(plate, "plate"));
  description.moving.position_m = {0, 0, 0.05};
  description.orientation = about_start(description, 0.3);
  description.workspace = WorkspaceBox{{-0.03, -0.03, 0.03}, {0.03, 0.03, 0.08}};
  return description;
}

struct ReachCount {
  std::size_t near = 0;     ///< nodes within epsilon of the best
  std::size_t lost = 0;     ///< near or separating nodes that are marked unreachable
  std::size_t too_far = 0;  ///< poses of pairs out of reach that come within the band
};

Point3 random_place(const WorkspaceBox& box, TestRandom& random) {
  Point3 x{};
  for (std::size_t i = 0; i < 3; ++i) {
    // A third of the coordinates on the faces of the box.
    const double share =
        random.between(0, 2) == 0 ? static_cast<double>(random.between(0, 1)) : random.uniform();
    x[i] = box.min_m[i] + share * (box.max_m[i] - box.min_m[i]);
  }
  return x;
}

/// Checks one pair at one pose; `best` over all nodes, or over those that may carry a force.
void check_pose(const PairMarks& marks, const std::vector<ContactPlane>& planes, const Point3& x,
                const SceneParameters& p, ReachCount& count) {
  double best = -std::numeric_limits<double>::infinity(), best_open = best;
  const auto value = [&](const ContactPlane& plane) {
    return vec::dot(plane.n, x) - plane.offset_m;
  };
  for (const ContactPlane& plane : planes) {
    best = std::max(best, value(plane));
    if (marks.exposed[plane.node]) best_open = std::max(best_open, value(plane));
  }
  // The largest value is at most the distance of the pieces.
  if (!marks.near && best < p.exact_band_m) ++count.too_far;
  if (!marks.near) return;
  for (const ContactPlane& plane : planes) {
    const double v = value(plane);
    const bool near =
        v >= best - p.epsilon_m || (marks.exposed[plane.node] && v >= best_open - p.epsilon_m);
    if (near) ++count.near;
    if ((near || v >= 0.0) && !marks.reachable[plane.node]) ++count.lost;
  }
}

ReachCount sample(const PrunedScene& scene, const WorkspaceBox& box, std::size_t poses) {
  TestRandom random(kWorkspaceSeed);
  ReachCount count;
  const OrientationEnvelope& envelope = *scene.description.orientation;
  for (std::size_t s = 0; s < poses; ++s) {
    const Rotation r = random_rotation(rotation_of(envelope.about_xyzw), envelope.max_angle_rad,
                                       s % 3 == 0, random);
    for (std::size_t i = 0; i < scene.moving.size(); ++i) {
      for (std::size_t j = 0; j < scene.fixed.size(); ++j) {
        const auto planes = applicable_planes(scene.moving[i], scene.fixed[j], r, 1e-9);
        for (int k = 0; k < 20; ++k) {
          check_pose(scene.marks(i, j), planes, random_place(box, random),
                     scene.description.parameters, count);
        }
      }
    }
  }
  return count;
}

}  // namespace

TEST_SUITE("tools.pruning_workspace") {
  TEST_CASE("a box above a plate drops the underside and the block far away, and nothing needed") {
    SceneDescription description = l_above_plate();
    SceneDescription unbounded = description;
    unbounded.workspace.reset();
    const PrunedScene scene = pruned(description);
    const std::size_t without = prune_scene(unbounded).counts.reachable.all();
    const std::size_t with = scene.account.counts.reachable.all();
    MESSAGE(without << " reachable without the box, " << with << " with it; "
                    << scene.account.pairs_out_of_reach << " pairs out of reach");
    CHECK(scene.account.pairs_out_of_reach == scene.moving.size());
    const std::size_t block_nodes = [&] {
      std::size_t sum = 0;
      for (std::size_t k = 0; k < unbounded.marks.size(); ++k) {
        if (scene.description.marks[k].near) continue;
        sum += static_cast<std::size_t>(std::count(unbounded.marks[k].reachable.begin(),
                                                   unbounded.marks[k].reachable.end(), true));
      }
      return sum;
    }();
    CHECK(with < without - block_nodes);
    CAPTURE(kWorkspaceSeed);
    const ReachCount count = sample(scene, *description.workspace, 400);
    CHECK(count.near > 10000);
    CHECK(count.lost == 0);
    CHECK(count.too_far == 0);
  }

  TEST_CASE("the sampling sees a part that leaves its box") {
    SceneDescription description = l_above_plate();
    const WorkspaceBox whole = *description.workspace;
    CHECK(sample(pruned(description), {{-0.03, -0.03, -0.06}, {0.03, 0.03, 0.0}}, 400).lost > 0);
    description.workspace = WorkspaceBox{{-0.03, -0.03, 0.2}, {0.03, 0.03, 0.25}};
    const PrunedScene high = pruned(description);
    CHECK(high.account.pairs_out_of_reach == high.account.pairs);
    CHECK(sample(high, whole, 100).too_far > 0);
  }

  TEST_CASE("random solids and boxes: neither a near nor a separating node is dropped") {
    std::size_t dropped = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      CAPTURE(seed);
      TestRandom random(seed);
      FlatBody a = random_boxes(seed), b = random_boxes(seed + 100);
      SceneDescription description = scene_of(prepared(a, "a"), prepared(b, "b"));
      description.moving.quaternion_wxyz = {0.5, 0.5, -0.5, 0.5};
      description.orientation = about_start(description, 0.1 + 0.3 * random.uniform());
      WorkspaceBox box;
      for (std::size_t i = 0; i < 3; ++i) {
        box.min_m[i] = 3 * random.uniform() - 1.5;
        box.max_m[i] = box.min_m[i] + 0.5 * random.uniform();
      }
      description.workspace = box;
      const PrunedScene scene = pruned(description);
      const ReachCount count = sample(scene, box, 30);
      CHECK(count.lost == 0);
      CHECK(count.too_far == 0);
      SceneDescription unbounded = description;
      unbounded.workspace.reset();
      dropped +=
          prune_scene(unbounded).counts.reachable.all() - scene.account.counts.reachable.all();
    }
    MESSAGE(dropped << " nodes dropped");
    CHECK(dropped > 0);
  }
}

}  // namespace haptic::tools::test
