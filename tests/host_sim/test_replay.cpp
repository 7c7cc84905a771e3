// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "host_sim/session/replay.hpp"
#include "host_sim/session/replay_summary.hpp"
#include "host_sim/timing/tick_times.hpp"
#include "tests/host_sim/sample_scenes.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

/// Replays with the check and requires a run that is both free and in contact, and right
/// throughout.
ReplayTotals require_right(CoreSession& session, const std::vector<MotionSample>& motion,
                           bool both = true) {
  ReplayOptions options;
  options.check = true;
  const ReplayResult result = replay(session, motion, options);
  const ReplayTotals t = total(result.ticks, session.view().header().capacity);
  REQUIRE(result.check.has_value());
  CHECK(result.check->ticks == motion.size());
  CHECK(result.check->wrong_verdict_pairs == 0);
  CHECK(result.check->wrong_depth_pairs == 0);
  CHECK(t.within_bounds());
  if (both) {
    CHECK(t.contact_ticks > motion.size() / 20);
    CHECK(t.contact_ticks < motion.size());
  }
  MESSAGE("ticks ", t.ticks, ", contact ", t.contact_ticks, ", largest error ",
          static_cast<double>(result.check->largest_error_m), " m, re-localised ",
          t.relocalised_pair_ticks, ", range ", result.check->widened_pairs, ", touching ",
          result.check->touching_pairs);
  return t;
}

PathShape over_box(double z) {
  PathShape shape;
  shape.centre_m[2] = z;
  return shape;
}

constexpr double kNoises_rad[] = {0.0,   1e-16, 1e-15, 1e-14, 1e-13, 1e-12,
                                  1e-11, 1e-10, 1e-9,  1e-8,  1e-6,  1e-3};

PathShape aligned_over_box(double z, double turn_rad, double amplitude_m) {
  PathShape shape = over_box(z);
  shape.aligned = true;
  shape.turn_rad = turn_rad;
  shape.amplitude_m = amplitude_m;
  return shape;
}

}  // namespace

