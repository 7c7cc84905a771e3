// SPDX-License-Identifier: Apache-2.0
// host_sim plan SCENE.rtscene --goal POSE -o PLAN
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/commands/commands.hpp"
#include "host_sim/commands/laboratory.hpp"
#include "host_sim/oracle/plan_clearance.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/plan_limits.hpp"
#include "tools/plan/search/harmonic_field.hpp"
#include "tools/plan/search/plan_ends.hpp"
#include "tools/plan/search/plan_making.hpp"
#include "tools/plan/search/translation_plan.hpp"

namespace haptic::sim {
namespace {

/// How a motion is found.
enum class PlanMethod : std::uint8_t {
  kSearch,        ///< by pushing the felt part; of a part that never turns after kTranslations
  kTranslations,  ///< from the cells of the free places at the start's orientation
  kHarmonic       ///< down a harmonic function along a channel of those cells
};

struct PlanArguments {
  std::string scene, start = "start", goal, out;
  double seconds = 120, shorten_millions = 1e-6 * static_cast<double>(tools::kShorteningWork);
  std::uint64_t seed = 1;
  PlanMethod method = PlanMethod::kSearch;
  bool json = false, fallback = false;
};

using Json = nlohmann::ordered_json;

/// Basic contacts of a C-face that are named.
constexpr std::size_t kMostNamed = 3;

std::string millimetres_or_less(double length_m) {
  return length_m >= 1e-4 ? tools::formatted("%.3g mm", 1e3 * length_m)
                          : tools::formatted("%.3g um", 1e6 * length_m);
}

std::string pose_as_option(const Pose& pose) {
  std::string text;
  for (int k = 0; k < 3; ++k)
    text += tools::short_number(static_cast<double>(pose.p_wa[k]), 6) + ",";
  const Quat& q = pose.q_wa;
  for (const Real x : {q.w(), q.x(), q.y()})
    text += tools::short_number(static_cast<double>(x), 9) + ",";
  return text + tools::short_number(static_cast<double>(q.z()), 9);
}

std::string plane_text(const SceneView& view, PairIndex index, const std::string& kind,
                       const tools::Vec3d& normal_w) {
  const PairRecord pair = view.pair_record(index);
  return tools::formatted("pieces %u and %u, %s, normal (%.3f, %.3f, %.3f)", pair.piece_a,
                          pair.piece_b, kind.c_str(), normal_w.x(), normal_w.y(), normal_w.z());
}

/// "pieces 0 and 3, a face of the fixed piece, normal (0, 0, 1)".
std::string plane_text(const SceneView& view, const tools::HoldingPlane& plane) {
  const char* const kind = plane.type == ContactType::kA   ? "a face of the moving piece"
                           : plane.type == ContactType::kB ? "a face of the fixed piece"
                                                           : "two edges";
  return plane_text(view, plane.pair, kind, plane.normal_w);
}

/// Names of the first basic contacts of a C-face: "44 B (v2, f0)".
std::vector<std::string> contact_names(const SceneView& view, const tools::BlockingFace& face) {
  std::vector<std::string> names;
  const PairView pair = view.pair(face.pair);
  for (const std::uint32_t node : face.nodes) {
    if (names.size() == kMostNamed) break;
    names.push_back(tools::node_text(pair, node));
  }
  return names;
}

std::string face_text(const SceneView& view, const tools::BlockingFace& face) {
  std::string kind = "C-face of " + joined(contact_names(view, face));
  if (face.nodes.size() > kMostNamed)
    kind += tools::formatted(" and %zu more", face.nodes.size() - kMostNamed);
  return plane_text(view, face.pair, kind, face.normal_w) +
         tools::formatted(", %.4g mm^2 of it", 1e6 * face.area_m2);
}

std::vector<double> numbers_of(const tools::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

Json enclosure_json(const SceneView& view, const tools::TranslationResult& result) {
  Json faces = Json::array();
  for (const tools::BlockingFace& face : result.enclosure.faces) {
    const PairRecord pair = view.pair_record(face.pair);
    faces.push_back({{"piece_a", pair.piece_a},
                     {"piece_b", pair.piece_b},
                     {"normal", numbers_of(face.normal_w)},
                     {"offset_m", face.offset_m},
                     {"area_m2", face.area_m2},
                     {"basic_contacts", face.nodes},
                     {"names", contact_names(view, face)}});
  }
  return {{"of", result.goal_is_enclosed ? "goal" : "start"},
          {"low_m", numbers_of(result.enclosure.low)},
          {"high_m", numbers_of(result.enclosure.high)},
          {"blocking_faces", std::move(faces)}};
}

/// No translation leads to the goal: the fact, and what it rests on.
void say_impossible(const SceneView& view, const tools::TranslationResult& result) {
  const tools::Enclosure& e = result.enclosure;
  const char* const what = result.goal_is_enclosed ? "goal" : "start";
  std::printf(
      "no translation at this orientation leads from the start to the goal: a fact, from %zu "
      "C-faces of %llu pairs, depths to %.3g m counted as free (%zu cells, %.2f s)\n",
      result.space.faces.size(), static_cast<unsigned long long>(view.pair_count()),
      result.space.tolerance_m, result.space.cells.size(), result.seconds);
  std::printf(
      "  from the %s the grip point reaches x %.6g to %.6g mm, y %.6g to %.6g mm, z %.6g to %.6g "
      "mm\n",
      what, 1e3 * e.low.x(), 1e3 * e.high.x(), 1e3 * e.low.y(), 1e3 * e.high.y(), 1e3 * e.low.z(),
      1e3 * e.high.z());
  if (tools::PlanLimits(view.parameters().envelope).has_box())
    std::printf("  places beyond [motion_limits] workspace count as shut\n");
  for (const tools::BlockingFace& face : e.faces)
    std::printf("  the %s is shut in by %s\n", what, face_text(view, face).c_str());
}

void say_progress(const tools::SearchState& state) {
  std::fprintf(stderr,
               "host_sim plan: %.0f s, %llu poses from the start and %llu from the goal, "
               "the trees are %.3g mm apart\n",
               state.seconds, static_cast<unsigned long long>(state.nodes_from_start),
               static_cast<unsigned long long>(state.nodes_from_goal), 1e3 * state.nearest_m);
}

/// Says about once a second how far the shortening is.
tools::ShorteningProgress say_shortening(const tools::ShorteningLimits& limits) {
  using Clock = std::chrono::steady_clock;
  return [limits, said = Clock::now()](const tools::ShorteningState& state) mutable {
    if (Clock::now() - said < std::chrono::seconds(1)) return;
    said = Clock::now();
    std::fprintf(
        stderr,
        "host_sim plan: a motion is found; %.3g %% of the work on its shortening, %zu corners\n",
        100.0 * static_cast<double>(state.work) / static_cast<double>(limits.work), state.corners);
  };
}

void say_failure(const SceneView& view, const tools::SlidingPart& part,
                 const tools::SearchResult& result, bool turned) {
  std::printf("no plan found in %.0f s (%llu pushes, %llu ticks); got as far as this state:\n",
              result.state.seconds, static_cast<unsigned long long>(result.state.pushes),
              static_cast<unsigned long long>(result.state.ticks));
  std::printf("  from the start to %s\n",
              pose_as_option(part.mesh_pose(result.nearest_to_goal)).c_str());
  std::printf("  from the goal to  %s\n",
              pose_as_option(part.mesh_pose(result.nearest_to_start)).c_str());
  std::printf("  the nearest two poses are %.4g mm apart, a turn of 1 rad counted as %.4g mm\n",
              1e3 * result.state.nearest_m, 1e3 * part.radius_m());
  for (const tools::HoldingPlane& plane : result.goal_held)
    std::printf("  pushed out of the goal it is held by %s\n", plane_text(view, plane).c_str());
  if (!turned && !view.is_locked())
    std::printf(
        "  the goal is turned as the start: --method translations may find a motion that does not "
        "turn the part, or prove that there is none\n");
}

/// The start and the goal of a plan, and what proves its steps.
struct Task {
  const SceneView& view;
  tools::SlidingPart& part;
  tools::StepProver& prover;
  Pose start_wa;  ///< of the mesh frame
  tools::PlanEnds ends;
};

tools::ShorteningLimits shortening_of(const PlanArguments& o) {
  tools::ShorteningLimits shortening;
  shortening.work = static_cast<std::uint64_t>(1e6 * o.shorten_millions);
  shortening.seed = o.seed;
  return shortening;
}

/// Proves the plan as a reader would, writes it and says so.
int keep_plan(const Task& task, const PlanArguments& o, const tools::Plan& plan, Json json,
              const std::string& how) {
  std::size_t runs = 0;
  for (const tools::PlanPlane& plane : plan.planes) runs += plane.runs.size();
  if (plan.poses.size() > tools::kMostPlanPoses || plan.planes.size() > tools::kMostPlanPlanes ||
      runs > tools::kMostPlanRuns) {
    std::printf(
        "a motion was found and each of its %zu steps is proved, by %zu planes over %zu runs of "
        "steps, but a plan file holds %zu, %zu and %zu: none is written; with more "
        "--shorten-millions it has fewer steps\n",
        plan.steps(), plan.planes.size(), runs, tools::kMostPlanPoses - 1, tools::kMostPlanPlanes,
        tools::kMostPlanRuns);
    return tools::kExitCheckFailed;
  }
  const tools::PlanProof proof = tools::write_proved_plan(task.view, plan, o.out);
  const PlanClearance clearance = clearance_of(task.view, plan);
  if (o.json) {
    json["plan"] = o.out;
    json["steps"] = proof.steps;
    json["certified"] = proof.certified;
    json["stations"] = plan.stations.size();
    json["length_m"] = plan.stations.front().cost_to_go_m;
    json["least_distance_m"] = proof.least_m;
    json["clearance_m"] = clearance.least_m;
    json["clearance_poses"] = clearance.poses;
    std::printf("%s\n", json.dump(2).c_str());
    return tools::kExitDone;
  }
  std::printf("%s: %zu steps, %zu stations, %.4g mm\n", o.out.c_str(), plan.steps(),
              plan.stations.size(), 1e3 * plan.stations.front().cost_to_go_m);
  std::printf("%s", how.c_str());
  std::printf(
      "  clearance %s: the least distance of the surfaces at %zu poses of the way, at most %s "
      "apart\n",
      millimetres_or_less(clearance.least_m).c_str(), clearance.poses,
      millimetres_or_less(clearance.apart_m).c_str());
  std::printf(
      "  certified %llu of %llu steps (%.4g %%), by %llu planes over %llu runs of steps, which "
      "leave %.3g um at least\n",
      static_cast<unsigned long long>(proof.certified),
      static_cast<unsigned long long>(proof.steps),
      100.0 * static_cast<double>(proof.certified) / static_cast<double>(proof.steps),
      static_cast<unsigned long long>(proof.planes), static_cast<unsigned long long>(proof.runs),
      1e6 * proof.least_m);
  return tools::kExitDone;
}

/// The answer of the cells, where they have one.
std::optional<int> plan_by_cells(const Task& task, const PlanArguments& o) {
  const tools::TranslationResult result =
      tools::plan_translation(task.view, task.prover, task.start_wa, task.ends.start,
                              task.ends.goal, tools::plan_tolerance_m(task.view));
  if (result.verdict == tools::TranslationVerdict::kUndecided) {
    const std::string why = "the cells of the free places decide nothing: " + result.why;
    if (o.method != PlanMethod::kSearch) {
      throw tools::InputError(o.scene + ": " + why + "; leave --method out");
    }
    std::fprintf(stderr, "host_sim plan: %s; the search goes on\n", why.c_str());
    return std::nullopt;
  }
  Json json{{"found", result.verdict == tools::TranslationVerdict::kFound},
            {"cells", result.space.cells.size()},
            {"c_faces", result.space.faces.size()},
            {"tolerance_m", result.space.tolerance_m},
            {"seconds", result.seconds}};
  if (result.verdict == tools::TranslationVerdict::kImpossible) {
    json["impossible_by_translation"] = true;
    json["enclosure"] = enclosure_json(task.view, result);
    if (o.json) {
      std::printf("%s\n", json.dump(2).c_str());
    } else {
      say_impossible(task.view, result);
    }
    return tools::kExitCheckFailed;
  }
  tools::CorneredMotion motion =
      tools::shortened(result.motion, task.prover, task.part.radius_m(), shortening_of(o),
                       say_shortening(shortening_of(o)));
  std::string how =
      tools::formatted("  exact     %.2f s, %zu cells from %zu C-faces of %llu pairs\n",
                       result.seconds, result.space.cells.size(), result.space.faces.size(),
                       static_cast<unsigned long long>(task.view.pair_count()));
  if (o.method == PlanMethod::kHarmonic) {
    tools::HarmonicDescent down = tools::descend_about(result.space, motion);
    motion = std::move(down.motion);
    how += tools::formatted("  harmonic  %zu cells of %.3g mm, %u rounds, residual %.2g\n",
                            down.field.cells.size(), 1e3 * down.field.pitch_m, down.field.rounds,
                            down.field.residual);
  }
  json["method"] = o.method == PlanMethod::kHarmonic ? "harmonic" : "translations";
  return keep_plan(task, o, tools::plan_from(task.view, task.part, task.prover, motion, o.seed),
                   std::move(json), how);
}

/// Goes on as the laboratory, which has OMPL's planners.
[[noreturn]] void plan_by_sampling(const PlanArguments& o) {
  std::fflush(stdout);
  std::vector<std::string> words{"host_lab",
                                 "plan-sampled",
                                 o.scene,
                                 "--goal=" + o.goal,
                                 "--start=" + o.start,
                                 "--out=" + o.out,
                                 "--seconds=" + tools::short_number(o.seconds, 9),
                                 "--seed=" + std::to_string(o.seed)};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  become_laboratory(argv.data());
}

int plan_by_search(const Task& task, const PlanArguments& o) {
  tools::SearchLimits limits;
  limits.seconds = o.seconds;
  limits.seed = o.seed;
  const tools::MadePlan made = tools::make_plan_between(
      task.view, task.part, task.prover, task.ends.start, task.ends.goal, limits, shortening_of(o),
      say_progress, say_shortening(shortening_of(o)));
  const tools::SearchResult& result = made.search;
  Json json{{"found", result.found},
            {"method", "search"},
            {"seconds", result.state.seconds},
            {"pushes", result.state.pushes},
            {"ticks", result.state.ticks}};
  if (!result.found) {
    json["nearest_m"] = result.state.nearest_m;
    if (o.json) {
      std::printf("%s\n", json.dump(2).c_str());
    } else {
      say_failure(task.view, task.part, result, task.ends.turned);
    }
    if (o.fallback) plan_by_sampling(o);
    return tools::kExitCheckFailed;
  }
  const std::string how = tools::formatted(
      "  search    %.2f s, %llu pushes, %llu ticks of the core; found %.4g mm\n"
      "  shortened %.2f s, %.4g million vertices looked at\n",
      result.state.seconds, static_cast<unsigned long long>(result.state.pushes),
      static_cast<unsigned long long>(result.state.ticks), 1e3 * made.found_m, made.shorten_s,
      1e-6 * static_cast<double>(made.shorten_work));
  return keep_plan(task, o, made.plan, std::move(json), how);
}

int do_plan(const PlanArguments& o) {
  if (o.out.empty()) throw tools::UsageError("--out: is empty; name the plan to write");
  const tools::SceneBytes bytes = tools::read_scene_bytes(o.scene);
  const CoreSession session(bytes.span(), o.scene, GoalContact::kLeftOut);  // checks the scene
  const SceneView& view = session.view();
  tools::claim_output(o.out, "--out", {tools::FileFormat::kPlan, {}});
  tools::SlidingPart part(view);
  tools::StepProver prover(view, tools::plan_tolerance_m(view));
  const tools::AskedEnds asked{tools::pose_from_text(view, "--start", o.start),
                               tools::pose_from_text(view, "--goal", o.goal), "--start", "--goal"};
  const Task task{view, part, prover, asked.start_wa, checked_ends(view, part, prover, asked)};
  const bool turned = task.ends.turned;
  if (turned && o.method != PlanMethod::kSearch) {
    throw tools::UsageError(
        "--method: is for translations, and the goal is turned; leave --method out");
  }
  if (o.method != PlanMethod::kSearch || (view.is_locked() && !turned)) {
    if (const std::optional<int> code = plan_by_cells(task, o)) return *code;
  }
  return plan_by_search(task, o);
}

/// Unlike CLI::Range it refuses what is no number.
CLI::Validator number_from(double low, double high) {
  return CLI::Validator(
      [low, high](std::string& word) {
        double value = 0;
        if (CLI::detail::lexical_cast(word, value) && value >= low && value <= high)
          return std::string();
        return tools::formatted("'%s' is no number from %.3g to %.3g", word.c_str(), low, high);
      },
      tools::formatted("%.3g to %.3g", low, high));
}

/// Digits alone, of at most 64 bits.
CLI::Validator whole_number() {
  return CLI::Validator(
      [](std::string& word) {
        std::uint64_t value = 0;
        const char* const end = word.data() + word.size();
        const auto read = std::from_chars(word.data(), end, value);
        if (read.ec == std::errc() && read.ptr == end) return std::string();
        return "'" + word + "' is no whole number from 0 to 18446744073709551615";
      },
      "0, 1, ..");
}

}  // namespace

Command add_plan_command(CLI::App& program) {
  const auto o = std::make_shared<PlanArguments>();
  CLI::App* app = program.add_subcommand(
      "plan", "Finds a motion of the moving part to a pose, and proves every step of it free.");
  app->add_option("scene,--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--goal", o->goal,
                  "where the part is to go: x,y,z[,qw,qx,qy,qz] of its file frame [m, or 5mm]")
      ->required();
  app->add_option("--start", o->start,
                  "where it begins, written alike; default: the scene's start");
  app->add_option("-o,--out", o->out, "plan to write")->required();
  app->add_option("--seconds", o->seconds, "time for the search (default 120)")
      ->check(tools::positive_number())
      ->check(number_from(0, 1e9));
  app->add_option(
         "--shorten-millions", o->shorten_millions,
         "work on making the plan shorter: vertices that it may look at, in millions "
         "(default 6000, about half a minute); it is counted, not timed, so that the plan is "
         "the same on any machine")
      ->check(number_from(0, 1e12));
  app->add_option("--seed", o->seed,
                  "of the random pushes (default 1); the same seed gives the same plan")
      ->check(whole_number());
  tools::add_choice<PlanMethod>(
      *app, "--method", o->method,
      {{"search", PlanMethod::kSearch},
       {"translations", PlanMethod::kTranslations},
       {"harmonic", PlanMethod::kHarmonic}},
      "search (default): by pushing the part; translations: exactly, from the C-faces at the "
      "start's orientation (always for a part that never turns); harmonic: down a harmonic "
      "function along a channel of their cells");
  CLI::Option* const fallback =
      app->add_flag("--fallback", o->fallback,
                    "where the search finds none, goes on with OMPL's planners, each for --seconds "
                    "(plan-sampled of host_lab)");
  app->add_flag("--json", o->json, "the account as JSON on stdout")->excludes(fallback);
  return {app, [o] { return do_plan(*o); },
          "host_sim plan peg.rtscene --goal 0,0,-40mm,1,0,0,0 -o peg.plan"};
}

}  // namespace haptic::sim
