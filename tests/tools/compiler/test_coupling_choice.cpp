// SPDX-License-Identifier: Apache-2.0
// Gains that a scene file gives or leaves open, against the device; friction by material; report.
#include <doctest/doctest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/tools/compiler/part_scenes.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/coupling/coupling_choice.hpp"
#include "tools/graph_compiler/coupling/passivity_budget.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"
#include "tools/graph_compiler/program/report.hpp"

using namespace haptic;
using namespace haptic::tools;
using namespace haptic::test;
using haptic::sim::test::ScratchFolder;

namespace {

constexpr double kRadius_m = 0.04;
constexpr const char* kDevice =
    "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 1\nmax_force_n = 8\nmax_torque_nm = 0.2\n"
    "rotor_inertia_kg_m2 = 9e-5\nrotor_damping_nms_per_rad = 9e-4\n";

/// A cube over a larger one; `k_f` stands at 12:15, `more` begins in line 13.
std::string scene_text(const std::string& k_f, const std::string& more) {
  return "format = 1\nname = \"c\"\n[moving]\nmesh = \"cube.obj\"\nscale_to_m = 0.02\n"
         "material = \"pom\"\n[[static]]\nmesh = \"cube.obj\"\nscale_to_m = 0.1\n"
         "material = \"steel\"\n[rendering]\nk_f_n_per_m = " +
         k_f + "\n" + more;
}

SceneFile parsed(const std::string& text, const ScratchFolder& folder) {
  write_cube(folder.file("cube.obj"));
  return parse_scene_file(text, "scene.toml", std::filesystem::path(folder.file("")));
}

CouplingChoice choice(const std::string& k_f, const std::string& more,
                      double radius_m = kRadius_m) {
  const ScratchFolder folder("coupling");
  const SceneFile scene = parsed(scene_text(k_f, more), folder);
  return choose_coupling(scene.parameters, scene.coupling, radius_m, scene.never_turns(),
                         scene.file);
}

std::string refusal(const std::string& k_f, const std::string& more) {
  try {
    choice(k_f, more);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

}  // namespace

TEST_SUITE("tools.coupling_choice") {
  TEST_CASE("without a device the gains follow from k_F and the radius, undamped") {
    const CouplingChoice made = choice("800", "");
    CHECK(made.coupling.k_t_n_per_m == 800.0);
    CHECK(made.coupling.k_r_nm_per_rad == doctest::Approx(800.0 * 0.18 * 0.18));
    CHECK(made.coupling.damping_ns_per_m == 0.0);
    CHECK(made.coupling.damping_share == 0.5);
    CHECK(made.coupling.max_rotation_error_rad == 1.0);
    CHECK(made.coupling.max_translation_error_m == 0.0);
    CHECK(made.coupling.passivity == 0);
    CHECK(made.notes.empty());
    const CouplingChoice length = choice("800", "[coupling]\nlength_m = 0.02\n");
    CHECK(length.coupling.k_r_nm_per_rad == doctest::Approx(800.0 * 0.02 * 0.02));
  }

  TEST_CASE("a device damps the coupling, limits its errors and turns the controller on") {
    const CouplingChoice made = choice("800", kDevice);
    const CouplingParameters& c = made.coupling;
    CHECK(c.k_t_n_per_m == 800.0);
    CHECK(c.damping_ns_per_m == 1.0);
    CHECK(c.max_translation_error_m == doctest::Approx(8.0 / 800.0));
    CHECK(c.max_rotation_error_rad == doctest::Approx(0.2 / c.k_r_nm_per_rad));
    CHECK(c.passivity == 1);
    REQUIRE(made.notes.size() == 1);
    CHECK(has(made.notes[0], "instead of 25.92 (k_t L^2)"));
    CHECK(choice("800", std::string(kDevice) + "[coupling]\npassivity = false\n")
              .coupling.passivity == 0);
  }

  TEST_CASE("a derived stiffness is reduced to what is calm at rest, and the report says so") {
    const CouplingChoice made = choice("20000", kDevice);
    REQUIRE(made.notes.size() == 2);
    CHECK(has(made.notes[0], "instead of 20000 (k_F), which is all that [device] can hold"));
    // Half of 2000 N/m, and of the rotor's 9e-4 N m s/rad over half a period.
    CHECK(made.coupling.k_t_n_per_m == doctest::Approx(1000.0).epsilon(0.01));
    CHECK(made.coupling.k_r_nm_per_rad == doctest::Approx(0.9).epsilon(0.01));
    const CouplingChoice soft =
        choice("20000", std::string(kDevice) + "max_stiffness_n_per_m = 500\n");
    CHECK(soft.coupling.k_t_n_per_m == 500.0);
    const CouplingChoice active =
        choice("20000", std::string(kDevice) + "[coupling]\nallow_active = true\n");
    CHECK(active.coupling.k_t_n_per_m == 20000.0);
    CHECK(active.coupling.allow_active == 1);
    CHECK(active.notes.empty());
  }

  TEST_CASE("a derived rotary stiffness is what the rotor holds and the motors render") {
    constexpr double kLarge_m = 0.5;
    const auto large = [&](const std::string& more) { return choice("800", more, kLarge_m); };
    const std::string bare = "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 1\n";
    const std::string rotor =
        "rotor_inertia_kg_m2 = [2e-4, 1e-4, 3e-4]\nrotor_damping_nms_per_rad = [2e-3, 1e-3, "
        "3e-3]\n";
    // L = 4.5 r_A would ask for 4050 N m/rad.
    const CouplingChoice held = large(bare + rotor);
    CHECK(held.coupling.k_t_n_per_m == 800.0);
    const SampledAxis axis{1e-4, 1e-3, 1e-3, 0.0, 1};
    const double k_r = held.coupling.k_r_nm_per_rad;
    CHECK(is_stable(axis, 1.99 * k_r, 0.0));
    CHECK(!is_stable(axis, 2.01 * k_r, 0.0));
    REQUIRE(held.notes.size() == 1);
    CHECK(has(held.notes[0], "k_r_nm_per_rad is "));
    CHECK(has(held.notes[0], "instead of 4050 (k_t L^2)"));
    CHECK(large(bare + rotor + "max_rotary_stiffness_nm_per_rad = 0.7\n").coupling.k_r_nm_per_rad ==
          0.7);
    CHECK(large(bare + rotor + "max_torque_nm = 0.01\n").coupling.k_r_nm_per_rad ==
          doctest::Approx(0.5));
    // Without a rotor: a light one, and a note.
    const CouplingChoice assumed = large(bare);
    CHECK(assumed.coupling.k_r_nm_per_rad < 0.2 * k_r);
    REQUIRE(assumed.notes.size() == 2);
    CHECK(has(assumed.notes[1], "no rotor_inertia_kg_m2"));
    CHECK(has(assumed.notes[1], "1e-05 kg m2 and 0.0001 N m s/rad"));
    CHECK(has(refusal("800", bare + "delay_s = 0.002\nrotor_inertia_kg_m2 = 1e-4\n"),
              "k_r_nm_per_rad: no rotary stiffness is stable"));
  }

  TEST_CASE("a light device gets less damping than the default") {
    const CouplingChoice made =
        choice("10", "[device]\nmass_kg = 0.001\ndamping_ns_per_m = 0.1\ndelay_s = 0.002\n");
    CHECK(made.coupling.damping_ns_per_m < 0.5);
    CHECK(made.coupling.damping_ns_per_m > 0.1);
    REQUIRE(!made.notes.empty());
    CHECK(has(made.notes[0], "damping_ns_per_m is"));
  }

  TEST_CASE("a given gain beyond the budget is refused at its place unless active is allowed") {
    const std::string device = kDevice;  // lines 13 to 19, [coupling] is line 20
    CHECK(has(refusal("800", device + "[coupling]\nk_t_n_per_m = 9000\n"),
              "scene.toml:21:15: k_t_n_per_m: is 9000, the device is safe up to "));
    CHECK(has(refusal("800", device + "[coupling]\nk_r_nm_per_rad = 90\n"),
              "scene.toml:21:18: k_r_nm_per_rad: is 90, the device is safe up to "));
    CHECK(has(refusal("800", device + "[coupling]\nlength_m = 0.4\n"),
              "scene.toml:21:12: k_r_nm_per_rad: is "));
    CHECK(has(refusal("800", device + "[coupling]\ndamping_ns_per_m = 900\n"),
              "scene.toml:21:20: damping_ns_per_m: is 900 N s/m, the device is safe up to 161"));
    CHECK(has(refusal("800", device + "[coupling]\nk_t_n_per_m = 9000\n"), "allow_active = true"));
    CHECK(refusal("800", device + "[coupling]\nk_t_n_per_m = 9000\nallow_active = true\n") ==
          "accepted");
    CHECK(has(refusal("9000", "law = \"paper\"\n" + device),
              "scene.toml:12:15: k_f_n_per_m: is 9000, the device is safe up to "));
    CHECK(has(refusal("9000", "law = \"paper\"\n" + device), "two opposite planes (slot)"));
    CHECK(refusal("9000", "law = \"paper\"\n" + device + "[coupling]\nallow_active = true\n") ==
          "accepted");
    CHECK(has(refusal("800", "[device]\nmass_kg = 0.1\n[coupling]\ndamping_ns_per_m = 0\n"),
              "scene.toml:12:15: k_f_n_per_m: no stiffness is stable on this device"));
    // What a refusal says is safe is accepted.
    for (const std::string gain : {"k_t_n_per_m = ", "k_r_nm_per_rad = "}) {
      const std::string words = refusal("800", device + "[coupling]\n" + gain + "9000\n");
      CAPTURE(words);
      REQUIRE(has(words, "up to "));
      const double safe = std::stod(words.substr(words.find("up to ") + 6));
      CHECK(refusal("800", device + "[coupling]\n" + gain + std::to_string(0.9999 * safe) + "\n") ==
            "accepted");
      CHECK(refusal("800", device + "[coupling]\n" + gain + std::to_string(1.0001 * safe) + "\n") !=
            "accepted");
    }
  }

  TEST_CASE("friction reaches the bodies; unknown pairs and other laws are noted") {
    const ScratchFolder folder("coupling");
    const std::string friction = "[[friction]]\nmaterials = [\"steel\", \"pom\"]\nmu = 0.3\n";
    const auto compiled = [&](const std::string& text) {
      return compile_scene(parsed(text, folder), {});
    };
    const CompiledScene rough = compiled(scene_text("800", friction));
    const SceneBytes bytes{rough.bytes};
    SceneView view;
    REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
    CHECK(view.parameters().law == LawId::kProxy);
    CHECK(view.bodies()[1].friction == 0.3);
    CHECK(view.bodies()[1].friction_static == 0.3);
    const auto noted = [](const CompiledScene& scene, const std::string& words) {
      return has(report_as_text(scene), "note: " + words);
    };
    CHECK(!noted(rough, "no [[friction]]"));
    CHECK(noted(compiled(scene_text("800", "")),
                "no [[friction]] between cube.obj of pom and cube.obj of steel: coefficient 0"));
    CHECK(noted(compiled(scene_text("800", "law = \"paper\"\n" + friction)),
                "friction of cube.obj is not rendered by this law"));
  }

  TEST_CASE("climb_m: by the size, as asked, or none") {
    const ScratchFolder folder("coupling");
    const auto coupling_of = [&](const std::string& more) {
      const CompiledScene made = compile_scene(parsed(scene_text("800", more), folder), {});
      const SceneBytes bytes{made.bytes};
      SceneView view;
      REQUIRE(SceneView::open(bytes.span(), view) == RtStatus::kOk);
      return std::pair{view.parameters().coupling.climb_m, report_as_text(made)};
    };
    const auto [by_size, usual] = coupling_of("");
    CHECK(by_size == 0.0);
    CHECK(has(usual, "between faces do not hold the part"));
    const auto [asked, told] = coupling_of("[coupling]\nclimb_m = 2e-5\n");
    CHECK(asked == 2e-5);
    CHECK(has(told, "steps up to 20 um between faces do not hold the part"));
    const auto [none, off] = coupling_of("[coupling]\nclimb_m = 0\n");
    CHECK(none < 0.0);
    CHECK(has(off, "every step between faces holds the part"));
    CHECK_THROWS_AS(coupling_of("[coupling]\nclimb_m = -1\n"), InputError);
  }

  TEST_CASE("the report states the budget by contact state, or that none was checked") {
    const ScratchFolder folder("coupling");
    const auto compiled = [&](const std::string& more) {
      return compile_scene(parsed(scene_text("800", more), folder), {});
    };
    const CompiledScene without = compiled("");
    CHECK(has(report_as_text(without), "no [device]: no budget was checked"));
    const auto none = nlohmann::json::parse(report_as_json(without));
    CHECK(none["passivity_budget"]["checked"] == false);
    // Largest lever of a cube about its centre against L = 4.5 of it.
    CHECK(none["coupling"]["stiffness_share_at_largest_lever"].get<double>() ==
          doctest::Approx(1.0 / (1.0 + 4.0 / 81.0)).epsilon(1e-5));
    const CompiledScene with = compiled(kDevice);
    const auto json = nlohmann::json::parse(report_as_json(with));
    CHECK(json["passivity_budget"]["checked"] == true);
    CHECK(json["passivity_budget"]["holds"] == true);
    CHECK(json["passivity_budget"]["states"].size() == 5);
    const std::string text = report_as_text(with);
    for (const char* words : {"one plane", "two opposite planes (slot)", "edge of two", "corner of",
                              "rotation", "k_r up to", "margin 1.25"}) {
      CAPTURE(words);
      CHECK(has(text, words));
    }
  }

  TEST_CASE("a derived budget holds when the scene is read back, in either precision") {
    const ScratchFolder folder("coupling");
    const CompiledScene scene = compile_scene(parsed(scene_text("20000", kDevice), folder), {});
    const auto json = nlohmann::json::parse(report_as_json(scene));
    CHECK(json["passivity_budget"]["holds"] == true);
    CHECK(json["notes"].size() >= 2);
  }

  TEST_CASE("a size that law proxy does not serve is refused, other laws take it") {
    const ScratchFolder folder("coupling");
    std::string wide = scene_text("800", "");
    wide.replace(wide.find("material = \"pom\""), 16, "grip_m = [20000, 0, 0]");
    CHECK_THROWS_WITH_AS(compile_scene(parsed(wide, folder), {}),
                         doctest::Contains("law proxy serves 1e-07 to 1e+04 m"), InputError);
    CHECK_NOTHROW(compile_scene(parsed(wide + "law = \"paper\"\n", folder), {}));
    // The same part where single precision resolves too little, double does not mind.
    std::string far = scene_text("800", "");
    far.replace(far.find("material = \"steel\""), 18, "position_m = [50, 0, 0]");
    if (sizeof(Real) == sizeof(float)) {
      CHECK_THROWS_WITH_AS(compile_scene(parsed(far, folder), {}),
                           doctest::Contains("move the scene towards the origin"), InputError);
    } else {
      CHECK_NOTHROW(compile_scene(parsed(far, folder), {}));
    }
  }
}
