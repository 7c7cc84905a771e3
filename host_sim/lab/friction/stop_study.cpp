// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "host_sim/lab/friction/friction_studies.hpp"
#include "host_sim/lab/friction/wander_scenes.hpp"
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

/// Sums of four sines along and about each axis, that begin softly at the start.
std::vector<MotionSample> wandering(const WanderScene& scene, std::uint64_t seed) {
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

void run_stops(TriedScene& tried, const WanderScene& scene, bool creeps, StopCell& cell) {
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
  const std::vector<WanderScene> scenes = wander_scenes();
  std::vector<double> frictions{0.15, 0.3, 0.6};
  std::vector<std::uint64_t> seeds{1, 2, 3};
  if (size.is_short) {
    frictions = {0.3};
    seeds = {1};
  }
  auto cells = cells_of<StopCell>(scenes, frictions, seeds);
  const std::size_t of_scene = frictions.size() * seeds.size();
  run_shards(
      cells.size(), options, "stops", [] { return 0; },
      [&](int, std::size_t k) {
        const WanderScene& scene = scenes[k / of_scene];
        TriedScene tried(scene_text(scene.text, kFitStiffness_n_per_m, cells[k].friction, 0,
                                    size.units(kLeastWorkUnits)),
                         scene.files);
        run_stops(tried, scene, size.fault == FrictionFault::kCreep, cells[k]);
      });
  PartReport report;
  report.title = "Stops with friction";
  ReportTable table("scene,friction,seed,held,moved,worst_change,worst_at_tick,ticks,behind,late");
  report.markdown = table_head({"scene", "stops held", "moved by more than 2 %", "largest change",
                                "ticks behind, per 1000"});
  std::size_t held = 0, moved = 0, ticks = 0, behind = 0;
  for (const WanderScene& scene : scenes) {
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
