// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/strangers/stranger_campaign.hpp"

#include <algorithm>
#include <map>
#include <mutex>

#include "host_sim/report/quantile.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::formatted;

std::size_t right_of(const std::vector<StrangerTrial>& trials) {
  return static_cast<std::size_t>(
      std::ranges::count_if(trials, [](const StrangerTrial& t) { return t.right(); }));
}

std::string words_of(const StrangerTrial& trial) {
  std::string words;
  for (const FoundFault& fault : trial.faults)
    words += (words.empty() ? "" : "; ") + std::string(to_text(fault.kind)) + ": " + fault.words;
  return words;
}

std::string csv_of(const std::vector<StrangerTrial>& trials) {
  ReportTable table(
      "family,seed,clearance_mm,parts,pairs,near_slots,init_exit,contact_share,motion,ticks,"
      "contact,largest_n,end_n,stuck,behind,recovery,ramping,loose,judged,apart,apart_n,stops,late,"
      "late_n,verdict,faults");
  for (const StrangerTrial& t : trials) {
    std::string words = words_of(t);
    std::ranges::replace(words, '"', '\'');
    const auto add = [&](const std::string& motion, const PlayedAccount& a) {
      table.add({t.family,
                 t.seed,
                 shown_as("%g", t.clearance_mm),
                 sim::quoted(t.parts),
                 t.pairs,
                 t.near_slots,
                 t.init_exit,
                 t.contact_share < 0 ? Cell() : shown_as("%.4f", t.contact_share),
                 sim::quoted(motion),
                 a.ticks,
                 a.contact,
                 shown_as("%.4f", a.largest_n),
                 shown_as("%.3g", a.end_n),
                 a.stuck,
                 a.behind,
                 a.recovery,
                 a.ramping,
                 a.loose,
                 a.judged,
                 a.apart,
                 shown_as("%.3f", a.apart_n),
                 a.stops,
                 a.late,
                 shown_as("%.3f", a.late_n),
                 t.verdict(),
                 sim::quoted(words)});
    };
    for (const NamedAccount& motion : t.motions) add(motion.name, motion.account);
    if (t.motions.empty()) add("", {});
  }
  return table.csv();
}

std::string page_of(const std::vector<StrangerTrial>& trials) {
  std::map<std::string, std::vector<const StrangerTrial*>> families;
  std::map<std::string, std::size_t> faults;
  std::map<std::string, std::vector<double>> behind;  // per motion, share of the ticks
  for (const StrangerTrial& t : trials) {
    families[t.family].push_back(&t);
    for (const FoundFault& fault : t.faults) ++faults[to_text(fault.kind)];
    for (const auto& [name, account] : t.motions) {
      if (account.ticks == 0) continue;
      behind[name].push_back(static_cast<double>(account.behind) /
                             static_cast<double>(account.ticks));
    }
  }
  std::string text = formatted("# Strangers' parts by defaults\n\n%zu of %zu pairs right.\n\n",
                               right_of(trials), trials.size());
  text += table_head({"family", "pairs", "right", "verdicts"});
  for (const auto& [name, of] : families) {
    std::map<std::string, std::size_t> verdicts;
    std::size_t right = 0;
    for (const StrangerTrial* t : of) {
      right += t->right() ? 1u : 0u;
      if (!t->right()) ++verdicts[t->verdict()];
    }
    std::vector<std::string> words;
    for (const auto& [verdict, count] : verdicts)
      words.push_back(formatted("%zu %s", count, verdict.c_str()));
    text += table_row({name, std::to_string(of.size()), std::to_string(right), joined(words)});
  }
  text += "\n" + table_head({"motion", "pairs", "ticks behind, median share", "largest share"});
  for (auto& [name, shares] : behind) {
    std::ranges::sort(shares);
    text += table_row({name, std::to_string(shares.size()),
                       formatted("%.4f", quantile(shares, 0.5)), formatted("%.4f", shares.back())});
  }
  if (!faults.empty()) {
    text += "\n" + table_head({"fault", "found"});
    for (const auto& [kind, count] : faults) text += table_row({kind, std::to_string(count)});
    text += "\n";
    for (const StrangerTrial& t : trials) {
      for (const FoundFault& fault : t.faults) {
        tools::append_line(text, "- %s, seed %llu, %g mm: %s: %s", t.family.c_str(),
                           static_cast<unsigned long long>(t.seed), t.clearance_mm,
                           to_text(fault.kind), fault.words.c_str());
      }
    }
  }
  return text;
}

}  // namespace

std::vector<StrangerPair> campaign_pairs(const StrangerCampaign& campaign) {
  std::vector<std::string> families = campaign.families;
  if (families.empty())
    for (const std::string_view name : stranger_families()) families.emplace_back(name);
  std::vector<StrangerPair> pairs;
  for (const std::uint64_t seed : campaign.seeds) {
    for (const std::string& family : families) {
      const std::vector<double> clearances =
          campaign.every_clearance ? clearances_of(family) : campaign.clearances_mm;
      if (clearances.empty()) pairs.push_back(stranger_pair(family, seed));
      for (const double c : clearances) pairs.push_back(stranger_pair(family, seed, c));
    }
  }
  return pairs;
}

std::vector<StrangerTrial> run_strangers(const StrangerCampaign& campaign,
                                         const RunOptions& options,
                                         const std::function<void(const StrangerTrial&)>& done) {
  const std::vector<StrangerPair> pairs = campaign_pairs(campaign);
  std::vector<StrangerTrial> trials(pairs.size());
  std::mutex mutex;
  run_shards(
      pairs.size(), options, "pairs", [] { return 0; },
      [&](int, std::size_t k) {
        trials[k] = try_pair(pairs[k], campaign.trial);
        const std::lock_guard lock(mutex);
        done(trials[k]);
      });
  return trials;
}

std::string trial_line(const StrangerTrial& t) {
  std::string line = formatted("%-6s %-14s seed %llu  %5g mm  %s, %zu pairs, %zu slots",
                               t.right() ? "right" : "FAULT", t.family.c_str(),
                               static_cast<unsigned long long>(t.seed), t.clearance_mm,
                               t.parts.c_str(), t.pairs, t.near_slots);
  if (!t.right()) line += "  " + t.verdict() + "  " + words_of(t);
  return line;
}

std::vector<OutputText> stranger_files(const std::vector<StrangerTrial>& trials) {
  return {{"strangers.csv", csv_of(trials)}, {"strangers.md", page_of(trials)}};
}

}  // namespace haptic::sim
