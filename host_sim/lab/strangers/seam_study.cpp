// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "host_sim/lab/strangers/part_studies.hpp"
#include "host_sim/lab/strangers/tried_scene.hpp"
#include "host_sim/lab/surface_fuzz/fuzz_meshes.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;
using tools::formatted;

constexpr double kSide_m = 0.012, kStiffness_n_per_m = 800, kPress_n = 1.6;
constexpr double kPlate_m = 0.05;
/// Up to this a step may not be felt, but for what climbing it stores in the spring; from that on
/// it holds the part. Between them lies `climb_m`.
constexpr double kNoStep_m = 4e-6, kStep_m = 10e-6;
constexpr double kBump_n = 0.12, kWall_n = 1;
/// Seam at x = 0; the part begins here, and goes on for the way.
constexpr double kBefore_m = 0.001, kSlowWay_m = 0.004, kWay_m = 0.016, kSlow_m_per_s = 0.005;
constexpr double kLift_m = 0.001, kApproach_s = 0.1;

enum class Ground : std::uint8_t { kParts, kSheets, kTorn };
constexpr const char* kGrounds[] = {"parts", "sheets", "torn"};

struct SeamCell {
  Ground ground;
  double step_m, friction;
};

/// A plate of triangles on a grid, every one on its own, up and down by half a step.
FuzzMesh torn_plate(double step_m) {
  FuzzMesh mesh{"torn", {}, {}, false};
  constexpr int kCells = 10;
  Seeded random(7);
  const auto at = [](int k) { return kPlate_m * (2.0 * k / kCells - 1); };
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const double x0 = at(i), x1 = at(i + 1), y0 = at(j), y1 = at(j + 1);
      const double corners[2][3][2] = {{{x0, y0}, {x1, y0}, {x1, y1}},
                                       {{x0, y0}, {x1, y1}, {x0, y1}}};
      for (const auto& triangle : corners) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        // All steps are of this height; at the seam the second half is the higher one.
        const double z =
            step_m * ((i >= kCells / 2 ? 1 : 0) + (random.below(2) == 0 ? 0 : -1)) * 0.5;
        for (const auto& corner : triangle) mesh.vertices.emplace_back(corner[0], corner[1], z);
        mesh.triangles.push_back({first, first + 1, first + 2});
      }
    }
  }
  return mesh;
}

FuzzMesh sheet(double x0, double x1, double z) {
  FuzzMesh mesh{"sheet", {}, {}, false};
  for (const auto& [x, y] :
       {std::pair{x0, -kPlate_m}, {x1, -kPlate_m}, {x1, kPlate_m}, {x0, kPlate_m}})
    mesh.vertices.emplace_back(x, y, z);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TriedScene seam_scene(const SeamCell& cell, double speed_m_per_s) {
  std::string text = "format = 1\nname = \"seam\"\n[moving]\n";
  append_line(
      text,
      "shape = \"box\"\nsize_m = [%g, %g, %g]\nposition_m = [%.9g, 0, %.9g]\nmaterial = \"part\"",
      kSide_m, kSide_m, kSide_m, -kSide_m / 2 - kBefore_m, kSide_m / 2 + kLift_m);
  static_cast<void>(speed_m_per_s);
  std::vector<OutputText> files;
  const auto add_mesh = [&](const char* name, const FuzzMesh& mesh) {
    append_line(text, "[[static]]\nmesh = \"%s\"\nscale_to_m = 1\nmaterial = \"ground\"", name);
    files.push_back({name, obj_text(mesh)});
  };
  switch (cell.ground) {
    case Ground::kParts:
      for (const double side : {-1.0, 1.0}) {
        append_line(text,
                    "[[static]]\nshape = \"box\"\nsize_m = [%g, %g, 0.02]\nposition_m = [%g, 0, "
                    "%.17g]\nmaterial = \"ground\"",
                    kPlate_m, 2 * kPlate_m, side * kPlate_m / 2,
                    -0.01 + (side > 0 ? cell.step_m : 0));
      }
      break;
    case Ground::kSheets:
      add_mesh("low.obj", sheet(-kPlate_m, 0, 0));
      add_mesh("high.obj", sheet(0, kPlate_m, cell.step_m));
      break;
    case Ground::kTorn:
      add_mesh("torn.obj", torn_plate(cell.step_m));
      break;
  }
  append_line(text, "[rendering]\nk_f_n_per_m = %g", kStiffness_n_per_m);
  if (cell.friction > 0)
    append_line(text, "[[friction]]\nmaterials = [\"part\", \"ground\"]\nmu = %g", cell.friction);
  return {text, files};
}

/// Down onto the ground, pressed, over the seam at this speed.
std::vector<MotionSample> over_the_seam(double speed_m_per_s, std::size_t& begin) {
  std::vector<MotionSample> motion;
  const double from = -kSide_m / 2 - kBefore_m, top = kSide_m / 2 + kLift_m;
  const double pressed = kSide_m / 2 - kPress_n / kStiffness_n_per_m;
  const auto approach = static_cast<int>(1e3 * kApproach_s);
  const auto add = [&](double x, double z) {
    motion.push_back(sample_at(1e-3 * static_cast<double>(motion.size()),
                               {x, 0.0003 * (x - from) / kSide_m, z}, Rotation::Identity()));
  };
  for (int k = 0; k < approach; ++k) add(from, top + (pressed - top) * k / (approach - 1));
  for (int k = 0; k < approach / 2; ++k) add(from, pressed);
  begin = motion.size();
  const double way = speed_m_per_s < kSlow_m_per_s ? kSlowWay_m : kWay_m;
  for (double x = 0; x < way; x += 1e-3 * speed_m_per_s) add(from + x, pressed);
  return motion;
}

struct SeamRun {
  double along_n = 0;  ///< largest force against the way, less the friction that the press makes
  double least_press_n = 0;
  std::size_t over = 0;  ///< most ticks in a row with more than a seam may give
  std::size_t recovery = 0, stuck = 0, behind = 0;
};

SeamRun seam_run(TriedScene& scene, const SeamCell& cell, double speed_m_per_s) {
  std::size_t begin = 0;
  const std::vector<PlayedTick> ticks = scene.play(over_the_seam(speed_m_per_s, begin));
  SeamRun run;
  run.least_press_n = kPress_n;
  std::size_t in_a_row = 0;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    const PlayedTick& tick = ticks[k];
    run.recovery += (tick.flags & kFlagRecovery) != 0 ? 1u : 0u;
    run.stuck += (tick.flags & kFlagProxyStuck) != 0 ? 1u : 0u;
    run.behind += (tick.flags & kFlagBehind) != 0 ? 1u : 0u;
    if (k < begin) continue;
    const double along = -tick.force_n[0] - cell.friction * std::abs(tick.force_n[2]);
    run.along_n = std::max(run.along_n, along);
    in_a_row = along > kBump_n ? in_a_row + 1 : 0;
    run.over = std::max(run.over, in_a_row);
    run.least_press_n = std::min(run.least_press_n, tick.force_n[2]);
  }
  return run;
}

}  // namespace

