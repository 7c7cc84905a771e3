// SPDX-License-Identifier: Apache-2.0
/// Any text as a message of Haply's service, as its version or as its list of sessions: refused, or
/// numbers that are finite and within a table, names that a command can carry, lists of bounded
/// length; and what is refused changes nothing.
#include <cmath>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/bridges/haply/haply_messages.hpp"

namespace {

using namespace haptic;
using namespace haptic::tools;
using fuzz::require;

const HaplyChoice kChoice{"04BA", "55", "wireless_verse_grip"};

void require_sound(const HaplyState& s) {
  double square = 0;
  for (const double x : s.q_xyzw) square += x * x;
  require(std::abs(square - 1) < 1e-9, "a grip's quaternion is a unit");
  require(s.buttons < 16, "four buttons");
  for (int k = 0; k < 3; ++k) {
    require(std::abs(s.position_m[k]) <= 2 && std::abs(s.velocity_m_per_s[k]) <= 100,
            "a position on a table, at a speed of a hand");
    require(std::abs(s.force_n[k]) <= 1000, "a force that a device could have");
  }
}

void require_name(const std::string& name) {
  require(!name.empty() && name.size() <= kMostHaplyName_bytes, "a name of bounded length");
  for (const char c : name) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                       c == '-' || c == '_' || c == '.';
    require(plain, "a name that a command can carry");
  }
}

bool same(const HaplyState& a, const HaplyState& b) {
  bool equal = a.buttons == b.buttons && a.calibrated == b.calibrated && a.powered == b.powered &&
               a.moved == b.moved && a.has_grip == b.has_grip;
  for (int k = 0; k < 3; ++k)
    equal = equal && a.position_m[k] == b.position_m[k] && a.force_n[k] == b.force_n[k];
  for (int k = 0; k < 4; ++k) equal = equal && a.q_xyzw[k] == b.q_xyzw[k];
  return equal;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  HaplyState state;
  state.position_m[0] = 0.25;
  state.buttons = 5;
  const HaplyState before = state;
  const HaplyVerdict verdict = read_haply_state(text, kChoice, state);
  require(verdict < HaplyVerdict::kCount, "a verdict of the list");
  require_sound(state);
  require(verdict == HaplyVerdict::kOk || same(state, before), "what is refused changes nothing");
  HaplyInventory inventory;
  if (read_haply_inventory(text, inventory) == HaplyVerdict::kOk) {
    for (const auto* list : {&inventory.devices, &inventory.grips}) {
      require(list->size() <= 3 * kMostHaplyDevices, "lists of bounded length");
      for (const HaplyListed& each : *list) require_name(each.id);
    }
    for (const HaplyListed& each : inventory.devices) {
      std::string out;
      write_haply_force(HaplyFormat::k35, each.id, {0.5, -1, 2}, true, out);
      require(out.size() < 4096, "a command of bounded length");
    }
  }
  if (const auto version = read_haply_version(text))
    require(version->text.size() <= size, "a version that was in the text");
  (void)read_haply_sessions(text);
  return 0;
}

std::vector<haptic::fuzz::Seed> haptic::fuzz::seeds() {
  // As docs.haply.co prints them (inverseSDK 3.x), shortened.
  return {{"inventory", R"({"session_id":7,"inverse3":[{"device_id":"04BA","config":{
  "type":"inverse3","port":"COM13","handedness":"right"},"state":{
  "cursor_position":{"x":0.07842738,"y":-0.14836666,"z":0.14297646},
  "cursor_velocity":{"x":-0.011969013,"y":0.0012009288,"z":-0.043197},
  "current_cursor_force":{"x":0,"y":0,"z":0}},
  "status":{"calibrated":false,"in_use":true,"power_supply":true,"ready":true,"started":true}}],
  "wireless_verse_grip":[{"device_id":"55","state":{},"status":{"awake":false}}]})"},
          {"state", R"({"inverse3":[{"device_id":"04BA","state":{
  "cursor_position":{"x":0.1,"y":-0.2,"z":3e-1},"cursor_velocity":{"x":-1,"y":2,"z":0.5},
  "current_cursor_force":{"x":0.5,"y":0,"z":-1},
  "transform":{"position":{"x":0},"scale":{"x":1,"y":1,"z":1}}},
  "status":{"calibrated":true,"power_supply":true,"ready":true}}],
  "wireless_verse_grip":[{"device_id":"55","state":{"buttons":{"a":true,"b":false,"c":true},
  "orientation":{"w":-0.022338867,"x":-0.5019531,"y":0.8632202,"z":-0.048095703}}}]})"},
          {"keyed", R"({"inverse3":{"04BA":{"state":{"cursor_position":{"x":0,"y":0,"z":0}}}}})"},
          {"version", R"({"ok":true,"data":{"project_version":"3.5.1.0","git_tag":"3.5.0"}})"},
          {"sessions", R"({"ok":true,"data":{"sessions":[{"session_id":1},{"session_id":2}]}})"},
          {"deep", std::string(40, '[') + "1" + std::string(40, ']')}};
}
