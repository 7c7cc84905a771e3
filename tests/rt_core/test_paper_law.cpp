// SPDX-License-Identifier: Apache-2.0
// Law `paper` on contact situations whose numbers can be derived by hand; k_F = 1000 N/m
// throughout.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/support/shapes.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

constexpr double kPaperTolerance = HAPTIC_REAL_IS_FLOAT ? 2e-4 : 1e-10;

void check_paper_vector(const Vec3& got, double x, double y, double z) {
  CHECK(std::abs(static_cast<double>(got[0]) - x) < kPaperTolerance);
  CHECK(std::abs(static_cast<double>(got[1]) - y) < kPaperTolerance);
  CHECK(std::abs(static_cast<double>(got[2]) - z) < kPaperTolerance);
}

/// A wedge whose lower edge runs along x from -0.05 to 0.03 at y = 0.02, z = -0.05 about the grip
/// point.
tools::Body wedge() {
  return convex_body({{-0.05, 0.02, -0.05},
                      {0.03, 0.02, -0.05},
                      {-0.05, -0.03, 0.05},
                      {0.03, -0.03, 0.05},
                      {-0.05, 0.07, 0.05},
                      {0.03, 0.07, 0.05}},
                     {{0, 1, 3, 2}, {0, 4, 5, 1}, {2, 3, 5, 4}, {0, 2, 4}, {1, 5, 3}});
}

}  // namespace

