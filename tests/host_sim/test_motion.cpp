// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "host_sim/session/motion_script.hpp"
#include "rt_core/base/scalar.hpp"
#include "tools/common/error.hpp"

namespace {

using haptic::sim::MotionSample;
using haptic::sim::MotionScript;
using haptic::sim::WayPoint;

// A file of the test's own in the temporary folder, removed at the end.
class TestFile {
 public:
  explicit TestFile(const std::string& name, const std::string& text = "")
      : path_(std::filesystem::temp_directory_path() / ("haptic_test_motion_" + name)) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~TestFile() { std::filesystem::remove(path_); }
  TestFile(const TestFile&) = delete;
  TestFile& operator=(const TestFile&) = delete;
  [[nodiscard]] std::string path() const { return path_.string(); }
  [[nodiscard]] std::string text() const {
    std::ifstream file(path_, std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  }

 private:
  std::filesystem::path path_;
};

const std::string kHeader = "t,x,y,z,qw,qx,qy,qz\n";

// The text of the refusal, empty when the file is taken.
std::string refusal_of_csv(const std::string& text) {
  const TestFile file("refused.csv", text);
  try {
    (void)haptic::sim::read_motion_csv(file.path());
  } catch (const haptic::tools::InputError& error) {
    return error.what();
  }
  return "";
}

std::string refusal_of_script(const std::string& text) {
  const TestFile file("refused.toml", text);
  try {
    (void)haptic::sim::read_motion_script(file.path());
  } catch (const haptic::tools::InputError& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

double quaternion_norm(const MotionSample& sample) {
  double square = 0.0;
  for (const double c : sample.q_wxyz) square += c * c;
  return std::sqrt(square);
}

const std::string kScript =
    "format = 1\n"
    "rate_hz = 1000\n"
    "seed = 42\n"
    "[tremor]\n"
    "position_m = 0.0002\n"
    "angle_rad = 0.0035\n"
    "band_hz = [8.0, 12.0]\n"
    "[[waypoint]]\n"
    "phase = \"start\"\n"
    "t_s = 0.0\n"
    "position_m = [0.01, 0.0, 0.1]\n"
    "[[waypoint]]\n"
    "phase = \"down\"\n"
    "t_s = 1.0\n"
    "position_m = [0.0, 0.02, 0.05]\n"
    "axis = [0, 0, 2]\n"
    "angle_rad = 1.0\n"
    "[[waypoint]]\n"
    "phase = \"hold\"\n"
    "t_s = 1.5\n"
    "position_m = [0.0, 0.02, 0.05]\n"
    "quaternion = { w = 0.5, x = 0.5, y = -0.5, z = 0.5 }\n"
    "tremor = 0\n";

/// The smallest, as the README has it.
const std::string kSmallest =
    "format = 1\n[[waypoint]]\nt_s = 0.0\nposition_m = [0, 0, 0.05]\n"
    "[[waypoint]]\nt_s = 2.0\nposition_m = [0, 0, -0.01]\n";

MotionScript script_from(const std::string& text) {
  const TestFile file("script.toml", text);
  return haptic::sim::read_motion_script(file.path());
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

}  // namespace

TEST_SUITE("host_sim.motion_csv") {
  TEST_CASE("read: values, order and normalised quaternions") {
    const TestFile file("good.csv",
                        kHeader + "0,0.1,-0.2,3e-1,1.0005,0,0,0\n0.001,1,2,3,0,0,-1,0\n");
    const std::vector<MotionSample> motion = haptic::sim::read_motion_csv(file.path());
    REQUIRE(motion.size() == 2);
    CHECK(motion[0].p[0] == 0.1);
    CHECK(motion[0].p[1] == -0.2);
    CHECK(motion[0].p[2] == 0.3);
    CHECK(motion[0].q_wxyz[0] == 1.0);
    CHECK(motion[1].t_s == 0.001);
    CHECK(motion[1].q_wxyz[2] == -1.0);
  }

  TEST_CASE("read: line ends, byte order mark, missing last line end and blank tail are accepted") {
    const std::string body = "t,x,y,z,qw,qx,qy,qz\r\n0,0,0,0,1,0,0,0\r\n0.5,0,0,0,1,0,0,0";
    for (const std::string& text : {body, "\xEF\xBB\xBF" + body, body + "\r\n\r\n\n"}) {
      const TestFile file("ends.csv", text);
      CHECK(haptic::sim::read_motion_csv(file.path()).size() == 2);
    }
  }

  TEST_CASE("read: bad files are refused with file, line and column") {
    const std::string good = "0,0,0,0,1,0,0,0\n";
    CHECK(refusal_of_csv(kHeader + good).empty());
    CHECK(contains(refusal_of_csv(""), "is empty"));
    CHECK(contains(refusal_of_csv("\n\n"), "is empty"));
    CHECK(contains(refusal_of_csv(kHeader), "no sample"));
    CHECK(contains(refusal_of_csv("t,x,y,z,qx,qy,qz,qw\n" + good), "refused.csv:1: the header"));
    CHECK(contains(refusal_of_csv(kHeader + good + "1,0,0,0,1,0,0\n"),
                   ":3: the line ends before column qz"));
    CHECK(contains(refusal_of_csv(kHeader + "0,0,0,0,1,0,0,0,0\n"), ":2: text after column qz"));
    CHECK(contains(refusal_of_csv(kHeader + "0,0,nan,0,1,0,0,0\n"), ":2: column y is not finite"));
    CHECK(contains(refusal_of_csv(kHeader + "0,0,0,-inf,1,0,0,0\n"), ":2: column z is not finite"));
    CHECK(contains(refusal_of_csv(kHeader + "0,0,0,1e999,1,0,0,0\n"), "out of range"));
    CHECK(contains(refusal_of_csv(kHeader + "0,0,zero,0,1,0,0,0\n"), "column y is not a number"));
    CHECK(contains(refusal_of_csv(kHeader + "0,,0,0,1,0,0,0\n"), "column x is not a number"));
    CHECK(contains(refusal_of_csv(kHeader + "0;0;0;0;1;0;0;0\n"), "no comma before column x"));
    CHECK(contains(refusal_of_csv(kHeader + "0,0,0,0,1.002,0,0,0\n"), "not 1; normalise"));
    CHECK(contains(refusal_of_csv(kHeader + "0,0,0,0,0,0,0,0\n"), "not 1; normalise"));
    CHECK(contains(refusal_of_csv(kHeader + good + good), ":3: the time does not increase"));
    CHECK(
        contains(refusal_of_csv(kHeader + good + "\n1,0,0,0,1,0,0,0\n"), ":3: the line is blank"));
    CHECK_THROWS_AS((void)haptic::sim::read_motion_csv("/nonexistent/motion.csv"),
                    haptic::tools::InputError);
  }

  TEST_CASE("write: fixed digits, and reading gives the samples back") {
    const std::vector<MotionSample> motion = haptic::sim::make_motion(script_from(kScript));
    const TestFile file("written.csv");
    haptic::sim::write_motion_csv(file.path(), motion);
    const std::vector<MotionSample> again = haptic::sim::read_motion_csv(file.path());
    REQUIRE(again.size() == motion.size());
    for (std::size_t i = 0; i < motion.size(); ++i) {
      REQUIRE(std::abs(again[i].t_s - motion[i].t_s) <= 0.5e-6);
      for (int k = 0; k < 3; ++k) REQUIRE(std::abs(again[i].p[k] - motion[i].p[k]) <= 0.51e-9);
      for (int k = 0; k < 4; ++k)
        REQUIRE(std::abs(again[i].q_wxyz[k] - motion[i].q_wxyz[k]) <= 1.1e-12);
    }
    CHECK(contains(file.text(), "\n0.001000,"));
    CHECK_THROWS_AS(haptic::sim::write_motion_csv("/nonexistent/motion.csv", motion),
                    haptic::tools::OsError);
  }

  TEST_CASE("read: a long recording is read in one fast pass") {
    std::vector<MotionSample> motion(80000);
    for (std::size_t i = 0; i < motion.size(); ++i) motion[i].t_s = 0.001 * static_cast<double>(i);
    const TestFile file("long.csv");
    haptic::sim::write_motion_csv(file.path(), motion);
    const auto start = std::chrono::steady_clock::now();
    CHECK(haptic::sim::read_motion_csv(file.path()).size() == motion.size());
    const std::chrono::duration<double, std::milli> spent =
        std::chrono::steady_clock::now() - start;
    MESSAGE("80000 lines read in " << spent.count() << " ms");
  }

  TEST_CASE("read: the recordings of the shared parts are accepted") {
    const std::filesystem::path folder = std::filesystem::path(HAPTIC_SHARED_DIR) / "data";
    if (!std::filesystem::exists(folder)) {
      MESSAGE("skipped: " << folder.string() << " is absent");
      return;
    }
    std::size_t count = 0;
    for (const auto& task : std::filesystem::directory_iterator(folder)) {
      const std::filesystem::path file = task.path() / "trajectory.csv";
      if (!std::filesystem::exists(file)) continue;
      CHECK(haptic::sim::read_motion_csv(file.string()).size() > 1000);
      ++count;
    }
    CHECK(count > 0);
  }
}

TEST_SUITE("host_sim.motion_script") {
  TEST_CASE("read: every key reaches the script") {
    const MotionScript script = script_from(kScript);
    CHECK(script.rate_hz == 1000.0);
    CHECK(script.seed == 42);
    CHECK(script.tremor.position_m == 0.0002);
    CHECK(script.tremor.angle_rad == 0.0035);
    CHECK(script.tremor.band_hz[0] == 8.0);
    CHECK(script.tremor.band_hz[1] == 12.0);
    REQUIRE(script.waypoints.size() == 3);
    CHECK(script.waypoints[0].q_wxyz[0] == 1.0);
    CHECK(script.waypoints[1].phase == "down");
    CHECK(script_from(kSmallest).waypoints[1].phase == "motion");
    CHECK(script.waypoints[1].p[1] == 0.02);
    CHECK(script.waypoints[1].q_wxyz[0] == doctest::Approx(std::cos(0.5)).epsilon(1e-6));
    CHECK(script.waypoints[1].q_wxyz[3] == doctest::Approx(std::sin(0.5)).epsilon(1e-6));
    CHECK(script.waypoints[2].q_wxyz[2] == -0.5);
    CHECK(script.waypoints[2].tremor == 0.0);
    CHECK(haptic::sim::phase_at(script, -1.0) == "down");
    CHECK(haptic::sim::phase_at(script, 0.999) == "down");
    CHECK(haptic::sim::phase_at(script, 1.0) == "hold");
    CHECK(haptic::sim::phase_at(script, 9.0) == "hold");
  }

  TEST_CASE("read: bad scripts are refused with file and line") {
    CHECK(refusal_of_script(kScript).empty());
    const auto refusal = [](const std::string& what, const std::string& by) {
      return refusal_of_script(replaced(kScript, what, by));
    };
    CHECK(contains(refusal("seed = 42", "sead = 42"), "refused.toml:3: unknown key 'sead'"));
    CHECK(contains(refusal("seed = 42", "seed = -1"), ":3: seed"));
    CHECK(contains(refusal("seed = 42", "seed = 1.5"), ":3: seed"));
    CHECK(contains(refusal("format = 1", "format = 2"), ":1: format"));
    CHECK(contains(refusal("format = 1\n", ""), "'format' is missing"));
    CHECK(contains(refusal("rate_hz = 1000", "rate_hz = 0"), ":2: rate_hz"));
    CHECK(contains(refusal("rate_hz = 1000", "rate_hz = nan"), ":2: rate_hz"));
    CHECK(contains(refusal("rate_hz = 1000", "rate_hz = \"fast\""), ":2: rate_hz"));
    CHECK(contains(refusal("[8.0, 12.0]", "[12.0, 8.0]"), ":7: band_hz runs backwards"));
    CHECK(contains(refusal("[8.0, 12.0]", "[8.0, 501.0]"), ":7: band_hz"));
    CHECK(contains(refusal("0.0002", "-0.1"), ":5: position_m"));
    CHECK(contains(refusal("t_s = 1.0", "t_s = 0.0"), ":12: t_s must be later"));
    CHECK(contains(refusal("[0.01, 0.0, 0.1]", "[0.01, 0.0]"), ":11: position_m"));
    CHECK(contains(refusal("[0.01, 0.0, 0.1]", "[0.01, 0.0, true]"), ":11: position_m"));
    CHECK(contains(refusal("[0, 0, 2]", "[0, 0, 0]"), "axis has no length"));
    CHECK(contains(refusal("angle_rad = 1.0\n", ""), "go together"));
    CHECK(contains(refusal("angle_rad = 1.0\n", "angle_rad = 3.1\n"), "more than 3 rad"));
    CHECK(contains(refusal("w = 0.5", "w = 0.6"), "not 1; normalise"));
    CHECK(contains(refusal("tremor = 0\n", "tremor = 2\n"), "tremor must be"));
    CHECK(contains(refusal("phase = \"down\"", "phase = \"\""), "phase"));
    CHECK(contains(refusal("[tremor]", "[tremor"), "not valid TOML"));
    CHECK(contains(refusal_of_script("format = 1\n"), "'waypoint' is missing"));
    CHECK_THROWS_AS((void)haptic::sim::read_motion_script("/nonexistent/motion.toml"),
                    haptic::tools::InputError);
  }

  TEST_CASE("make: covers the script at the rate, passes through the way points at rest") {
    MotionScript script = script_from(kScript);
    script.tremor = {};
    const std::vector<MotionSample> motion = haptic::sim::make_motion(script);
    REQUIRE(motion.size() == 1501);
    CHECK(motion.back().t_s == doctest::Approx(1.5));
    const std::size_t at[3] = {0, 1000, 1500};
    for (std::size_t i = 0; i < 3; ++i) {
      const WayPoint& point = script.waypoints[i];
      const MotionSample& sample = motion[at[i]];
      double dot = 0.0;
      for (int k = 0; k < 3; ++k) CHECK(std::abs(sample.p[k] - point.p[k]) < 1e-12);
      for (int k = 0; k < 4; ++k) dot += sample.q_wxyz[k] * point.q_wxyz[k];
      CHECK(std::abs(dot) > 1.0 - 1e-9);
    }
    // Minimum jerk: half way in the middle, peak speed 1.875 times the mean, almost still at the
    // ends.
    CHECK(motion[500].p[2] == doctest::Approx(0.075));
    CHECK((motion[500].p[2] - motion[501].p[2]) / 0.001 ==
          doctest::Approx(1.875 * 0.05).epsilon(1e-4));
    CHECK(std::abs(motion[999].p[2] - motion[1000].p[2]) < 1e-9);
    // A quarter of the angle of the blend at s = 0.5: turn of 1 rad about z.
    CHECK(motion[500].q_wxyz[3] == doctest::Approx(std::sin(0.25)).epsilon(1e-6));
    CHECK(motion[500].q_wxyz[1] == doctest::Approx(0.0));
  }

  TEST_CASE("make: the tremor stays within its amplitude and its band, and fades with its factor") {
    MotionScript script = script_from(kScript);
    const std::vector<MotionSample> with = haptic::sim::make_motion(script);
    script.tremor = {};
    const std::vector<MotionSample> without = haptic::sim::make_motion(script);
    REQUIRE(with.size() == without.size());
    double largest_m = 0.0;
    double largest_rad = 0.0;
    int crossings = 0;
    for (std::size_t i = 0; i < with.size(); ++i) {
      CHECK(std::abs(quaternion_norm(with[i]) - 1.0) < 1e-15);
      double dot = 0.0;
      for (int k = 0; k < 3; ++k)
        largest_m = std::max(largest_m, std::abs(with[i].p[k] - without[i].p[k]));
      for (int k = 0; k < 4; ++k) dot += with[i].q_wxyz[k] * without[i].q_wxyz[k];
      largest_rad = std::max(largest_rad, 2.0 * std::acos(std::min(1.0, std::abs(dot))));
      if (i > 0 && i <= 1000) {
        const double before = with[i - 1].p[0] - without[i - 1].p[0];
        crossings += (before < 0.0) != (with[i].p[0] - without[i].p[0] < 0.0) ? 1 : 0;
      }
    }
    CHECK(largest_m <= 0.0002 + 1e-12);
    CHECK(largest_m > 0.0001);
    CHECK(largest_rad <= 0.0035 * std::sqrt(3.0) + 1e-6);
    CHECK(largest_rad > 0.0015);
    CHECK(crossings >= 14);  // 8 to 12 Hz over one second, beats included
    CHECK(crossings <= 26);
    for (int k = 0; k < 3; ++k) CHECK(with.back().p[k] == without.back().p[k]);
  }

  TEST_CASE("make: the seed decides, and equal scripts give equal bytes") {
    const TestFile first("first.csv");
    const TestFile second("second.csv");
    MotionScript script = script_from(kScript);
    haptic::sim::write_motion_csv(first.path(), haptic::sim::make_motion(script));
    haptic::sim::write_motion_csv(second.path(), haptic::sim::make_motion(script));
    CHECK(first.text() == second.text());
    script.seed = 43;
    haptic::sim::write_motion_csv(second.path(), haptic::sim::make_motion(script));
    CHECK(first.text() != second.text());
    if constexpr (sizeof(haptic::Real) == sizeof(double)) {
      std::uint64_t hash =
          0xCBF29CE484222325ULL;  // FNV-1a of the file, the same for every compiler
      for (const char c : first.text())
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3ULL;
      MESSAGE("hash of the written motion: " << hash);
      constexpr std::uint64_t kExpected = 14046444905946296204ULL;
      CHECK(hash == kExpected);
    }
  }

  TEST_CASE("scenes: every motion of the project is read and stays within human speed") {
    std::size_t count = 0;
    for (const auto& scene : std::filesystem::directory_iterator(HAPTIC_SCENES_DIR)) {
      const std::filesystem::path file = scene.path() / "motion.toml";
      if (!std::filesystem::exists(file)) continue;
      CAPTURE(file.string());
      const MotionScript script = haptic::sim::read_motion_script(file.string());
      const std::vector<MotionSample> motion = haptic::sim::make_motion(script);
      CHECK(script.rate_hz == 1000.0);
      CHECK(motion.size() > 2000);
      double fastest_m_s = 0.0;
      for (std::size_t i = 1; i < motion.size(); ++i) {
        double square = 0.0;
        for (int k = 0; k < 3; ++k)
          square += (motion[i].p[k] - motion[i - 1].p[k]) * (motion[i].p[k] - motion[i - 1].p[k]);
        fastest_m_s = std::max(fastest_m_s, std::sqrt(square) * script.rate_hz);
      }
      CHECK(fastest_m_s < 0.5);
      ++count;
    }
    CHECK(count >= 3);
  }
}
