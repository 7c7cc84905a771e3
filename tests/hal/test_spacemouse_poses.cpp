// SPDX-License-Identifier: Apache-2.0
/// The driver's poses for reports of all kinds are those of tests/golden/spacemouse_poses.txt,
/// which the page of host_sim/view, with a reader and an integration of its own, is compared with
/// too.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "hal/drivers/spacemouse_driver.hpp"
#include "tests/support/spacemouse_counterpart.hpp"

using namespace haptic;
using namespace haptic::hal;
using haptic::test::SpaceMouseCounterpart;

namespace {

constexpr const char* kFile = HAPTIC_TEST_DIR "/golden/spacemouse_poses.txt";
constexpr std::uint64_t kSeed = 20261130;
constexpr int kReportsEach = 40;
constexpr double kTolerance = sizeof(Real) == 8 ? 1e-12 : 1e-4;

struct Session {
  std::uint16_t vendor, product;
  const char* layout;  ///< "joined", "split" or "none": no descriptor
  std::int16_t range;
  SpaceMouseSettings settings;
};

SpaceMouseSettings settings_of(double speed, double turn, double dead_zone, double reach,
                               std::int64_t longest_ns) {
  SpaceMouseSettings s;
  s.full_speed_m_per_s = static_cast<Real>(speed);
  s.full_turn_rad_per_s = static_cast<Real>(turn);
  s.dead_zone = static_cast<Real>(dead_zone);
  s.reach_m = static_cast<Real>(reach);
  s.longest_step_ns = longest_ns;
  return s;
}

std::vector<Session> sessions() {
  return {{0x256f, 0xc635, "joined", 350, {}},
          {0x046d, 0xc626, "split", 350, {}},
          {0x046d, 0xc606, "joined", 512, {}},
          {0x256f, 0xc6ff, "none", 350, {}},
          {0x256f, 0xc633, "joined", 32767, settings_of(1.0, 5.0, 0.0, 0.02, 20'000'000)},
          {0x046d, 0xc621, "split", 500, settings_of(0.02, 0.3, 0.2, 0.25, 100'000'000)}};
}

/// A report as it may come: mostly whole ones, also short, long and foreign ones.
std::vector<std::uint8_t> some_report(std::mt19937_64& random, std::int16_t range) {
  constexpr std::uint8_t kNumbers[] = {1, 1, 1, 1, 2, 2, 2, 3, 4, 23, 255};
  constexpr std::size_t kLengths[] = {7, 7, 13, 13, 13, 6, 2, 1, 14};
  std::vector<std::uint8_t> bytes(kLengths[random() % std::size(kLengths)]);
  bytes[0] = kNumbers[random() % std::size(kNumbers)];
  for (std::size_t i = 1; i + 1 < bytes.size(); i += 2) {
    const auto kind = random() % 4;
    const auto span = static_cast<std::int64_t>(range) * (kind == 0 ? 4 : 1);
    std::int64_t value =
        static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(2 * span + 1)) - span;
    if (kind == 1) value = 0;
    const auto pattern = static_cast<std::uint16_t>(static_cast<std::int16_t>(value));
    bytes[i] = static_cast<std::uint8_t>(pattern & 0xff);
    bytes[i + 1] = static_cast<std::uint8_t>(pattern >> 8);
  }
  return bytes;
}

std::string state_text(const DeviceState& state) {
  std::string text;
  char number[40];
  for (const Real x : state.pose_dh.p_m) {
    std::snprintf(number, sizeof number, " %.15f", static_cast<double>(x));
    text += number;
  }
  for (const Real x : state.pose_dh.q_xyzw) {
    std::snprintf(number, sizeof number, " %.15f", static_cast<double>(x));
    text += number;
  }
  return text + " " + std::to_string(state.switches);
}

