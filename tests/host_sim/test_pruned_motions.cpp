// SPDX-License-Identifier: Apache-2.0
// Scenes on their own motions, pruned and whole: an envelope of 30 degrees leaves every bit as it
// is while the motion stays inside, hidden seams leave the proxy and every verdict as they are. Own
// scenes, and real parts where the folder is there.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/motion_script.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/proxy_bench.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;
using haptic::test::LoadedScene;

namespace {

constexpr double kEnvelope_rad = 30 * std::numbers::pi / 180;

/// A scene and the part of a motion of it whose orientations stay well inside the envelope.
struct Task {
  std::string name;
  tools::SceneFile scene;
  std::array<double, 4> about_wxyz{1, 0, 0, 0};  ///< as assembled
  std::vector<MotionSample> motion;
};

double angle_to(const std::array<double, 4>& about, const MotionSample& s) {
  double dot = 0;
  for (std::size_t k = 0; k < 4; ++k) dot += about[k] * s.q_wxyz[k];
  return 2 * std::acos(std::min(1.0, std::abs(dot)));
}

void keep_inside(Task& task) {
  const auto outside = std::ranges::find_if(task.motion, [&](const MotionSample& s) {
    return angle_to(task.about_wxyz, s) > 0.9 * kEnvelope_rad;
  });
  task.motion.erase(outside, task.motion.end());
}

Task own_task(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(HAPTIC_SCENES_DIR) / name;
  Task task;
  task.name = name;
  task.scene = tools::read_scene_file(folder / "scene.toml");
  task.scene.parameters.goal_contact = 1;
  task.motion = make_motion(read_motion_script((folder / "motion.toml").string()));
  // As assembled all stand upright; the tetrahedron, which is not assembled, as it starts.
  if (name == "tetrahedron_on_box")
    std::ranges::copy(task.motion[0].q_wxyz, task.about_wxyz.begin());
  keep_inside(task);
  return task;
}

std::optional<Task> shared_task(const std::string& name) {
  const std::string folder = std::string(HAPTIC_SHARED_DIR) + "/data/" + name;
  if (!std::filesystem::exists(folder + "/trajectory.csv")) {
    MESSAGE("skipped: no folder ", folder);
    return std::nullopt;
  }
  const auto json = nlohmann::json::parse(text_of_file(folder + "/task.json"));
  std::string toml = "format = 1\nname = \"" + name + "\"\n";
  for (const char* part : {"moving", "static"}) {
    const auto& p = json.at(part);
    toml += (std::string(part) == "moving" ? "[moving]\n" : "[[static]]\n") +
            std::string("mesh = ") + p.at("file").dump() +
            "\nscale_to_m = " + p.at("scale_to_m").dump() + '\n';
  }
  toml += "[rendering]\nk_f_n_per_m = 1000.0\nepsilon_m = 1e-4\n";
  Task task;
  task.name = name;
  task.scene = tools::parse_scene_file(toml, "scene.toml", folder);
  task.scene.parameters.goal_contact = 1;
  task.about_wxyz = json.at("assembled_pose").at("quaternion_wxyz").get<std::array<double, 4>>();
  task.motion = read_motion_csv(folder + "/trajectory.csv");
  keep_inside(task);
  return task;
}

std::vector<Task> tasks() {
  std::vector<Task> all;
  for (const char* name : {"tetrahedron_on_box", "square_peg_five", "ell_insert", "pin_field"}) {
    all.push_back(own_task(name));
  }
  for (const char* name : {"square_peg", "cube_in_cup", "rect_peg_16mm"}) {
    if (auto task = shared_task(name)) all.push_back(std::move(*task));
  }
  return all;
}

std::vector<std::byte> compiled(const Task& task, LawId law, bool envelope, bool prune) {
  tools::SceneFile scene = task.scene;
  scene.parameters.law = law;
  scene.parameters.work_units = 1000;  // the same with and without marks
  const auto& q = task.about_wxyz;
  if (envelope) {
    scene.orientation = tools::OrientationEnvelope{{q[1], q[2], q[3], q[0]}, kEnvelope_rad};
  }
  tools::CompileOptions options;
  options.prune = prune;
  return tools::compile_scene(scene, options).bytes;
}

StepResult step(LoadedScene& scene, const MotionSample& s) {
  return scene.step({s.p[0], s.p[1], s.p[2]}, {s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2], s.q_wxyz[3]});
}

