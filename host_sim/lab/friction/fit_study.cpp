// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "host_sim/lab/friction/fit_scenes.hpp"
#include "host_sim/lab/friction/friction_studies.hpp"
#include "host_sim/lab/strangers/tried_scene.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kPressed_s = 0.2, kBegin_s = 0.4;
/// Once the spring is stretched by friction the part slides for so long, but no farther and no less
/// far than this.
constexpr double kSlide_s = 0.8, kMost_m = 0.04, kLeast_m = 0.004;
/// Part of that way over which the force is judged, and by how much it may be off.
constexpr double kFrom = 0.5, kTo = 0.95, kOff = 0.05;
constexpr double kMostBehind = 1e-3;
constexpr double kTooMuch = 1.25;
constexpr std::uint32_t kFewUnits = 50;

struct FitSetting {
  FitKind kind;
  double clearance_m, friction;
  std::uint32_t passes;
};

struct FitCell {
  FitSetting setting{};
  double speed_m_per_s = 0, press_n = 0;
  double right_n = 0, least_n = 0, most_n = 0;  ///< along the way
  std::size_t ticks = 0, behind = 0;
  double wound_up_n = 0;  ///< the largest of them above what is right
  bool locks = false;

  [[nodiscard]] double off() const {
    return std::max(std::abs(least_n - right_n), std::abs(most_n - right_n)) / right_n;
  }
  [[nodiscard]] bool right() const { return locks || off() <= kOff; }
};

std::vector<FitSetting> settings_of(bool is_short) {
  std::vector<double> clearances{1e-6, 1e-5, 1e-4, 1e-3}, frictions{0.05, 0.1, 0.3, 0.6, 1};
  std::vector<std::uint32_t> passes{1, 3, 5};
  if (is_short) {
    clearances = {1e-5};
    frictions = {0.05, 0.6};
    passes = {1, 3};
  }
  std::vector<FitSetting> settings;
  for (const FitKind kind : kFitKinds) {
    const bool has_room = kind != FitKind::kVee15 && kind != FitKind::kVee45;
    for (std::size_t c = 0; c < (has_room ? clearances.size() : 1); ++c) {
      for (const double friction : frictions) {
        for (const std::uint32_t n : passes) settings.push_back({kind, clearances[c], friction, n});
      }
    }
  }
  return settings;
}

FitCell run_cell(TriedScene& tried, const FitScene& fit, FitCell cell) {
  cell.right_n = cell.setting.friction * fit.normal_share * cell.press_n;
  const double stretch_m = cell.right_n / kFitStiffness_n_per_m;
  const double way_m = std::clamp(kSlide_s * cell.speed_m_per_s, kLeast_m, kMost_m);
  const double slips_s = kBegin_s + stretch_m / cell.speed_m_per_s;
  const double slides_s = way_m / cell.speed_m_per_s;
  const Vector pressed = fit.reach_w + cell.press_n / kFitStiffness_n_per_m * fit.press_w;
  std::vector<MotionSample> motion;
  for (double t = 0; t < slips_s + slides_s; t += 1e-3) {
    const double slid = cell.speed_m_per_s * std::max(t - kBegin_s, 0.0) - way_m / 2;
    motion.push_back(sample_at(t, std::min(t / kPressed_s, 1.0) * pressed + slid * fit.slide_w,
                               Rotation::Identity()));
  }
  const std::vector<PlayedTick> ticks = tried.play(motion);
  cell.least_n = 1e9;
  cell.most_n = -1e9;
  for (std::size_t k = 0; k < ticks.size(); ++k) {
    const double t = motion[k].t_s;
    const double along_n = -ticks[k].force_n.dot(fit.slide_w);
    cell.ticks += 1;
    if ((ticks[k].flags & kFlagBehind) != 0) {
      cell.behind += 1;
      cell.wound_up_n = std::max(cell.wound_up_n, along_n - cell.right_n);
    }
    if (t < slips_s + kFrom * slides_s || t > slips_s + kTo * slides_s) continue;
    cell.least_n = std::min(cell.least_n, along_n);
    cell.most_n = std::max(cell.most_n, along_n);
  }
  return cell;
}

