// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/lab/continuity/continuity_report.hpp"
#include "host_sim/session/core_session.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

PathRun run_of(std::uint32_t steps, double torque_step_nm) {
  PathRun run;
  run.steps = steps;
  run.largest_torque_step_nm = torque_step_nm;
  return run;
}

/// Both laws on all paths, once for all cases.
const std::vector<PathResult>& quick_results() {
  static const std::vector<PathResult> results = run_paths(true);
  return results;
}

}  // namespace

TEST_SUITE("host_sim.continuity") {
  TEST_CASE("paths: D_near stays at the depth, poses follow each other smoothly") {
    const std::vector<ContactPath> paths = contact_paths();
    REQUIRE(paths.size() == 6);
    for (const ContactPath& path : paths) {
      CAPTURE(path.name);
      const std::vector<std::byte> scene =
          scene_of(path.a, {&path.b, 1}, kPathStiffness_n_per_m, kPathEpsilon_m);
      CoreSession session(scene, path.name);
      double longest_step = 0;
      PathPose last = path.pose(0);
      for (int k = 0; k <= 1000; ++k) {
        const PathPose pose = path.pose(k / 1000.0);
        StepInput input;
        input.pose_wa = pose_at(pose.p, pose.q);
        session.core().reset();
        const double d = static_cast<double>(session.core().step(input).d_near_m);
        if (path.name == "over_corner") {
          CHECK(d <= -0.00099);
          CHECK(d >= -0.00171);
        } else {
          CHECK(std::abs(d + kPathDepth_m) < (HAPTIC_REAL_IS_FLOAT ? 1e-7 : 1e-12));
        }
        longest_step = std::max(longest_step, (pose.p - last.p).norm());
        longest_step = std::max(longest_step, 0.1 * pose.q.angularDistance(last.q));
        last = pose;
      }
      CHECK(longest_step < 0.0006);
    }
  }

  TEST_CASE("the weighted law settles on every path, the paper's law jumps") {
    for (const PathResult& r : quick_results()) {
      CAPTURE(r.path.name);
      REQUIRE(r.weighted.size() == 2);
      CHECK(r.weighted.back().steps == r.path.fine_steps);
      CHECK(settles(r.weighted, r.path.fine_steps));
      if (r.path.name == "flat_yaw") continue;  // pi stays in H: neither law has a torque
      CHECK_FALSE(settles(r.paper, r.path.fine_steps));
      CHECK(r.paper.back().largest_torque_step_nm > 5 * r.weighted.back().largest_torque_step_nm);
      double largest_nm = 0;
      for (const Vector& torque : r.weighted.back().torque_w)
        largest_nm = std::max(largest_nm, torque.norm());
      CHECK(largest_nm > 0.01);
    }
    CHECK(continuous(quick_results()));
  }

  TEST_CASE("a jump in the finest runs is found, a coarse beginning is not held against a law") {
    const std::vector<PathRun> smooth = {run_of(1000, 0.04), run_of(4000, 0.03),
                                         run_of(16000, 0.008)};
    CHECK_FALSE(settles(smooth, 4000));
    CHECK(settles(smooth, 16000));
    CHECK(std::abs(ratio_to_previous(smooth, 2) - 3.75) < 1e-12);
    CHECK(ratio_to_previous(smooth, 0) == 0);
    const std::vector<PathRun> still = {run_of(1000, 0), run_of(4000, 0)};
    CHECK(settles(still, 4000));
    const std::vector<PathRun> late = {run_of(1000, 0.04), run_of(4000, 0.01),
                                       run_of(16000, 0.009)};
    CHECK_FALSE(settles(late, 4000));
    CHECK_FALSE(settles({smooth.data(), 1}, 1000));  // one run says nothing
    std::vector<PathResult> results = quick_results();
    results[0].weighted.back().largest_torque_step_nm =
        results[0].weighted.front().largest_torque_step_nm;
    CHECK_FALSE(continuous(results));
  }

  TEST_CASE("files: one row per run, JSON of the same numbers, a picture of every path") {
    const std::vector<PathResult>& results = quick_results();
    const std::vector<OutputText> files = continuity_files(results);
    CHECK(files.size() == 4 + results.size());
    const std::string csv = continuity_csv(results);
    CHECK(csv.starts_with(
        "path,law,steps,largest_torque_step_nm,largest_force_step_n,ratio_to_previous\n"));
    CHECK(std::count(csv.begin(), csv.end(), '\n') == 1 + 4 * static_cast<long>(results.size()));
    const nlohmann::json json = nlohmann::json::parse(continuity_json(results));
    REQUIRE(json["paths"].size() == results.size());
    CHECK(json["passed"].get<bool>());
    CHECK(json["paths"][0]["weighted_region"][1]["largest_torque_step_nm"].get<double>() ==
          results[0].weighted[1].largest_torque_step_nm);
    for (const PathResult& r : results) {
      const std::string svg = torque_picture(r);
      CHECK(svg.find("<polyline") != std::string::npos);
      CHECK(svg.ends_with("</svg>\n"));
      CHECK(svg.find("nan") == std::string::npos);
    }
  }
}
