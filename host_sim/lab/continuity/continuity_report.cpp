// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/continuity/continuity_report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host_sim/report/output_file.hpp"
#include "host_sim/report/report_table.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

namespace {

/// The runs of one law, a row each.
void add_rows(ReportTable& table, const ContactPath& path, std::span<const PathRun> runs) {
  for (std::size_t k = 0; k < runs.size(); ++k)
    table.add({path.name, law_name(runs[k].law), runs[k].steps, runs[k].largest_torque_step_nm,
               runs[k].largest_force_step_n, ratio_to_previous(runs, k)});
}

constexpr const char* kColumns =
    "path,law,steps,largest_torque_step_nm,largest_force_step_n,ratio_to_previous";

nlohmann::ordered_json to_json(const ContactPath& path, std::span<const PathRun> runs) {
  ReportTable table(kColumns);
  add_rows(table, path, runs);
  return table.json({"path", "law"});
}

/// "82 / 82 / 82": the runs of one law.
std::string steps_text(std::span<const PathRun> runs) {
  std::string text;
  for (const PathRun& run : runs)
    text += (text.empty() ? "" : " / ") + short_number(1e3 * run.largest_torque_step_nm, 3);
  return text;
}

std::string counts_text(std::span<const PathRun> runs) {
  std::string text;
  for (const PathRun& run : runs) text += (text.empty() ? "" : " / ") + std::to_string(run.steps);
  return text;
}

/// Least ratio among those that decide; "-" where nothing moves.
std::string deciding_ratio(std::span<const PathRun> runs, std::uint32_t fine_steps) {
  double least = 0;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    const double ratio = ratio_to_previous(runs, k);
    if (runs[k].steps >= fine_steps && ratio > 0)
      least = least > 0 ? std::min(least, ratio) : ratio;
  }
  return least > 0 ? fixed(least, 2) : "-";
}

}  // namespace

PathRun run_path(const ContactPath& path, LawId law, std::uint32_t steps) {
  const std::vector<std::byte> scene =
      scene_of(path.a, {&path.b, 1}, kPathStiffness_n_per_m, kPathEpsilon_m, law);
  CoreSession session(scene, path.name);
  PathRun run;
  run.law = law;
  run.steps = steps;
  Vector last_force = Vector::Zero(), last_torque = Vector::Zero();
  for (std::uint32_t k = 0; k <= steps; ++k) {
    const double s = static_cast<double>(k) / steps;
    const PathPose pose = path.pose(s);
    StepInput input;
    input.sequence = k;
    input.pose_wa = pose_at(pose.p, pose.q);
    const StepResult result = session.core().step(input);
    if (result.status != RtStatus::kOk)
      throw tools::InputError(path.name + ": a pose is refused: " + to_text(result.status));
    const Vector force = result.wrench_w.force_w.cast<double>();
    const Vector torque = result.wrench_w.torque_w.cast<double>();
    if (k > 0) {
      run.largest_force_step_n = std::max(run.largest_force_step_n, (force - last_force).norm());
      const double torque_step_nm = (torque - last_torque).norm();
      if (torque_step_nm > run.largest_torque_step_nm) {
        run.largest_torque_step_nm = torque_step_nm;
        run.largest_torque_step_at = s;
        run.largest_torque_step_w = torque - last_torque;
      }
    }
    last_force = force;
    last_torque = torque;
    run.parameter.push_back(s);
    run.torque_w.push_back(torque);
  }
  return run;
}

std::vector<PathResult> run_paths(bool quick) {
  std::vector<PathResult> results;
  for (const ContactPath& path : contact_paths()) {
    std::vector<std::uint32_t> steps = {250, 1000, 4000, 16000};
    if (quick) steps = {path.fine_steps / 4, path.fine_steps};
    PathResult result{path, {}, {}};
    for (const std::uint32_t count : steps) {
      result.paper.push_back(run_path(path, LawId::kPaper, count));
      result.weighted.push_back(run_path(path, LawId::kWeightedRegion, count));
    }
    results.push_back(std::move(result));
  }
  return results;
}

double ratio_to_previous(std::span<const PathRun> runs, std::size_t k) {
  if (k == 0 || runs[k].largest_torque_step_nm < kStillTorque_nm) return 0;
  return runs[k - 1].largest_torque_step_nm / runs[k].largest_torque_step_nm;
}

