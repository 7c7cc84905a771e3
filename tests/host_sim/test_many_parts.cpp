// SPDX-License-Identifier: Apache-2.0
/// More loose parts than may move in a tick: fifty screws on a table. Those that a hand comes near
/// move, the others lie as hard as the table, and nobody goes through anybody.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "host_sim/lab/bodies_fuzz/bodies_judge.hpp"
#include "host_sim/oracle/oracle_piece.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/counters_check.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr int kScrews = 50, kColumns = 10;
constexpr double kPitch_m = 0.011;

/// A screw of two prisms as one closed mesh: head 8 mm wide and 3 mm high, shank 4 mm and 10 mm.
std::string screw_obj() {
  constexpr int kSides = 8;
  std::string text;
  std::vector<std::string> faces;
  const auto ring = [&](double radius_m, double z_m) {
    for (int k = 0; k < kSides; ++k) {
      const double at = 2 * M_PI * (k + 0.5) / kSides;
      text += "v " + std::to_string(radius_m * std::cos(at)) + " " +
              std::to_string(radius_m * std::sin(at)) + " " + std::to_string(z_m) + "\n";
    }
  };
  // Head down: that is how they stand.
  ring(0.004, 0);
  ring(0.004, 0.003);
  ring(0.002, 0.003);
  ring(0.002, 0.013);
  const auto band = [&](int from) {
    for (int k = 0; k < kSides; ++k) {
      const int next = (k + 1) % kSides;
      faces.push_back("f " + std::to_string(from + k + 1) + " " + std::to_string(from + next + 1) +
                      " " + std::to_string(from + kSides + next + 1) + " " +
                      std::to_string(from + kSides + k + 1) + "\n");
    }
  };
  for (int r = 0; r < 3; ++r) band(r * kSides);
  std::string bottom = "f", top = "f";
  for (int k = 0; k < kSides; ++k) {
    bottom += " " + std::to_string(kSides - k);
    top += " " + std::to_string(3 * kSides + k + 1);
  }
  for (const std::string& face : faces) text += face;
  return text + bottom + "\n" + top + "\n";
}

/// A hand with a stick, fifty screws in five rows and a table. `height_m`: above the table.
std::vector<std::byte> screws_scene(const std::string& lead, double height_m,
                                    const std::string& more = "") {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / "haptic_test_many_parts";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "screw.obj") << screw_obj();
  std::ofstream scene(folder / "screws.toml");
  scene << "format = 1\nname = \"screws\"\n"
        << "[[part]]\nname = \"stick\"\nrole = \"hand\"\nshape = \"cylinder\"\n"
        << "radius_m = 0.004\nheight_m = 0.04\nposition_m = [0, -0.045, 0.0201]\n"
        << "[[part]]\nname = \"table\"\nrole = \"fixed\"\nshape = \"box\"\n"
        << "size_m = [0.4, 0.4, 0.02]\nposition_m = [0, 0, -0.01]\n";
  for (int k = 0; k < kScrews; ++k) {
    const double x_m = (k % kColumns - (kColumns - 1) / 2.0) * kPitch_m;
    const double y_m = (k / kColumns - 2) * kPitch_m;
    scene << "[[part]]\nname = \"screw" << k << "\"\nrole = \"loose\"\nmesh = \"screw.obj\"\n"
          << "scale_to_m = 1.0\nposition_m = [" << x_m << ", " << y_m << ", " << height_m << "]\n"
          << lead;
  }
  scene << more << "[rendering]\nk_f_n_per_m = 1000\n[coupling]\nk_t_n_per_m = 1000\n";
  scene.close();
  std::vector<std::byte> bytes =
      tools::compile_scene(tools::read_scene_file(folder / "screws.toml"), {}).bytes;
  std::filesystem::remove_all(folder);
  return bytes;
}

const std::vector<std::byte>& standing_screws() {
  static const std::vector<std::byte> scene = screws_scene("", 2e-5);
  return scene;
}

JudgedBody judged(const SceneView& scene, std::uint32_t body) {
  JudgedBody judged;
  const BodyRecord& record = scene.bodies()[body];
  for (std::uint32_t k = 0; k < record.piece_count; ++k) {
    OraclePiece piece = oracle_piece_of(scene.piece(record.piece_begin + k));
    for (WideVec& v : piece.vertices) {
      v = v + WideVec{record.reference_m[0], record.reference_m[1], record.reference_m[2]};
      judged.radius_m = std::max(judged.radius_m, norm(v));
    }
    judged.pieces.push_back(std::move(piece));
  }
  return judged;
}

