// SPDX-License-Identifier: Apache-2.0
// Faults of the device and its bus: scripts, and the filter of reports.
#include <doctest/doctest.h>

#include <fstream>
#include <string>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "host_sim/device/device_fault.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = DeviceFaultKind;

std::vector<DeviceFaultEvent> script(const std::string& text, double rate_hz = 1000) {
  const test::ScratchFolder folder("device_fault");
  const std::string path = folder.file("test_device_fault.toml");
  std::ofstream(path) << text;
  return read_fault_script(path, rate_hz);
}

std::string refusal(const std::string& text) {
  try {
    static_cast<void>(script(text));
  } catch (const tools::InputError& error) {
    return error.what();
  }
  return "accepted";
}

Bytes report_of(std::uint32_t sequence) {
  hal::ReferenceReport report;
  report.sequence = sequence;
  Bytes bytes(hal::kReferenceReportBytes);
  hal::encode(report, std::span<std::uint8_t, hal::kReferenceReportBytes>(bytes));
  return bytes;
}

/// Sequences of what goes out in periods 1 to `periods`, -1 for what does not decode.
std::vector<std::vector<int>> passed(const DeviceFaultEvent& event, unsigned periods) {
  ReportFaultFilter filter;
  filter.add(event);
  std::vector<std::vector<int>> all;
  for (unsigned k = 1; k <= periods; ++k) {
    std::vector<int>& now = all.emplace_back();
    for (const Bytes& bytes : filter.pass(k, report_of(k))) {
      hal::ReferenceReport report;
      const bool good = hal::decode(bytes, report) == hal::CodecVerdict::kOk;
      now.push_back(good ? static_cast<int>(report.sequence) : -1);
    }
  }
  return all;
}

using Passed = std::vector<std::vector<int>>;

}  // namespace