PartReport seam_study(const StudySize& size, const RunOptions& options) {
  using List = std::vector<double>;
  const List steps =
      size.is_short ? List{0, 20e-9, 1e-6, 10e-6} : List{0,      1e-9, 5e-9, 10e-9, 20e-9, 73e-9,
                                                         200e-9, 1e-6, 2e-6, 5e-6,  10e-6, 100e-6};
  const List speeds = size.is_short ? List{0.05} : List{0.001, 0.01, 0.05, 0.1, 0.3};
  std::vector<SeamCell> cells;
  for (const Ground ground : {Ground::kParts, Ground::kSheets, Ground::kTorn}) {
    for (const double friction : size.is_short ? List{0} : List{0, 0.3}) {
      for (const double step : steps) cells.push_back({ground, step, friction});
    }
  }
  std::vector<std::vector<SeamRun>> runs(cells.size());
  run_shards(
      cells.size(), options, "seams", [] { return 0; },
      [&](int, std::size_t k) {
        TriedScene scene = seam_scene(cells[k], speeds[0]);
        for (const double speed : speeds) {
          runs[k].push_back(seam_run(scene, cells[k], speed));
          // A wall that nobody made; or a step that is not felt.
          if (size.fault == StrangerFault::kWall && cells[k].step_m < kNoStep_m)
            runs[k].back().over = kPassingTicks + 1;
        }
      });
  PartReport report;
  report.title = "Seams and steps";
  ReportTable table(
      "ground,friction,step_nm,speed_mm_per_s,along_n,over_ticks,least_press_n,stuck,behind,"
      "recovery,verdict");
  std::map<std::pair<std::string, double>, double> first_step;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const SeamCell& cell = cells[k];
    const std::string ground = kGrounds[static_cast<std::size_t>(cell.ground)];
    for (std::size_t s = 0; s < speeds.size(); ++s) {
      const SeamRun& run = runs[k][s];
      // A cone that leans over the step hops over it; that is right with friction.
      const bool wall = cell.step_m <= kNoStep_m && run.over > kPassingTicks;
      const bool gone = cell.step_m >= kStep_m && cell.friction == 0 &&
                        cell.ground != Ground::kTorn && run.along_n < kWall_n;
      const bool away = run.recovery > 0;
      const char* verdict = wall ? "WALL" : gone ? "NO STEP" : away ? "RECOVERY" : "right";
      report.passed = report.passed && !wall && !gone && !away;
      table.add({ground, shown_as("%g", cell.friction), shown_as("%g", 1e9 * cell.step_m),
                 shown_as("%g", 1e3 * speeds[s]), shown_as("%.4f", run.along_n), run.over,
                 shown_as("%.4f", run.least_press_n), run.stuck, run.behind, run.recovery,
                 verdict});
      double& first = first_step.try_emplace({ground, cell.friction}, HUGE_VAL).first->second;
      if (run.along_n > kWall_n) first = std::min(first, cell.step_m);
    }
  }
  report.markdown = formatted(
      "A cube of 12 mm, pressed with %g N, is drawn over a seam. Along: the largest force against "
      "the way, less the friction of the press. Up to %g um a seam may give more than %g N for two "
      "ticks at most; from %g um on a "
      "step must hold the part without friction (%g N).\n\n",
      kPress_n, 1e6 * kNoStep_m, kBump_n, 1e6 * kStep_m, kWall_n);
  for (const auto& [of, step] : first_step) {
    report.markdown +=
        std::isfinite(step)
            ? formatted("- %s, friction %g: the lowest step that holds the part is %g um\n",
                        of.first.c_str(), of.second, 1e6 * step)
            : formatted("- %s, friction %g: no step held the part\n", of.first.c_str(), of.second);
  }
  report.markdown += "\n" + table.markdown();
  report.files = {{"seams.csv", table.csv()}};
  return report;
}

}  // namespace haptic::sim