TEST_SUITE("rt_core.paper_law") {
  TEST_CASE("one type-B contact: force along the face, torque of its vertex (eqs. 2, 3)") {
    // Apex of an upside-down pyramid 1 mm inside a face, 10 mm off the grip point along x.
    LoadedScene scene(scene_of(
        tetrahedron({0.01, 0, -0.05}, {0.05, 0.05, 0.05}, {-0.05, 0.05, 0.05}, {0, -0.05, 0.05}),
        {box({-0.2, -0.2, -0.2}, {0.2, 0.2, 0})}));
    const StepResult r = scene.step({0, 0, 0.049});
    CHECK(r.situation == ContactSituation::kVertexFace);
    CHECK(std::abs(static_cast<double>(r.d_near_m) + 0.001) < kPaperTolerance);
    check_paper_vector(r.wrench_w.force_w, 0, 0, 1);
    check_paper_vector(r.wrench_w.torque_w, 0, -0.01, 0);  // (0.01, 0, .) x (0, 0, 1)
  }

  TEST_CASE("one type-A contact: the vertex of the obstacle under a face of the part") {
    // The tip of the obstacle is the origin; the part's lower face is 2 mm below it.
    LoadedScene scene(scene_of(
        box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
        {tetrahedron({0, 0, 0}, {0.05, 0.05, -0.1}, {-0.05, 0.05, -0.1}, {0, -0.05, -0.1})}));
    const StepResult r = scene.step({0.02, -0.01, 0.048});
    CHECK(r.situation == ContactSituation::kFaceVertex);
    check_paper_vector(r.wrench_w.force_w, 0, 0, 2);
    check_paper_vector(r.wrench_w.torque_w, 0.01 * 2, 0.02 * 2, 0);  // (-0.02, 0.01, .) x (0, 0, 2)
  }

  TEST_CASE("one type-C contact: crossed edges") {
    // Ridge of the obstacle along x at z = 0, ridge of the part along y at 1 mm below it, 30 mm off
    // in x.
    const tools::Body ridge =
        convex_body({{-0.1, 0, 0},
                     {0.1, 0, 0},
                     {-0.1, -0.1, -0.1},
                     {0.1, -0.1, -0.1},
                     {-0.1, 0.1, -0.1},
                     {0.1, 0.1, -0.1}},
                    {{0, 2, 3, 1}, {0, 1, 5, 4}, {2, 4, 5, 3}, {0, 4, 2}, {1, 3, 5}});
    const tools::Body keel =
        convex_body({{0.03, -0.1, -0.05},
                     {0.03, 0.1, -0.05},
                     {-0.07, -0.1, 0.05},
                     {-0.07, 0.1, 0.05},
                     {0.13, -0.1, 0.05},
                     {0.13, 0.1, 0.05}},
                    {{0, 2, 3, 1}, {0, 1, 5, 4}, {2, 4, 5, 3}, {0, 4, 2}, {1, 3, 5}});
    LoadedScene scene(scene_of(keel, {ridge}));
    const StepResult r = scene.step({0, 0, 0.049});
    CHECK(r.situation == ContactSituation::kEdgeEdge);
    check_paper_vector(r.wrench_w.force_w, 0, 0, 1);
    check_paper_vector(r.wrench_w.torque_w, 0, -0.03, 0);
  }

  TEST_CASE("edge-face of one B and one C contact: torque about the edge, none across it") {
    // The wedge's edge lies along x over x = -0.03 ... 0.05; the obstacle's face begins at x = 0.
    // App_1 = the edge's end (0.05, 0.02) on the face, App_2 = crossing of the edges (0, 0.02);
    // pi(x0) = (0.02, 0).
    LoadedScene scene(scene_of(wedge(), {box({0, -0.1, -0.1}, {0.1, 0.1, 0})}));
    const StepResult r = scene.step({0.02, 0, 0.049});
    CHECK(r.situation == ContactSituation::kEdgeFace);
    CHECK(scene.core->pair_report(0).contact_nodes.size() == 2);
    check_paper_vector(r.wrench_w.force_w, 0, 0, 1);
    check_paper_vector(r.wrench_w.torque_w, 0.02, 0,
                       0);  // tau_x > 0; tau_y of 0.03 and -0.02 differ in sign: 0
  }

  TEST_CASE("edge-face with pi beyond both ends: the mean of both torques") {
    LoadedScene scene(scene_of(wedge(), {box({0.03, -0.1, -0.1}, {0.2, 0.1, 0})}));
    const StepResult r = scene.step({0.02, 0, 0.049});  // contact from x = 0.03 to 0.05, pi at 0.02
    CHECK(r.situation == ContactSituation::kEdgeFace);
    check_paper_vector(r.wrench_w.torque_w, 0.02, -0.02, 0);  // mean of -(0.01) and -(0.03)
  }

  TEST_CASE(
      "face-face with pi outside H: two C, one A, one B contact; torque about the nearest edge") {
    // Overlap x 0.02 ... 0.05, y -0.05 ... 0.01; pi(x0) = (0, 0) is nearest to the edge x = 0.02.
    LoadedScene scene(scene_of(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
                               {box({0.02, -0.2, -0.2}, {0.2, 0.01, 0})}));
    const StepResult r = scene.step({0, 0, 0.048});
    CHECK(r.situation == ContactSituation::kFaceFace);
    int types[3] = {0, 0, 0};
    for (const std::uint32_t node : scene.core->pair_report(0).contact_nodes) {
      types[node < 48 ? 0 : node < 96 ? 1 : 2] += 1;
    }
    CHECK(types[0] == 1);
    CHECK(types[1] == 1);
    CHECK(types[2] == 2);
    check_paper_vector(r.wrench_w.force_w, 0, 0, 2);
    check_paper_vector(r.wrench_w.torque_w, 0, -0.035 * 2,
                       0);  // mean lever across the edge: (0.02 + 0.02 + 0.05 + 0.05)/4
  }

  TEST_CASE("face-face with pi inside H: no torque") {
    LoadedScene scene(scene_of(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
                               {box({-0.02, -0.2, -0.2}, {0.2, 0.01, 0})}));
    const StepResult r = scene.step({0, 0, 0.048});
    CHECK(r.situation == ContactSituation::kFaceFace);
    CHECK(scene.core->pair_report(0).contact_nodes.size() == 4);
    check_paper_vector(r.wrench_w.force_w, 0, 0, 2);
    check_paper_vector(r.wrench_w.torque_w, 0, 0, 0);
  }

  TEST_CASE("face-face with pi nearest to a corner of H: the edge whose line is farther decides") {
    // Overlap x 0.02 ... 0.05, y 0.01 ... 0.05: pi is nearest to (0.02, 0.01); line x = 0.02 is
    // farther than y = 0.01.
    LoadedScene scene(scene_of(box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}),
                               {box({0.02, 0.01, -0.2}, {0.2, 0.2, 0})}));
    const StepResult r = scene.step({0, 0, 0.048});
    // x axis along y: all levers along it positive, so (5) is their mean too.
    check_paper_vector(r.wrench_w.torque_w, 0.03 * 2, -0.035 * 2, 0);
  }

  TEST_CASE("a single contact is minus the gradient of its potential") {
    if (HAPTIC_REAL_IS_FLOAT) return;  // central differences of 1e-7 need double
    LoadedScene scene(scene_of(
        tetrahedron({0.01, 0, -0.05}, {0.05, 0.05, 0.05}, {-0.05, 0.05, 0.05}, {0, -0.05, 0.05}),
        {box({-0.2, -0.2, -0.2}, {0.2, 0.2, 0})}));
    const Point at = {0.003, -0.002, 0.048};
    const std::array<double, 4> q = {std::sqrt(1 - 0.05 * 0.05 - 0.02 * 0.02), 0.05, 0.02, 0};
    const StepResult r = scene.step(at, q);
    const auto potential = [&](const Point& p, const std::array<double, 4>& rotation) {
      scene.core->reset();
      const double d = static_cast<double>(scene.step(p, rotation).d_near_m);
      return 500.0 * d * d;
    };
    const double h = 1e-6;
    for (std::size_t i = 0; i < 3; ++i) {
      Point plus = at, minus = at;
      plus[i] += h;
      minus[i] -= h;
      const double force = -(potential(plus, q) - potential(minus, q)) / (2 * h);
      CHECK(std::abs(force - static_cast<double>(r.wrench_w.force_w[static_cast<int>(i)])) < 1e-6);
      const auto turned =
          [&](double angle) {  // left multiplication: rotation about the world axis i through x0
            Eigen::Vector3d axis = Eigen::Vector3d::Zero();
            axis[static_cast<int>(i)] = 1;
            const Eigen::Quaterniond turn(std::cos(angle / 2), std::sin(angle / 2) * axis[0],
                                          std::sin(angle / 2) * axis[1],
                                          std::sin(angle / 2) * axis[2]);
            const Eigen::Quaterniond t = turn * Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
            return std::array<double, 4>{t.w(), t.x(), t.y(), t.z()};
          };
      const double torque = -(potential(at, turned(h)) - potential(at, turned(-h))) / (2 * h);
      CHECK(std::abs(torque - static_cast<double>(r.wrench_w.torque_w[static_cast<int>(i)])) <
            1e-6);
    }
  }
}
