// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/surface_fuzz/surface_campaign.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "host_sim/session/motion_csv.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// Ticks of a run, without its rest.
constexpr std::uint64_t kShardTicks = 2000;
/// With one pass in a tick the way of the tick is the way of the pass.
constexpr std::uint32_t kPasses[] = {kDefaultProxyPasses, 1};

constexpr NamedCount<SurfaceTotals> kFigures[] = {
    {"ways", &SurfaceTotals::ways},
    {"unproven_parts", &SurfaceTotals::unproven},
    {"meeting_ticks", &SurfaceTotals::meeting},
    {"behind_ticks", &SurfaceTotals::behind},
    {"longest_arrival", &SurfaceTotals::longest_arrival}};

std::string csv(const SurfaceFuzzResult& result) {
  std::string columns =
      "scene,moving_triangles,fixed_triangles,friction,motion,passes,ticks,held,worst_gap_m,worst_"
      "way_m,largest_rise_j,largest_rest_gap_m";
  columns += column_names(counts_of(kSurfaceMustBeZero, {}));
  columns += column_names(counts_of(kFigures, {}));
  ReportTable table(columns);
  for (const SurfaceFuzzRow& row : result.rows) {
    const SurfaceTotals& t = row.totals;
    std::vector<Cell> cells{quoted(row.scene),
                            row.moving,
                            row.fixed,
                            row.friction,
                            row.motion,
                            row.passes,
                            t.ticks,
                            t.held,
                            number_text(t.worst_gap_m),
                            number_text(t.worst_way_m),
                            number_text(t.largest_rise_j),
                            number_text(t.largest_rest_gap_m)};
    append_cells(cells, counts_of(kSurfaceMustBeZero, t));
    append_cells(cells, counts_of(kFigures, t));
    table.add(std::move(cells));
  }
  return table.csv();
}

nlohmann::ordered_json json(const SurfaceFuzzResult& result) {
  const SurfaceTotals t = result.totals();
  nlohmann::ordered_json j;
  j["seed"] = result.size.seed;
  j["ticks"] = t.ticks;
  j["held_ticks"] = t.held;
  j["passed"] = t.failed() == 0;
  for (const auto& [name, count] : counts_of(kSurfaceMustBeZero, t))
    j["must_be_zero"][name] = count;
  j["worst_gap_m"] = static_cast<double>(t.worst_gap_m);
  j["worst_way_gap_m"] = static_cast<double>(t.worst_way_m);
  j["largest_rise_j"] = static_cast<double>(t.largest_rise_j);
  j["largest_rest_gap_m"] = static_cast<double>(t.largest_rest_gap_m);
  for (const auto& [name, count] : counts_of(kFigures, t)) j[name] = count;
  j["failures"] = t.failures.lines();
  return j;
}

/// Rows of one scene together.
std::string scene_table(const SurfaceFuzzResult& result) {
  ReportTable table(
      "scene,triangles,ticks,held,worst gap um,on the way um,ticks that meet,behind,longest "
      "arrival,failures");
  struct Key {
    std::string scene;
    std::size_t moving, fixed;
    bool operator==(const Key&) const = default;
  };
  Groups<Key, SurfaceTotals> groups;
  for (const SurfaceFuzzRow& row : result.rows)
    groups.at({row.scene, row.moving, row.fixed}).add(row.totals);
  for (const auto& [first, t] : groups.list()) {
    const std::uint64_t held = 100 * t.held / std::max<std::uint64_t>(t.ticks, 1);
    table.add({first.scene, std::to_string(first.moving) + " x " + std::to_string(first.fixed),
               t.ticks, std::to_string(held) + " %", number_text(t.worst_gap_m * 1e6L),
               number_text(t.worst_way_m * 1e6L), t.meeting, t.behind, t.longest_arrival,
               t.failed()});
  }
  return table.markdown();
}

