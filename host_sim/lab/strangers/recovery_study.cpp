// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "host_sim/lab/strangers/part_studies.hpp"
#include "host_sim/lab/strangers/stranger_trial.hpp"
#include "host_sim/lab/strangers/tried_scene.hpp"
#include "host_sim/report/quantile.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::formatted;

constexpr double kPart_mm = 8;
/// Ticks that a start inside is given; the clusters are 60 mm wide, and a tick of recovery goes
/// some tenths of a millimetre.
constexpr std::size_t kTicksToLeave = 3000, kTicksAfter = 20;
/// How deep triangles may share space where the part is said to be free.
constexpr double kFreeDepth_m = 1e-6;

/// Boxes that a part may begin in.
struct Cluster {
  std::string name;
  StrangerPair pair;
  double reach_mm;  ///< starts are drawn within this cube about the origin
};

StrangerPair cluster_of(std::vector<DrawnMesh> boxes) {
  StrangerPair pair;
  pair.moving = block_mesh(Vector::Constant(-kPart_mm / 2), Vector::Constant(kPart_mm / 2));
  pair.fixed = std::move(boxes);
  pair.places.resize(pair.fixed.size());
  pair.depth_mm = 100;
  return pair;
}

std::vector<Cluster> clusters(std::uint64_t seed) {
  std::vector<Cluster> list;
  const auto box = [](const Vector& middle, double side) {
    return block_mesh(middle - Vector::Constant(side / 2), middle + Vector::Constant(side / 2));
  };
  list.push_back({"two flush boxes", cluster_of({box({-25, 0, 0}, 50), box({25, 0, 0}, 50)}), 22});
  std::vector<DrawnMesh> flush;
  for (int k = 0; k < 27; ++k)
    flush.push_back(box(20.0 * Vector(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1), 20));
  list.push_back({"27 flush boxes", cluster_of(flush), 28});
  Seeded random(seed);
  std::vector<DrawnMesh> turned;
  for (int k = 0; k < 30; ++k) {
    const double side = random.uniform(15, 25);
    const Vector middle = 20 * random.uniform(0.2, 1) * random.direction();
    turned.push_back(placed_mesh(box(Vector::Zero(), side), random.rotation(), middle));
  }
  list.push_back({"30 overlapping turned boxes", cluster_of(turned), 20});
  return list;
}

struct StartTotals {
  std::size_t starts = 0, led_out = 0, said = 0, silent = 0;
  std::vector<std::size_t> ticks;  ///< of recovery, of those led out
  std::string first_silent;
};

MotionSample drawn_start(Seeded& random, double reach_mm) {
  Vector p;
  for (int i = 0; i < 3; ++i) p[i] = 1e-3 * reach_mm * random.uniform(-1, 1);
  return sample_at(0, p, random.rotation());
}

/// One start: the hand stays where it is. A start that is free does not count.
void try_start(TriedScene& scene, const MeshPair& meshes, const MotionSample& start, bool falsified,
               StartTotals& totals) {
  scene.session().core().reset();
  std::size_t recovering = 0, after = 0;
  Pose last;
  bool inside = false;
  for (std::size_t k = 0; k < kTicksToLeave && after < kTicksAfter; ++k) {
    const StepResult result = scene.session().core().step(input_of(start, k));
    inside = (result.flags & kFlagRecovery) != 0 && !falsified;
    recovering += inside ? 1u : 0u;
    after = inside ? 0 : after + 1;
    last = result.proxy_pose_wa;
    if (falsified) break;
  }
  if (inside) {
    ++totals.starts;
    ++totals.said;
    return;
  }
  const auto q = last.q_wa;
  const MeshCrossing crossing =
      meshes.crossing({rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z())),
                       {widen(last.p_wa[0]), widen(last.p_wa[1]), widen(last.p_wa[2])}});
  if (crossing.depth_m > kFreeDepth_m) {
    ++totals.starts;
    ++totals.silent;
    if (totals.first_silent.empty())
      totals.first_silent =
          formatted("start at (%.17g, %.17g, %.17g) m: %.3g um deep and no word of it", start.p[0],
                    start.p[1], start.p[2], 1e6 * static_cast<double>(crossing.depth_m));
    return;
  }
  if (recovering == 0) return;
  ++totals.starts;
  ++totals.led_out;
  totals.ticks.push_back(recovering);
}

StartTotals run_starts(const Cluster& cluster, std::size_t count, std::uint64_t seed,
                       bool falsified) {
  TriedScene scene(scene_of_pair(cluster.pair, 0), files_of_pair(cluster.pair));
  std::vector<Triangle> fixed;
  for (const DrawnMesh& mesh : cluster.pair.fixed)
    for (const Triangle& t : file_triangles(mesh)) fixed.push_back(t);
  const MeshPair meshes(file_triangles(cluster.pair.moving), fixed);
  StartTotals totals;
  Seeded random(seed);
  constexpr std::size_t kDrawsOfStart = 50;
  for (std::size_t draw = 0; totals.starts < count && draw < kDrawsOfStart * count; ++draw)
    try_start(scene, meshes, drawn_start(random, cluster.reach_mm), falsified, totals);
  return totals;
}