std::vector<FitCell> run_setting(const FitSetting& setting, const FrictionSize& size) {
  const std::vector<double> speeds =
      size.is_short ? std::vector<double>{0.005, 0.3} : std::vector<double>{0.005, 0.05, 0.1, 0.3};
  const std::vector<double> presses =
      size.is_short ? std::vector<double>{1} : std::vector<double>{0.2, 1, 5};
  const bool more = size.fault == FrictionFault::kCoefficient;
  const FitScene fit = fit_scene(setting.kind, setting.clearance_m);
  TriedScene tried(
      scene_text(fit.text, kFitStiffness_n_per_m, setting.friction * (more ? kTooMuch : 1),
                 setting.passes, size.units(kFewUnits)),
      fit.files);
  std::vector<FitCell> cells;
  for (const double speed : speeds) {
    for (const double press : presses) {
      FitCell cell;
      cell.setting = setting;
      cell.speed_m_per_s = speed;
      cell.press_n = press;
      cell.locks = setting.friction >= fit.locks_at;
      cells.push_back(run_cell(tried, fit, cell));
    }
  }
  return cells;
}

}  // namespace

FrictionFault friction_fault_named(const std::string& name) {
  if (name == "coefficient") return FrictionFault::kCoefficient;
  if (name == "budget") return FrictionFault::kBudget;
  if (name == "creep") return FrictionFault::kCreep;
  if (name == "late") return FrictionFault::kLate;
  throw tools::UsageError("--fault " + name + ": give coefficient, budget, creep or late");
}

PartReport fit_study(const FrictionSize& size, const RunOptions& options) {
  const std::vector<FitSetting> settings = settings_of(size.is_short);
  std::vector<std::vector<FitCell>> found(settings.size());
  run_shards(
      settings.size(), options, "fits", [] { return 0; },
      [&](int, std::size_t k) { found[k] = run_setting(settings[k], size); });
  PartReport report;
  report.title = "Friction in tight fits";
  ReportTable table(
      "fit,clearance_m,friction,passes,speed_m_per_s,press_n,right_n,least_n,most_n,off_percent,"
      "ticks,behind_ticks,wound_up_n,locks,right");
  report.markdown = table_head({"fit", "cells", "locking", "wrong", "largest error, %",
                                "ticks behind, per 1000", "wound up, N"});
  std::size_t wrong = 0, ticks = 0, behind = 0;
  for (const FitKind kind : kFitKinds) {
    std::size_t count = 0, locks = 0, bad = 0, own_ticks = 0, own_behind = 0;
    double off = 0, wound_up_n = 0;
    for (const auto& cells : found) {
      for (const FitCell& c : cells) {
        if (c.setting.kind != kind) continue;
        count += 1;
        locks += c.locks ? 1u : 0u;
        bad += c.right() ? 0u : 1u;
        off = c.locks ? off : std::max(off, c.off());
        own_ticks += c.ticks;
        own_behind += c.behind;
        wound_up_n = c.locks ? wound_up_n : std::max(wound_up_n, c.wound_up_n);
        table.add({fit_name(kind), c.setting.clearance_m, c.setting.friction, c.setting.passes,
                   c.speed_m_per_s, c.press_n, c.right_n, c.least_n, c.most_n, 100 * c.off(),
                   c.ticks, c.behind, c.wound_up_n, yes_or_no(c.locks), yes_or_no(c.right())});
      }
    }
    report.markdown +=
        table_row({fit_name(kind), std::to_string(count), std::to_string(locks),
                   std::to_string(bad), fixed(100 * off, 3),
                   fixed(1e3 * static_cast<double>(own_behind) / static_cast<double>(own_ticks), 3),
                   short_number(wound_up_n, 3)});
    wrong += bad;
    ticks += own_ticks;
    behind += own_behind;
  }
  const double share = static_cast<double>(behind) / static_cast<double>(ticks);
  report.passed = wrong == 0 && share <= kMostBehind;
  report.markdown += tools::formatted(
      "\n%zu wrong: more than %g %% off Coulomb's force over the second half of the way. %zu of "
      "%zu "
      "ticks behind. Locking: between walls that stand at no more than the angle of friction to "
      "each other statics allows any force along them.\n",
      wrong, 100 * kOff, behind, ticks);
  report.files = {{"fits.csv", table.csv()}};
  return report;
}

}  // namespace haptic::sim