void write_session(const Session& session, std::mt19937_64& random, std::ostream& out) {
  const bool joined = std::string(session.layout) == "joined";
  SpaceMouseCounterpart device(joined, session.range);
  if (std::string(session.layout) == "none") device.descriptor.clear();
  SpaceMouseSettings settings = session.settings;
  settings.vendor_id = session.vendor;
  settings.product_id = session.product;
  SpaceMouseDriver driver(settings);
  REQUIRE(driver.start(device) == HalStatus::kOk);
  char head[160];
  std::snprintf(
      head, sizeof head, "session %04x %04x %s %d %.3f %.3f %.3f %.3f %lld\n",
      static_cast<unsigned>(session.vendor), static_cast<unsigned>(session.product), session.layout,
      static_cast<int>(session.range), static_cast<double>(settings.full_speed_m_per_s),
      static_cast<double>(settings.full_turn_rad_per_s), static_cast<double>(settings.dead_zone),
      static_cast<double>(settings.reach_m), static_cast<long long>(settings.longest_step_ns));
  out << head;
  DeviceState state;
  std::int64_t stamp_ns = 1'000'000'000;
  REQUIRE(driver.rest(stamp_ns, state));
  for (int i = 0; i < kReportsEach; ++i) {
    // Also two at one time, one that is late, and a pause.
    constexpr std::int64_t kSteps_us[] = {8000, 8000, 8000, 16000, 11300, 0, -5000, 170000};
    stamp_ns += 1000 * kSteps_us[random() % std::size(kSteps_us)];
    if (random() % 5 == 0) {
      REQUIRE(driver.rest(stamp_ns, state));
      out << "rest " << stamp_ns;
    } else {
      const std::vector<std::uint8_t> report = some_report(random, session.range);
      static_cast<void>(driver.read(report, stamp_ns, state));
      out << "report " << stamp_ns << ' ';
      char byte[4];
      for (const std::uint8_t value : report) {
        std::snprintf(byte, sizeof byte, "%02x", static_cast<unsigned>(value));
        out << byte;
      }
    }
    out << state_text(state) << '\n';
  }
}

/// Everything that the file holds, as this driver has it.
std::string whole() {
  std::ostringstream out;
  char line[120];
  for (const SpaceMouseModel& model : spacemouse_models()) {
    std::snprintf(line, sizeof line, "model %04x %04x %s %s\n",
                  static_cast<unsigned>(model.vendor_id), static_cast<unsigned>(model.product_id),
                  model.axes.swap_yz ? "older" : "current", model.name);
    out << line;
  }
  for (unsigned product = 0; product <= 0xffff; ++product) {
    if (!is_refused_spacemouse(k3DconnexionId, static_cast<std::uint16_t>(product))) continue;
    std::snprintf(line, sizeof line, "refused %04x\n", product);
    out << line;
  }
  std::mt19937_64 random(kSeed);
  for (const Session& session : sessions()) write_session(session, random, out);
  return out.str();
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

}  // namespace

TEST_SUITE("hal.spacemouse_poses") {
  TEST_CASE("golden: the models and the pose after each report are those of the file") {
    std::ifstream file(kFile);
    REQUIRE_MESSAGE(file.good(), "cannot read " << kFile);
    std::stringstream text;
    text << file.rdbuf();
    const std::vector<std::string> golden = words_of(text.str()), got = words_of(whole());
    REQUIRE(golden.size() == got.size());
    int moved = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
      CAPTURE(i);
      if (got[i].find('.') == std::string::npos) {
        REQUIRE(got[i] == golden[i]);
        continue;
      }
      const double a = std::strtod(got[i].c_str(), nullptr);
      REQUIRE(std::abs(a - std::strtod(golden[i].c_str(), nullptr)) <= kTolerance);
      moved += std::abs(a) > 1e-3 && std::abs(a) < 0.9 ? 1 : 0;
    }
    CHECK(moved > 500);  // the file is of poses that move
  }

  TEST_CASE("rewrite the golden file" * doctest::skip()) {
    REQUIRE(sizeof(Real) == 8);  // of the default scalar
    std::ofstream file(kFile);
    file << whole();
    REQUIRE(file.good());
  }
}
