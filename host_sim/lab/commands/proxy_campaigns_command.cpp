// SPDX-License-Identifier: Apache-2.0
// host_sim proxy-fuzz, crossings, hold, flight: the campaigns against the proxy on solids.
#include <memory>

#include "host_sim/lab/commands/campaign_command.hpp"
#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/proxy_fuzz/crossings.hpp"
#include "host_sim/lab/proxy_fuzz/flight.hpp"
#include "host_sim/lab/proxy_fuzz/hold_campaign.hpp"
#include "host_sim/lab/proxy_fuzz/proxy_campaign.hpp"
#include "tools/common/command_line.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint64_t kMostRuns = std::uint64_t{1} << 30, kMostTicks = std::uint64_t{1} << 40;

/// Size of a campaign with what all of them are asked.
template <typename Size>
struct Asked : CampaignArguments {
  Size size;

  [[nodiscard]] Size whole() const {
    Size asked = size;
    asked.fault = proxy_fault_named(fault);
    if constexpr (requires { asked.only; }) asked.only = only;
    return asked;
  }
};

/// The command of a campaign whose results are `run(size, options)` and whose report is `end`.
template <typename Size, typename Run, typename End>
Command command_of(CLI::App* app, const CampaignWords& words, std::shared_ptr<Asked<Size>> o,
                   Run run, End end) {
  return {app,
          [=] { return run_campaign(words, *o, [&] { return end(run(o->whole(), o->run())); }); },
          words.example};
}

}  // namespace

Command add_proxy_fuzz_command(CLI::App& program) {
  const CampaignWords words{
      "proxy-fuzz",
      "Random, jittering and jumping devices against the proxy; every tick judged.",
      "host_sim proxy-fuzz --out fuzz",
      "folder for proxy_fuzz.md, .csv and .json",
      {"proxy_fuzz.*"},
      {"certificate", "spring", "vertex"}};
  const auto o = std::make_shared<Asked<ProxyFuzzSize>>();
  CLI::App* app = add_campaign(program, words, *o, o->size.seed);
  add_count(*app, "--ticks", o->size.ticks, kMostTicks, "ticks over all scenes (default 1000000)");
  app->add_option_function<double>(
         "--friction", [o](double mu) { o->size.frictions = {mu}; },
         "Coulomb coefficient (default: 0 and 0.3)")
      ->check(tools::number_within(0.0, 2.0));
  app->add_flag("--budgets", o->size.budgets,
                "a budget of work for every scene, 50 to 10000 units, and a rest after every run");
  return command_of(app, words, o, run_proxy_fuzz, proxy_fuzz_end);
}

Command add_crossings_command(CLI::App& program) {
  const CampaignWords words{
      "crossings",
      "Drives rods, blades and sheets through each other; the way of every pass judged.",
      "host_sim crossings --out crossings",
      "folder for crossings.md, .csv and .json",
      {"crossings.*"},
      {"certificate", "vertex"},
      "the one of this number, as a failure names it"};
  const auto o = std::make_shared<Asked<CrossingSize>>();
  CLI::App* app = add_campaign(program, words, *o, o->size.seed);
  add_count(*app, "--crossings", o->size.crossings, kMostRuns,
            "random ones; 4 for 10 more of rods and of nearly parallel edges (default 1000)");
  return command_of(app, words, o, run_crossings, crossings_end);
}

Command add_hold_command(CLI::App& program) {
  const CampaignWords words{
      "hold",
      "Holds the device still after stress: a fixed point, balanced, no energy gained.",
      "host_sim hold --out hold",
      "folder for hold.md, .csv and .json",
      {"hold.*", "hold_ticks.csv"},
      {"restless", "spring", "certificate"},
      "the pose of this number, as a failure names it, and hold_ticks.csv of it"};
  const auto o = std::make_shared<Asked<HoldSize>>();
  CLI::App* app = add_campaign(program, words, *o, o->size.seed);
  add_count(*app, "--poses", o->size.poses, kMostRuns, "poses over all scenes (default 10000)");
  return command_of(app, words, o, run_hold, hold_end);
}

Command add_flight_command(CLI::App& program) {
  const CampaignWords words{
      "flight",
      "Flies parts of 10 um to 10 m freely and along a wall: no force at all.",
      "host_sim flight --out flight",
      "folder for flight.md, .csv and .json",
      {"flight.*"},
      {"restless"}};
  const auto o = std::make_shared<Asked<FlightSize>>();
  CLI::App* app = add_campaign(program, words, *o, o->size.seed);
  app->add_option("--ticks", o->size.ticks, "ticks of every flight (default 400)")
      ->check(CLI::Range(1u, 1u << 20));
  return command_of(app, words, o, run_flight, flight_end);
}

}  // namespace haptic::sim
