// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/pareto/pareto_measure.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr double kPi = std::numbers::pi;

/// What a method states to be off by at most [m]; the tolerance of its setting where it has one.
double stated_error_m(const PeerEntry& entry) {
  if (entry.setting.starts_with("tol ")) return 2 * std::stod(entry.setting.substr(4)) + 1e-12;
  return sizeof(Real) == sizeof(double) ? 1e-12 : 1e-6;
}

PairClass two_boxes() { return pair_classes(1)[1]; }

struct Place {
  const char* words;
  Vector p;
  Rotation q;
  double depth_m;
  PeerVector normal;
};

/// Upper box A (half heights 0.020) over B (0.030), so faces meet at z = 0.050.
std::vector<Place> face_contacts() {
  const Rotation turned(Eigen::AngleAxisd(0.3, Vector::UnitZ()));
  const Rotation over(Eigen::AngleAxisd(kPi / 2, Vector::UnitX()));
  return {{"aligned, 6 mm deep", {0.004, -0.003, 0.044}, Rotation::Identity(), -0.006, {0, 0, 1}},
          {"turned about the normal, 8 mm deep", {0.010, 0.005, 0.042}, turned, -0.008, {0, 0, 1}},
          {"from below, 7 mm deep", {0.002, 0.001, -0.043}, turned, -0.007, {0, 0, -1}},
          {"on its side, 1 mm deep", {0.001, 0.002, 0.054}, over, -0.001, {0, 0, 1}}};
}

}  // namespace

TEST_SUITE_BEGIN("host_sim.peers");

TEST_CASE("peers: depth, normal and verdict of two boxes face on face") {
  const PairClass pair = two_boxes();
  for (const PeerEntry& entry : peer_catalog()) {
    if (entry.method == "empty") continue;
    // Its tolerance is on the last step of the polytope, not on the depth; 1e-3 stops anywhere.
    if (entry.method == "libccd_epa" && entry.setting == "tol 1e-3") continue;
    CAPTURE(entry.method);
    CAPTURE(entry.setting);
    const auto peer = entry.make(pair.a, pair.b);
    for (const Place& place : face_contacts()) {
      CAPTURE(place.words);
      peer->reset();
      peer->prepare(peer_pose(place.p, place.q));
      peer->query();
      const PeerAnswer answer = peer->answer();
      CHECK(answer.penetrating);
      CHECK(std::abs(answer.depth_m - place.depth_m) <= stated_error_m(entry));
      double along = 0;
      for (std::size_t i = 0; i < 3; ++i) along += answer.normal_w[i] * place.normal[i];
      CHECK(along > 1 - std::max(1e-9, stated_error_m(entry)));
      CHECK(answer.patch_points >= 1);
    }
    peer->reset();
    peer->prepare(peer_pose({0.01, 0.01, 0.060}, Rotation::Identity()));
    peer->query();
    CHECK_FALSE(peer->answer().penetrating);
    if (peer->answer().separated == SeparatedValue::kPlane)
      CHECK(peer->answer().depth_m == doctest::Approx(0.010).epsilon(1e-6));
  }
}

TEST_CASE("peers: a reset method answers as a new one") {
  const PairClass pair = pair_classes(1)[3];
  const ContactWorkload motion = contact_workload(pair.a, pair.b, 80, 6);
  for (const PeerEntry& entry : peer_catalog()) {
    if (entry.boxes_only || entry.method == "empty") continue;
    CAPTURE(entry.method);
    const auto used = entry.make(pair.a, pair.b), fresh = entry.make(pair.a, pair.b);
    for (const WorkloadPose& pose : motion.poses) {
      used->prepare(peer_pose(pose.p_wa, pose.q_wa));
      used->query();
    }
    used->reset();
    for (const auto* peer : {&used, &fresh}) {
      (*peer)->prepare(peer_pose(motion.poses[70].p_wa, motion.poses[70].q_wa));
      (*peer)->query();
    }
    const PeerAnswer a = used->answer(), b = fresh->answer();
    CHECK(a.penetrating == b.penetrating);
    CHECK(std::isnan(a.depth_m) == std::isnan(b.depth_m));
    if (!std::isnan(a.depth_m)) CHECK(a.depth_m == b.depth_m);
  }
}

TEST_CASE("exhaustive peer: D_near of the reference within rounding, verdicts all right") {
  const TickClock clock;
  MeasurePlan plan;
  plan.passes = 1;
  for (const PairClass& pair : pair_classes(9)) {
    if (pair.nodes > 20'000) continue;
    CAPTURE(pair.name);
    const TruthfulWorkload workload = truthful_workload(pair, 1600, 9);
    for (const PeerEntry& entry : peer_catalog()) {
      if (entry.method != "exhaustive") continue;
      const auto peer = entry.make(pair.a, pair.b);
      for (const ParetoRow& row :
           rows_of(measure_motion(*peer, workload, 1, plan, clock), workload.truths)) {
        CAPTURE(row.state);
        CHECK(row.max_error_m < 1e-15);
        CHECK(row.wrong_verdicts_beyond_1nm == 0);
        CHECK(row.normal_error_deg < 1e-9);
      }
    }
  }
}

TEST_CASE("peers: libraries name their licence, and a version where they are built") {
  for (const PeerLibrary& library : peer_libraries()) {
    CHECK_FALSE(library.licence.empty());
    CHECK(library.built == !library.version.empty());
  }
}

TEST_SUITE_END();
