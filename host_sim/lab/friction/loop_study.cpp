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

/// The hand comes to the loop's begin, goes around once, and is judged the second time.
constexpr double kCome_s = 0.5, kLoop_s = 2;
/// What rounding leaves of a loop that neither loses nor gives.
constexpr double kMostGiven_j = 1e-9;
/// What is felt comes so many ticks late where the study is to fail.
constexpr std::size_t kLateTicks = 200;

struct LoopCell {
  std::string scene;
  double friction = 0;
  std::uint64_t seed = 0;
  std::size_t ticks = 0, behind = 0;
  double given_j = 0, most_n = 0;

  [[nodiscard]] bool right() const { return given_j <= kMostGiven_j; }
};

/// Along and about each axis a sine of the loop's first to third harmonic.
std::vector<MotionSample> closed_loops(const WanderScene& scene, std::uint64_t seed) {
  struct Wave {
    double size, phase, harmonic;
  };
  Seeded random(seed);
  std::array<Wave, 6> waves;
  for (std::size_t axis = 0; axis < waves.size(); ++axis) {
    waves[axis] = {random.uniform(0.3, 1.5), random.uniform(0, 2 * std::numbers::pi),
                   static_cast<double>(1 + (axis + seed) % 3)};
  }
  std::vector<MotionSample> motion;
  for (double t = 0; t < kCome_s + 2 * kLoop_s + 5e-4; t += 1e-3) {
    const double begun = std::min(t / kCome_s, 1.0);
    const double around = 2 * std::numbers::pi * std::max(t - kCome_s, 0.0) / kLoop_s;
    const auto at = [&](std::size_t axis) {
      return waves[axis].size * std::sin(waves[axis].harmonic * around + waves[axis].phase);
    };
    const Vector way = scene.wander_m.cwiseProduct(Vector(at(0), at(1), at(2)));
    const Vector turn = begun * scene.wander_rad * Vector(at(3), at(4), at(5));
    motion.push_back(sample_at(t, begun * (scene.home_m + way),
                               Rotation(Eigen::AngleAxisd(turn.norm(), turn.normalized()))));
  }
  return motion;
}

/// The work that the wrench does on the hand between two samples, by the mean of the two.
double work_j(const MotionSample& from, const MotionSample& to, const PlayedTick& begin,
              const PlayedTick& end) {
  const auto turn_of = [](const MotionSample& sample) {
    return Rotation(sample.q_wxyz[0], sample.q_wxyz[1], sample.q_wxyz[2], sample.q_wxyz[3]);
  };
  const Eigen::AngleAxisd turn(turn_of(to) * turn_of(from).conjugate());
  const Vector way(to.p[0] - from.p[0], to.p[1] - from.p[1], to.p[2] - from.p[2]);
  return (begin.force_n + end.force_n).dot(way) / 2 +
         (begin.torque_nm + end.torque_nm).dot(turn.angle() * turn.axis()) / 2;
}

void run_loop(const WanderScene& scene, const FrictionSize& size, LoopCell& cell) {
  TriedScene tried(
      scene_text(scene.text, kFitStiffness_n_per_m, cell.friction, 0, size.units(kLeastWorkUnits)),
      scene.files);
  const std::vector<MotionSample> motion = closed_loops(scene, cell.seed);
  const std::vector<PlayedTick> ticks = tried.play(motion);
  const std::size_t late = size.fault == FrictionFault::kLate ? kLateTicks : 0;
  const auto loop = static_cast<std::size_t>(std::lround(1e3 * kLoop_s));
  const std::size_t first = motion.size() - 1 - loop;
  for (std::size_t k = first; k + 1 < motion.size(); ++k) {
    cell.given_j += work_j(motion[k], motion[k + 1], ticks[k - late], ticks[k + 1 - late]);
    cell.most_n = std::max(cell.most_n, ticks[k].force_n.norm());
  }
  for (const PlayedTick& tick : ticks) {
    cell.ticks += 1;
    cell.behind += (tick.flags & kFlagBehind) != 0 ? 1u : 0u;
  }
}

}  // namespace

PartReport loop_study(const FrictionSize& size, const RunOptions& options) {
  const std::vector<WanderScene> scenes = wander_scenes();
  std::vector<double> frictions{0.05, 0.3, 0.8};
  std::vector<std::uint64_t> seeds{1, 2, 3, 4};
  if (size.is_short) {
    frictions = {0.3};
    seeds = {1};
  }
  auto cells = cells_of<LoopCell>(scenes, frictions, seeds);
  const std::size_t of_scene = frictions.size() * seeds.size();
  run_shards(
      cells.size(), options, "loops", [] { return 0; },
      [&](int, std::size_t k) { run_loop(scenes[k / of_scene], size, cells[k]); });
  PartReport report;
  report.title = "Closed loops with friction";
  ReportTable table("scene,friction,seed,given_j,most_n,ticks,behind,right");
  report.markdown = table_head({"scene", "loops", "that give energy", "least lost, mJ",
                                "most lost, mJ", "ticks behind, per 1000"});
  std::size_t wrong = 0, unfelt = 0;
  for (const WanderScene& scene : scenes) {
    std::size_t loops = 0, give = 0, ticks = 0, behind = 0;
    double most_j = -1e9, least_j = 1e9;
    for (const LoopCell& c : cells) {
      if (c.scene != scene.name) continue;
      loops += 1;
      give += c.right() ? 0u : 1u;
      unfelt += c.most_n > 0 ? 0u : 1u;
      ticks += c.ticks;
      behind += c.behind;
      most_j = std::max(most_j, c.given_j);
      least_j = std::min(least_j, c.given_j);
      table.add({quoted(c.scene), c.friction, c.seed, c.given_j, c.most_n, c.ticks, c.behind,
                 yes_or_no(c.right())});
    }
    report.markdown +=
        table_row({scene.name, std::to_string(loops), std::to_string(give),
                   short_number(-1e3 * most_j, 3), short_number(-1e3 * least_j, 3),
                   fixed(1e3 * static_cast<double>(behind) / static_cast<double>(ticks), 3)});
    wrong += give;
  }
  report.passed = wrong == 0 && unfelt == 0;
  report.markdown += tools::formatted(
      "\n%zu of %zu loops of %g s give the hand more than %g J; %zu are not felt at all.\n", wrong,
      cells.size(), kLoop_s, kMostGiven_j, unfelt);
  report.files = {{"loops.csv", table.csv()}};
  return report;
}

}  // namespace haptic::sim
