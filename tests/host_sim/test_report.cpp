// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "host_sim/report/part_report.hpp"
#include "host_sim/report/picture.hpp"
#include "host_sim/session/contact_reference.hpp"
#include "host_sim/session/replay_plot.hpp"
#include "host_sim/session/replay_summary.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("haptic_report_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] std::string file(const char* name) const { return (path_ / name).string(); }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

std::vector<TickRecord> wavy_run(std::size_t ticks) {
  std::vector<TickRecord> run(ticks);
  for (std::size_t i = 0; i < ticks; ++i) {
    TickRecord& r = run[i];
    const double t = static_cast<double>(i) * 1e-3;
    r.tick = i;
    r.t_s = t;
    for (int k = 0; k < 3; ++k) r.force_n[k] = std::sin(40 * t + k) / 3;
    r.d_near_m = 0.01 * std::cos(7 * t);
    r.situation = r.d_near_m <= 0 ? ContactSituation::kFaceFace : ContactSituation::kNone;
    r.nodes_evaluated = static_cast<std::uint32_t>(i % 50);
    r.state_hash = 0x0123456789abcdefull + i;
  }
  return run;
}

constexpr double kBand_m = 0.005;

/// Whether every tag of an XML text without comments is closed in order.
bool tags_balance(const std::string& xml) {
  std::vector<std::string> open;
  std::size_t at = 0;
  while ((at = xml.find('<', at)) != std::string::npos) {
    const std::size_t end = xml.find('>', at);
    if (end == std::string::npos || xml.find('<', at + 1) < end) return false;
    const std::string tag = xml.substr(at + 1, end - at - 1);
    at = end;
    if (tag.starts_with("?") || tag.ends_with("/")) continue;
    if (tag.starts_with("/")) {
      if (open.empty() || open.back() != tag.substr(1)) return false;
      open.pop_back();
    } else {
      open.push_back(tag.substr(0, tag.find(' ')));
    }
  }
  return open.empty();
}

}  // namespace

