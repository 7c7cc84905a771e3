// SPDX-License-Identifier: Apache-2.0
// A part that never turns: its rotation is locked, and the device's orientation is not looked at.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "rt_core/proxy/proxy_qp.hpp"
#include "rt_core/proxy/valid_planes.hpp"
#include "tests/support/counter_bounds.hpp"
#include "tests/support/pair_bench.hpp"
#include "tests/support/pruned_scenes.hpp"
#include "tests/support/rt_guard.hpp"

using namespace haptic;
using namespace haptic::test;

namespace {

/// The description with the orientation q (w, x, y, z) alone.
tools::SceneDescription with_one_orientation(tools::SceneDescription d,
                                             const std::array<double, 4>& q) {
  d.orientation = tools::OrientationEnvelope{{q[1], q[2], q[3], q[0]}, 0.0};
  return d;
}

struct HeldShape {
  std::string name;
  tools::Body a, b;
};
std::vector<HeldShape> held_shapes() {
  const tools::Body corner =
      tetrahedron({0, 0, 0}, {0.03, 0, 0.02}, {-0.01, 0.03, 0.02}, {-0.01, -0.02, 0.03});
  return {
      {"tetrahedron on box", corner, box({-0.06, -0.06, -0.03}, {0.06, 0.06, 0})},
      {"boxes", box({-0.02, -0.01, -0.015}, {0.02, 0.01, 0.015}),
       box({-0.05, -0.05, -0.03}, {0.05, 0.05, 0})},
      {"prisms", prism(12, 0.02, 0.05), prism(7, 0.03, 0.04)},
      {"hulls", random_hull(91, 24, {0.03, 0.02, 0.025}), random_hull(92, 30, {0.04, 0.05, 0.03})}};
}

std::array<double, 4> unit(const std::array<double, 4>& q) {
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
}

tools::Body peg() { return box({-0.01, -0.01, -0.03}, {0.01, 0.01, 0.03}); }
tools::Body socket() {
  return join({box({-0.03, -0.03, -0.04}, {-0.0103, 0.03, 0}),
               box({0.0103, -0.03, -0.04}, {0.03, 0.03, 0}),
               box({-0.0103, -0.03, -0.04}, {0.0103, -0.0103, 0}),
               box({-0.0103, 0.0103, -0.04}, {0.0103, 0.03, 0}),
               box({-0.03, -0.03, -0.06}, {0.03, 0.03, -0.04})});
}

double wrench_difference(const Wrench& a, const Wrench& b) {
  const double scale = std::max(static_cast<double>(b.force_w.norm()), 1e-3);
  return std::max(static_cast<double>((a.force_w - b.force_w).norm()),
                  static_cast<double>((a.torque_w - b.torque_w).norm())) /
         scale;
}

/// The C-face planes of a pair that bound its C-obstacle where A stands upright: of all faces, and
/// of the edge pairs that apply.
std::vector<PlaneGap> planes_at(const PairView& pair, const Vec3& y_w) {
  std::vector<PlaneGap> planes;
  const Mat3 upright = Mat3::Identity();
  const auto take = [&](ContactType type, std::uint32_t i, std::uint32_t j, bool flipped) {
    PlaneId id;
    id.type = type;
    id.i = static_cast<std::uint16_t>(i);
    id.j = static_cast<std::uint16_t>(j);
    id.flipped = flipped;
    if (!plane_applies(pair, upright, id)) return;
    const PlaneGap plane = plane_gap(pair, upright, y_w, id, {});
    if (plane.defined) planes.push_back(plane);
  };
  for (std::uint32_t i = 0; i < pair.a.face_count; ++i) take(ContactType::kA, i, 0, false);
  for (std::uint32_t j = 0; j < pair.b.face_count; ++j) take(ContactType::kB, 0, j, false);
  for (std::uint32_t i = 0; i < pair.a.edge_count; ++i) {
    for (std::uint32_t j = 0; j < pair.b.edge_count; ++j) {
      take(ContactType::kC, i, j, false);
      take(ContactType::kC, i, j, true);
    }
  }
  return planes;
}

constexpr double kSameLength_m = HAPTIC_REAL_IS_FLOAT ? 2e-7 : 1e-12;

}  // namespace

