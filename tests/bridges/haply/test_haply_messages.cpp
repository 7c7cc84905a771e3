// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <string>

#include "tools/bridges/haply/haply_messages.hpp"

using namespace haptic::tools;

namespace {

// As docs.haply.co prints them (inverseSDK 3.x, simulation channel), shortened.
const std::string kInventory = R"({"session_id":7,"inverse3":[{"device_id":"04BA","config":{
  "type":"inverse3","port":"COM13","handedness":"right"},"state":{
  "cursor_position":{"x":0.07842738,"y":-0.14836666,"z":0.14297646},
  "cursor_velocity":{"x":-0.011969013,"y":0.0012009288,"z":-0.043197},
  "current_cursor_force":{"x":0,"y":0,"z":0}},
  "status":{"calibrated":false,"in_use":true,"power_supply":true,"ready":true,"started":true}}],
  "verse_grip":[{"device_id":"61548","config":{"type":"verse_grip"},"state":{"button":false}}],
  "wireless_verse_grip":[{"device_id":"55","state":{},"status":{"awake":false}}]})";

const std::string kState = R"({"inverse3":[
  {"device_id":"other","state":{"cursor_position":{"x":1,"y":1,"z":1}}},
  {"device_id":"04BA","state":{"cursor_position":{"x":0.1,"y":-0.2,"z":3e-1},
  "cursor_velocity":{"x":-1,"y":2,"z":0.5},"current_cursor_force":{"x":0.5,"y":0,"z":-1},
  "transform":{"position":{"x":0},"scale":{"x":1,"y":1,"z":1}}},
  "status":{"calibrated":true,"power_supply":true,"ready":true}}],
  "wireless_verse_grip":[{"device_id":"55","state":{"buttons":{"a":true,"b":false,"c":true},
  "orientation":{"w":-0.022338867,"x":-0.5019531,"y":0.8632202,"z":-0.048095703}}}]})";

const HaplyChoice kChoice{"04BA", "55", "wireless_verse_grip"};

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), with);
}

/// A state is what its header promises, after any text.
bool is_sound(const HaplyState& s) {
  double square = 0;
  for (const double x : s.q_xyzw) square += x * x;
  bool sound = std::abs(square - 1) < 1e-9 && s.buttons < 16;
  for (int k = 0; k < 3; ++k)
    sound = sound && std::abs(s.position_m[k]) <= 2 && std::abs(s.velocity_m_per_s[k]) <= 100 &&
            std::abs(s.force_n[k]) <= 1000;
  return sound;
}

/// Texts made of the right one by seeded damage: bytes changed, cut, doubled, put elsewhere.
void damage(std::uint64_t seed, unsigned rounds) {
  std::mt19937_64 random(seed);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  const std::string words[] = {
      "NaN",     "-Infinity", "1e999", "\"0.1\"",  "null",           "{",   "[[[[[[[[", "}",
      "\\u0000", "-",         "1e308", "\xff\xfe", "\"device_id\":", "true"};
  unsigned taken = 0;
  for (unsigned k = 0; k < rounds; ++k) {
    std::string text = (random() & 1) != 0 ? kState : kInventory;
    for (std::size_t n = 1 + below(4); n > 0 && !text.empty(); --n) {
      const std::size_t at = below(text.size());
      switch (random() % 5) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.resize(at);
          break;
        case 2:
          text.insert(at, words[below(std::size(words))]);
          break;
        case 3:
          text.insert(at, text.substr(below(text.size()), below(64)));
          break;
        default:
          text.erase(at, 1 + below(16));
          break;
      }
    }
    HaplyState state;
    const HaplyVerdict verdict = read_haply_state(text, kChoice, state);
    CHECK_MESSAGE(is_sound(state), text);
    if (verdict == HaplyVerdict::kOk) ++taken;
    HaplyInventory inventory;
    const bool listed = read_haply_inventory(text, inventory) == HaplyVerdict::kOk;
    CHECK((listed || inventory.devices.empty()));
    CHECK(inventory.devices.size() + inventory.grips.size() <= 4 * kMostHaplyDevices);
    static_cast<void>(read_haply_version(text));
    static_cast<void>(read_haply_sessions(text));
  }
  CHECK(taken > 0);  // not everything is refused
  CHECK(taken < rounds / 2);
}

}  // namespace

