// SPDX-License-Identifier: Apache-2.0
// host_sim flight [--ticks N] [--seed S] [--out DIR] [--threads N] [--fault restless]
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/proxy_fuzz/flight.hpp"
#include "host_sim/report/campaign_text.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::sim {
namespace {

struct FlightArguments {
  std::string out, fault;
  FlightSize size;
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
};

int do_flight(const FlightArguments& o) {
  tools::claim_folder(o.out, "--out", {"flight.*"});
  FlightSize size = o.size;
  if (!o.fault.empty()) size.fault = proxy_fault_named(o.fault);
  const FlightResult result = run_flight(size, {o.threads, true});
  std::printf("%s", flight_page(result).c_str());
  if (!o.out.empty()) write_flight(o.out, result);
  return campaign_exit(result.failed() == 0, size.fault.has_value());
}

}  // namespace

Command add_flight_command(CLI::App& program) {
  const auto o = std::make_shared<FlightArguments>();
  CLI::App* app = program.add_subcommand(
      "flight", "Flies parts of 10 um to 10 m freely and along a wall: no force at all.");
  app->add_option("--ticks", o->size.ticks, "ticks of every flight (default 400)")
      ->check(CLI::Range(1u, 1u << 20));
  app->add_option("--seed", o->size.seed, "of all random draws (default 1)");
  app->add_option("-o,--out", o->out, "folder for flight.md, .csv and .json");
  app->add_option("--threads", o->threads, "threads (default: one per processor)")
      ->check(CLI::Range(1, 256));
  app->add_option("--fault", o->fault,
                  "damage the core on purpose and check: exit 1 when the fault is caught")
      ->check(CLI::IsMember({"restless"}));
  return {app, [o] { return do_flight(*o); }, "host_sim flight --out flight"};
}

}  // namespace haptic::sim