TEST_SUITE("host_sim.device_fault") {
  TEST_CASE("script: every kind, defaults, order of periods") {
    std::string text = "format = 1\n";
    for (const DeviceFaultRule& rule : device_fault_kinds()) {
      text += "[[fault]]\nkind = \"" + std::string(rule.name) + "\"\nreport = 7\n";
      CHECK(std::string(to_text(rule.kind)) == rule.name);
    }
    text += "[[fault]]\nkind = \"late\"\nt_s = 0.0031\ncount = 2\namount = 50\n";
    text += "[[fault]]\nkind = \"stall\"\nreport = 4\nendpoint = \"out\"\ncount = 3\n";
    const std::vector<DeviceFaultEvent> events = script(text);
    REQUIRE(events.size() == device_fault_kinds().size() + 2);
    CHECK(events[0].kind == Kind::kLate);
    CHECK(events[0].report == 3);
    CHECK(events[0].amount == 50);
    CHECK(events[1].out_endpoint);
    CHECK(events[1].count == 3);
    for (std::size_t k = 2; k < events.size(); ++k) {
      CHECK(events[k].report == 7);
      CHECK(events[k].count == 1);
      CHECK(events[k].amount == device_fault_kinds()[k - 2].usual);
    }
    CHECK(script("format = 1\n").empty());
  }

  TEST_CASE("script: what is wrong is named with file, line and fix") {
    const std::string head = "format = 1\n[[fault]]\n";
    const std::pair<std::string, std::string> cases[] = {
        {"[[fault]]\n", "toml:1: not a fault script of this format; begin with format = 1"},
        {"format = 2\n", "toml:1: not a fault script"},
        {"format = 1\nfaults = 3\n", "toml:2: unknown key 'faults'"},
        {"format = 1\nfault = 3\n", "toml:2: fault must be a list of tables"},
        {"format = 1\n[[fault]\n", "toml:2:9: not valid TOML"},
        {head + "report = 3\n", "toml:2: the key 'kind' is missing"},
        {head + "kind = \"lots\"\nreport = 3\n",
         "toml:3: no such kind of fault; use one of: unplug"},
        {head + "kind = 4\nreport = 3\n", "toml:3: no such kind"},
        {head + "kind = \"lost\"\n", "toml:2: give either report or t_s"},
        {head + "kind = \"lost\"\nreport = 1\nt_s = 1\n", "toml:2: give either"},
        {head + "kind = \"lost\"\nreport = 0\n", "toml:4: report must be a whole number from 1"},
        {head + "kind = \"lost\"\nreport = 1.5\n", "toml:4: report must be a whole number"},
        {head + "kind = \"lost\"\nt_s = nan\n", "toml:4: t_s must be a number from 0"},
        {head + "kind = \"lost\"\nreport = 1\ncount = 0\n", "toml:5: count must be a whole number"},
        {head + "kind = \"late\"\nreport = 1\namount = 1001\n", "toml:5: amount must be a whole"},
        {head + "kind = \"encoder_jump\"\nreport = 1\namount = 2\n", "from -1 to 1"},
        {head + "kind = \"lost\"\nreport = 1\namount = 1\n",
         "'amount' means nothing for a lost; remove"},
        {head + "kind = \"unplug\"\nreport = 1\ncount = 2\n",
         "toml:5: the key 'count' means nothing"},
        {head + "kind = \"stall\"\nreport = 1\nendpoint = \"up\"\n", "\"in\" or \"out\""},
        {head + "kind = \"lost\"\nreport = 1\nwhen = 2\n", "toml:5: the key 'when' means nothing"}};
    for (const auto& [written, expected] : cases) {
      const std::string& text = written;
      CAPTURE(text);
      const std::string said = refusal(text);
      CAPTURE(said);
      CHECK(said.find(expected) != std::string::npos);
      CHECK(said.find("/test_device_fault.toml") != std::string::npos);
    }
  }

  TEST_CASE("filter: order and number of reports") {
    CHECK(passed({Kind::kLost, 2, 2}, 4) == Passed{{1}, {}, {}, {4}});
    CHECK(passed({Kind::kDoubled, 2, 2}, 4) == Passed{{1}, {2, 2}, {3, 3}, {4}});
    CHECK(passed({Kind::kReordered, 2, 2}, 6) == Passed{{1}, {}, {3, 2}, {}, {5, 4}, {6}});
    CHECK(passed({Kind::kLate, 2, 1, 3}, 6) == Passed{{1}, {}, {}, {}, {2, 5}, {6}});
    CHECK(passed({Kind::kLate, 2, 2, 2}, 7) == Passed{{1}, {}, {}, {2}, {}, {4, 6}, {7}});
    CHECK(passed({Kind::kLate, 2, 1, 1}, 4) == Passed{{1}, {}, {2, 3}, {4}});
    CHECK(passed({Kind::kFrozen, 3, 2}, 6) == Passed{{1}, {2}, {2}, {2}, {5}, {6}});
    CHECK(passed({Kind::kStall, 2, 2}, 3) == Passed{{1}, {2}, {3}});
    CHECK(passed({Kind::kLost, 0, 1}, 2) == Passed{{}, {2}});
  }

  TEST_CASE("filter: damaged bytes") {
    ReportFaultFilter filter;
    filter.add({Kind::kShort, 1, 1, 5});
    filter.add({Kind::kLong, 2, 1, 7});
    filter.add({Kind::kCorrupt, 3, 200, 3});
    CHECK(filter.pass(1, report_of(1)).at(0).size() == 91);
    CHECK(filter.pass(2, report_of(2)).at(0).size() == 103);
    std::vector<Bytes> turned;
    for (unsigned k = 3; k < 203; ++k) {
      const Bytes good = report_of(k), bad = filter.pass(k, good).at(0);
      REQUIRE(bad.size() == good.size());
      int flipped = 0;
      Bytes difference(good.size());
      for (std::size_t i = 0; i < good.size(); ++i) {
        difference[i] = good[i] ^ bad[i];
        flipped += __builtin_popcount(difference[i]);
      }
      CHECK(flipped == 3);
      hal::ReferenceReport report;
      CHECK(hal::decode(bad, report) != hal::CodecVerdict::kOk);
      turned.push_back(difference);
    }
    CHECK(turned.front() != turned.back());
    CHECK(filter.pass(203, report_of(203)).at(0) == report_of(203));
  }

  TEST_CASE("filter: two faults at one report both show") {
    ReportFaultFilter filter;
    filter.add({Kind::kDoubled, 1, 1});
    filter.add({Kind::kShort, 1, 1, 1});
    const auto sent = filter.pass(1, report_of(1));
    REQUIRE(sent.size() == 2);
    CHECK(sent[0].size() == 95);
    CHECK(sent[0] == sent[1]);
  }
}

}  // namespace haptic::sim
