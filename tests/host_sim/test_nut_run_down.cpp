// SPDX-License-Identifier: Apache-2.0
// A hand at a simulated device runs a nut down its bolt, pulls, and takes it off again.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <vector>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/device/simulated_device.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr double kPitch_m = 0.0015;  // of M10

/// Turn of a pose about the bolt, beside an earlier one, the shorter way.
double turned(const Pose& from, const Pose& to) {
  const Quat by = to.q_wa * from.q_wa.conjugate();
  const double angle = 2 * std::atan2(static_cast<double>(by.z()), static_cast<double>(by.w()));
  return std::remainder(angle, 2 * std::numbers::pi);
}

double height_m(const LoopRecord& record) { return record.tick.proxy_wa.p_m[2]; }

}  // namespace

TEST_SUITE("host_sim") {
  TEST_CASE("a nut is run six turns down its bolt by hand, holds a pull, and comes off again") {
    const std::filesystem::path folder = std::filesystem::path(HAPTIC_SCENES_DIR) / "nut_on_bolt";
    CoreSession session(
        tools::compile_scene(tools::read_scene_file(folder / "scene.toml"), {}).bytes, "nut");
    const MotionScript script = read_motion_script(folder / "six_turns.toml");
    ClosedLoop loop(session, {}, *hand_named("firm"), script.rate_hz);
    const std::vector<LoopRecord> records = run_loop(loop, make_motion(script));
    const auto at = [&](double t_s) -> const LoopRecord& {
      return records[static_cast<std::size_t>(std::lround(t_s * script.rate_hz))];
    };
    // Times of the script: on from 1 s to 21.8 s, the pull to 22.8 s, off from 23.8 s to 44.6 s.
    double on_rad = 0, off_rad = 0, most_delivered_j = 0, worst_gap_m = 0;
    for (std::size_t k = 1; k < records.size(); ++k) {
      const double turn = turned(records[k - 1].tick.proxy_wa, records[k].tick.proxy_wa);
      if (records[k].tick.t_s > 1.0 && records[k].tick.t_s <= 21.8) on_rad += turn;
      if (records[k].tick.t_s > 23.8 && records[k].tick.t_s <= 44.6) off_rad += turn;
      most_delivered_j = std::max(most_delivered_j, records[k].delivered_j);
      worst_gap_m = std::min(worst_gap_m, records[k].tick.proxy_gap_m);
    }
    const double six_rad = 12 * std::numbers::pi;
    CHECK(on_rad == doctest::Approx(-six_rad).epsilon(0.01));
    CHECK(off_rad == doctest::Approx(six_rad).epsilon(0.01));
    // Pressed on one flank all the way, it goes down by the pitch: from 3 turns on to the end.
    const double third_s = 1.0 + 20.8 / 2;
    CHECK(height_m(at(third_s)) - height_m(at(21.8)) ==
          doctest::Approx(3 * kPitch_m).epsilon(0.03));
    CHECK(at(15).tick.force_n[2] > 0.2);
    CHECK(at(22.8).tick.force_n[2] < -0.2);
    CHECK(height_m(at(22.8)) - height_m(at(21.8)) < kPitch_m / 3);
    CHECK(at(30).tick.force_n[2] < -0.2);
    // Off: it follows the hand, without force.
    CHECK(records.back().tick.situation == ContactSituation::kNone);
    CHECK(height_m(records.back()) == doctest::Approx(0.0485).epsilon(1e-3));
    // Friction takes energy and nothing gives any; the nut stays free of the bolt.
    CHECK(most_delivered_j < 1e-5);
    CHECK(records.back().delivered_j <
          -1.5e-2);  // -2.0e-2; Coulomb's law of both flanks asks for 2.6e-2
    CHECK(worst_gap_m > -1e-6);
    CHECK_FALSE(total(records).runs_away());
    CHECK(total(records).contact_ticks > records.size() / 2);
  }

  TEST_CASE("a loop that blows up is told") {
    const std::filesystem::path folder =
        std::filesystem::path(HAPTIC_SCENES_DIR) / "square_peg_five";
    CoreSession session(
        tools::compile_scene(tools::read_scene_file(folder / "scene.toml"), {}).bytes, "peg");
    MotionScript script = read_motion_script(folder / "insert.toml");
    const std::vector<MotionSample> motion = make_motion(script);
    for (const std::uint32_t delay : {0u, 10u}) {
      DeviceModel model;
      model.delay_samples = delay;
      ClosedLoop loop(session, model, *hand_named("loose"), script.rate_hz);
      CHECK(total(run_loop(loop, motion)).runs_away() == (delay > 0));
    }
  }
}