/// The screws, the stick and the table, tick by tick.
class ScrewBench {
 public:
  explicit ScrewBench(const std::vector<std::byte>& scene) : session_(scene, "screws") {
    device = pose_of(session_.parts()->start_of(0));
    SceneView held, loose;
    REQUIRE(SceneView::open(session_.parts()->scene_of(0), held) == RtStatus::kOk);
    REQUIRE(SceneView::open(session_.parts()->scene_of(2), loose) == RtStatus::kOk);
    stick_ = judged(held, 0);
    screw_ = judged(loose, 0);
    table_ = judged(loose, 1);
  }
  void ticks(int many) {
    for (int k = 0; k < many; ++k) {
      ticks_ += 1;
      StepInput input;
      input.sequence = ticks_;
      input.stamp_ns = static_cast<std::int64_t>(ticks_) * 1'000'000;
      input.pose_wa = device;
      session_.hands()->follow({{}, input.stamp_ns, true});
      last = session_.step(input);
      REQUIRE(last.status == RtStatus::kOk);
      limited += (last.flags & kFlagProxyLimited) != 0 ? 1 : 0;
      behind += (last.flags & kFlagBehind) != 0 ? 1 : 0;
      // Where the budget is spent before a step was found the part stays too.
      stuck += (last.flags & (kFlagProxyStuck | kFlagBehind)) == kFlagProxyStuck ? 1 : 0;
      is_within_ = is_within_ && within_bounds(last.counters, session_.bounds());
    }
  }
  void go(const Vec3& way_m, int many) {
    for (int k = 0; k < many; ++k) {
      device.p_wa += way_m / static_cast<Real>(many);
      ticks(1);
    }
  }
  [[nodiscard]] Pose screw(int k) {
    return session_.hands()->driven().states()[static_cast<std::size_t>(k)].felt_wa;
  }
  [[nodiscard]] std::vector<Pose> screws() {
    std::vector<Pose> poses;
    for (int k = 0; k < kScrews; ++k) poses.push_back(screw(k));
    return poses;
  }
  /// The smallest distance of two parts that are near each other.
  [[nodiscard]] double least_gap_m() {
    BodyPairJudge of_screws(screw_, screw_, kTolerance_m, kTolerance_m);
    BodyPairJudge of_stick(screw_, stick_, kTolerance_m, kTolerance_m);
    BodyPairJudge of_table(screw_, table_, kTolerance_m, kTolerance_m);
    const WidePose stick = wide_pose(session_.hands()->felt_wa(0));
    Wide least = 1;
    std::vector<WidePose> at;
    for (const Pose& pose : screws()) at.push_back(wide_pose(pose));
    for (int a = 0; a < kScrews; ++a) {
      const WidePose& one = at[static_cast<std::size_t>(a)];
      least = std::min(least, of_table.end_gap_m(one, kWanted_m));
      least = std::min(least, of_stick.end_gap_m(seen_from_wide(stick, one), kWanted_m));
      for (int b = a + 1; b < kScrews; ++b) {
        const WidePose& other = at[static_cast<std::size_t>(b)];
        if (norm(one.p - other.p) > 0.03) continue;
        least = std::min(least, of_screws.end_gap_m(seen_from_wide(other, one), kWanted_m));
      }
    }
    return static_cast<double>(least);
  }
  [[nodiscard]] bool is_within_bounds() const { return is_within_; }
  [[nodiscard]] CoreSession& session() { return session_; }

  static constexpr Wide kTolerance_m = 1e-6L, kWanted_m = 1e-3L;
  Pose device;
  StepResult last;
  int limited = 0, behind = 0, stuck = 0;  ///< ticks

 private:
  CoreSession session_;
  JudgedBody stick_, screw_, table_;
  std::uint64_t ticks_ = 0;
  bool is_within_ = true;
};

bool are_same(const std::vector<Pose>& one, const std::vector<Pose>& other) {
  return std::equal(one.begin(), one.end(), other.begin(), other.end(),
                    [](const Pose& a, const Pose& b) {
                      return a.p_wa == b.p_wa && a.q_wa.coeffs() == b.q_wa.coeffs();
                    });
}

/// The hand trembles before them.
void check_left_alone(int many) {
  ScrewBench bench(standing_screws());
  bench.ticks(100);
  const std::vector<Pose> at = bench.screws();
  CHECK(bench.least_gap_m() >= 0);
  for (int k = 0; k < many; ++k) {
    bench.device.p_wa.x() += k % 2 == 0 ? 1e-5_r : -1e-5_r;
    bench.ticks(1);
  }
  CHECK(are_same(at, bench.screws()));
  CHECK(bench.is_within_bounds());
}

}  // namespace

