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
#include "host_sim/commands/plan_account.hpp"
#include "host_sim/commands/stage_plans.hpp"
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
  std::string stage;       ///< number or "all"; empty: the scene has one moving part
  bool order = false;      ///< of the assembly, to be found
  std::string scene_file;  ///< that the scene is from; empty: beside it
};

using Json = nlohmann::ordered_json;

/// Basic contacts of a C-face that are named.
constexpr std::size_t kMostNamed = 3;

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
  if (const std::string large = too_large(plan); !large.empty()) {
    std::printf("%s\n", large.c_str());
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

StageRequest stage_request(const PlanArguments& o, bool has_shortening) {
  StageRequest request;
  request.scene = o.scene;
  request.scene_file = o.scene_file;
  request.out = o.out;
  request.seconds = o.seconds;
  request.shortening = shortening_of(o);
  if (!has_shortening) request.shortening.work = kStageShorteningWork;
  request.json = o.json;
  return request;
}

int do_plan(const PlanArguments& o, bool has_shortening) {
  if (o.order) return plan_order(stage_request(o, has_shortening));
  if (!o.stage.empty()) return plan_stages(stage_request(o, has_shortening), o.stage);
  if (o.goal.empty()) throw tools::UsageError("--goal: is missing; say where the part is to go");
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
  CLI::Option* const goal =
      app->add_option("--goal", o->goal,
                      "where the part is to go: x,y,z[,qw,qx,qy,qz] of its file frame [m, or 5mm]");
  CLI::Option* const start = app->add_option(
      "--start", o->start, "where it begins, written alike; default: the scene's start");
  app->add_option("-o,--out", o->out,
                  "plan to write; for --stage all and --order the folder of the plans")
      ->required();
  CLI::Option* const stage =
      app->add_option("--stage", o->stage,
                      "a stage of an assembly, from 1, or all: its part goes from its start to its "
                      "goal, while those of earlier stages stand at theirs")
          ->excludes(goal)
          ->excludes(start);
  CLI::Option* const order =
      app->add_flag(
             "--order", o->order,
             "finds the order of an assembly by taking it apart, and writes it with its plans")
          ->excludes(goal)
          ->excludes(start)
          ->excludes(stage);
  app->add_option("--scene-file", o->scene_file,
                  "of --order: the scene file that the scene was compiled from; default: the "
                  "scene's name with .toml")
      ->needs(order);
  app->add_option("--seconds", o->seconds, "time for the search (default 120)")
      ->check(tools::positive_number())
      ->check(number_from(0, 1e9));
  CLI::Option* const shorten = app->add_option(
      "--shorten-millions", o->shorten_millions,
      "work on making the plan shorter: vertices that it may look at, in millions "
      "(default 6000, about half a minute); it is counted, not timed, so that the plan is "
      "the same on any machine; of a stage 600");
  shorten->check(number_from(0, 1e12));
  app->add_option("--seed", o->seed,
                  "of the random pushes (default 1); the same seed gives the same plan")
      ->check(whole_number());
  CLI::Option* const method = tools::add_choice<PlanMethod>(
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
  for (CLI::Option* const of : {stage, order}) of->excludes(method)->excludes(fallback);
  return {app, [o, shorten] { return do_plan(*o, shorten->count() > 0); },
          "host_sim plan peg.rtscene --goal 0,0,-40mm,1,0,0,0 -o peg.plan"};
}

}  // namespace haptic::sim
