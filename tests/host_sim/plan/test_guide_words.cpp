// SPDX-License-Identifier: Apache-2.0
// Where on the plan of a guide the part is, and which contact comes next, as the operator gets it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "host_sim/device/loop_run.hpp"
#include "host_sim/report/part_report.hpp"
#include "host_sim/view/loop_ticks.hpp"
#include "host_sim/view/mcap_file.hpp"
#include "tests/support/program_run.hpp"
#include "tests/tools/plan/plan_bench.hpp"
#include "tools/c_space/pose_text.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/live/topics.hpp"
#include "tools/plan/guide_legs.hpp"
#include "tools/plan/plan_check.hpp"
#include "tools/plan/search/plan_shortening.hpp"
#include "tools/plan/search/translation_plan.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

/// A cube over a floor, which a plan leads down, and along the floor to two walls, one after the
/// other.
const std::string kCorner =
    "format = 1\nname = \"corner\"\n[moving]\nshape = \"box\"\nsize_m = [0.02, 0.02, 0.02]\n"
    "position_m = [0.0, 0.0, 0.012]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.2, 0.2, 0.02]\nposition_m = [0.0, 0.0, -0.01]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.02, 0.2, 0.04]\nposition_m = [0.05, 0.0, 0.02]\n"
    "[[static]]\nshape = \"box\"\nsize_m = [0.08, 0.02, 0.04]\nposition_m = [0.0, 0.05, 0.02]\n"
    "[rendering]\nk_f_n_per_m = 800.0\n";

struct Subject {
  PlannedScene plain{kCorner, "corner"};
  tools::SceneBytes guided;
  SceneView view;

  Subject() {
    SlidingPart part(plain.view);
    const double tolerance_m = 0.995 * tools::most_tolerance_m(plain.view);
    StepProver prover(plain.view, tolerance_m);
    CorneredMotion motion;
    for (const Vec3d& x :
         {Vec3d(0, 0, 0.012), Vec3d(0, 0, 0.01), Vec3d(0.03, 0, 0.01), Vec3d(0.03, 0.03, 0.01)})
      motion.corners.push_back(plan_pose(x, Quatd::Identity()));
    const tools::Plan plan = make_plan(motion, prover, tools::PlanCheck(plain.view),
                                       {"corner", 1, tolerance_m, 5e-5, part.radius_m()});
    const ScratchFolder scratch("guide_words");
    const std::string file = scratch.file("corner.plan");
    write_whole_file(file, tools::plan_as_text(plan));
    tools::SceneFile scene = tools::parse_scene_file(kCorner, "corner", HAPTIC_SCENES_DIR);
    scene.guide.emplace();
    scene.guide->plan = file;
    guided = tools::SceneBytes(tools::compile_scene(scene, {}).bytes);
    REQUIRE(SceneView::open(guided.span(), view) == RtStatus::kOk);
  }
};

const Subject& subject() {
  static const Subject the_one;
  return the_one;
}

/// The device led over the plan, 0.1 mm a tick, and 0.1 mm into the floor.
std::vector<LoopRecord> led() {
  CoreSession session(subject().guided.span(), "guided", GoalContact::kLeftOut);
  std::vector<MotionSample> motion;
  for (int k = 0; k <= 640; ++k) {
    const double way = 1e-4 * k;
    motion.push_back({});
    motion.back().t_s = 1e-3 * k;
    motion.back().p[0] = std::clamp(way - 0.0025, 0.0, 0.03);
    motion.back().p[1] = std::max(way - 0.0325, 0.0);
    motion.back().p[2] = std::max(0.012 - way, 0.0099);
    motion.back().q_wxyz[0] = 1;
  }
  ClosedLoop loop(session, DeviceModel{}, *hand_named("firm"), 1000);
  return run_loop(loop, motion);
}

}  // namespace

