// SPDX-License-Identifier: Apache-2.0
// host_sim vectors FILE.json... [--json]
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/lab/commands/lab_commands.hpp"
#include "host_sim/lab/golden/golden_check.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

void print_text(const GoldenReport& report) {
  std::printf("%s: %s, %llu cases, size %.4g m, epsilon %.3g m, depth tolerance %.3g m: %s\n",
              report.path.c_str(), report.family.c_str(),
              static_cast<unsigned long long>(report.cases), report.size_m, report.epsilon_m,
              report.depth_tolerance_m, report.passed() ? "passed" : "FAILED");
  std::printf("  %-24s %9s %13s %8s %22s %14s\n", "quantity", "compared", "not compared", "failed",
              "error / tolerance", "largest error");
  for (std::size_t q = 0; q < report.tallies.size(); ++q) {
    const GoldenTally& t = report.tallies[q];
    if (t.compared + t.not_compared == 0) continue;
    std::printf("  %-24s %9llu %13llu %8llu %22.3g %14.3g\n",
                to_text(static_cast<GoldenQuantity>(q)),
                static_cast<unsigned long long>(t.compared),
                static_cast<unsigned long long>(t.not_compared),
                static_cast<unsigned long long>(t.failed), t.worst_ratio, t.worst_error);
  }
}

nlohmann::ordered_json to_json(const GoldenReport& report) {
  nlohmann::ordered_json json;
  json["file"] = report.path;
  json["family"] = report.family;
  json["cases"] = report.cases;
  json["size_m"] = report.size_m;
  json["epsilon_m"] = report.epsilon_m;
  json["depth_tolerance_m"] = report.depth_tolerance_m;
  json["tolerance"] = {{"depth", static_cast<double>(report.tolerance.depth)},
                       {"force", static_cast<double>(report.tolerance.force)},
                       {"torque", static_cast<double>(report.tolerance.torque)},
                       {"relative", static_cast<double>(report.tolerance.relative)}};
  json["passed"] = report.passed();
  for (std::size_t q = 0; q < report.tallies.size(); ++q) {
    const GoldenTally& t = report.tallies[q];
    nlohmann::ordered_json tally{
        {"compared", t.compared}, {"not_compared", t.not_compared}, {"failed", t.failed}};
    tally["largest_error"] = t.worst_error;  // depth, SCP, force, torque: shares, see tolerance
    tally["error_by_tolerance"] = t.worst_ratio;  // null when infinite: two sets differ
    json["quantities"][to_text(static_cast<GoldenQuantity>(q))] = tally;
  }
  json["failures"] = report.failures;
  return json;
}

int do_vectors(const std::vector<std::string>& files, bool as_json) {
  bool passed = true;
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  std::vector<std::string> failures;
  for (const std::string& path : files) {
    GoldenReport report;
    try {
      report = check_golden_file(read_golden_file(path));
    } catch (const tools::InputError& error) {
      const std::string text =
          error.what();  // what the bodies are refused for does not name the file
      throw tools::InputError(text.starts_with(path) ? text : path + ": " + text);
    }
    passed = passed && report.passed();
    failures.insert(failures.end(), report.failures.begin(), report.failures.end());
    if (as_json) {
      all.push_back(to_json(report));
    } else {
      print_text(report);
    }
  }
  if (as_json) std::printf("%s\n", all.dump(2).c_str());
  for (const std::string& failure : failures)
    std::fprintf(stderr, "host_sim: %s\n", failure.c_str());
  return passed ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_vectors_command(CLI::App& program) {
  struct VectorsArguments {
    std::vector<std::string> files;
    bool json = false;
  };
  const auto o = std::make_shared<VectorsArguments>();
  CLI::App* app = program.add_subcommand("vectors", "Compares the core with golden vectors.");
  app->add_option("files", o->files, "golden files (JSON)")->required();
  app->add_flag("--json", o->json, "result as JSON on stdout");
  return {app, [o] { return do_vectors(o->files, o->json); },
          "host_sim vectors tests/golden/box_box_generic.json"};
}

}  // namespace haptic::sim
