// SPDX-License-Identifier: Apache-2.0
// Extreme geometry and a peg in its hole in short form, and that each comparison can fail.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "host_sim/lab/laws/law_comparison.hpp"
#include "host_sim/lab/stability/extreme_scene.hpp"
#include "host_sim/lab/stability/peg_insertion.hpp"
#include "host_sim/lab/stability/pressed_contact.hpp"
#include "host_sim/lab/stability/stability_report.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr std::uint64_t kSeed = 71;

/// The swaying insertion as a motion.
std::vector<MotionSample> swaying_motion() {
  std::vector<MotionSample> motion;
  for (int k = 0; k <= 4600; ++k) {
    const PathPose pose = device_on(PegPath::kWobble, 1e-3 * k);
    motion.push_back(sample_at(1e-3 * k, pose.p, pose.q));
  }
  return motion;
}

constexpr double kDown[3] = {0, 0, -1};

}  // namespace

TEST_SUITE("host_sim.stability_extreme") {
  TEST_CASE("extreme geometry: every short run holds its limits") {
    const PartReport report = extreme_part(true);
    CAPTURE(report.markdown);
    CHECK(report.passed);
    CHECK(report.findings.size() == 3);
    for (const char* name : {"extreme.csv", "extreme_press.csv", "extreme.md", "extreme.svg"}) {
      CHECK(std::any_of(report.files.begin(), report.files.end(), [name](const OutputText& file) {
        return file.name == name && file.content.size() > 500;
      }));
    }
  }

  TEST_CASE("depth: an error of twice the limit fails in every pose") {
    for (const ExtremeScene& scene : extreme_scenes(true)) {
      if (scene.refused || scene.family == "prisms" || scene.family == "prisms_upright") continue;
      CAPTURE(scene.family);
      CAPTURE(scene.parameter);
      CAPTURE(kSeed);
      const DepthErrors right = measure_depth(scene, 12, kSeed);
      CHECK(right.failures() == 0);
      // Inside, D_near is one number; outside, nearly parallel edges may leave it a range.
      const DepthErrors wrong = measure_depth(scene, 12, kSeed, 2.5 * right.limit_m);
      CHECK(wrong.wrong_depths > 0);
    }
  }

  TEST_CASE("writer: sizes that the format does not hold are refused with a reason") {
    int refused = 0;
    for (const ExtremeScene& scene : extreme_scenes(true)) {
      if (!scene.refused) continue;
      const DepthErrors errors = measure_depth(scene, 1, kSeed);
      CHECK(errors.refusal.find("refused") != std::string::npos);
      refused += 1;
    }
    CHECK(refused == 3);
  }

  TEST_CASE("writer: a place whose numbers lie farther apart than the proxy's depths is refused") {
    PressedContact far = pressed_contacts(true).front();  // of 1e-6 m
    CHECK(press(far, LawId::kProxy).ok());
    far.scene.place_w = Vector(0, 1e5, 0);
    const PressErrors refused = press(far, LawId::kProxy);
    CHECK(refused.must_be_refused);
    CHECK(refused.refusal.find("apart") != std::string::npos);
    CHECK(press(far, LawId::kPaper).refusal.empty());  // no proxy, no such place
  }

  TEST_CASE("press: a closed form with another stiffness is not met") {
    for (const PressedContact& contact : pressed_contacts(true)) {
      CAPTURE(contact.scene.family);
      CAPTURE(std::string(to_text(contact.kind)));
      if (press(contact, LawId::kProxy).must_be_refused) continue;
      CHECK_FALSE(press(contact, LawId::kProxy, HAPTIC_REAL_IS_FLOAT ? 0.05 : 1e-4).ok());
    }
  }

  TEST_CASE("press: a single contact gives way by 1 + k_t rho^2 / k_r") {
    for (const PressedContact& contact : pressed_contacts(true)) {
      if (contact.kind != PressKind::kVertex || contact.scene.family != "size") continue;
      const Wide k_t = 1000, depth = widen(contact.depth_m) / 100;
      const Wide size = widen(contact.scene.size_m);
      const Wide k_r = k_t * size * size;
      const WideVec x_d{0, 0, widen(contact.height_m) - depth};
      const Wide rho = widen(contact.lever_m);
      const Wide expected = depth / (1 / k_t + rho * rho / k_r);
      const Wide found = norm(proxy_press(contact, x_d, k_t, k_r).force_n);
      CHECK(static_cast<double>(found / expected) == doctest::Approx(1.0).epsilon(1e-3));
    }
  }

  TEST_CASE("clearance: the force of two sliding points tells one friction from another") {
    const PegRun run = run_peg(inserted_peg_scene(1e-5, 0.2), PegPath::kTilted, 1e-3, false);
    const double pull = run.end.force_n[2];
    CHECK(two_point_force_n(run.end, 1e-5, 0.2) == doctest::Approx(pull).epsilon(0.02));
    CHECK(std::abs(two_point_force_n(run.end, 1e-5, 0.3) - pull) > 0.2 * pull);
  }

  TEST_CASE("clearance: below the force at which it slips the tilted peg is jammed") {
    const PegRun run = run_peg(inserted_peg_scene(1e-5, 0.5), PegPath::kTilted, 1e-3, true);
    // 2.5 mm of push, 2.5 N, do not move it by a tenth of that.
    const double push_mm = 2.5;
    std::size_t begin = 0;
    const auto device_mm = [](std::size_t k) {
      return 1e3 * device_on(PegPath::kTilted, 1e-3 * static_cast<double>(k)).p[2];
    };
    const double top_mm = device_mm(0);
    while (device_mm(begin) == top_mm) begin += 1;
    std::size_t end = begin;
    while (top_mm - device_mm(end) < push_mm) end += 1;
    CHECK(push_mm - (run.lag_mm[end] - run.lag_mm[begin]) < 0.1 * push_mm);
    CHECK(run.slip.force_n[2] > kPegStiffness_n_per_m * 1e-3 * push_mm);
    const PegRun free = run_peg(inserted_peg_scene(1e-5, 0), PegPath::kTilted, 1e-3, true);
    CHECK(free.lag_mm[end] - free.lag_mm[begin] < 0.1 * push_mm);
  }

  TEST_CASE("laws compared: the peg goes in under the proxy law, the scene changes law alone") {
    const std::vector<std::byte> bytes = inserted_peg_scene(1e-4, 0);
    const CoreSession session(bytes, "peg");
    const std::vector<std::byte> same = scene_with_law(session.view(), LawId::kProxy);
    CHECK(std::equal(same.begin(), same.end(), bytes.begin(), bytes.end()));
    CHECK_THROWS_AS(static_cast<void>(scene_with_law(session.view(), LawId::kProxy, 1e-60)),
                    tools::InputError);

    const std::vector<MotionSample> motion = swaying_motion();
    std::vector<LawRun> runs;
    for (const LawId law : {LawId::kPaper, LawId::kProxy})
      runs.push_back(run_law(scene_with_law(session.view(), law), law, motion, kDown));
    // The device goes 1 mm into the floor, the part stays on it.
    CHECK(runs[0].farthest_proxy_m == runs[0].farthest_goal_m);
    CHECK(runs[1].farthest_goal_m - runs[1].farthest_proxy_m ==
          doctest::Approx(0.001).epsilon(0.001));
    CHECK(runs[1].force_steps[0].force_n < runs[0].force_steps[0].force_n);
    CHECK(runs[1].force_steps.size() == kListedSteps);
    CHECK(runs[1].force_steps[0].force_n >= runs[1].force_steps[1].force_n);

    const auto json = nlohmann::json::parse(comparison_json(runs));
    CHECK(json.at(1).at("law") == "proxy");
    CHECK(json[1].at("force_steps").size() == kListedSteps);
    const std::string csv = comparison_csv(runs);
    CHECK(std::count(csv.begin(), csv.end(), '\n') ==
          static_cast<std::ptrdiff_t>(motion.size() + 1));
    CHECK(comparison_page(runs, "peg").find("| proxy |") != std::string::npos);
  }
}