TEST_SUITE("host_sim.replay") {
  TEST_CASE(
      "tetrahedron on box: every tick of coherent random motions agrees with the exhaustive "
      "search") {
    CoreSession session(scene_of(tetrahedron(), box(0.1, 0.06, 0.05)), "tetrahedron on box");
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      CAPTURE(seed);
      require_right(session, smooth_path(seed, 3000, over_box(0.08)));
    }
  }

  TEST_CASE(
      "box on box, aligned with rotation noise from 0 to 1e-3 rad: agrees with the exhaustive "
      "search") {
    CoreSession session(scene_of(box(0.03, 0.04, 0.05), box(0.1, 0.06, 0.05)), "box on box");
    for (const double noise : kNoises_rad) {
      CAPTURE(noise);
      require_right(session, smooth_path(11, 600, aligned_over_box(0.102, noise, 0.02)));
    }
  }

  TEST_CASE(
      "box next to a parallel edge of a box, rotation noise from 0 to 1e-3 rad: agrees with the "
      "exhaustive search") {
    CoreSession session(scene_of(box(0.03, 0.04, 0.05), box(0.1, 0.06, 0.05)), "box on box");
    for (const double noise : kNoises_rad) {
      CAPTURE(noise);
      PathShape shape = aligned_over_box(0.1, noise, 0.01);
      shape.centre_m[0] = 0.127;  // the edges of both, along y, pass each other
      require_right(session, smooth_path(14, 1200, shape));
    }
  }

  TEST_CASE("prism on box, tumbling and aligned: agrees with the exhaustive search") {
    CoreSession session(scene_of(prism(12, 0.04, 0.03), box(0.1, 0.06, 0.05)), "prism on box");
    require_right(session, smooth_path(21, 2000, over_box(0.09)));
    for (const double noise : {0.0, 1e-13, 1e-9, 1e-4}) {
      CAPTURE(noise);
      require_right(session, smooth_path(22, 500, aligned_over_box(0.081, noise, 0.015)));
    }
  }

  TEST_CASE("jumps and far flight: the verdict agrees with the exhaustive search") {
    CoreSession session(scene_of(tetrahedron(), box(0.1, 0.06, 0.05)), "tetrahedron on box");
    PathShape wide = over_box(0.06);
    wide.amplitude_m = 0.12;
    const std::vector<MotionSample> path = smooth_path(5, 60000, wide);
    std::vector<MotionSample> jumps;
    for (std::size_t i = 0; i < path.size(); i += 60) jumps.push_back(path[i]);
    // 60 ms at a time at 1 m/s: the verdict must be right; the depth of a deep penetration may be a
    // local maximum (rt_core/METHOD.md section 7.3), seldom.
    ReplayOptions options;
    options.check = true;
    const CheckTotals check = *replay(session, jumps, options).check;
    MESSAGE("after jumps: wrong d_near in ", check.wrong_depth_ticks, " of ", check.ticks,
            " ticks, largest error ", static_cast<double>(check.largest_error_m), " m");
    CHECK(check.wrong_verdict_pairs == 0);
    CHECK(check.wrong_depth_ticks < check.ticks / 100);
    PathShape far;
    far.centre_m[0] = 3.0;
    require_right(session, smooth_path(6, 300, far), false);
  }

  TEST_CASE("the check finds a core that is wrong: the literal steps with delta = dx") {
    CoreSession session(scene_of(tetrahedron(), box(0.1, 0.06, 0.05)), "tetrahedron on box");
    ReplayOptions options;
    options.check = true;
    options.literal = DeltaReading::kTranslation;
    std::uint64_t narrow_wrong = 0, wide_wrong = 0;
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      const std::vector<MotionSample> motion = smooth_path(seed, 3000, over_box(0.08));
      options.literal = DeltaReading::kTranslation;
      narrow_wrong += replay(session, motion, options).check->wrong_depth_ticks;
      options.literal = DeltaReading::kTranslationAndRotation;
      wide_wrong += replay(session, motion, options).check->wrong_depth_ticks;
    }
    MESSAGE("ticks with a wrong D_Near of 9000: delta = dx ", narrow_wrong,
            ", delta = dx-rotation ", wide_wrong);
    CHECK(narrow_wrong > 0);
    CHECK(wide_wrong <= narrow_wrong);
  }

  TEST_CASE("the same motion gives the same state hashes, and another motion gives others") {
    const std::vector<std::byte> scene = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    CoreSession first(scene, "first"), second(scene, "second");
    const std::vector<MotionSample> motion = smooth_path(9, 500, over_box(0.08));
    const ReplayResult a = replay(first, motion, {}), b = replay(second, motion, {}),
                       again = replay(first, motion, {});
    CHECK(tick_csv(a.ticks) == tick_csv(b.ticks));
    CHECK(tick_csv(a.ticks) == tick_csv(again.ticks));
    const ReplayResult other = replay(first, smooth_path(10, 500, over_box(0.08)), {});
    CHECK(other.ticks.back().state_hash != a.ticks.back().state_hash);
  }

  TEST_CASE("force of a flat press is k_F times the depth along the face normal") {
    CoreSession session(scene_of(box(0.03, 0.03, 0.03), box(0.1, 0.1, 0.05)), "box on box");
    std::vector<MotionSample> motion(20);
    for (std::size_t i = 0; i < motion.size(); ++i) {
      motion[i].t_s = static_cast<double>(i) * 1e-3;
      motion[i].p[2] = 0.081 - 2e-4 * static_cast<double>(i);
    }
    const ReplayResult result = replay(session, motion, {});
    const double tolerance = sizeof(Real) == 4 ? 1e-3 : 1e-9;
    for (std::size_t i = 0; i < motion.size(); ++i) {
      const double depth = 0.08 - motion[i].p[2];
      if (std::abs(depth) < 1e-6) continue;
      const double expected = depth > 0 ? 1000.0 * depth : 0.0;
      CHECK(std::abs(result.ticks[i].force_n[2] - expected) < tolerance);
      CHECK(std::abs(result.ticks[i].torque_nm[0]) < tolerance);
      CHECK(result.ticks[i].situation ==
            (depth > 0 ? ContactSituation::kFaceFace : ContactSituation::kNone));
    }
  }

  TEST_CASE("a pose that is no rotation is refused in its tick and counted") {
    CoreSession session(scene_of(tetrahedron(), box(0.1, 0.06, 0.05)), "tetrahedron on box");
    std::vector<MotionSample> motion = smooth_path(4, 20, over_box(0.1));
    motion[7].q_wxyz[0] = motion[7].q_wxyz[1] = motion[7].q_wxyz[2] = motion[7].q_wxyz[3] = 2.0;
    ReplayOptions options;
    options.check = true;
    const ReplayResult result = replay(session, motion, options);
    CHECK(total(result.ticks, session.view().header().capacity).refused_poses == 1);
    CHECK(result.check->ticks == 19);
    CHECK(result.check->passed());
  }

  TEST_CASE("bytes that are no scene are refused by name") {
    std::vector<std::byte> scene = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    scene[scene.size() / 2] ^= std::byte{1};
    CHECK_THROWS_WITH_AS(CoreSession(scene, "damaged.rtscene"),
                         doctest::Contains("damaged.rtscene: not a usable scene"),
                         tools::InputError);
    CHECK_THROWS_AS(CoreSession({}, "empty"), tools::InputError);
    CHECK_THROWS_AS(CoreSession("/nonexistent.rtscene"), tools::InputError);
  }

  TEST_CASE("timing leaves the run as it is: the state after it is that of a replay") {
    const std::vector<std::byte> scene = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    CoreSession timed(scene, "timed"), plain(scene, "plain");
    const std::vector<MotionSample> motion = smooth_path(12, 200, over_box(0.08));
    const WcetResult times = measure(timed, motion, 3);
    CHECK(times.ticks.size() == motion.size());
    CHECK(times.core.count == motion.size());
    CHECK(times.core.median > 0);
    CHECK(times.core.median <= times.core.p99);
    CHECK(times.core.p99 <= times.core.largest);
    CHECK(times.core_contact.count + times.core_free.count == motion.size());
    const ReplayResult expected = replay(plain, motion, {});
    const MotionSample next = smooth_path(12, 201, over_box(0.08)).back();
    CHECK(timed.core().step(input_of(next, 200)).state_hash ==
          plain.core().step(input_of(next, 200)).state_hash);
    CHECK(expected.ticks.size() == 200);
  }

  TEST_CASE("figures are ranks of the sorted values") {
    std::vector<double> values;
    for (int i = 1000; i >= 1; --i) values.push_back(i);
    const TimeFigures f = figures(values);
    CHECK(f.median == doctest::Approx(501));
    CHECK(f.p99 == doctest::Approx(991));
    CHECK(f.largest == doctest::Approx(1000));
    CHECK(figures({}).count == 0);
  }
}
