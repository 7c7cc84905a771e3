// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "host_sim/lab/strangers/families.hpp"
#include "host_sim/lab/strangers/part_studies.hpp"
#include "host_sim/lab/strangers/stranger_trial.hpp"
#include "host_sim/lab/strangers/tried_scene.hpp"
#include "host_sim/lab/wcet/instruction_counts.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/child_run.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::formatted;

constexpr double kClearance_mm = 0.05;
/// Flags of a tick whose force may be another one than that of the full list.
constexpr std::uint32_t kSaid = kFlagProxyLimited | kFlagProxyStuck | kFlagBehind | kFlagRamping |
                                kFlagRecovery | kFlagListFull;
/// Forces that are equal: two runs take other orders of the same planes.
constexpr double kSameForce_n = 1e-3;

struct FreezePart {
  std::string name;
  StrangerPair pair;
};

std::vector<FreezePart> parts_of(bool is_short) {
  std::vector<FreezePart> parts;
  const auto add = [&](const char* what, std::uint32_t count,
                       StrangerPair (*draw)(std::uint32_t, double)) {
    parts.push_back({formatted("%s %u", what, count), draw(count, kClearance_mm)});
    StrangerPair& pair = parts.back().pair;
    pair.seed = count;
    pair.places.resize(pair.fixed.size());
  };
  using Counts = std::vector<std::uint32_t>;
  for (const std::uint32_t n : is_short ? Counts{32} : Counts{16, 32, 64, 128, 256})
    add("shaft", n, shaft_of_facets);
  for (const std::uint32_t n : is_short ? Counts{12} : Counts{12, 18, 24, 36, 48})
    add("spline", n, shaft_of_splines);
  for (const std::uint32_t n : is_short ? Counts{10} : Counts{10, 20, 50, 100})
    add("connector", n, connector_of_pins);
  return parts;
}

/// The last is what the others are compared with: every pair has a slot, and no tick is cut by its
/// budget, after which a part that several places hold may rest at another of them.
struct ListChoice {
  const char* name;
  const char* lines;
};
constexpr ListChoice kLists[] = {{"default", ""},
                                 {"64", "[budget]\nnear_pairs = 64\n"},
                                 {"all", "[budget]\nnear_pairs = 32768\nwork_units = 65536\n"}};

struct FreezeRun {
  std::size_t pairs = 0, slots = 0;
  PlayedAccount account;
  std::vector<FoundFault> faults;
  std::size_t open_pulls =
      0;  ///< ticks with a force where the program says that nothing is touched
  std::vector<PlayedTick> ticks;
  std::size_t unlike_run = 0;  ///< most of the next in a row
  std::size_t unlike = 0;      ///< ticks without a flag in either run whose forces differ
  double unlike_n = 0;
  std::uint64_t median_instructions = 0, most_instructions = 0;
};

void count(TriedScene& scene, const HandMotion& hand, FreezeRun& run) {
  const TemporaryFolder folder;
  write_whole_file(folder.file("s.rtscene"),
                   {reinterpret_cast<const char*>(scene.blob().data()), scene.blob().size()});
  write_motion_csv(folder.file("m.csv"), hand.samples);
  const std::vector<MotionSample> motion = read_motion_csv(folder.file("m.csv"));
  InstructionQuestion question;
  question.program = program_beside("host_lab");
  question.arguments = {
      "wcet", "--once", "--scene", folder.file("s.rtscene"), "--motion", folder.file("m.csv")};
  question.state_hash = run_once(scene.session(), motion);
  question.ticks = motion.size();
  const InstructionCounts counts = count_instructions(question);
  run.median_instructions = counts.median;
  run.most_instructions = counts.largest;
}