TEST_SUITE("host_sim.many_parts") {
  TEST_CASE("fifty equal screws share their scenes") {
    const CoreSession session(standing_screws(), "screws");
    const PartScenes& parts = *session.parts();
    CHECK(parts.driven().size() == kScrews);
    CHECK(parts.pairs().size() == kScrews * (kScrews + 1) / 2);
    std::set<std::uint64_t> scenes;
    for (const BodyPairRecord& pair : parts.pairs()) scenes.insert(pair.scene_begin);
    CHECK(scenes.size() == 2);  // with a screw, and with the stick
  }

  TEST_CASE("left alone they keep the same bits") { check_left_alone(20'000); }
  TEST_CASE("[long] left alone for an hour they keep the same bits") {
    check_left_alone(3'600'000);
  }

  TEST_CASE("a stick stirs them, and nobody goes through anybody") {
    ScrewBench bench(standing_screws());
    bench.ticks(50);
    const std::vector<Pose> before = bench.screws();
    double least_m = 1;
    // To and fro through the rows, farther each time.
    for (int k = 0; k < 160; ++k) {
      const double at = 0.08 * k;
      bench.go({0.0015_r * static_cast<Real>(std::cos(at)),
                0.0006_r + 0.0012_r * static_cast<Real>(std::sin(at)), 0},
               10);
      least_m = std::min(least_m, bench.least_gap_m());
    }
    CHECK(least_m >= -2e-6);
    MESSAGE("least gap ", 1e6 * least_m, " um; of 1650 ticks limited ", bench.limited, ", behind ",
            bench.behind, ", stuck ", bench.stuck);
    CHECK(bench.stuck == 0);
    CHECK(bench.behind < 100);
    CHECK(bench.is_within_bounds());
    int moved = 0;
    for (int k = 0; k < kScrews; ++k) {
      const double way_m = static_cast<double>(
          (bench.screw(k).p_wa - before[static_cast<std::size_t>(k)].p_wa).norm());
      moved += way_m > 0.005 ? 1 : 0;
    }
    CHECK(moved >= 8);
    // Away from them: they stay where they were left.
    bench.go({0, -0.02_r, 0}, 200);
    const std::vector<Pose> left = bench.screws();
    bench.ticks(3000);
    CHECK(are_same(left, bench.screws()));
  }

  TEST_CASE("screws that sink take turns until all stand on the table") {
    ScrewBench bench(screws_scene("weight_n = 0.05\nfall_m_per_s = 0.2\n", 0.004));
    bench.ticks(3000);
    for (int k = 0; k < kScrews; ++k) {
      CHECK(static_cast<double>(bench.screw(k).p_wa.z()) < 2e-5);
      CHECK(static_cast<double>(bench.screw(k).p_wa.z()) > -2e-6);
    }
    CHECK(bench.least_gap_m() >= -2e-6);
    CHECK(bench.is_within_bounds());
  }

  TEST_CASE("the same motion gives the same bits, after a reset too") {
    ScrewBench first(standing_screws()), second(standing_screws());
    first.go({0, 0.04_r, 0}, 400);
    second.go({0, 0.04_r, 0}, 400);
    CHECK(first.last.state_hash == second.last.state_hash);
    CHECK(are_same(first.screws(), second.screws()));
    // Those that took the places of others go on from where they are.
    const std::vector<Pose> left = first.screws();
    first.session().hands()->reset();
    first.ticks(5);
    CHECK(first.least_gap_m() >= -2e-6);
    for (int k = 0; k < kScrews; ++k) {
      const Pose& before = left[static_cast<std::size_t>(k)];
      CHECK((first.screw(k).p_wa - before.p_wa).norm() < 1e-3_r);
    }
  }

  TEST_CASE("more parts that always move than a tick has room for are refused") {
    std::string driven;
    for (int k = 0; k < 7; ++k)
      driven += "[[part]]\nname = \"d" + std::to_string(k) +
                "\"\nrole = \"driven\"\nshape = \"box\"\nsize_m = [0.01, 0.01, 0.01]\n"
                "fastest_m_per_s = 0.1\nfastest_rad_per_s = 1\nposition_m = [1, 0, " +
                std::to_string(1 + k) + "]\n";
    std::string said;
    try {
      screws_scene("", 2e-5, driven);
    } catch (const tools::InputError& error) {
      said = error.what();
    }
    CHECK(haptic::test::has(said, "has 8 parts in hands or driven"));
    CHECK(haptic::test::has(said, "give at most 7 beside loose ones"));
  }
}