TEST_SUITE("rt_core.locked_rotation") {
  TEST_CASE("law paper: the wrench of a part that turns, at that orientation") {
    for (const auto& cut :
         {std::pair{false, false}, std::pair{true, false}, std::pair{true, true}}) {
      const bool cut_plate = cut.first, cut_block = cut.second;
      CAPTURE(cut_plate);
      CAPTURE(cut_block);
      const auto q = unit(cut_plate ? std::array<double, 4>{1, 6e-4, -3e-4, 0.003}
                                    : std::array<double, 4>{1, 0.0004, -0.0003, 0.2});
      const Point lo = {-0.1, -0.1, -0.03}, hi = {0.1, 0.1, 0};
      const Point block_lo = {-0.03, -0.02, -0.02}, block_hi = {0.03, 0.02, 0.02};
      tools::SceneDescription d = scene_of(box(block_lo, block_hi), {box(lo, hi)});
      d.parameters.law = LawId::kPaper;
      if (cut_plate) d.statics[0].body = cut_box(lo, hi, {0.003}, {{}, {-0.004}});
      if (cut_block) d.moving.body = cut_box(block_lo, block_hi, {-0.005}, {{0.006}, {}});
      if (cut_plate) {
        const LoadedScene all(d);
        d.marks = all_marks(all.view);
        mark_cuts(all.view, 1, box(lo, hi), d.marks);
        if (cut_block) mark_cuts(all.view, 0, box(block_lo, block_hi), d.marks);
      }
      LoadedScene turning(d), fixed(with_one_orientation(d, q));
      double largest = 0, depth = 0;
      int contacts = 0;
      for (int t = 0; t < 2000; ++t) {
        const double s = 0.004 * t;
        const Point p = {0.04 * std::sin(s), 0.04 * std::cos(1.3 * s),
                         0.0197 + 0.0006 * std::sin(5 * s)};
        const StepResult a = fixed.step(p), b = turning.step(p, q);
        largest = std::max(largest, wrench_difference(a.wrench_w, b.wrench_w));
        depth = std::max(depth, std::abs(static_cast<double>(a.d_near_m - b.d_near_m)));
        contacts += b.wrench_w.force_w.norm() > 0;
        for (const Wrench& w : {a.wrench_w, b.wrench_w}) {  // no lever beyond the block's corners
          CHECK(w.torque_w.norm() <= 0.0413_r * w.force_w.norm());
        }
        CHECK(a.situation == b.situation);
      }
      CHECK(largest <= (HAPTIC_REAL_IS_FLOAT ? 5e-3 : 1e-9));
      CHECK(depth <= kSameLength_m);
      CHECK(contacts > 300);
    }
  }

  TEST_CASE("proxy: slides into a hole without turning, regardless of the device's orientation") {
    tools::SceneDescription d = scene_of(peg(), {socket()});
    d.parameters.law = LawId::kProxy;
    for (const double friction : {0.0, 0.3}) {
      d.statics[0].friction = friction;
      LoadedScene fixed(with_one_orientation(d, {1, 0, 0, 0}));
      LoadedScene again(with_one_orientation(d, {1, 0, 0, 0}));
      Random random(73);
      double deepest = 0;
      int pressed = 0;
      const SceneCapacity& c = fixed.view.header().capacity;
      for (int t = 0; t < 4000; ++t) {
        // Into the hole along its axis, then to the floor and 1.2 mm into the walls.
        const double s = 0.002 * t, wide = t < 500 ? 0.0002 : 0.0015;
        const Point p = {wide * std::sin(3 * s), wide * std::cos(2 * s),
                         t < 2000 ? 0.034 - 2.3e-5 * t : -0.012};
        const auto turned = t == 0 ? std::array<double, 4>{1, 0, 0, 0} : random.rotation();
        StepResult r;
        std::uint64_t heap_calls = 0;
        {
          const RtGuard guard;
          r = fixed.step(p, turned);
          heap_calls = guard.heap_calls();
        }
        CHECK(heap_calls == 0);
        const StepResult same = again.step(p);
        CHECK(r.state_hash == same.state_hash);  // the orientation was not looked at
        CHECK(r.proxy_pose_wa.q_wa.coeffs() == Quat::Identity().coeffs());
        CHECK(r.goal_pose_wa.q_wa.coeffs() == Quat::Identity().coeffs());
        CHECK(r.wrench_w.torque_w == Vec3::Zero());
        CHECK(r.proxy_gap_m > -1e-6_r);
        CHECK(over_bound(r.counters, c) == "");
        const Vec3& x = r.proxy_pose_wa.p_wa;
        deepest = std::min(deepest, static_cast<double>(x[2]));
        if (x[2] < 0.029_r) {  // in the hole: 0.3 mm of play, and the floor
          CHECK(std::abs(static_cast<double>(x[0])) <= 0.0003 + 1e-6);
          CHECK(std::abs(static_cast<double>(x[1])) <= 0.0003 + 1e-6);
          CHECK(static_cast<double>(x[2]) >= -0.01 - 1e-6);
        }
        pressed += r.wrench_w.force_w.norm() > 0.5_r;
      }
      CHECK(deepest < -0.0099);
      CHECK(pressed > 1000);
    }
  }

  TEST_CASE("proxy: the nearest free place to the goal, as one program over all planes has it") {
    tools::SceneDescription d = scene_of(held_shapes()[3].a, {held_shapes()[3].b});
    d.parameters.law = LawId::kProxy;
    LoadedScene fixed(with_one_orientation(d, {1, 0, 0, 0}));
    const PairView pair = fixed.view.pair(0);
    Random random(74);
    int held = 0;
    for (int k = 0; k < 20; ++k) {
      fixed.core->reset();
      const std::array<double, 4> q = random.rotation();
      const double z = q[1] * 2, y = q[2] * 2, x = q[3] * 2;
      StepResult r;
      const Point from = {0.2 * x, 0.2 * y, 0.2 * z}, to = {0.03 * x, 0.03 * y, 0.03 * z};
      for (int t = 0; t <= 600; ++t) {
        const double s = std::min(1.0, t / 400.0);
        r = fixed.step({from[0] + s * (to[0] - from[0]), from[1] + s * (to[1] - from[1]),
                        from[2] + s * (to[2] - from[2])});
      }
      if (r.d_near_m > -1e-4_r) continue;
      ++held;
      // At rest the pull is held by planes on which the proxy lies: it points into their cone.
      const double* b = fixed.view.bodies()[1].reference_m;
      const Vec3 at = r.proxy_pose_wa.p_wa - Vec3(static_cast<Real>(b[0]), static_cast<Real>(b[1]),
                                                  static_cast<Real>(b[2]));
      std::vector<QpRow> rows;
      double largest = -1;
      for (const PlaneGap& plane : planes_at(pair, at)) {
        largest = std::max(largest, static_cast<double>(plane.gap_m));
        if (plane.gap_m < -1e-6_r) continue;
        QpRow row;
        row.g.head<3>() = plane.normal_w;
        row.h = -plane.normal_w.dot(r.goal_pose_wa.p_wa - r.proxy_pose_wa.p_wa);
        rows.push_back(row);
      }
      CHECK(std::abs(largest) < 1e-6);
      // The move that the active planes leave of the pull: none.
      const QpResult left = closest_point(rows, 1e-9_r);
      const Vec3 move = left.z.head<3>() + (r.goal_pose_wa.p_wa - r.proxy_pose_wa.p_wa);
      CHECK(static_cast<double>(move.norm()) < (HAPTIC_REAL_IS_FLOAT ? 2e-4 : 2e-6));
    }
    CHECK(held > 5);
  }
}