TEST_SUITE("bridges.haply_messages") {
  TEST_CASE("read_haply_version: 3.0, 3.1 and 3.5 with and without the envelope, and no other") {
    const auto format = [](const std::string& version) {
      const auto read = read_haply_version(R"({"project_version":")" + version + "\"}");
      return read ? read->format : HaplyFormat::kOther;
    };
    CHECK(format("3.0.0.0") == HaplyFormat::k30);
    CHECK(format("3.1.1.0") == HaplyFormat::k31);
    CHECK(format("3.5.0") == HaplyFormat::k35);
    CHECK(format("3.5") == HaplyFormat::k35);
    for (const char* other :
         {"3.2.0", "3.3.2", "3.4.9", "3.10.0", "3.50.1", "4.0.0", "13.5.0", "3"})
      CHECK(format(other) == HaplyFormat::kOther);
    const auto wrapped =
        read_haply_version(R"({"ok":true,"data":{"git_tag":"3.5.0","git_hash":"ce34c39e"}})");
    REQUIRE(wrapped);
    CHECK(wrapped->text == "3.5.0");
    CHECK(wrapped->format == HaplyFormat::k35);
    for (const char* none : {"", "{}", "[]", "3.5.0", R"({"project_version":3.5})",
                             R"({"project_version":"3.5\n; rm"})"})
      CHECK_FALSE(read_haply_version(none));
  }

  TEST_CASE("read_haply_inventory: devices and grips of each group with their status") {
    HaplyInventory inventory;
    REQUIRE(read_haply_inventory(kInventory, inventory) == HaplyVerdict::kOk);
    REQUIRE(inventory.devices.size() == 1);
    CHECK(inventory.devices[0].id == "04BA");
    CHECK(inventory.devices[0].kind == "inverse3");
    CHECK_FALSE(inventory.devices[0].calibrated);
    CHECK(inventory.devices[0].in_use);
    CHECK(inventory.devices[0].tells_force);
    REQUIRE(inventory.grips.size() == 2);
    CHECK(inventory.grips[0].group == "wireless_verse_grip");
    CHECK_FALSE(inventory.grips[0].awake);
    CHECK(inventory.grips[1].id == "61548");
    // A name that could end the text of a command is no name.
    const std::string name = replaced(kInventory, "04BA", R"(04\"BA)");
    REQUIRE(read_haply_inventory(name, inventory) == HaplyVerdict::kOk);
    CHECK(inventory.devices.empty());
  }

  TEST_CASE("read_haply_state: the chosen device alone, in D, with the grip's axes and buttons") {
    HaplyState s;
    REQUIRE(read_haply_state(kState, kChoice, s) == HaplyVerdict::kOk);
    CHECK(s.position_m[0] == 0.1);
    CHECK(s.position_m[2] == 0.3);
    CHECK((s.has_velocity && s.velocity_m_per_s[1] == 2));
    CHECK((s.has_force && s.force_n[2] == -1));
    CHECK((s.calibrated && s.powered && !s.moved));
    CHECK((s.has_grip && s.buttons == 5u));
    CHECK(s.q_xyzw[1] == doctest::Approx(0.8632202).epsilon(0.01));
    CHECK(s.q_xyzw[3] < 0);
    CHECK(is_sound(s));
  }

  TEST_CASE("read_haply_state: a wrong text leaves the state as it was, and says which it is") {
    struct Row {
      std::string text;
      HaplyVerdict verdict;
    };
    const Row rows[] = {
        {replaced(kState, "-0.2", "NaN"), HaplyVerdict::kNotJson},
        {replaced(kState, "-0.2", "\"-0.2\""), HaplyVerdict::kBadNumber},
        {replaced(kState, "-0.2", "null"), HaplyVerdict::kBadNumber},
        {replaced(kState, "-0.2", "1e999"), HaplyVerdict::kNotJson},
        {replaced(kState, "-0.2", "-2.5"), HaplyVerdict::kBadNumber},
        {replaced(kState, "\"y\":2", "\"y\":1e300"), HaplyVerdict::kBadNumber},
        {replaced(kState, "-0.022338867", "\"w\""), HaplyVerdict::kBadNumber},
        {replaced(kState, "0.8632202", "0"), HaplyVerdict::kBadNumber},
        {replaced(kState, "\"z\":3e-1", "\"Z\":3e-1"), HaplyVerdict::kBadNumber},
        {replaced(kState, "{\"device_id\":\"04BA\",\"state\"", "{\"device_id\":\"04BA\",\"State\""),
         HaplyVerdict::kIncomplete},
        {replaced(kState, "04BA", "04BB"), HaplyVerdict::kAbsent},
        {R"({"inverse3":[]})", HaplyVerdict::kAbsent},
        {"{}", HaplyVerdict::kAbsent},
        {"", HaplyVerdict::kNotJson},
        {"7", HaplyVerdict::kNotJson},
        {kState.substr(0, kState.size() - 1), HaplyVerdict::kNotJson},
        {kState + std::string(kMostHaplyText_bytes, ' '), HaplyVerdict::kTooLong},
        {std::string(30'000, '[') + std::string(30'000, ']'), HaplyVerdict::kTooDeep},
        {std::string(17, '[') + std::string(17, ']'), HaplyVerdict::kTooDeep}};
    for (const Row& row : rows) {
      CAPTURE(row.text.substr(0, 400));
      HaplyState s;
      s.position_m[1] = 0.7;
      CHECK(read_haply_state(row.text, kChoice, s) == row.verdict);
      CHECK(s.position_m[1] == 0.7);
      CHECK_FALSE(s.calibrated);
      CHECK(std::string(to_text(row.verdict)).size() > 4);
    }
  }

  TEST_CASE("read_haply_state: a workspace that another program has moved, a supply that is off") {
    HaplyState s;
    for (const char* moved : {R"("position":{"x":0.01})", R"("scale":{"x":2})",
                              R"("rotation":{"w":0.9,"z":0.1})", R"("scale":{"x":"1"})"}) {
      const std::string text =
          replaced(kState, R"("position":{"x":0},"scale":{"x":1,"y":1,"z":1})", moved);
      REQUIRE(read_haply_state(text, kChoice, s) == HaplyVerdict::kOk);
      CHECK(s.moved);
    }
    REQUIRE(read_haply_state(replaced(kState, R"("power_supply":true)", R"("power_supply":false)"),
                             kChoice, s) == HaplyVerdict::kOk);
    CHECK_FALSE(s.powered);
    CHECK_FALSE(s.moved);
  }

  TEST_CASE("write_haply_force: the key of each version, its own axes once, all digits") {
    std::string text;
    const double force[3] = {0.1, -2, 1e-7};
    write_haply_force(HaplyFormat::k31, "049D", force, true, text);
    CHECK(text == R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":)"
                  R"({"values":{"x":0.1,"y":-2,"z":1e-07}}}}]})");
    write_haply_force(HaplyFormat::k35, "049D", force, false, text);
    CHECK(text == R"({"inverse3":[{"device_id":"049D","commands":{"set_cursor_force":)"
                  R"({"vector":{"x":0.1,"y":-2,"z":1e-07}}}}]})");
    write_haply_force(HaplyFormat::k35, "049D", force, true, text);
    CHECK(text.find(R"("basis":{"permutation":"XYZ"})") != std::string::npos);
    CHECK(text.find(R"("preset":"defaults")") != std::string::npos);
  }

  TEST_CASE("damaged texts: never a state that is not sound") { damage(20'261, 4'000); }
  TEST_CASE("damaged texts: never a state that is not sound, in full [long]") {
    damage(7, 1'000'000);
  }
}
