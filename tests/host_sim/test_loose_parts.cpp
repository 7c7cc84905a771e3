// SPDX-License-Identifier: Apache-2.0
/// Loose parts: pushed they go, left alone they stay, a weight sinks until something holds it.

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "host_sim/session/core_session.hpp"
#include "tests/support/text_search.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

std::vector<std::byte> loose_scene(const std::string& text) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / "haptic_test_loose_parts.toml";
  std::ofstream(path) << "format = 1\nname = \"loose\"\n"
                      << text
                      << "[rendering]\nk_f_n_per_m = 1000\n[coupling]\nk_t_n_per_m = 1000\n";
  std::vector<std::byte> bytes = tools::compile_scene(tools::read_scene_file(path), {}).bytes;
  std::filesystem::remove(path);
  return bytes;
}

std::string box_part(const std::string& name, const std::string& role, const char* size,
                     const char* at, const std::string& more = "") {
  return "[[part]]\nname = \"" + name + "\"\nrole = \"" + role + "\"\nshape = \"box\"\nsize_m = [" +
         size + "]\nposition_m = [" + at + "]\n" + more;
}

const std::string kTable = box_part("table", "fixed", "0.4, 0.4, 0.02", "0, 0, -0.01");

/// The hands' devices, tick by tick.
class LooseBench {
 public:
  explicit LooseBench(const std::vector<std::byte>& scene) : session_(scene, "loose parts") {
    for (std::uint32_t k = 0; k < count(); ++k) device[k] = pose_of(session_.parts()->start_of(k));
    ticks(3);
  }
  [[nodiscard]] std::uint32_t count() { return session_.hands()->count(); }
  void ticks(int many) {
    for (int k = 0; k < many; ++k) {
      ticks_ += 1;
      Hands::Each<StepInput> inputs;
      Hands::Each<const StepInput*> given{};
      for (std::uint32_t h = 0; h < count(); ++h) {
        inputs[h].sequence = ticks_;
        inputs[h].stamp_ns = static_cast<std::int64_t>(ticks_) * 1'000'000;
        inputs[h].pose_wa = device[h];
        given[h] = &inputs[h];
      }
      session_.hands()->follow({{}, inputs[0].stamp_ns, true});
      last = session_.hands()->step(given);
    }
  }
  /// Each hand by a way, in equal steps.
  void go(const Hands::Each<Vec3>& way_m, int many) {
    for (int k = 0; k < many; ++k) {
      for (std::uint32_t h = 0; h < count(); ++h)
        device[h].p_wa += way_m[h] / static_cast<Real>(many);
      ticks(1);
    }
  }
  [[nodiscard]] const DrivenState& loose(std::size_t k = 0) {
    return session_.hands()->driven().states()[k];
  }
  [[nodiscard]] double at_m(int axis, std::size_t k = 0) {
    return static_cast<double>(loose(k).felt_wa.p_wa[axis]);
  }
  [[nodiscard]] double force_n(std::size_t hand, int axis) const {
    return static_cast<double>(last[hand].wrench_w.force_w[axis]);
  }

  Hands::Each<Pose> device;
  Hands::Each<StepResult> last;

 private:
  CoreSession session_;
  std::uint64_t ticks_ = 0;
};

/// 4 N of each hand, mu 0.3, on a bar of 1 N, for so many ticks.
void check_lifted(int many) {
  LooseBench bench(loose_scene(
      box_part("left", "hand", "0.02, 0.04, 0.04", "-0.08, 0, 0.03", "material = \"rubber\"\n") +
      box_part("right", "hand2", "0.02, 0.04, 0.04", "0.08, 0, 0.03", "material = \"rubber\"\n") +
      box_part("bar", "loose", "0.1, 0.02, 0.02", "0, 0, 0.0301",
               "weight_n = 1\nmaterial = \"rubber\"\n") +
      kTable + "[[friction]]\nmaterials = [\"rubber\", \"rubber\"]\nmu = 0.3\n"));
  bench.ticks(100);
  CHECK(bench.at_m(2) < 0.0301);
  // 20 mm to each face, and 4 mm on: 4 N each.
  bench.go({Vec3(0.024_r, 0, 0), Vec3(-0.024_r, 0, 0)}, 300);
  bench.go({Vec3(0, 0, 0.05_r), Vec3(0, 0, 0.05_r)}, 600);
  bench.ticks(500);
  const double held_m = bench.at_m(2);
  CHECK(held_m > 0.04);
  CHECK(bench.force_n(0, 2) + bench.force_n(1, 2) == doctest::Approx(-1).epsilon(0.05));
  bench.ticks(many);
  CHECK(std::abs(bench.at_m(2) - held_m) < 1e-6);
  // Let go of: it falls to the table again.
  bench.go({Vec3(-0.02_r, 0, 0), Vec3(0.02_r, 0, 0)}, 300);
  bench.ticks(500);
  CHECK(bench.at_m(2) == doctest::Approx(0.01).epsilon(0.01));
}

}  // namespace

