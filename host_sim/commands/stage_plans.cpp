// SPDX-License-Identifier: Apache-2.0
#include "host_sim/commands/stage_plans.hpp"

#include <sys/wait.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "host_sim/commands/assembly_file.hpp"
#include "host_sim/commands/plan_account.hpp"
#include "host_sim/commands/stage_table.hpp"
#include "host_sim/oracle/plan_clearance.hpp"
#include "host_sim/session/child_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/plan/assembly_stages.hpp"
#include "tools/plan/guide_tables.hpp"
#include "tools/plan/search/disassembly.hpp"
#include "tools/plan/search/plan_ends.hpp"
#include "tools/plan/search/plan_making.hpp"

namespace haptic::sim {
namespace {

using Json = nlohmann::ordered_json;

/// Halvings of a straight way that was proved with the same parts before.
constexpr int kAgainHalvings = 16;

struct OpenedFile {
  explicit OpenedFile(const std::string& path) : bytes(tools::read_scene_bytes(path)) {
    const RtStatus status = SceneView::open(bytes.span(), view);
    if (status != RtStatus::kOk)
      throw tools::InputError(path + ": not a usable scene: " + to_text(status) +
                              "; compile it again");
  }
  tools::SceneBytes bytes;
  SceneView view;
};

const char* to_text(tools::WayKind kind) {
  return kind == tools::WayKind::kStraight ? "straight"
         : kind == tools::WayKind::kCells  ? "cells"
                                           : "search";
}

/// The plan along a motion from the part's start to its goal.
void finish(const SceneView& view, tools::WayOut& way, const tools::CorneredMotion& motion,
            const StageRequest& o, const std::string& file, StageRow& row) {
  const tools::CorneredMotion shorter = tools::shortened(
      motion, way.prover(), way.part().radius_m(), o.shortening, say_shortening(o.shortening));
  const tools::Plan plan =
      tools::plan_from(view, way.part(), way.prover(), shorter, o.shortening.seed);
  row.failure = too_large(plan);
  if (!row.failure.empty()) return;
  tools::ProvedText proved = tools::proved_plan_text(view, plan, file);
  row.text = std::move(proved.text);
  row.steps = proved.proof.steps;
  row.certified = proved.proof.certified;
  row.length_m = plan.stations.front().cost_to_go_m;
  row.clearance_m = clearance_of(view, plan).least_m;
}

/// The stage's scene, and the part in it.
struct StageTask {
  StageTask(const tools::AssemblyStages& assembly, std::size_t stage, std::uint64_t seed)
      : bytes(assembly.scene_at(stage)), place(assembly.stages()[stage].goal) {
    if (SceneView::open(bytes.span(), view) != RtStatus::kOk)
      throw tools::InputError("the scene of a stage does not open; compile the scene again");
    const PartScenes& parts = assembly.parts();
    const std::uint32_t part = assembly.stages()[stage].part;
    // Parts of later stages lie where they start, and are no part of what this one comes into.
    std::vector<bool> is_later(parts.count(), false);
    for (std::size_t k = stage; k < assembly.stages().size(); ++k)
      is_later[assembly.stages()[k].part] = true;
    const std::span<const std::uint32_t> others = parts.others_of(part);
    rest = tools::ball_about(view, [&](std::size_t body) { return !is_later[others[body - 1]]; });
    start_wa = pose_of(parts.start_of(part));
    goal_wa = pose_of(place);
    if (rest.radius_m == 0) rest.centre = goal_wa.p_wa.cast<double>();
    way.emplace(view, rest, seed);
  }
  tools::SceneBytes bytes;
  PartPlace place;
  SceneView view;
  tools::Ball rest;
  Pose start_wa, goal_wa;
  std::optional<tools::WayOut> way;
};

/// Backwards out of the goal, where few ways are left, and on to the start; else by the search.
StageRow plan_stage(const tools::AssemblyStages& assembly, std::size_t stage, const StageRequest& o,
                    const std::string& file) {
  StageRow row;
  row.number = stage + 1;
  row.part = assembly.name(stage);
  StageTask task(assembly, stage, o.shortening.seed);
  tools::WayOut& way = *task.way;
  const std::string title = tools::formatted("stage %zu, ", row.number) + in_quotes(row.part);
  const tools::PlanPose asked = way.part().grip_pose(task.goal_wa);
  double depth_m = 0;
  const double size_m = 2 * (task.rest.radius_m + way.part().radius_m());
  const auto goal = way.settled(asked, tools::kSettleShare * size_m, depth_m);
  if (goal && !(*goal == asked)) {
    row.settled_m = (tools::place_of(*goal) - tools::place_of(asked)).norm();
    task.goal_wa = way.part().mesh_pose(*goal);
    if (row.settled_m > tools::kSamePlanEnd * way.part().radius_m()) {
      row.failure = tools::formatted("it overlaps at its goal by %.3g um, and is free at %s",
                                     1e6 * depth_m, pose_as_option(task.goal_wa).c_str());
      return row;
    }
  }
  const tools::PlanEnds ends =
      checked_ends(task.view, way.part(), way.prover(),
                   {task.start_wa, task.goal_wa, title + ": the start", title + ": the goal"});
  bool impossible = false;
  std::optional<tools::OutWay> out = way.straight(ends.goal);
  if (!out) out = way.by_cells(ends.goal, impossible);
  if (out && way.go_on(*out, ends.start)) {
    std::ranges::reverse(out->motion.corners);
    row.how = to_text(out->kind);
    finish(task.view, way, out->motion, o, file, row);
    return row;
  }
  tools::SearchLimits limits;
  limits.seconds = o.seconds;
  limits.seed = o.shortening.seed;
  std::fprintf(stderr,
               "host_sim plan: %s: no translation that was tried leads out of the goal; the search "
               "goes on\n",
               title.c_str());
  const tools::SearchResult result = tools::search_plan(
      task.view, way.part(), way.prover(), ends.start, ends.goal, limits, say_progress);
  row.how = to_text(tools::WayKind::kSearch);
  if (!result.found) {
    if (!o.json) say_failure(task.view, way.part(), result, ends.turned);
    row.failure = tools::formatted("no plan found in %.0f s", result.state.seconds);
    return row;
  }
  finish(task.view, way, result.motion, o, file, row);
  return row;
}

std::string plan_name(std::size_t number) { return std::to_string(number) + ".plan"; }

/// Number from 1, or nothing for "all".
std::optional<std::size_t> stage_number(const std::string& which, std::size_t count,
                                        const std::string& scene) {
  if (count == 0)
    throw tools::InputError(scene +
                            ": has no stages; add [[stage]] tables to its scene file, or find them "
                            "with --order");
  if (which == "all") return std::nullopt;
  std::size_t number = 0;
  const char* const end = which.data() + which.size();
  const auto read = std::from_chars(which.data(), end, number);
  if (read.ec != std::errc() || read.ptr != end || number == 0 || number > count)
    throw tools::UsageError(tools::formatted(
        "--stage: '%s' is none; give a number from 1 to %zu, or all", which.c_str(), count));
  return number;
}

/// The part and the plane that a part leans on.
std::string hold_text(const PartScenes& parts, const tools::PartHold& hold) {
  const tools::Vec3d& n = hold.plane.normal_w;
  return in_quotes(std::string(parts.name(hold.other))) +
         tools::formatted(": pieces %u and %u, %s, normal (%.3f, %.3f, %.3f)", hold.piece,
                          hold.other_piece, kind_text(hold.plane.type), n.x(), n.y(), n.z());
}

/// No order: what went out, what is left, and what holds it.
int say_stuck(const PartScenes& parts, const tools::Disassembly& found, const StageRequest& o) {
  const auto name = [&](std::uint32_t part) { return in_quotes(std::string(parts.name(part))); };
  std::string out, left;
  for (const tools::TakenPart& taken : found.taken)
    out += (out.empty() ? "" : ", ") + name(taken.part);
  for (const tools::StuckPart& stuck : found.stuck)
    left += (left.empty() ? "" : ", ") + name(stuck.part);
  if (o.json) {
    Json json{{"found", false}, {"seconds", found.seconds}};
    json["taken_out"] = Json::array();
    json["left"] = Json::array();
    for (const tools::TakenPart& taken : found.taken)
      json["taken_out"].push_back(std::string(parts.name(taken.part)));
    for (const tools::StuckPart& stuck : found.stuck) {
      Json holds = Json::array();
      for (const tools::PartHold& hold : stuck.holds)
        holds.push_back(std::string(parts.name(hold.other)));
      json["left"].push_back({{"part", std::string(parts.name(stuck.part))},
                              {"no_translation", stuck.no_translation},
                              {"held_by", std::move(holds)}});
    }
    std::printf("%s\n", json.dump(2).c_str());
    return tools::kExitCheckFailed;
  }
  std::printf("no order found in %.0f s: taken out are %s\n", found.seconds,
              out.empty() ? "none" : out.c_str());
  for (const tools::StuckPart& stuck : found.stuck) {
    std::printf("  %s: no way out was found%s\n", name(stuck.part).c_str(),
                stuck.no_translation ? "; that no translation leads out is a fact" : "");
    for (const tools::PartHold& hold : stuck.holds)
      std::printf("    pushed, it is held by %s\n", hold_text(parts, hold).c_str());
  }
  std::printf(
      "parts left: %s; one part is moved at a time, so parts that must go out together are not "
      "taken apart; longer --seconds search on\n",
      left.c_str());
  return tools::kExitCheckFailed;
}

/// The parts that go out, and where all are when assembled.
struct Assembled {
  std::vector<PartPlace> places;
  std::vector<tools::AssembledPart> movable;
};

Assembled assembled_state(const tools::AssemblyStages& assembly, const std::string& scene) {
  const PartScenes& parts = assembly.parts();
  Assembled state;
  for (std::uint32_t k = 0; k < parts.count(); ++k) state.places.push_back(parts.start_of(k));
  if (assembly.stages().empty()) {
    for (std::uint32_t k = 0; k < parts.count(); ++k)
      if (parts.may_be_taken(k)) state.movable.push_back({k, std::nullopt});
  }
  for (const tools::Stage& stage : assembly.stages()) {
    const PartPlace start = parts.start_of(stage.part);
    state.places[stage.part] = stage.goal;
    state.movable.push_back(
        {stage.part, start == stage.goal ? std::nullopt : std::optional(start)});
  }
  if (state.movable.empty())
    throw tools::InputError(
        scene + ": has no part that may be taken out; give the parts role = \"placed\"");
  return state;
}

/// The scene file with the stages in the order that was found, compiled.
struct CompiledOrder {
  std::string text;
  tools::SceneBytes bytes;
};

CompiledOrder compile_order(const AssemblyFile& file, const std::vector<OrderedPart>& order) {
  CompiledOrder made;
  made.text = file.with_order(order, false);
  const TemporaryFolder folder;
  const std::string toml = folder.file("assembly.toml"), scene = folder.file("assembly.rtscene");
  tools::write_files({{toml, std::as_bytes(std::span(made.text))}});
  const std::string err = folder.file("err");
  const int status = run_to_end({program_beside("graph_compiler"), toml, "-o", scene, "--quiet"},
                                folder.file("out"), err);
  const bool is_refused = WIFEXITED(status) && WEXITSTATUS(status) != tools::kExitDeviceOrOs;
  if (status < 0 || (status != 0 && !is_refused))
    throw tools::OsError("graph_compiler did not run to its end: " + last_line(file_text(err)));
  if (status != 0)
    throw tools::InputError("the scene of the order that was found is refused by graph_compiler: " +
                            last_line(file_text(err)));
  made.bytes = tools::read_scene_bytes(scene);
  return made;
}

/// The plan of a stage along the way on which its part was taken out, in the scene of the order.
StageRow plan_again(const tools::AssemblyStages& assembly, std::size_t stage,
                    const tools::TakenPart& taken, const StageRequest& o, const std::string& file) {
  StageRow row;
  row.number = stage + 1;
  row.part = assembly.name(stage);
  row.how = to_text(taken.way.kind);
  StageTask task(assembly, stage, o.shortening.seed);
  tools::CorneredMotion motion = taken.way.motion;
  std::ranges::reverse(motion.corners);
  // The same to rounding.
  motion.corners.front() = task.way->part().grip_pose(task.start_wa);
  motion.corners.back() = task.way->part().grip_pose(task.goal_wa);
  for (std::size_t k = 1; k < motion.corners.size(); ++k) {
    if (task.way->prover().prove(motion.corners[k - 1], motion.corners[k], kAgainHalvings))
      continue;
    row.failure =
        "the way on which it was taken out is not proved in the scene compiled for the order: it "
        "is "
        "a question of rounding";
    return row;
  }
  finish(task.view, *task.way, motion, o, file, row);
  return row;
}

}  // namespace

int plan_stages(const StageRequest& o, const std::string& which) {
  if (o.out.empty())
    throw tools::UsageError("--out: is empty; name the plan, or the folder, to write");
  const OpenedFile scene(o.scene);
  const tools::AssemblyStages assembly(scene.view, o.scene);
  const std::optional<std::size_t> one = stage_number(which, assembly.stages().size(), o.scene);
  if (one) {
    tools::claim_output(o.out, "--out", {tools::FileFormat::kPlan, {}});
  } else {
    tools::claim_folder(o.out, "--out", {"*.plan"});
  }
  std::vector<StageRow> rows;
  for (std::size_t k = one ? *one - 1 : 0; k < (one ? *one : assembly.stages().size()); ++k) {
    const std::string file =
        one ? o.out : (std::filesystem::path(o.out) / plan_name(k + 1)).string();
    rows.push_back(plan_stage(assembly, k, o, file));
    if (!rows.back().text.empty())
      tools::write_files({{file, std::as_bytes(std::span(rows.back().text))}});
  }
  return say_rows(rows, o.json, {{"scene", o.scene}});
}

int plan_order(const StageRequest& o) {
  if (o.out.empty()) throw tools::UsageError("--out: is empty; name the folder to write");
  const OpenedFile scene(o.scene);
  const tools::AssemblyStages assembly(scene.view, o.scene);
  const PartScenes& parts = assembly.parts();
  const Assembled state = assembled_state(assembly, o.scene);
  const AssemblyFile file(o.scene_file.empty()
                              ? std::filesystem::path(o.scene).replace_extension(".toml").string()
                              : o.scene_file,
                          parts);
  tools::claim_folder(o.out, "--out", {"assembly.toml", "assembly.rtscene", "*.plan"});
  tools::DisassemblyLimits limits;
  limits.seconds = o.seconds;
  limits.seed = o.shortening.seed;
  const tools::Disassembly found = tools::take_apart(
      parts, state.places, state.movable, limits,
      [](const std::string& line) { std::fprintf(stderr, "host_sim plan: %s\n", line.c_str()); });
  if (!found.is_whole()) return say_stuck(parts, found, o);

  std::vector<OrderedPart> order;
  for (auto taken = found.taken.rbegin(); taken != found.taken.rend(); ++taken)
    order.push_back({std::string(parts.name(taken->part)), taken->removed, taken->assembled});
  const CompiledOrder compiled = compile_order(file, order);
  SceneView view;
  if (SceneView::open(compiled.bytes.span(), view) != RtStatus::kOk)
    throw tools::InputError("the scene of the order does not open");
  const tools::AssemblyStages stages(view, o.scene);
  std::vector<StageRow> rows;
  std::vector<std::optional<tools::GuideTables>> guides(stages.parts().count());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const tools::TakenPart& taken = found.taken[order.size() - 1 - k];
    rows.push_back(plan_again(stages, k, taken, o, plan_name(k + 1)));
    for (const tools::SettledPart& settled : found.settled)
      if (settled.part == taken.part) rows.back().settled_m = settled.moved_m;
    if (rows.back().text.empty()) continue;
    const tools::SceneBytes alone = stages.scene_at(k);
    SceneView of;
    if (SceneView::open(alone.span(), of) != RtStatus::kOk) continue;
    guides[stages.stages()[k].part] =
        tools::guide_tables(of, tools::parse_plan(rows.back().text, plan_name(k + 1)));
  }
  const bool is_proved =
      std::ranges::all_of(rows, [](const StageRow& r) { return r.failure.empty(); });
  const std::filesystem::path folder(o.out);
  const std::string text = file.with_order(order, is_proved);
  const std::vector<std::byte> guided = tools::with_guides(view, guides);
  std::vector<tools::PendingFile> files{{folder / "assembly.toml", std::as_bytes(std::span(text))},
                                        {folder / "assembly.rtscene", std::span(guided)}};
  for (const StageRow& row : rows) {
    if (!row.text.empty())
      files.push_back({folder / plan_name(row.number), std::as_bytes(std::span(row.text))});
  }
  tools::write_files(files);
  Json names = Json::array();
  std::string said;
  for (const OrderedPart& part : order) {
    names.push_back(part.name);
    said += (said.empty() ? "" : ", ") + part.name;
  }
  if (!o.json) {
    std::printf("%s: order %s, found in %.1f s\n", (folder / "assembly.toml").string().c_str(),
                said.c_str(), found.seconds);
  }
  return say_rows(rows, o.json, {{"scene", o.scene}, {"order", names}, {"seconds", found.seconds}});
}

}  // namespace haptic::sim
