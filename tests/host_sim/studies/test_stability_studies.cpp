// SPDX-License-Identifier: Apache-2.0
// The parts of the stability report that are studies, in short form.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "host_sim/lab/optional/studies.hpp"
#include "host_sim/lab/stability/stability_report.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

/// Whether the finding that names `topic` says yes.
bool holds(const PartReport& report, const std::string& topic) {
  for (const Finding& finding : report.findings) {
    if (finding.topic.find(topic) != std::string::npos) return finding.same == "yes";
  }
  return false;
}

}  // namespace

TEST_SUITE("host_sim.stability_studies") {
  TEST_CASE("continuity and energy, files of every part, limits hold") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    StabilityOptions options;
    options.quick = true;
    for (const auto part : {continuity_part, energy_part}) {
      const PartReport report = part(options);
      CAPTURE(report.title);
      for (const Finding& finding : report.findings) {
        CAPTURE(finding.topic);
        CAPTURE(finding.ours);
        CHECK(finding.same == "yes");
      }
      CHECK(report.passed);
      CHECK(report.files.size() >= 3);
      for (const OutputText& file : report.files) {
        CHECK(file.content.size() > 200);
        CHECK(file.content.find("nan") == std::string::npos);
      }
    }
  }

  TEST_CASE("divisions: files of the part, limits hold") {
    if (HAPTIC_REAL_IS_FLOAT) return;
    const PartReport report = divisions_part({});
    for (const Finding& finding : report.findings) {
      CAPTURE(finding.topic);
      CAPTURE(finding.ours);
      CHECK(finding.same == "yes");
    }
    CHECK(report.passed);
    CHECK(report.findings.size() > 20);
    CHECK(report.files.size() == 3);
    for (const OutputText& file : report.files) {
      CHECK(file.content.size() > 200);
      CHECK(file.content.find("nan") == std::string::npos);
    }
  }

  TEST_CASE("clearance: insertion, offset, friction and steps hold their limits") {
    const PartReport report = clearance_part(true);
    CAPTURE(report.markdown);
    CHECK(report.passed);
    CHECK(report.files.size() == 3);
  }

  TEST_CASE("clearance: limits that cannot hold are seen to be passed") {
    ClearanceLimits limits;
    limits.least_ratio = 2.5;
    limits.slip_share = 0.01;
    limits.offset_m = -1;
    const PartReport report = clearance_part(true, limits);
    CHECK_FALSE(report.passed);
    CHECK_FALSE(holds(report, "step is halved"));
    CHECK_FALSE(holds(report, "sticks and slips"));
    CHECK_FALSE(holds(report, "stands off"));
    CHECK(holds(report, "reaches the floor"));
  }

  TEST_CASE("every part is there, and one is run by its number") {
    REQUIRE(studies_built());
    std::string numbers;
    for (const StabilityPart& part : stability_parts()) numbers += std::to_string(part.number);
    CHECK(numbers == "1345678");
    StabilityOptions options;
    options.quick = true;
    options.laws = {LawId::kPaper};
    const test::ScratchFolder folder("stability_studies");
    CHECK(write_stability(folder.file("one"), {5}, options));
    CHECK(test::text_of_file(folder.file("one/energy.csv")).size() > 200);
  }
}
