// SPDX-License-Identifier: Apache-2.0
// A scene and a recording in a page, without a browser.
#include <doctest/doctest.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/view/page_file.hpp"
#include "tests/host_sim/sample_scenes.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::sim::test;

namespace {

std::string coded(const std::string& text) { return base64(std::as_bytes(std::span(text))); }

constexpr const char* kPage = "<title>@TITLE@</title>[@SCENE@](@RECORDING@)";

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
    CHECK(page.find('[' + base64(session.view().blob()) + ']') != std::string::npos);
    // 16 bytes of head and 2 x 72 bytes, in groups of three.
    CHECK(page.size() - page.find('(') == 2 + (16 + 2 * 72 + 2) / 3 * 4);
    CHECK(page.find("(UlRWSUVXMQAC") != std::string::npos);  // RTVIEW1, zero, 2 ticks
    CHECK(filled_page(kPage, session.view(), {}).ends_with("()"));
    CHECK_THROWS_AS((void)filled_page("@TITLE@ @SCENE@", session.view(), {}), tools::InputError);
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
    const ProgramResult run = run_program(
        program, "view '" + folder.file("s.rtscene") + "' --html '" + folder.file("s.html") + "'");
    CHECK(run.exit_code == 4);
    CHECK(run.err.find("the page has not been built; run tools/view") != std::string::npos);
    CHECK(run.err.find("clang-16") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder.file("s.html")));
  }
}