/// A scene of the campaign, compiled for one friction and number of passes.
struct Subject {
  std::string name, label;
  double friction = 0, share = 1;
  std::uint32_t passes = 0;
  const SurfaceScene* scene = nullptr;  ///< null: the user's file
  SurfaceMotion::Surroundings way{Vector::Zero(), Vector::UnitZ(), 0, 0};
  CompiledSurface compiled;
};

std::vector<Subject> subjects_of(const SurfaceFuzzSize& size,
                                 const std::vector<SurfaceScene>& scenes) {
  std::vector<Subject> subjects;
  const auto add = [&](Subject subject) {
    for (const std::uint32_t passes : kPasses) {
      subject.passes = passes;
      subject.label = subject.name + ", friction " + number_text(widen(subject.friction)) + ", " +
                      std::to_string(passes) + (passes == 1 ? " pass" : " passes");
      subjects.push_back(subject);
    }
  };
  Subject subject;
  if (!size.scene_file.empty()) {
    subject.name = size.scene_file;
    add(subject);
    return subjects;
  }
  for (const SurfaceScene& scene : scenes) {
    for (const double friction : size.frictions) {
      subject.name = scene.name;
      subject.friction = friction;
      subject.share = scene.share;
      subject.scene = &scene;
      subject.way = {scene.through_at, scene.through_axis, 0, 0};
      add(subject);
    }
  }
  return subjects;
}

}  // namespace

SurfaceFuzzResult run_surface_fuzz(const SurfaceFuzzSize& size, const RunOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const bool closed_only = size.as != PartKind::kSurface;
  std::vector<SurfaceScene> scenes;
  if (size.scene_file.empty()) {
    scenes = surface_scenes(size.scenes.value_or(fixed_surface_scenes(closed_only)), size.seed,
                            closed_only);
  }
  for (SurfaceScene& scene : scenes) scene.part_as = scene.around_as = size.as;
  std::vector<Subject> subjects = subjects_of(size, scenes);
  double shares = 0;
  for (const Subject& subject : subjects) shares += subject.share;
  std::vector<MotionSample> given;
  if (!size.motion_file.empty()) given = read_played_motion(size.motion_file);
  const std::size_t kinds = given.empty() ? std::size(kSurfaceMotions) : 1;
  const double per_share = static_cast<double>(size.ticks) / (shares * static_cast<double>(kinds));
  Campaign<SurfaceFuzzRow> campaign;
  for (const Subject& s : subjects) {
    if (!given.empty()) {
      campaign.add({s.name, size.motion_file, s.friction, s.passes, 0, 0, {}},
                   static_cast<double>(given.size()), given.size());
      continue;
    }
    for (const SurfaceMotionKind kind : kSurfaceMotions) {
      campaign.add({s.name, to_text(kind), s.friction, s.passes, 0, 0, {}}, per_share * s.share,
                   kShardTicks);
    }
  }
  if (size.only && *size.only >= campaign.shards.size()) {
    throw tools::InputError("no run " + std::to_string(*size.only) + "; there are " +
                            std::to_string(campaign.shards.size()) + ", from 0");
  }
  const auto wanted = [&](std::size_t subject) {
    return !size.only || campaign.shards[*size.only].row / kinds == subject;
  };
  run_shards(
      subjects.size(), {options.threads, false}, "scenes", [] { return 0; },
      [&](int, std::size_t k) {
        Subject& s = subjects[k];
        if (!wanted(k)) return;
        s.compiled = s.scene != nullptr ? compiled_surface(*s.scene, s.friction, s.passes)
                                        : compiled_surface(size.scene_file, s.passes);
        for (std::size_t kind = 0; kind < kinds; ++kind) {
          SurfaceFuzzRow& row = campaign.rows[k * kinds + kind];
          row.moving = s.compiled.moving.size();
          row.fixed = s.compiled.fixed.size();
        }
      });
  SurfaceFuzzResult result;
  result.size = size;
  campaign.run<SurfaceRun>(
      options, "surface", [&](auto& kept, const auto& shard, std::size_t number) {
        if (size.only && number != *size.only) return SurfaceTotals{};
        const std::size_t at = shard.row / kinds;
        const Subject& s = subjects[at];
        std::unique_ptr<SurfaceRun>& run = kept[at];
        if (!run) {
          run = std::make_unique<SurfaceRun>(s.compiled, s.way, s.label, size.strict, size.fault);
        }
        if (!given.empty()) return run->run(given);
        return run->run(kSurfaceMotions[shard.row % kinds], shard.count, size.seed, number,
                        size.only ? &result.motion : nullptr);
      });
  result.rows = std::move(campaign.rows);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!size.only) return result;
  std::erase_if(result.rows, [](const SurfaceFuzzRow& row) { return row.totals.ticks == 0; });
  const Subject& s = subjects[campaign.shards[*size.only].row / kinds];
  if (s.scene == nullptr) return result;
  result.files = {{"scene.toml", scene_text(*s.scene, s.friction, s.passes)},
                  {"part.obj", obj_text(s.scene->part)},
                  {"around.obj", obj_text(s.scene->around)}};
  return result;
}