FreezeRun freeze_run(const StrangerPair& pair, const ListChoice& list, const StudySize& size) {
  TriedScene scene(with_keys(scene_of_pair(pair, 0), list.lines), files_of_pair(pair));
  const HandMotion hand = insertion_motion(pair);
  FreezeRun run;
  const SceneCapacity& capacity = scene.session().view().header().capacity;
  run.pairs = scene.session().view().pair_count();
  run.slots = capacity.near_slots;
  run.ticks = scene.play(hand.samples);
  if (size.fault) falsify(run.ticks, hand, *size.fault);
  // Where a tick was falsified, the wrench says where the part is felt.
  if (size.fault)
    for (PlayedTick& tick : run.ticks) tick.felt.reset();
  run.account = account_of(run.ticks, &hand, scene.springs(), PairTriangles(pair), kTouching_m);
  find_faults("hand", run.account, &hand, run.faults);
  for (const PlayedTick& tick : run.ticks)
    run.open_pulls += !tick.touches && tick.force_n.norm() > kFalseForce_n ? 1u : 0u;
  if (size.instructions) count(scene, hand, run);
  return run;
}

}  // namespace

PartReport freeze_study(const StudySize& size, const RunOptions& options) {
  const std::vector<FreezePart> parts = parts_of(size.is_short);
  constexpr std::size_t kChoices = std::size(kLists);
  std::vector<FreezeRun> runs(parts.size() * kChoices);
  run_shards(
      runs.size(), options, "freeze", [] { return 0; },
      [&](int, std::size_t k) {
        runs[k] = freeze_run(parts[k / kChoices].pair, kLists[k % kChoices], size);
      });
  PartReport report;
  report.title = "Parts with many near pairs";
  ReportTable table(
      "part,near_pairs,pairs,slots,largest_n,end_n,open_pulls,stuck,behind,late,late_n,unlike_"
      "ticks,unlike_n,median_instructions,most_instructions,verdict");
  std::vector<std::string> words;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    FreezeRun& run = runs[k];
    const std::vector<PlayedTick>& full = runs[k / kChoices * kChoices + kChoices - 1].ticks;
    std::size_t in_a_row = 0;
    for (std::size_t t = 0; t < std::min(run.ticks.size(), full.size()); ++t) {
      if (((run.ticks[t].flags | full[t].flags) & kSaid) != 0) continue;
      const double by = (run.ticks[t].force_n - full[t].force_n).norm();
      run.unlike += by > kSameForce_n ? 1u : 0u;
      run.unlike_n = std::max(run.unlike_n, by);
      in_a_row = by > kSameForce_n ? in_a_row + 1 : 0;
      run.unlike_run = std::max(run.unlike_run, in_a_row);
    }
    std::string verdict;
    for (const FoundFault& fault : run.faults) {
      // With few slots a part may lag where it says so; it may not freeze.
      if (fault.kind == StrangerFault::kLate) continue;
      verdict += (verdict.empty() ? "" : "+") + std::string(to_text(fault.kind));
      words.push_back(parts[k / kChoices].name + ", near_pairs " + kLists[k % kChoices].name +
                      ": " + to_text(fault.kind) + ": " + fault.words);
    }
    if (run.unlike_run > kPassingTicks)
      verdict += (verdict.empty() ? "" : "+") + std::string("UNLIKE");
    report.passed = report.passed && verdict.empty();
    table.add({parts[k / kChoices].name, kLists[k % kChoices].name, run.pairs, run.slots,
               shown_as("%.3f", run.account.largest_n), shown_as("%.2g", run.account.end_n),
               run.open_pulls, run.account.stuck_pulled, run.account.behind, run.account.late,
               shown_as("%.3f", run.account.late_n), run.unlike, shown_as("%.2g", run.unlike_n),
               run.median_instructions, run.most_instructions,
               verdict.empty() ? "right" : verdict});
  }
  report.markdown = formatted(
                        "Each part goes in, is pressed and comes out; %g mm of clearance. Unlike: "
                        "ticks without a flag whose force differs by more than %g N from that of "
                        "the run with a slot for every pair.\n\n",
                        kClearance_mm, kSameForce_n) +
                    table.markdown();
  for (const std::string& line : words) report.markdown += "- " + line + "\n";
  report.files = {{"freeze.csv", table.csv()}};
  return report;
}

}  // namespace haptic::sim
