// SPDX-License-Identifier: Apache-2.0
// A scene and a recording in a page, without a browser.
#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "host_sim/view/gallery.hpp"
#include "host_sim/view/loop_ticks.hpp"
#include "host_sim/view/recorded_ticks.hpp"
#include "tests/host_sim/recorded_input.hpp"
#include "tests/host_sim/sample_scenes.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"
#include "tools/live/page_file.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

std::string coded(const std::string& text) { return base64(std::as_bytes(std::span(text))); }

constexpr const char* kPage =
    "<@CONNECT@><title>@TITLE@</title>{@ABOUT@}[@SCENE@]|@LIVE@|(@RECORDING@)";

/// The recording by its description: columns of words, of each byte plane by plane, folded second
/// differences but for the hash.
void check_columns(const std::vector<RecordedTick>& ticks, std::size_t columns) {
  const std::vector<std::byte> bytes = recording_bytes(ticks);
  const std::size_t n = ticks.size();
  REQUIRE(bytes.size() == 16 + 8 * columns * n);
  CHECK(std::to_integer<unsigned>(bytes[12]) == (columns > 15 ? 3u : 1u));
  for (std::size_t column = 0; column < columns; ++column) {
    std::uint64_t before = 0, before_that = 0;
    for (std::size_t k = 0; k < n; ++k) {
      std::uint64_t word = 0;
      for (std::size_t byte = 0; byte < 8; ++byte)
        word |= std::to_integer<std::uint64_t>(bytes[16 + (8 * column + byte) * n + k])
                << (8 * byte);
      std::uint64_t value = word;
      if (column != 8)
        value = ((word & 1) != 0 ? ~(word >> 1) : word >> 1) + 2 * before - before_that;
      before_that = before;
      before = value;
      const RecordedTick& t = ticks[k];
      const double as_double = std::bit_cast<double>(value);
      if (column == 0) REQUIRE(value == static_cast<std::uint64_t>(t.stamp_ns));
      if (column >= 1 && column < 4) REQUIRE(as_double == t.p_wa_m[column - 1]);
      if (column >= 4 && column < 8) REQUIRE(as_double == t.q_wa_xyzw[column - 4]);
      if (column == 8) REQUIRE(value == t.state_hash);
      if (column >= 9 && column < 15) REQUIRE(as_double == t.accepted_w[column - 9]);
      if (column >= 15 && column < 21) REQUIRE(as_double == t.twist_w[column - 15]);
      if (column == 21) REQUIRE(value == t.marks);
    }
  }
}

}  // namespace

