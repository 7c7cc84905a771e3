// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "host_sim/lab/golden/golden_check.hpp"
#include "tools/common/error.hpp"

using namespace haptic::sim;

namespace {

const GoldenTally& tally(const GoldenReport& report, GoldenQuantity quantity) {
  return report.tallies[static_cast<std::size_t>(quantity)];
}

GoldenFile golden(const char* name) {
  return read_golden_file(std::string(HAPTIC_TEST_DIR "/golden/") + name);
}

/// What reading `text` is refused for; empty when it is accepted.
std::string refusal_of(const std::string& text) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("haptic_golden_" + std::to_string(::getpid()) + ".json");
  std::ofstream(path) << text;
  std::string refusal;
  try {
    static_cast<void>(read_golden_file(path.string()));
  } catch (const haptic::tools::InputError& error) {
    refusal = error.what();
  }
  std::filesystem::remove(path);
  return refusal;
}

}  // namespace

TEST_SUITE("host_sim.vectors") {
  TEST_CASE("every golden file agrees with the core and with the oracle") {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(HAPTIC_TEST_DIR "/golden")) {
      const bool vectors =
          entry.path().extension() == ".json" && entry.path().filename() != "state_hashes.json";
      if (vectors) files.push_back(entry.path().string());
    }
    std::sort(files.begin(), files.end());
    REQUIRE(files.size() >= 19);
    std::uint64_t cases = 0, torques = 0, coherent = 0;
    for (const std::string& path : files) {
      const GoldenReport report = check_golden_file(read_golden_file(path));
      for (const std::string& failure : report.failures) FAIL_CHECK(failure);
      cases += report.cases;
      torques += tally(report, GoldenQuantity::kTorque).compared;
      coherent += tally(report, GoldenQuantity::kCoherentDepth).compared;
      CHECK(tally(report, GoldenQuantity::kDepth).compared == report.cases);
      CHECK(tally(report, GoldenQuantity::kOracleDepth).compared == 2 * report.cases);
    }
    CHECK(cases >= 240);
    CHECK(torques >=
          (sizeof(haptic::Real) == 4 ? 80 : 90));  // single precision settles fewer near sets
    CHECK(coherent >= 160);
  }

  TEST_CASE(
      "a changed expectation is found: depth, verdict, near set, force, torque, contact nodes") {
    const GoldenFile good = golden("tetra_box_face_face.json");
    REQUIRE(check_golden_file(good).passed());
    const auto failed = [&](auto change, GoldenQuantity quantity) {
      GoldenFile bad = good;
      change(bad.cases[0]);
      const GoldenReport report = check_golden_file(bad);
      return !report.passed() && tally(report, quantity).failed > 0;
    };
    const long double depth_change = sizeof(haptic::Real) == 4 ? 1e-7L : 1e-12L;
    CHECK(failed([&](GoldenCase& c) { c.d_near_m += depth_change; }, GoldenQuantity::kDepth));
    CHECK(failed([](GoldenCase& c) { c.separated = !c.separated; }, GoldenQuantity::kVerdict));
    CHECK(failed([](GoldenCase& c) { c.near.pop_back(); }, GoldenQuantity::kNearSet));
    CHECK(failed([](GoldenCase& c) { c.force_n->x += 1e-4L; }, GoldenQuantity::kForce));
    CHECK(failed([](GoldenCase& c) { c.torque_nm->y += 1e-5L; }, GoldenQuantity::kTorque));
    CHECK(
        failed([](GoldenCase& c) { c.contact_nodes->pop_back(); }, GoldenQuantity::kContactNodes));
    CHECK(failed([](GoldenCase& c) { c.depth_by_node[0].second += 1e-9L; },
                 GoldenQuantity::kOracleDepthByNode));
  }

  TEST_CASE("malformed files are refused with their place") {
    CHECK(refusal_of("{\n\"family\": \"x\",\n oops }").find(".json:3: ") != std::string::npos);
    CHECK(refusal_of("{}").find("'family' is missing") != std::string::npos);
    CHECK(refusal_of("{\"family\":\"x\",\"k_F\":\"soft\"}")
              .find("/k_F: 'soft' is not a finite decimal") != std::string::npos);
    CHECK(refusal_of("[1, 2]").find("an object is expected") != std::string::npos);
    CHECK_THROWS_AS(static_cast<void>(read_golden_file("/nonexistent.json")),
                    haptic::tools::InputError);
  }
}