bool same_wrench(const StepResult& a, const StepResult& b) {
  return std::memcmp(&a.wrench_w, &b.wrench_w, sizeof a.wrench_w) == 0;
}

/// Pairs whose verdicts differ; a pair that was not looked at is apart.
int other_verdicts(const LoadedScene& a, const LoadedScene& b) {
  int other = 0;
  for (std::uint32_t i = 0; i < a.core->pair_count(); ++i) {
    const bool apart_a = a.core->pair_report(i).verdict == Verdict::kSeparated;
    other += apart_a != (b.core->pair_report(i).verdict == Verdict::kSeparated) ? 1 : 0;
  }
  return other;
}

}  // namespace

TEST_SUITE("host_sim.pruned_motions") {
  TEST_CASE(
      "within an envelope of 30 degrees: the scene without it, under every law; every bit without "
      "a proxy") {
    for (const Task& task : tasks()) {
      for (const LawId law : {LawId::kPaper, LawId::kProxy}) {
        CAPTURE(task.name);
        CAPTURE(static_cast<int>(law));
        LoadedScene free(compiled(task, law, false, true)), inside(compiled(task, law, true, true));
        int contacts = 0, other = 0, flagged = 0;
        for (const MotionSample& s : task.motion) {
          const StepResult a = step(free, s), b = step(inside, s);
          // The proxy's way in a tick is bounded by the pairs that are near, marked or not.
          const double off_n =
              static_cast<double>((a.wrench_w.force_w - b.wrench_w.force_w).cwiseAbs().maxCoeff());
          const bool same = law == LawId::kProxy ? off_n <= 2 * haptic::test::tolerance_n(free)
                                                 : same_wrench(a, b);
          other += same && a.d_near_m == b.d_near_m ? 0 : 1;
          other += other_verdicts(free, inside);
          flagged += (b.flags & kFlagOutsideEnvelope) != 0 ? 1 : 0;
          contacts += a.wrench_w.force_w != Vec3::Zero() ? 1 : 0;
        }
        MESSAGE(task.name, ", law ", static_cast<int>(law), ": ", task.motion.size(), " ticks, ",
                contacts, " in contact, other bits in ", other);
        CHECK(other == 0);
        CHECK(flagged == 0);
        CHECK(contacts > 500);
      }
    }
  }

  TEST_CASE("hidden seams and envelope: proxy and verdicts of the whole scene") {
    for (const Task& task : tasks()) {
      CAPTURE(task.name);
      LoadedScene all(compiled(task, LawId::kProxy, true, false));
      LoadedScene pruned(compiled(task, LawId::kProxy, true, true));
      int same = 0, verdicts = 0, contacts = 0;
      double force_n = 0;
      for (const MotionSample& s : task.motion) {
        const StepResult a = step(all, s), b = step(pruned, s);
        same += same_wrench(a, b) ? 1 : 0;
        verdicts += other_verdicts(all, pruned);
        force_n = std::max(
            force_n,
            static_cast<double>((a.wrench_w.force_w - b.wrench_w.force_w).cwiseAbs().maxCoeff()));
        contacts += a.wrench_w.force_w != Vec3::Zero() ? 1 : 0;
      }
      const double allowed_n = haptic::test::tolerance_n(all);
      MESSAGE(task.name, ": ", same, " of ", task.motion.size(),
              " ticks bit for bit, along one axis ", force_n, " N, k_t tol ", allowed_n, " N");
      CHECK(force_n <= 2 * allowed_n);  // each of the two is within the tolerance
      CHECK(verdicts == 0);
      CHECK(contacts > 500);
    }
  }
}
