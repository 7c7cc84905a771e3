// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "host_sim/lab/pareto/pareto_measure.hpp"
#include "host_sim/shapes/contact_workload.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;

TEST_SUITE_BEGIN("host_sim.contact_workload");

TEST_CASE("contact_workload: recordings of every kind cover the poses in order") {
  const PairClass pair = pair_classes(1)[0];
  const ContactWorkload workload = contact_workload(pair.a, pair.b, 2003, 7);
  REQUIRE(workload.poses.size() == 2003);
  std::size_t begin = 0;
  std::vector<int> kinds(kWorkloadKinds, 0);
  for (const Recording& recording : workload.recordings) {
    CHECK(recording.begin == begin);
    CHECK(recording.end > recording.begin);
    begin = recording.end;
    ++kinds[static_cast<std::size_t>(recording.kind)];
  }
  CHECK(begin == 2003);
  CHECK(*std::min_element(kinds.begin(), kinds.end()) >= 1);
}

TEST_CASE("contact_workload: no tick passes 0.3 m/s or 3 rad/s, and some come near") {
  for (const PairClass& pair : pair_classes(1)) {
    if (pair.nodes > 100'000) continue;
    for (const std::uint64_t seed : {1u, 2u, 99u}) {
      CAPTURE(pair.name);
      CAPTURE(seed);
      const ContactWorkload workload = contact_workload(pair.a, pair.b, 4000, seed);
      double fastest = 0, turn = 0;
      for (const Recording& recording : workload.recordings) {
        for (std::size_t k = recording.begin + 1; k < recording.end; ++k) {
          const WorkloadPose &from = workload.poses[k - 1], &to = workload.poses[k];
          fastest = std::max(fastest, (to.p_wa - from.p_wa).norm() / 1e-3);
          turn =
              std::max(turn, from.q_wa.normalized().angularDistance(to.q_wa.normalized()) / 1e-3);
        }
      }
      CHECK(fastest <= kWorkloadSpeed_m_per_s);
      CHECK(turn <= kWorkloadTurn_rad_per_s);
      CHECK(fastest > 0.5 * kWorkloadSpeed_m_per_s);
      CHECK(turn > 0.5 * kWorkloadTurn_rad_per_s);
    }
  }
}

TEST_CASE("contact_workload: a quarter to a third of the poses are in contact") {
  for (const PairClass& pair : pair_classes(1)) {
    if (pair.nodes > 20'000) continue;
    for (const std::uint64_t seed : {1u, 5u}) {
      CAPTURE(pair.name);
      CAPTURE(seed);
      const TruthfulWorkload workload = truthful_workload(pair, 8000, seed);
      CHECK(workload.penetrating_share() > 0.25);
      CHECK(workload.penetrating_share() < 0.33);
    }
  }
}

TEST_CASE("contact_workload: same seed, same bits; another seed, other poses") {
  const PairClass pair = pair_classes(1)[3];
  const ContactWorkload first = contact_workload(pair.a, pair.b, 400, 3);
  const ContactWorkload second = contact_workload(pair.a, pair.b, 400, 3);
  const ContactWorkload other = contact_workload(pair.a, pair.b, 400, 4);
  std::size_t equal = 0;
  for (std::size_t k = 0; k < 400; ++k) {
    CHECK(first.poses[k].p_wa == second.poses[k].p_wa);
    CHECK(first.poses[k].q_wa.coeffs() == second.poses[k].q_wa.coeffs());
    equal += first.poses[k].p_wa == other.poses[k].p_wa ? 1u : 0u;
  }
  CHECK(equal == 0);
}

TEST_CASE("contact_workload: fewer poses than kinds are refused") {
  const PairClass pair = pair_classes(1)[0];
  CHECK_THROWS_AS(static_cast<void>(contact_workload(pair.a, pair.b, 7, 1)), tools::InputError);
}

TEST_SUITE_END();
