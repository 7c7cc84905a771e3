// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Seeded campaigns as commands: the options that all of them have, and how each ends.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "host_sim/report/campaign_text.hpp"
#include "host_sim/report/shard_run.hpp"
#include "tools/common/command_line.hpp"

namespace haptic::sim {

using tools::Command;

struct CampaignArguments {
  std::string out, fault;
  std::optional<std::uint64_t> only;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());

  [[nodiscard]] RunOptions run() const { return {threads, true}; }
};

/// A campaign on the command line.
struct CampaignWords {
  const char *name, *does, *example;
  const char* out;                  ///< help of --out
  std::vector<std::string> files;   ///< what --out may replace there
  std::vector<std::string> faults;  ///< words of --fault
  const char* only = nullptr;       ///< help of --only; null: there is none
  const char* fault = "damage the core on purpose and check: exit 1 when the fault is caught";
};

/// The sub-command with --seed, --only, --out, --threads and --fault.
CLI::App* add_campaign(CLI::App& program, const CampaignWords& words, CampaignArguments& arguments,
                       std::uint64_t& seed);

/// An option for a number of items, 1 to `most`.
CLI::Option* add_count(CLI::App& app, const char* name, std::uint64_t& target, std::uint64_t most,
                       const char* help);

/// Claims the folder, runs, prints what the campaign says and writes its files. The arguments live
/// as long as the command.
[[nodiscard]] int run_campaign(const CampaignWords& words, const CampaignArguments& arguments,
                               const std::function<CampaignEnd()>& run);

}  // namespace haptic::sim