TEST_SUITE("host_sim.report") {
  TEST_CASE("tick CSV: header, one line per tick, numbers read back to the bit") {
    const std::vector<TickRecord> run = wavy_run(200);
    std::istringstream csv(tick_csv(run));
    std::string line;
    REQUIRE(std::getline(csv, line));
    CHECK(line ==
          "tick,t_s,fx_n,fy_n,fz_n,tx_nm,ty_nm,tz_nm,d_near_m,state,near_count,nodes_evaluated,"
          "flags,state_hash,proxy_gap_m,energy_j,proxy_x_m,proxy_y_m,proxy_z_m,proxy_qw,proxy_qx,"
          "proxy_qy,proxy_qz,device_x_m,device_y_m,device_z_m,device_qw,device_qx,device_qy,"
          "device_qz");
    for (const TickRecord& r : run) {
      REQUIRE(std::getline(csv, line));
      std::vector<std::string> cells;
      std::istringstream row(line);
      for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
      REQUIRE(cells.size() == 30);
      CHECK(std::strtoull(cells[0].c_str(), nullptr, 10) == r.tick);
      CHECK(std::strtod(cells[1].c_str(), nullptr) == r.t_s);
      for (std::size_t k = 0; k < 3; ++k)
        CHECK(std::strtod(cells[2 + k].c_str(), nullptr) == r.force_n[k]);
      CHECK(std::strtod(cells[8].c_str(), nullptr) == r.d_near_m);
      CHECK(cells[9] == to_text(r.situation));
      CHECK(cells[11] == std::to_string(r.nodes_evaluated));
      CHECK(cells[13].size() == 16);
      CHECK(std::strtoull(cells[13].c_str(), nullptr, 16) == r.state_hash);
    }
    CHECK_FALSE(std::getline(csv, line));
  }

  TEST_CASE("plot: well-formed, labelled with units, small for many ticks, no peak lost") {
    std::vector<TickRecord> run = wavy_run(60000);
    run[31234].force_n[2] = 25.0;  // one tick among 60 per pixel column
    const std::string svg = replay_plot(run, "peg <&> \"hole\"", kBand_m);
    CHECK(tags_balance(svg));
    CHECK(svg.size() < 1000000);
    for (const char* text :
         {"force (N)", "torque (N m)", "d_near (mm)", "time (s)", "face_face", "|F|", "Tz"}) {
      CHECK_MESSAGE(svg.find(text) != std::string::npos, text);
    }
    CHECK(svg.find("peg &lt;&amp;&gt; &quot;hole&quot;") != std::string::npos);
    CHECK(svg.find(">20<") !=
          std::string::npos);  // the axis reaches for the peak; without it, 0.4 N
    CHECK(svg.find("nan") == std::string::npos);
    CHECK(svg == replay_plot(run, "peg <&> \"hole\"", kBand_m));
  }

  TEST_CASE("plot: d_near is drawn where it was searched, not where it is a bound") {
    std::vector<TickRecord> run = wavy_run(200);
    CHECK(searched_depth_m(run[0], kBand_m) == run[0].d_near_m);
    for (const std::uint32_t flag : {kFlagInexact, kFlagBudgetUsedUp}) {
      for (TickRecord& r : run) r.flags = flag;
      CHECK(std::isnan(searched_depth_m(run[0], kBand_m)));
      CHECK(replay_plot(run, "bounds", kBand_m).find("d_near (mm)") == std::string::npos);
      run[100].flags = 0;
      CHECK(replay_plot(run, "one tick", kBand_m).find("d_near (mm)") != std::string::npos);
    }
    // Told of pairs that are far, also where the nearest one was searched; beyond the band it is a
    // bound.
    for (TickRecord& r : run) r.flags = kFlagFarBand;
    CHECK(replay_plot(run, "far", kBand_m).find("d_near (mm)") != std::string::npos);
    TickRecord far = run[0];
    far.d_near_m = 0.9 * kBand_m;
    CHECK(searched_depth_m(far, kBand_m) == far.d_near_m);
    far.d_near_m = 1.1 * kBand_m;
    CHECK(std::isnan(searched_depth_m(far, kBand_m)));
    far.flags = 0;
    CHECK(searched_depth_m(far, kBand_m) == far.d_near_m);
    far.status = RtStatus::kPoseNotFinite;
    CHECK(std::isnan(searched_depth_m(far, kBand_m)));
  }

  TEST_CASE("plot: what a guide pulls and the station that it has passed have panels") {
    std::vector<TickRecord> run = wavy_run(200);
    CHECK(replay_plot(run, "no guide", kBand_m).find("guide (N)") == std::string::npos);
    for (TickRecord& r : run) r.guide.state = GuideState::kOff;
    CHECK(replay_plot(run, "off", kBand_m).find("guide (N)") == std::string::npos);
    for (std::size_t k = 50; k < 150; ++k) {
      run[k].guide.state = GuideState::kOn;
      run[k].guide.station = static_cast<std::uint32_t>(k / 10);
      run[k].guide.force_n[1] = 40;
      run[k].guide.torque_nm[2] = 0.125;
    }
    const std::string svg = replay_plot(run, "led", kBand_m);
    CHECK(tags_balance(svg));
    for (const char* text : {"guide (N)", ">station<", "0.12 N m", ">40<", ">10<"})
      CHECK_MESSAGE(svg.find(text) != std::string::npos, text);
    CHECK(svg.find("nan") == std::string::npos);
  }

  TEST_CASE("plot: counts as in contact what is felt, with any force") {
    std::vector<TickRecord> run = wavy_run(200);
    for (std::size_t k = 0; k < 30; ++k) run[k].in_contact = true;
    CHECK(replay_plot(run, "felt", kBand_m).find("200 ticks, 30 in contact") != std::string::npos);
  }

  TEST_CASE("plot: no ticks, one tick and a flat run are drawn") {
    for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{5}}) {
      std::vector<TickRecord> flat(n);
      for (std::size_t i = 0; i < n; ++i) flat[i].t_s = static_cast<double>(i);
      const std::string svg = replay_plot(flat, "flat", kBand_m);
      CHECK(tags_balance(svg));
      CHECK(svg.find("nan") == std::string::npos);
      CHECK(svg.find("inf") == std::string::npos);
    }
  }

  TEST_CASE("table: one set of typed cells as CSV, JSON and Markdown") {
    ReportTable table("name,count,force_n,rounded,note");
    table.add({"a", 3, 0.1, shown_as("%.1f", 2.25), quoted("x, y")});
    table.add({"b", 0u, NAN, shown_as("%.1f", NAN), {}});
    CHECK(table.csv() ==
          "name,count,force_n,rounded,note\na,3,0.10000000000000001,2.2,\"x, y\"\nb,0,nan,,\n");
    CHECK(table.csv({"force_n", "note"}) == "name,count,rounded\na,3,2.2\nb,0,\n");
    CHECK(table.json({"note"}).dump() ==
          R"([{"name":"a","count":3,"force_n":0.1,"rounded":2.25},)"
          R"({"name":"b","count":0,"force_n":null,"rounded":null}])");
    CHECK(table.markdown().starts_with(
        "| name | count | force_n | rounded | note |\n|---|---|---|---|---|\n| a | 3 |"));
  }

  TEST_CASE("picture: a band shows what is rare, text is well-formed for any bytes") {
    const Panel panel{0, 0, 4, 10, 0, 4, 0, 1};
    const std::vector<double> times{0.0, 0.1, 0.2, 1.0, 2.0, 3.0};
    const std::vector<std::size_t> values{0, 1, 1, 0, 2, 0};
    const std::vector<BandValue> table{{"none", "#fff"}, {"often", "#aaa"}, {"rare", "#bbb"}};
    const std::string often =
        band(panel, "situation", false, times, values, table, BandColumn::kMostFrequent);
    for (const char* colour : {"#fff", "#aaa", "#bbb"})
      CHECK_MESSAGE(often.find(colour) != std::string::npos, colour);
    CHECK(band_key(0, 0, std::vector<std::size_t>{0, 2}, table).find("often") == std::string::npos);
    CHECK(tools::xml_escaped("a\xff<b>\n\xcf\x80&") == "a?&lt;b&gt;?\xcf\x80&amp;");
    CHECK(tools::xml_escaped("\xcf") == "?");
  }

  TEST_CASE("files are written whole, replace their elder, and leave nothing behind") {
    const TemporaryFolder folder;
    write_whole_file(folder.file("a.csv"), "a,b\n1,2\n");
    write_whole_file(folder.file("a.csv"), "a,b\n3,4\n");
    std::ifstream stream(folder.file("a.csv"));
    CHECK(std::string(std::istreambuf_iterator<char>(stream), {}) == "a,b\n3,4\n");
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
    CHECK_THROWS_AS(write_whole_file(folder.file("missing/a.csv"), "x"), tools::OsError);
    CHECK_THROWS_AS(write_whole_file(folder.path().string(), "x"), tools::OsError);
  }

  TEST_CASE("totals: changes, bounds and re-localisations after the first tick") {
    std::vector<TickRecord> run(4);
    run[0].relocalised_pairs = 2;  // the start does not count
    run[2].relocalised_pairs = 1;
    run[1].situation = run[2].situation = ContactSituation::kEdgeFace;
    run[1].in_contact = run[2].in_contact = true;
    run[1].d_near_m = -0.002;
    run[0].d_near_m = run[2].d_near_m = run[3].d_near_m = 0.001;
    run[1].force_n[0] = 3;
    run[1].force_n[1] = 4;
    run[2].nodes_evaluated = 101;
    SceneCapacity capacity{};
    capacity.pair_count = 2;
    capacity.max_feature_evaluations = 60;
    capacity.max_edge_pairs = 40;
    const ReplayTotals t = total(run, capacity);
    CHECK(t.contact_ticks == 2);  // those that are felt, wherever the goal is
    CHECK(t.situation_changes == 2);
    CHECK(t.largest_force_n == doctest::Approx(5));
    CHECK(t.largest_force_change_n == doctest::Approx(5));
    CHECK(t.smallest_d_near_m == doctest::Approx(-0.002));
    CHECK(t.relocalised_pair_ticks == 1);
    CHECK(t.pair_ticks == 6);
    CHECK_FALSE(t.within_bounds());
    run[2].nodes_evaluated = 100;
    CHECK(total(run, capacity).within_bounds());
  }

  TEST_CASE("the JSON summary is JSON and repeats the totals") {
    ReplayReport report;
    report.scene = "a \"scene\"";
    report.mode = "core";
    report.totals = total(wavy_run(100), SceneCapacity{});
    report.check.emplace();
    const auto json = nlohmann::json::parse(json_summary(report));
    CHECK(json.at("scene") == "a \"scene\"");
    CHECK(json.at("ticks") == 100);
    CHECK(json.at("check").at("passed") == true);
    CHECK_FALSE(json.contains("reference"));
    CHECK(json.at("flag_ticks").size() == kFlagCount);
    CHECK(text_summary(report).find("wrong verdicts") != std::string::npos);
  }

  TEST_CASE("contact reference: decided samples are compared with the tick of their time") {
    const TemporaryFolder folder;
    std::ofstream(folder.file("r.csv"))
        << "t,contact\n0.000,0\n0.010,1\n0.020,u\r\n0.030,0\n9.0,1\n";
    const std::vector<ReferenceSample> samples = read_contact_reference(folder.file("r.csv"));
    REQUIRE(samples.size() == 5);
    std::vector<TickRecord> run(40);
    for (std::size_t i = 0; i < run.size(); ++i) {
      run[i].t_s = static_cast<double>(i) * 1e-3;
      run[i].d_near_m = i == 10 || i == 30 ? -1e-4 : 1e-4;
    }
    const ReferenceTotals totals = compare_with_reference(samples, run, 5e-4);
    CHECK(totals.contact == 1);
    CHECK(totals.free == 2);
    CHECK(totals.undecided == 1);
    CHECK(totals.unmatched == 1);
    CHECK(totals.wrong == 1);
    CHECK(totals.first_wrong_t_s == doctest::Approx(0.03));
    for (const char* bad : {"time,contact\n0,1\n", "t,contact\n0,2\n", "t,contact\nx,1\n",
                            "t,contact\n1,1\n1,1\n", "t,contact\n"}) {
      std::ofstream(folder.file("bad.csv")) << bad;
      CHECK_THROWS_AS(static_cast<void>(read_contact_reference(folder.file("bad.csv"))),
                      tools::InputError);
    }
  }
}
