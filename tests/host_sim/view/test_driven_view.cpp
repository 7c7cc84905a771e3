// SPDX-License-Identifier: Apache-2.0
// A run with a driven part, as pages, viewers and MCAP files get it, without a browser.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/session/drive_run.hpp"
#include "host_sim/session/drive_tape.hpp"
#include "host_sim/view/loop_ticks.hpp"
#include "host_sim/view/mcap_file.hpp"
#include "tests/host_sim/recorded_input.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/live/live_board.hpp"
#include "tools/live/topics.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

/// A block in the hand and a plate that pushes it; with a wall, or with nothing that stands.
std::vector<std::byte> plate_scene(bool has_wall = true) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "haptic_test_driven_view.toml";
  std::ofstream(path) << "format = 1\nname = \"plate\"\n"
                         "[[part]]\nname = \"block\"\nrole = \"hand\"\nshape = \"box\"\n"
                         "size_m = [0.04, 0.04, 0.03]\nposition_m = [0, 0, 0]\n"
                         "[[part]]\nname = \"plate\"\nrole = \"driven\"\nshape = \"box\"\n"
                         "size_m = [0.02, 0.1, 0.1]\nposition_m = [-0.1, 0, 0]\n"
                         "fastest_m_per_s = 0.5\nfastest_rad_per_s = 2.0\n"
                      << (has_wall
                              ? "[[part]]\nname = \"wall\"\nrole = \"fixed\"\nshape = \"box\"\n"
                                "size_m = [0.02, 0.3, 0.3]\nposition_m = [0.06, 0, 0]\n"
                              : "")
                      << "[rendering]\nk_f_n_per_m = 1000\n[coupling]\nk_t_n_per_m = 1000\n";
  const std::vector<std::byte> bytes = compile_scene(read_scene_file(path), {}).bytes;
  std::filesystem::remove(path);
  return bytes;
}

/// The plate comes to the block at rest and pushes it by 10 mm, 100 poses a second.
struct PushedRun {
  CoreSession session{plate_scene(), "plate"};
  DriveTape tape{true};
  std::vector<LoopRecord> records;

  PushedRun() {
    ClosedLoop loop(session, DeviceModel{}, *hand_named("firm"), 1000.0);
    DriveStream stream{"plate", "", {}};
    for (int k = 0; k <= 60; ++k) {
      MotionSample pose;
      pose.t_s = 0.01 * k;
      pose.p[0] = -0.1 + 0.08 * std::min(1.0, k / 50.0);
      stream.poses.push_back(pose);
    }
    DriveRun drives(session, {std::move(stream)});
    std::vector<MotionSample> still(701);
    for (std::size_t k = 0; k < still.size(); ++k) still[k].t_s = 1e-3 * static_cast<double>(k);
    records = run_loop(
        loop, still,
        [&](const LoopRecord& record) {
          drives.after_tick(record.tick);
          tape.take(session.hand()->driven());
        },
        [&](double t_s) {
          tape.give(drives.input(t_s));
          drives.before_tick(t_s);
        });
  }
  [[nodiscard]] std::vector<RecordedTick> ticks() const {
    std::vector<RecordedTick> ticks;
    for (const LoopRecord& record : records) {
      ticks.push_back(recorded_tick(record, 1000.0));
      tape.mark(ticks.back(), record.tick.tick);
    }
    return ticks;
  }
};

/// The JSON objects in `text` that begin with `begin`.
std::vector<nlohmann::json> objects_in(const std::string& text, const std::string& begin) {
  std::vector<nlohmann::json> all;
  for (std::size_t at = text.find(begin); at != std::string::npos; at = text.find(begin, at + 1)) {
    std::size_t end = at;
    int depth = 0;
    do {
      depth += text[end] == '{' ? 1 : text[end] == '}' ? -1 : 0;
      ++end;
    } while (depth > 0);
    all.push_back(nlohmann::json::parse(text.substr(at, end - at)));
  }
  return all;
}

}  // namespace