std::string surface_fuzz_page(const SurfaceFuzzResult& result) {
  const SurfaceTotals t = result.totals();
  std::string text = "# The proxy on triangle meshes\n\n";
  text += std::to_string(t.ticks) + " ticks, " + std::to_string(t.held) + " held, seed " +
          std::to_string(result.size.seed) +
          "; every felt pose judged triangle against triangle in long double. Lengths are for a "
          "part of 50 mm.\n\n";
  text += zero_table(counts_of(kSurfaceMustBeZero, t));
  text += "\nWorst gap " + number_text(t.worst_gap_m * 1e6L) + " um at the ends of ticks, " +
          number_text(t.worst_way_m * 1e6L) + " um on the straight ways of " +
          std::to_string(t.ways) + " passes (allowed: the tolerance, -0.1); " +
          std::to_string(t.unproven) +
          " parts of ways were cut down to a fiftieth of it without a proof. Triangles shared a "
          "point in " +
          std::to_string(t.meeting) + " ticks. Largest rise of the energy " +
          number_text(t.largest_rise_j) + " J. At rest at most " +
          number_text(t.largest_rest_gap_m * 1e6L) + " um off what holds the part, after at most " +
          std::to_string(t.longest_arrival) + " ticks.\n\n";
  return text + scene_table(result) + failure_section(t.failures);
}

CampaignEnd surface_fuzz_end(const SurfaceFuzzResult& result) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  const SurfaceTotals t = result.totals();
  std::string said = campaign_line(result.size.seed, t.ticks, t.held, result.seconds) + "\n" +
                     zero_line(counts_of(kSurfaceMustBeZero, t)) + "\n";
  said += tools::formatted(
      "worst gap %.4Lg um, on the ways of %llu passes %.4Lg um (%llu parts unproven), triangles "
      "met in %llu ticks, largest rise %.3Lg J\n",
      t.worst_gap_m * 1e6L, number(t.ways), t.worst_way_m * 1e6L, number(t.unproven),
      number(t.meeting), t.largest_rise_j);
  said += tools::formatted(
      "at rest at most %.4Lg um off, after %llu ticks; ended for want of budget: %llu\n",
      t.largest_rest_gap_m * 1e6L, number(t.longest_arrival), number(t.behind));
  CampaignEnd end{
      said + failure_lines(t.failures),
      campaign_files("surface_fuzz", csv(result), json(result), surface_fuzz_page(result)),
      t.failed() == 0};
  end.files.insert(end.files.end(), result.files.begin(), result.files.end());
  if (!result.motion.empty()) end.files.push_back({"motion.csv", motion_csv(result.motion)});
  return end;
}

}  // namespace haptic::sim
