// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "host_sim/lab/friction/fit_scenes.hpp"
#include "host_sim/lab/friction/friction_studies.hpp"
#include "host_sim/lab/strangers/tried_scene.hpp"

namespace haptic::sim {
namespace {

/// The hand wanders for so many ticks and is stopped at every so many of them; what is felt so many
/// ticks later is to stay.
constexpr std::size_t kWanders = 2600, kFirst = 400, kEvery = 30, kSettles = 30, kRests = 1000;
constexpr double kLeast_n = 0.05, kChange = 0.02, kMostShare = 2e-3;
/// Torques count as forces with this lever.
constexpr double kLever_m = 0.02;
constexpr double kCreep_m = 20e-6;

/// A fit and the hand in it: about a place, by so much along each axis and so much turn.
struct StopScene {
  std::string name, text;
  std::vector<OutputText> files;
  Vector home_m = Vector::Zero(), wander_m = Vector::Zero();
  double wander_rad = 0;
};

std::string tube_text(const char* as) {
  return tools::formatted(
      "[moving]\nshape = \"cylinder\"\nradius_m = 0.005\nheight_m = 0.04\nsegments = 24\nas = "
      "\"%s\"\nposition_m = [0, 0, 0]\nmaterial = \"a\"\n[[static]]\nshape = \"tube\"\n"
      "inner_radius_m = 0.0051\nouter_radius_m = 0.012\nheight_m = 0.03\nsegments = 24\nas = "
      "\"%s\"\nmaterial = \"b\"\n",
      as, as);
}

std::vector<StopScene> stop_scenes() {
  const auto fit = [](const char* name, FitKind kind, double clearance_m, const Vector& home_m,
                      const Vector& wander_m, double wander_rad) {
    const FitScene scene = fit_scene(kind, clearance_m);
    return StopScene{name, scene.text, scene.files, home_m, wander_m, wander_rad};
  };
  std::vector<StopScene> scenes{
      fit("V groove 45", FitKind::kVee45, 0, {0, 0, -8e-4}, {8e-4, 5e-3, 8e-4}, 0.03),
      fit("slot 10 um", FitKind::kSlot, 1e-5, {0, 0, 0}, {8e-4, 4e-3, 4e-3}, 0.03),
      fit("slot 0.1 mm", FitKind::kSlot, 1e-4, {0, 0, 0}, {8e-4, 4e-3, 4e-3}, 0.03),
      fit("square hole 10 um", FitKind::kHole, 1e-5, {0, 0, 0}, {8e-4, 8e-4, 4e-3}, 0.03),
      fit("square hole 1 mm", FitKind::kHole, 1e-3, {0, 0, 0}, {2e-3, 2e-3, 4e-3}, 0.06),
      fit("dovetail 10 um", FitKind::kDovetail, 1e-5, {0, 0, 0}, {5e-4, 4e-3, 8e-4}, 0.02)};
  scenes.push_back({"block on a plate",
                    box_text(true, {0.04, 0.03, 0.02}, Vector::Zero()) +
                        box_text(false, {0.2, 0.2, 0.02}, {0, 0, -0.0201}),
                    {},
                    {0, 0, -5e-4},
                    {4e-3, 4e-3, 1e-3},
                    0.05});
  scenes.push_back({"corner of three",
                    box_text(true, {0.01, 0.02, 0.01}, Vector::Zero()) +
                        box_text(false, {0.02, 0.3, 0.04}, {0.01501, 0, 0}) +
                        box_text(false, {0.06, 0.3, 0.02}, {0, 0, -0.01501}) +
                        box_text(false, {0.06, 0.02, 0.06}, {0, 0.02001, 0}),
                    {},
                    {5e-4, 5e-4, -5e-4},
                    {8e-4, 8e-4, 8e-4},
                    0.03});
  const Vector in_tube_m(6e-4, 6e-4, 3e-3);
  scenes.push_back({"tube, solids", tube_text("solid"), {}, Vector::Zero(), in_tube_m, 0.03});
  scenes.push_back({"tube, surfaces", tube_text("surface"), {}, Vector::Zero(), in_tube_m, 0.03});
  scenes.push_back({"nut M10",
                    "[moving]\nshape = \"nut\"\nmaterial = \"a\"\nsize = \"M10\"\nclearance_m = "
                    "1e-4\n[[static]]\nshape = \"thread\"\nmaterial = \"b\"\nsize = \"M10\"\nturns "
                    "= 8\nclearance_m = 1e-4\n",
                    {},
                    Vector::Zero(),
                    {3e-4, 3e-4, 5e-4},
                    0.05});
  return scenes;
}

/// Sums of four sines along and about each axis, that begin softly at the start.
std::vector<MotionSample> wandering(const StopScene& scene, std::uint64_t seed) {
  constexpr std::array<double, 4> kRates_hz{0.3, 0.7, 1.3, 2.1};
  Seeded random(seed);
  std::vector<MotionSample> motion;
  std::array<std::array<double, 8>, 6> waves{};
  for (auto& wave : waves) {
    for (std::size_t f = 0; f < kRates_hz.size(); ++f) {
      // About as a normal draw: a sum of four.
      double draw = 0;
      for (int k = 0; k < 4; ++k) draw += random.uniform(-0.87, 0.87);
      wave[2 * f] = draw / (1 + kRates_hz[f]);
      wave[2 * f + 1] = random.uniform(0, 2 * std::numbers::pi);
    }
  }
  for (std::size_t k = 0; k < kWanders; ++k) {
    const double t = 1e-3 * static_cast<double>(k), begun = std::min(t / 0.3, 1.0);
    const double soft = begun * begun * (3 - 2 * begun);
    const auto at = [&](std::size_t axis) {
      double sum = 0;
      for (std::size_t f = 0; f < kRates_hz.size(); ++f) {
        sum += waves[axis][2 * f] *
               std::sin(2 * std::numbers::pi * kRates_hz[f] * t + waves[axis][2 * f + 1]);
      }
      return sum;
    };
    const Vector way = scene.wander_m.cwiseProduct(Vector(at(0), at(1), at(2)));
    const Vector turn = scene.wander_rad * Vector(at(3), at(4), at(5));
    motion.push_back(sample_at(t, soft * (scene.home_m + way),
                               Rotation(Eigen::AngleAxisd(soft * turn.norm(), turn.normalized()))));
  }
  return motion;
}

struct StopCell {
  std::string scene;
  double friction = 0;
  std::uint64_t seed = 0;
  std::size_t held = 0, moved = 0, ticks = 0, behind = 0, late = 0;
  double worst = 0;          ///< change over the force, the largest
  std::size_t worst_at = 0;  ///< tick of that stop
};

double size_of(const Wrench& wrench) {
  return std::hypot(static_cast<double>(wrench.force_w.norm()),
                    static_cast<double>(wrench.torque_w.norm()) / kLever_m);
}

/// What changes of the wrench while the hand rests after tick `at`, over its size: none where there
/// is hardly any.
std::optional<double> change_at_rest(CoreSession& session, StepInput input, bool creeps,
                                     StopCell& cell) {
  Wrench begun;
  double most = 0;
  for (std::size_t k = 1; k <= kSettles + kRests; ++k) {
    input.sequence += 1;
    input.stamp_ns += 1000000;
    if (creeps && k == kSettles + 1) input.pose_wa.p_wa += Vec3::Constant(Real(kCreep_m));
    const StepResult result = session.core().step(input);
    if (k < kSettles) continue;
    if (k == kSettles) begun = result.wrench_w;
    cell.late += (result.flags & kFlagBehind) != 0 ? 1u : 0u;
    Wrench change;
    change.force_w = result.wrench_w.force_w - begun.force_w;
    change.torque_w = result.wrench_w.torque_w - begun.torque_w;
    most = std::max(most, size_of(change));
  }
  const double size = size_of(begun);
  return size > kLeast_n ? std::optional(most / size) : std::nullopt;
}

void run_stops(TriedScene& tried, const StopScene& scene, bool creeps, StopCell& cell) {
  const std::vector<MotionSample> motion = wandering(scene, cell.seed);
  CoreSession& session = tried.session();
  session.core().reset();
  std::vector<std::byte> kept(session.state().size());
  for (std::size_t k = 0; k < motion.size(); ++k) {
    const StepInput input = input_of(motion[k], k);
    const StepResult result = session.core().step(input);
    cell.ticks += 1;
    cell.behind += (result.flags & kFlagBehind) != 0 ? 1u : 0u;
    if (k < kFirst || k % kEvery != 0) continue;
    std::ranges::copy(session.state(), kept.begin());
    const std::optional<double> change = change_at_rest(session, input, creeps, cell);
    std::ranges::copy(kept, session.state().begin());
    if (!change) continue;
    cell.held += 1;
    cell.moved += *change > kChange ? 1u : 0u;
    if (*change > cell.worst) {
      cell.worst = *change;
      cell.worst_at = k;
    }
  }
}

}  // namespace

PartReport stop_study(const FrictionSize& size, const RunOptions& options) {
  const std::vector<StopScene> scenes = stop_scenes();
  std::vector<double> frictions{0.15, 0.3, 0.6};
  std::vector<std::uint64_t> seeds{1, 2, 3};
  if (size.is_short) {
    frictions = {0.3};
    seeds = {1};
  }
  std::vector<StopCell> cells;
  for (const StopScene& scene : scenes) {
    for (const double friction : frictions) {
      for (const std::uint64_t seed : seeds) {
        StopCell cell;
        cell.scene = scene.name;
        cell.friction = friction;
        cell.seed = seed;
        cells.push_back(cell);
      }
    }
  }
  const std::size_t of_scene = frictions.size() * seeds.size();
  run_shards(
      cells.size(), options, "stops", [] { return 0; },
      [&](int, std::size_t k) {
        const StopScene& scene = scenes[k / of_scene];
        TriedScene tried(scene_text(scene.text, kFitStiffness_n_per_m, cells[k].friction, 0,
                                    size.fault == FrictionFault::kBudget ? kLeastWorkUnits : 0),
                         scene.files);
        run_stops(tried, scene, size.fault == FrictionFault::kCreep, cells[k]);
      });
  PartReport report;
  report.title = "Stops with friction";
  ReportTable table("scene,friction,seed,held,moved,worst_change,worst_at_tick,ticks,behind,late");
  report.markdown = table_head({"scene", "stops held", "moved by more than 2 %", "largest change",
                                "ticks behind, per 1000"});
  std::size_t held = 0, moved = 0, ticks = 0, behind = 0;
  for (const StopScene& scene : scenes) {
    StopCell sum;
    for (const StopCell& c : cells) {
      if (c.scene != scene.name) continue;
      sum.held += c.held;
      sum.moved += c.moved;
      sum.ticks += c.ticks;
      sum.behind += c.behind;
      sum.worst = std::max(sum.worst, c.worst);
      table.add({quoted(c.scene), c.friction, c.seed, c.held, c.moved, c.worst, c.worst_at, c.ticks,
                 c.behind, c.late});
    }
    report.markdown += table_row(
        {scene.name, std::to_string(sum.held), std::to_string(sum.moved),
         short_number(sum.worst, 3),
         fixed(1e3 * static_cast<double>(sum.behind) / static_cast<double>(sum.ticks), 3)});
    held += sum.held;
    moved += sum.moved;
    ticks += sum.ticks;
    behind += sum.behind;
  }
  const double share =
      static_cast<double>(moved) / static_cast<double>(std::max<std::size_t>(held, 1));
  report.passed = held > 0 && share <= kMostShare;
  report.markdown += tools::formatted(
      "\n%zu of %zu held stops change by more than %g %% from %zu ticks after the stop on, within "
      "a "
      "second; %zu of %zu ticks before them behind.\n",
      moved, held, 100 * kChange, kSettles, behind, ticks);
  report.files = {{"stops.csv", table.csv()}};
  return report;
}

}  // namespace haptic::sim
