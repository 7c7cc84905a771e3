// SPDX-License-Identifier: Apache-2.0
/// Any bytes as the line by which `device_bridge --probe --json` answers, and any bytes as the
/// words of a device in that line: read or refused with a reason, in words of bounded length.
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/fuzz/report_stream.hpp"
#include "tools/bridges/facts_text.hpp"
#include "tools/run_device/bridge_answer.hpp"

namespace {

using namespace haptic;
using namespace haptic::tools;
using fuzz::ReportStream;
using fuzz::require;

void check(const BridgeAnswer& answer) {
  for (const std::string* text : {&answer.name, &answer.words, &answer.why})
    require(text->size() <= kMostBridgeAnswer, "words of bounded length");
  require(answer.found || !answer.why.empty(), "a device that is not found has a reason");
  require(!answer.found || !answer.name.empty(), "a device that is found has a name");
}

/// A device that calls itself anything, and states any numbers.
void tell_and_read(ReportStream& input) {
  hal::BridgeFacts facts;
  const std::span<const std::uint8_t> name = input.report(), words = input.report();
  facts.name.assign(name.begin(), name.end());
  facts.words.assign(words.begin(), words.end());
  facts.capabilities.max_force_n = input.number();
  facts.capabilities.max_torque_nm = input.number();
  facts.capabilities.max_stiffness_n_per_m = input.number();
  facts.capabilities.driven_dof = input.byte();
  const std::string line = facts_line("any", &facts, "");
  require(line.find('\n') == std::string::npos, "one line");
  const BridgeAnswer answer = read_bridge_answer(line);
  check(answer);
  require(answer.found == !facts.name.empty(), "what a bridge tells is read");
  (void)facts_text("any", &facts, "");
  const BridgeAnswer absent = read_bridge_answer(facts_line("any", nullptr, facts.words));
  check(absent);
  require(!absent.found, "a device that is not there is not found");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  if (data[0] % 4 == 0) {
    ReportStream input(std::span<const std::uint8_t>(data + 1, size - 1));
    tell_and_read(input);
    return 0;
  }
  check(read_bridge_answer({reinterpret_cast<const char*>(data + 1), size - 1}));
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  return {
      {"found",
       R"(j{"bridge":"haply","found":true,"name":"Inverse3, serial 04a1","words":"x","max_force_n":8})"},
      {"absent", R"(j{"bridge":"spacenav","found":false,"why":"spacenavd is not running"})"},
      {"wrong_kinds", R"(j{"bridge":1,"found":"yes","name":[],"words":{},"why":null})"},
      {"deep", "j" + std::string(2000, '[')},
      {"brackets_in_a_name", std::string("\0\6[[{[[[\0", 9)},
      {"no_json", "jdevice_bridge: no such bridge"},
      {"told", std::string("\0\5Touch\6a word\0\0\x50\x41", 18)},
      {"not_utf8", std::string("\0\4\xff\xfe\xc3\x28\3\xed\xa0\x80", 10)}};
}