bool settles(std::span<const PathRun> runs, std::uint32_t fine_steps) {
  bool looked = false, settled = true;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    if (runs[k].steps < fine_steps) continue;
    looked = true;
    settled = settled && (runs[k].largest_torque_step_nm < kStillTorque_nm ||
                          ratio_to_previous(runs, k) >= kLeastRatio);
  }
  return looked && settled;
}

std::string continuity_csv(std::span<const PathResult> results) {
  ReportTable table(kColumns);
  for (const PathResult& result : results) {
    add_rows(table, result.path, result.paper);
    add_rows(table, result.path, result.weighted);
  }
  return table.csv();
}

std::string continuity_json(std::span<const PathResult> results) {
  nlohmann::ordered_json json;
  json["stiffness_n_per_m"] = kPathStiffness_n_per_m;
  json["depth_m"] = kPathDepth_m;
  json["epsilon_m"] = kPathEpsilon_m;
  json["least_ratio"] = kLeastRatio;
  json["still_torque_nm"] = kStillTorque_nm;
  json["passed"] = continuous(results);
  for (const PathResult& result : results) {
    nlohmann::ordered_json path;
    path["name"] = result.path.name;
    path["title"] = result.path.title;
    path["fine_steps"] = result.path.fine_steps;
    path["weighted_region_settles"] = settles(result.weighted, result.path.fine_steps);
    path["paper_settles"] = settles(result.paper, result.path.fine_steps);
    path["paper"] = to_json(result.path, result.paper);
    path["weighted_region"] = to_json(result.path, result.weighted);
    json["paths"].push_back(path);
  }
  return json.dump(2) + "\n";
}

std::string continuity_page(std::span<const PathResult> results) {
  std::string page =
      "# Continuity of the contact laws\n\n"
      "Made by `host_sim continuity --out DIR`: the core runs over six smooth paths, cubes of "
      "0.1 m, k_F 1000 N/m, depth 1 mm (1 N on one face; up to 1.7 mm on the last path), epsilon = "
      "epsilon_o = 0.5 mm. Each path is cut into equal steps, coarse to fine. Largest change of "
      "the torque per step, mN m; a law without jumps brings it down by four when the steps are "
      "four times smaller, a jump stays. The least ratio from the fine steps on decides; a law "
      "settles when it is " +
      fixed(kLeastRatio, 0) + " or more, or when nothing moves.\n\n" +
      table_head({"path", "steps", "paper", "weighted region", "fine from", "ratio, paper",
                  "ratio, weighted", "weighted settles"});
  for (const PathResult& r : results) {
    page += table_row({r.path.title, counts_text(r.weighted), steps_text(r.paper),
                       steps_text(r.weighted), std::to_string(r.path.fine_steps),
                       deciding_ratio(r.paper, r.path.fine_steps),
                       deciding_ratio(r.weighted, r.path.fine_steps),
                       yes_or_no(settles(r.weighted, r.path.fine_steps))});
  }
  page +=
      "\nA contact comes and goes while its depth differs from D_near by less than epsilon. The "
      "general motion turns so fast that 4000 steps give that only a few steps, so there 4000 "
      "against 16000 decides.\n\n" +
      picture_line("continuity.svg", "Largest torque step over the number of steps");
  for (const PathResult& r : results) {
    page += "\n## " + r.path.name + ": " + r.path.title + "\n\n" +
            picture_line(r.path.name + ".svg", "Torque over the path");
  }
  return page;
}

std::vector<OutputText> continuity_files(std::span<const PathResult> results) {
  std::vector<OutputText> files = {{"continuity.csv", continuity_csv(results)},
                                   {"continuity.json", continuity_json(results)},
                                   {"continuity.svg", step_picture(results)},
                                   {"README.md", continuity_page(results)}};
  for (const PathResult& result : results)
    files.push_back({result.path.name + ".svg", torque_picture(result)});
  return files;
}

bool continuous(std::span<const PathResult> results) {
  return !results.empty() && std::all_of(results.begin(), results.end(), [](const PathResult& r) {
    return settles(r.weighted, r.path.fine_steps);
  });
}

}  // namespace haptic::sim