TEST_SUITE("host_sim.loose_parts") {
  TEST_CASE("a block is pushed with the force that its anchor holds, and stays where it was left") {
    LooseBench bench(loose_scene(
        box_part("finger", "hand", "0.02, 0.02, 0.02", "-0.06, 0, 0.02") +
        box_part("block", "loose", "0.04, 0.04, 0.03", "0, 0, 0.0155", "yield_n = 0.8\n") +
        kTable));
    bench.ticks(100);
    CHECK(bench.at_m(0) == 0);
    CHECK(bench.at_m(2) == doctest::Approx(0.0155));
    // The faces are 30 mm apart; the finger comes 50 mm.
    bench.go({Vec3(0.05_r, 0, 0), Vec3::Zero()}, 500);
    // On the move its anchor's spring holds more.
    CHECK(bench.force_n(0, 0) < -0.8);
    CHECK(bench.force_n(0, 0) > -4);
    bench.ticks(400);
    CHECK(bench.force_n(0, 0) == doctest::Approx(-0.8).epsilon(0.05));
    CHECK(bench.loose().touches());
    const double pushed_m = bench.at_m(0);
    CHECK(pushed_m == doctest::Approx(0.0192).epsilon(0.02));
    // Away: it gives back no more than its anchor's spring holds, 40 um.
    bench.go({Vec3(-0.03_r, 0, 0), Vec3::Zero()}, 300);
    CHECK(std::abs(bench.at_m(0) - pushed_m) < 5e-5);
    CHECK(bench.force_n(0, 0) == doctest::Approx(0));
    const double left_m = bench.at_m(0);
    bench.ticks(3000);
    CHECK(bench.at_m(0) == left_m);
  }

  TEST_CASE("what is pushed pushes the next, and both stop at the wall") {
    LooseBench bench(loose_scene(box_part("finger", "hand", "0.02, 0.02, 0.02", "-0.06, 0, 0.03") +
                                 box_part("first", "loose", "0.03, 0.03, 0.03", "-0.02, 0, 0.03") +
                                 box_part("second", "loose", "0.03, 0.03, 0.03", "0.02, 0, 0.03") +
                                 box_part("wall", "fixed", "0.02, 0.2, 0.2", "0.06, 0, 0")));
    bench.go({Vec3(0.08_r, 0, 0), Vec3::Zero()}, 800);
    bench.ticks(300);
    // From the wall's face at 50 mm back: 15, 30 + 15, 60 + 10 mm.
    CHECK(bench.at_m(0, 1) == doctest::Approx(0.035).epsilon(1e-3));
    CHECK(bench.at_m(0, 0) == doctest::Approx(0.005).epsilon(0.01));
    CHECK(static_cast<double>(bench.last[0].proxy_pose_wa.p_wa[0]) ==
          doctest::Approx(-0.02).epsilon(1e-3));
    CHECK(bench.force_n(0, 0) < -10);
  }

  TEST_CASE("a weight sinks onto the table, and no farther") {
    LooseBench bench(loose_scene(box_part("finger", "hand", "0.02, 0.02, 0.02", "-0.1, 0, 0.02") +
                                 box_part("block", "loose", "0.04, 0.04, 0.03", "0, 0, 0.05",
                                          "weight_n = 1\nfall_m_per_s = 0.5\n") +
                                 kTable));
    // 35 mm at 0.5 m/s.
    bench.ticks(40);
    CHECK(bench.at_m(2) < 0.045);
    CHECK(bench.at_m(2) > 0.016);
    bench.ticks(300);
    CHECK(bench.at_m(2) == doctest::Approx(0.015).epsilon(1e-3));
    const double rests_m = bench.at_m(2);
    bench.ticks(2000);
    CHECK(std::abs(bench.at_m(2) - rests_m) < 1e-6);
    CHECK(static_cast<double>(bench.loose().pushed_w.force_w[2]) ==
          doctest::Approx(1).epsilon(0.02));
  }

  TEST_CASE("a cone, whose centre of volume is not that of its box, stands on its base") {
    LooseBench bench(loose_scene(
        box_part("finger", "hand", "0.02, 0.02, 0.02", "-0.1, 0, 0.02") +
        "[[part]]\nname = \"cone\"\nrole = \"loose\"\nshape = \"cone\"\nradius_m = 0.02\n"
        "height_m = 0.04\nposition_m = [0, 0, 0.05]\nweight_n = 1\n" +
        kTable));
    bench.ticks(500);
    // Its mesh frame is half way up.
    CHECK(bench.at_m(2) == doctest::Approx(0.02).epsilon(1e-3));
  }

  TEST_CASE("two hands lift a bar by friction and hold it without creep") { check_lifted(5000); }
  TEST_CASE("[long] two hands hold a bar for a minute without creep") { check_lifted(60'000); }

  TEST_CASE("what a loose part may not say is refused, with the fix") {
    const auto refused = [](const std::string& more, const std::string& others = "") {
      try {
        loose_scene(box_part("finger", "hand", "0.02, 0.02, 0.02", "-0.1, 0, 0.02") +
                    box_part("block", "loose", "0.04, 0.04, 0.03", "0, 0, 0.05", more) + others +
                    kTable);
      } catch (const tools::InputError& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    using haptic::test::has;
    CHECK(refused("").empty());
    CHECK(has(refused("yield_n = 1\nweight_n = 1\n"), "keep one of the two"));
    CHECK(has(refused("fall_m_per_s = 1\n"), "give that too, or leave it out"));
    CHECK(has(refused("grip_m = [0, 0, 0]\n"), "is of a part that the hand may hold"));
    CHECK(has(refused("", box_part("c", "placed", "0.02, 0.02, 0.02", "0.1, 0, 0.1")),
              "'c' is \"placed\"; make it fixed"));
  }
}