TEST_SUITE("host_sim.guide_words") {
  TEST_CASE("guide: a scene knows how the part touches at its stations") {
    const GuideLegs legs(subject().view);
    REQUIRE(legs.count() == 4);
    CHECK(legs.words(3) == "three faces");
    CHECK(legs.words(0) == "free");
    CHECK(legs.words(1) == "face on face");
    CHECK(legs.words(2) == "two faces");
    const auto last = static_cast<std::uint32_t>(subject().view.guide_stations().size() - 1);
    CHECK(legs.leg_of(0) == 0);
    CHECK(legs.leg_of(last) == 3);
    CHECK(legs.place(GuideState::kOn, 0) == "1 of 4: free, then face on face");
    CHECK(legs.place(GuideState::kOn, last) == "4 of 4: three faces, then the goal");
    CHECK(legs.place(GuideState::kOff, 0) == "the guide is off");
    CHECK(legs.place(GuideState::kLost, 0).starts_with("off the way"));
    CHECK(legs.place(GuideState::kNone, 0).empty());
    CHECK(GuideLegs(subject().plain.view).empty());
    CHECK(GuideLegs(subject().plain.view).place(GuideState::kOn, 0).empty());
  }

  TEST_CASE("guide: a station whose planes and contacts disagree is refused") {
    const auto* const first =
        reinterpret_cast<const std::byte*>(subject().view.guide_stations().data());
    const auto at = static_cast<std::size_t>(first - subject().view.blob().data());
    tools::SceneBytes bytes(subject().view.blob());
    auto* const stations = reinterpret_cast<GuideStation*>(bytes.span().data() + at);
    GuideStation& last = stations[subject().view.guide_stations().size() - 1];
    std::memset(last.touching, 0, sizeof last.touching);
    auto* const header = reinterpret_cast<SceneHeader*>(bytes.span().data());
    header->content_hash = scene_content_hash(bytes.span());
    SceneView opened;
    CHECK(SceneView::open(bytes.span(), opened) != RtStatus::kOk);
  }

  TEST_CASE("guide: the run's CSV has its columns, and without a guide none") {
    const std::vector<LoopRecord> records = led();
    const GuideLegs legs(subject().view);
    std::istringstream csv(loop_csv(records, legs));
    std::string head, line;
    REQUIRE(std::getline(csv, head));
    CHECK(head.starts_with(loop_csv_header() + ",guide,guide_station,guide_place,guide_fx_n"));
    std::string seen;
    std::size_t lines = 0;
    while (std::getline(csv, line)) {
      ++lines;
      const std::size_t from = line.find('"'), to = line.rfind('"');
      REQUIRE(from != std::string::npos);
      const std::string place = line.substr(from + 1, to - from - 1);
      if (seen.size() < place.size() || !seen.ends_with(place)) seen += "|" + place;
    }
    CHECK(lines == records.size());
    CHECK(seen.find("|1 of 4: free, then face on face|2 of 4: face on face, then two faces|3 of 4: "
                    "two faces") != std::string::npos);
    CHECK(loop_csv(records) == loop_csv(records, GuideLegs(subject().plain.view)));
    CHECK(loop_csv(records).find("guide") == std::string::npos);
    std::vector<TickRecord> ticks;
    for (const LoopRecord& record : records) ticks.push_back(record.tick);
    CHECK(tick_csv(ticks).starts_with(tick_columns(TickTable::kCsv) +
                                      tick_columns(TickTable::kCsvPoses) + "\n"));
    CHECK(tick_csv(ticks, legs).starts_with(tick_columns(TickTable::kCsv) + ",guide,"));
  }

  TEST_CASE("guide: topic and MCAP say the same") {
    const std::vector<LoopRecord> records = led();
    const GuideLegs legs(subject().view);
    std::size_t on = 0;
    for (const LoopRecord& record : records) {
      const std::string message = tick_message(Topic::kGuide, record.tick, legs);
      REQUIRE_FALSE(message.empty());
      const auto json = nlohmann::json::parse(message);
      const TickGuide& guide = record.tick.guide;
      CHECK(json["place"] == legs.place(guide.state, guide.station));
      CHECK(json["force_n"]["x"] == guide.force_n[0]);
      CHECK(json["legs"] == 4);
      on += json["state"] == "on" ? 1u : 0u;
      CHECK(tick_message(Topic::kGuide, record.tick, GuideLegs(subject().plain.view)).empty());
      const auto schema =
          nlohmann::json::parse(topics()[static_cast<std::size_t>(Topic::kGuide)].schema);
      for (const auto& [key, value] : json.items()) CHECK(schema["properties"].contains(key));
    }
    CHECK(on > records.size() / 2);
    const std::string with = mcap_of(subject().view, records);
    const std::string without = mcap_of(subject().plain.view, records);
    CHECK(with.find("2 of 4: face on face, then two faces") != std::string::npos);
    CHECK(without.find("then two faces") == std::string::npos);
  }
}
