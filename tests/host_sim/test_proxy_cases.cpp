// SPDX-License-Identifier: Apache-2.0
// The proxy law at the contacts it was designed for. The figures are those of double precision.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "host_sim/lab/stability/proxy_cases.hpp"
#include "host_sim/lab/stability/stability_report.hpp"
#include "host_sim/shapes/contact_case.hpp"
#include "rt_core/base/scalar.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// Depth that counts as free, with the room that the invariants give it.
constexpr double kFree_m = -2e-7;

void check_rows(const std::vector<CaseRow>& rows) {
  if (HAPTIC_REAL_IS_FLOAT) return;
  for (const CaseRow& row : rows) {
    CAPTURE(row.title);
    for (const Figure& figure : row.measure()) {
      CAPTURE(figure.what);
      CAPTURE(figure.design);
      CAPTURE(figure.least);
      CAPTURE(figure.most);
      CHECK(figure.measured >= figure.least);
      CHECK(figure.measured <= figure.most);
    }
  }
}

/// Largest difference of force and torque between two runs, in ticks without a release.
WrenchSteps differences(const Trace& a, const Trace& b) {
  WrenchSteps largest;
  REQUIRE(a.ticks.size() == b.ticks.size());
  for (std::size_t k = 1; k < a.ticks.size(); ++k) {
    const auto step = [k](const Trace& t) {
      return (t.ticks[k].force_n - t.ticks[k - 1].force_n).norm();
    };
    if (std::max(step(a), step(b)) > 0.05) break;
    largest.force_n = std::max(largest.force_n, (a.ticks[k].force_n - b.ticks[k].force_n).norm());
    largest.torque_nm =
        std::max(largest.torque_nm, (a.ticks[k].torque_nm - b.ticks[k].torque_nm).norm());
  }
  return largest;
}

/// `runs` pushes of 25 mm through a plate of 0.5 mm, at 1 m/s and 10 rad/s.
void push_through(int runs) {
  constexpr std::uint64_t kSeed = 20260605;
  constexpr double kThickness_m = 5e-4, kDeep_m = 0.025, kClear_m = 0.001;
  Seeded random(kSeed);
  CAPTURE(kSeed);
  CoupledScene scene;
  scene.moving = sample_box();
  scene.statics.push_back(thin_plate(kThickness_m, 0.4));
  for (int k = 0; k < runs; ++k) {
    CAPTURE(k);
    const Rotation start = random.rotation();
    const Vector axis = random.direction();
    Vector way = random.direction();
    way.z() = -std::max(std::abs(way.z()), 0.2);
    way.normalize();
    double lowest = 0;
    for (const auto& v : scene.moving.pieces[0].vertices)
      lowest = std::min(lowest, (start * Vector(v[0], v[1], v[2])).z());
    TimedPath path;
    path.pose = [=](double t) -> PathPose {
      return {Vector(0, 0, kClear_m - lowest) + t * way, turn_about(10 * t, axis) * start};
    };
    path.duration_s = (kClear_m + kDeep_m) / -way.z();
    path.approach_s = 0.001;
    path.retreat_w = -0.001 * way;
    const Trace trace = run_trace(scene, LawId::kProxy, path);
    CHECK(worst_gap_m(trace.ticks) >= kFree_m);
    double under_m = 0;
    for (const TraceTick& tick : trace.ticks) {
      for (const auto& v : scene.moving.pieces[0].vertices) {
        const Vector w = tick.proxy.p + tick.proxy.q * Vector(v[0], v[1], v[2]);
        under_m = std::min(under_m, w.z());
      }
    }
    CHECK(under_m >= kFree_m);
    CHECK(trace.ticks.back().force_n.z() > 1);  // it is held, and on the side it came from
  }
}

}  // namespace

TEST_SUITE("host_sim.proxy_cases") {
  TEST_CASE("slides, tilts, plates, seams, swings, corner") { check_rows(contact_rows()); }
  TEST_CASE("peg: insertion, tilt, drop-in") { check_rows(peg_rows()); }
  TEST_CASE("single contact: the coupling's stiffness over its lever") {
    check_rows(stiffness_rows());
  }
  TEST_CASE("recovery, limits of the pull, jumps of the device") { check_rows(limit_rows()); }
  TEST_CASE("friction: stick, slide, jam") { check_rows(friction_rows()); }
  TEST_CASE("a block cut by random planes feels like the block") { check_rows(division_rows()); }
  TEST_CASE("closed loops give nothing to the hand") { check_rows(energy_rows()); }

  TEST_CASE("the order of pieces does not matter") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    for (ContactCase c : {seam_case(0.1, 0.02, false), insertion_case(1e-4), corner_case(),
                          tilted_peg_case(1e-4)}) {
      CAPTURE(c.name);
      const Trace first = run_trace(c.scene, LawId::kProxy, c.path);
      std::vector<std::uint32_t> order(c.scene.statics[0].pieces.size());
      std::iota(order.begin(), order.end(), 0u);
      for (std::size_t turn = 0; turn < 2; ++turn) {
        if (turn == 0) std::ranges::reverse(order);
        if (turn == 1) std::rotate(order.begin(), order.begin() + 1, order.end());
        CoupledScene other = c.scene;
        other.statics[0] = reordered(c.scene.statics[0], order);
        const WrenchSteps apart = differences(first, run_trace(other, LawId::kProxy, c.path));
        CHECK(apart.force_n < 1e-9);
        CHECK(apart.torque_nm < 1e-9);
      }
    }
  }

  TEST_CASE("nothing is summed twice: pieces, and a body that stands there twice") {
    const ContactCase whole = seam_case(0.1, 0, true), cut = seam_case(0.1, 0, false);
    CoupledScene twice = whole.scene;
    twice.statics.push_back(whole.scene.statics[0]);
    twice.statics.push_back(cut.scene.statics[0]);
    const Trace trace = run_trace(twice, LawId::kProxy, whole.path);
    for (const TraceTick& tick : trace.path())
      CHECK(tick.force_n.norm() == doctest::Approx(3).epsilon(HAPTIC_REAL_IS_FLOAT ? 1e-2 : 1e-6));
  }

  TEST_CASE("cut bodies: pieces tile the body and share its planes") {
    Seeded random(20260606);
    const tools::Body whole = sample_block();
    for (int k = 0; k < 20; ++k) {
      const tools::Body cut = random_cuts(whole, {0.05, 0.05, 0.02}, 11, random);
      CHECK(cut.pieces.size() > 1);
      CHECK(cut.pieces.size() <= 11);
      CHECK(cut.volume_m3 == doctest::Approx(whole.volume_m3).epsilon(1e-12));
      for (std::size_t i = 0; i < 3; ++i)
        CHECK(std::abs(cut.centre_of_volume_m[i] - whole.centre_of_volume_m[i]) < 1e-12);
      CHECK(cut.planes.size() <= whole.planes.size() + 4);
      for (const tools::ConvexPiece& piece : cut.pieces) {
        for (const tools::PieceFace& face : piece.faces) {
          const tools::BodyPlane& plane = cut.planes[face.plane];
          for (const auto& v : piece.vertices) {
            const double height = face.sign * (plane.normal[0] * v[0] + plane.normal[1] * v[1] +
                                               plane.normal[2] * v[2] - plane.offset_m);
            CHECK(height < 1e-15);
          }
        }
      }
    }
  }

  TEST_CASE("a thin plate, 25 mm deep, fast, from random directions: never through") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    push_through(60);
  }
  TEST_CASE("[long] a thin plate, 25 mm deep, fast, from 1000 random directions: never through") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    push_through(1000);
  }
}