TEST_SUITE("host_sim.driven_view") {
  TEST_CASE("an MCAP file has a frame of each driven part, where it is felt in each tick") {
    const PushedRun run;
    REQUIRE(run.tape.states().size() == run.records.size());
    const std::string file = mcap_of(run.session.view(), run.records, run.tape.states());
    std::vector<nlohmann::json> plate;
    for (nlohmann::json& message : objects_in(file, R"({"timestamp":{"sec":)"))
      if (message.value("child_frame_id", "") == "driven/plate") plate.push_back(message);
    REQUIRE(plate.size() == run.records.size());
    for (std::size_t k = 0; k < plate.size(); ++k) {
      const double x_m = plate[k]["translation"]["x"].get<double>();
      REQUIRE(x_m == run.tape.states()[k].felt_wa.p_m[0]);
      CHECK(plate[k]["parent_frame_id"] == "w");
    }
    CHECK(plate.front()["translation"]["x"].get<double>() == doctest::Approx(-0.1));
    CHECK(plate.back()["translation"]["x"].get<double>() == doctest::Approx(-0.02).epsilon(1e-3));
    // It has pushed the block.
    CHECK(run.records.back().tick.proxy_wa.p_m[0] > 0.005);
  }

  TEST_CASE("a viewer is given a driven part's shape about its own frame, once") {
    for (const bool has_wall : {true, false}) {
      CAPTURE(has_wall);
      CoreSession session(plate_scene(has_wall), "plate");
      const auto entities = nlohmann::json::parse(scene_message(session.view()))["entities"];
      std::vector<std::string> frames;
      for (const auto& entity : entities) frames.push_back(entity["frame_id"]);
      const std::vector<std::string> of_all = {"part", "w", "driven/plate"};
      const std::vector<std::string> of_two = {"part", "driven/plate"};
      CHECK(frames == (has_wall ? of_all : of_two));
      double largest_m = 0;
      for (const auto& point : entities.back()["triangles"][0]["points"])
        largest_m = std::max(largest_m, std::abs(point["x"].get<double>()));
      CHECK(largest_m == doctest::Approx(0.01));
    }
  }

  TEST_CASE("the recorded poses and clock of a driven part give the hashes again") {
    const PushedRun run;
    const std::vector<RecordedTick> ticks = run.ticks();
    const std::vector<GivenPose> given = run.tape.given();
    CHECK(given.size() == 61);
    // As a page does it.
    const auto first_difference = [&](bool follows) {
      CoreSession session(plate_scene(), "plate");
      FrameRecord newest;
      std::size_t next = 0;
      for (std::size_t k = 0; k < ticks.size(); ++k) {
        for (; next < given.size() && given[next].tick == k; ++next) newest = given[next].record;
        if (follows)
          session.hand()->follow(
              {std::span(&newest, 1), ticks[k].driven_ns, (ticks[k].marks & kMarkFelt) != 0});
        if (session.step(recorded_input(ticks[k])).state_hash != ticks[k].state_hash) return k;
      }
      return ticks.size();
    };
    CHECK(first_difference(true) == ticks.size());
    CHECK(first_difference(false) < ticks.size());
  }

  TEST_CASE("a recording without driven parts is not longer, and one with them has their columns") {
    const PushedRun run;
    std::vector<RecordedTick> ticks = run.ticks();
    const std::vector<GivenPose> given = run.tape.given();
    const std::size_t n = ticks.size();
    CHECK(recording_bytes(ticks, given).size() == 16 + 8 * 17 * n + 8 + 120 * given.size());
    for (RecordedTick& tick : ticks) {
      tick.marks &= ~std::uint64_t{kMarkDriven | kMarkFelt};
      tick.driven_ns = 0;
    }
    CHECK(recording_bytes(ticks).size() == 16 + 8 * 15 * n);
  }

  TEST_CASE("the board has the poses of each tick, and those that are overwritten end the ticks") {
    const auto board = std::make_unique<LiveBoard>();
    LiveWriter writer(*board);
    LiveReader reader(*board);
    const std::size_t most = LiveBoard::kGiven / kMostDriven;
    std::vector<GivenPose> poses(kMostDriven);
    for (std::size_t k = 0; k < 2 * most; ++k) {
      for (std::size_t driven = 0; driven < kMostDriven; ++driven) {
        poses[driven].driven = driven;
        poses[driven].record.number = k + 1;
      }
      writer.publish(live_tick({}, k), {}, poses);
    }
    std::vector<LiveTick> ticks(4 * most);
    std::uint64_t first = 0;
    const std::size_t count = reader.copy(first, ticks);
    REQUIRE(count == 2 * most);
    std::vector<GivenPose> given;
    CHECK(reader.copy_given(std::span(ticks).first(count), 4096, given) == 0);
    const auto newest = std::span(ticks).subspan(count - 20, 20);
    CHECK(reader.copy_given(newest, 4096, given) == 20);
    REQUIRE(given.size() == 20 * kMostDriven);
    CHECK(given.back().tick == count - 1);
    CHECK(given.back().driven == kMostDriven - 1);
    CHECK(given.back().record.number == count);
    // No part of a tick's.
    CHECK(reader.copy_given(newest, 2 * kMostDriven + 1, given) == 2);
    CHECK(given.size() == 2 * kMostDriven);
  }
}