TEST_SUITE("host_sim.page_file") {
  TEST_CASE("base64: the vectors of RFC 4648") {
    CHECK(coded("").empty());
    CHECK(coded("f") == "Zg==");
    CHECK(coded("fo") == "Zm8=");
    CHECK(coded("foo") == "Zm9v");
    CHECK(coded("foobar") == "Zm9vYmFy");
    CHECK(coded("\xff\xfe\xfd") == "//79");
  }

  TEST_CASE(
      "filled_page: scene and ticks stand in it; a page without a place for them is refused") {
    const std::vector<std::byte> bytes = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    CoreSession session(bytes, "sample");
    MotionSample sample;
    sample.t_s = 0.25;
    sample.p[2] = 0.2;
    const std::vector<RecordedTick> ticks = record_motion(session, std::vector{sample, sample});
    REQUIRE(ticks.size() == 2);
    CHECK(ticks[0].stamp_ns == 250000000);
    CHECK(ticks[0].p_wa_m[2] == static_cast<double>(static_cast<Real>(0.2)));
    CHECK(ticks[0].q_wa_xyzw[3] == 1.0);
    CHECK(ticks[0].state_hash != ticks[1].state_hash);

    const std::string page = filled_page(kPage, session.view(), ticks);
    CHECK(page.find('[' + packed_text(session.view().blob()) + ']') != std::string::npos);
    CHECK(page.ends_with('(' + packed_text(recording_bytes(ticks)) + ')'));
    CHECK(base64(recording_bytes(ticks)).starts_with("UlRWSUVXMwAC"));  // RTVIEW3, zero, 2 ticks
    CHECK(filled_page(kPage, session.view(), {}).ends_with("()"));
    CHECK(filled_page(kPage, session.view(), {}, "a < b").find("{a &lt; b}") != std::string::npos);
    // It may connect to nothing; that of a live session to its server alone.
    CHECK(page.starts_with("<'none'>"));
    CHECK(page.find("||") != std::string::npos);
    const std::string live = live_page(kPage, session.view(), {true, "why"});
    CHECK(live.find(R"(|{"takesHand":true,"whyNotCompared":"why"}|())") != std::string::npos);
    CHECK(connected_page(live, "localhost:80").starts_with("<'self' ws://localhost:80>"));
    CHECK_THROWS_AS((void)connected_page(page, "localhost:80"), tools::InputError);
    CHECK_THROWS_AS((void)filled_page("@TITLE@ @SCENE@", session.view(), {}), tools::InputError);
  }

  TEST_CASE("a closed loop's ticks carry the wrench that acted: the core gives the hashes again") {
    const std::vector<std::byte> bytes = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    CoreSession session(bytes, "sample");
    ClosedLoop loop(session, DeviceModel{}, *hand_named("firm"), 1000.0);
    std::vector<MotionSample> motion(200);
    for (std::size_t k = 0; k < motion.size(); ++k) {
      motion[k].t_s = 1e-3 * static_cast<double>(k);
      motion[k].p[2] = 0.12 - 1e-3 * static_cast<double>(k);
    }
    const std::vector<LoopRecord> records = run_loop(loop, motion);
    std::vector<RecordedTick> ticks;
    bool acted = false;
    for (const LoopRecord& record : records) {
      ticks.push_back(recorded_tick(record, 1000.0));
      acted = acted || ticks.back().accepted_w[2] != 0;
    }
    CHECK(acted);
    session.core().reset();
    for (const RecordedTick& tick : ticks)
      REQUIRE(hash_after(session.core(), tick) == tick.state_hash);
    check_columns(ticks, 15);
    // What a device adds, from the first tick on that has any of it.
    for (const TickMark mark : {kMarkTwist, kMarkClutched, kMarkReset}) {
      std::vector<RecordedTick> more = ticks;
      more[100].marks |= mark;
      more[100].twist_w[4] = 0.25;
      check_columns(more, 22);
    }
  }

  TEST_CASE("the gallery: eight scenes, each with its files; a number that it has not is refused") {
    CHECK(gallery().size() == 8);
    for (const GalleryScene& scene : gallery()) {
      CAPTURE(scene.name);
      const std::filesystem::path folder = std::filesystem::path(HAPTIC_SCENES_DIR) / scene.name;
      for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name == "insert.toml" || name == "six_turns.toml") continue;  // other motions
        std::ifstream file(entry.path());
        std::stringstream text;
        text << file.rdbuf();
        CHECK(gallery_file(scene.name, name) == text.str());
      }
      CHECK_FALSE(gallery_file(scene.name, "scene.toml").empty());
      CHECK_FALSE(gallery_file(scene.name, "motion.toml").empty());
      CHECK(std::ranges::count(scene.about, '.') >= 2);
    }
    CHECK(gallery_scene(2).name == "square_peg_five");
    CHECK_THROWS_AS((void)gallery_scene(0), tools::UsageError);
    CHECK_THROWS_AS((void)gallery_scene(9), tools::UsageError);
    const ProgramResult list = run_program(HAPTIC_HOST_SIM, "view --list");
    CHECK(list.exit_code == 0);
    CHECK(list.out.find("  7  Nut on a bolt.") != std::string::npos);
    CHECK(run_program(HAPTIC_HOST_SIM, "view 9").exit_code == 2);
    CHECK(run_program(HAPTIC_HOST_SIM, "view").exit_code == 2);
  }

  TEST_CASE("view without a built page: exit 4 and what to run and to install") {
    const ScratchFolder folder("page_file");
    const std::vector<std::byte> bytes = scene_of(tetrahedron(), box(0.1, 0.06, 0.05));
    std::ofstream(folder.file("s.rtscene"), std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    std::filesystem::create_directory(folder.file("bin"));
    const std::string program = folder.file("bin/host_sim");
    std::filesystem::copy_file(HAPTIC_HOST_SIM, program);
    const std::string view =
        "view '" + folder.file("s.rtscene") + "' --html '" + folder.file("s.html") + "'";
    const ProgramResult installed = run_program(program, view);
    CHECK(installed.exit_code == 4);
    CHECK(installed.err.find("this installation was made without the page") != std::string::npos);
    std::ofstream(folder.file("CMakeCache.txt"));  // a build folder
    const ProgramResult run = run_program(program, view);
    CHECK(run.exit_code == 4);
    CHECK(run.err.find("the page has not been built; run tools/view") != std::string::npos);
    CHECK(run.err.find("clang-16") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder.file("s.html")));
  }
}