struct MotionTotals {
  std::size_t motions = 0, with_recovery = 0, ticks = 0;
  std::string first;
};

/// Both parts as surfaces, the hands of several seeds; recovery after a free start takes the force
/// away.
MotionTotals run_motions(const std::string& family, std::size_t count, bool falsified) {
  StrangerPair pair = stranger_pair(family, 1);
  std::string text = scene_of_pair(pair, 0);
  std::string surfaces;
  for (std::size_t at = 0, end; at < text.size(); at = end) {
    end = std::min(text.find('\n', at), text.size() - 1) + 1;
    surfaces += text.substr(at, end - at);
    if (text.compare(at, 4, "mesh") == 0) surfaces += "as = \"surface\"\n";
  }
  TriedScene scene(surfaces, files_of_pair(pair));
  MotionTotals totals;
  for (std::size_t k = 0; k < count; ++k) {
    pair.seed = 1 + k;
    const HandMotion hand = insertion_motion(pair);
    std::vector<PlayedTick> ticks = scene.play(hand.samples);
    if (falsified) falsify(ticks, hand, StrangerFault::kRecovery);
    std::size_t recovery = 0, first = 0;
    for (std::size_t t = 0; t < ticks.size(); ++t)
      if ((ticks[t].flags & kFlagRecovery) != 0 && recovery++ == 0) first = t;
    ++totals.motions;
    totals.ticks += recovery;
    if (recovery == 0) continue;
    ++totals.with_recovery;
    if (totals.first.empty())
      totals.first = formatted("%s, hand %zu: %zu ticks of recovery, the first at tick %zu (%s)",
                               family.c_str(), k + 1, recovery, first, hand.phases[first].c_str());
  }
  return totals;
}

}  // namespace

PartReport recovery_study(const StudySize& size, const RunOptions& options) {
  const bool falsified = size.fault == StrangerFault::kRecovery;
  const std::vector<Cluster> all = clusters(5);
  const std::size_t shards = size.is_short ? 1 : 4, starts = size.is_short ? 10 : 84;
  std::vector<StartTotals> totals(all.size() * shards);
  run_shards(
      totals.size(), options, "starts", [] { return 0; },
      [&](int, std::size_t k) {
        totals[k] = run_starts(all[k / shards], starts, seed_of(11, k), falsified);
      });
  PartReport report;
  report.title = "Recovery";
  ReportTable table("cluster,starts,led_out,said,silent,median_ticks,most_ticks");
  std::vector<std::string> words;
  for (std::size_t c = 0; c < all.size(); ++c) {
    StartTotals sum;
    for (std::size_t s = 0; s < shards; ++s) {
      const StartTotals& t = totals[c * shards + s];
      sum.starts += t.starts;
      sum.led_out += t.led_out;
      sum.said += t.said;
      sum.silent += t.silent;
      sum.ticks.insert(sum.ticks.end(), t.ticks.begin(), t.ticks.end());
      if (!t.first_silent.empty()) words.push_back(all[c].name + ": " + t.first_silent);
    }
    std::ranges::sort(sum.ticks);
    report.passed = report.passed && sum.silent == 0 && sum.said == 0;
    if (sum.said > 0)
      words.push_back(formatted("%s: %zu starts of %zu still inside after %zu ticks",
                                all[c].name.c_str(), sum.said, sum.starts, kTicksToLeave));
    table.add({all[c].name, sum.starts, sum.led_out, sum.said, sum.silent,
               sum.ticks.empty() ? Cell() : Cell(quantile(sum.ticks, 0.5)),
               sum.ticks.empty() ? Cell() : Cell(sum.ticks.back())});
  }
  const std::vector<std::string> families =
      size.is_short ? std::vector<std::string>{"keyed_shaft"}
                    : std::vector<std::string>{
                          "keyed_shaft", "bayonet",  "splined_shaft", "hex_socket", "dowel_plate",
                          "t_slot",      "dovetail", "filleted_peg",  "connector",  "taper_plug"};
  const std::size_t hands = size.is_short ? 1 : 10;
  std::vector<MotionTotals> motions(families.size());
  run_shards(
      families.size(), options, "motions", [] { return 0; },
      [&](int, std::size_t k) { motions[k] = run_motions(families[k], hands, falsified); });
  ReportTable over("surfaces,motions,with_recovery,recovery_ticks");
  for (std::size_t k = 0; k < families.size(); ++k) {
    const MotionTotals& m = motions[k];
    over.add({families[k], m.motions, m.with_recovery, m.ticks});
    report.passed = report.passed && m.with_recovery == 0;
    if (!m.first.empty()) words.push_back(m.first);
  }
  report.markdown = formatted(
                        "Starts at random inside; the hand stays there. Led out: free by the "
                        "triangles too within %zu ticks; said: still flagged; silent: neither.\n\n",
                        kTicksToLeave) +
                    table.markdown() + "\nMotions that start free, both parts as surfaces.\n\n" +
                    over.markdown();
  for (const std::string& line : words) report.markdown += "- " + line + "\n";
  report.files = {{"recovery.csv", table.csv()}, {"recovery_motions.csv", over.csv()}};
  return report;
}

}  // namespace haptic::sim
