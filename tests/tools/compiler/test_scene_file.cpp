// SPDX-License-Identifier: Apache-2.0

#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/toml_table.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

using namespace haptic;
using namespace haptic::tools;
using haptic::sim::test::ScratchFolder;

namespace {

// A sound scene file, and every way in which the tests spoil it.

inline constexpr const char* kGood =
    "format = 1\n"                                           // 1
    "name = \"sample\"\n"                                    // 2
    "[moving]\n"                                             // 3
    "mesh = \"part.obj\"\n"                                  // 4
    "scale_to_m = 0.001\n"                                   // 5
    "position_m = [0.1, 0.2, 0.3]\n"                         // 6
    "quaternion = { w = 0.6, x = 0.0, y = 0.8, z = 0.0 }\n"  // 7
    "grip_m = [0, 0, 0.5]\n"                                 // 8
    "[[static]]\n"                                           // 9
    "mesh = \"part.obj\"\n"                                  // 10
    "scale_to_m = [1.0, 2, 3.5]\n"                           // 11
    "[rendering]\n"                                          // 12
    "k_f_n_per_m = 1500\n";                                  // 13

/// One edit of kGood, and what is said of it then.
struct SceneFileDefect {
  const char *from, *to;  ///< first occurrence of `from` in kGood
  const char *place, *says;
};

inline constexpr SceneFileDefect kDefects[] = {
    {"format = 1", "format = 2", "1:10: ", "this compiler reads format = 1"},
    {"format = 1", "format = 1.0", "1:10: ", "give an integer"},
    {"format = 1\n", "", "1:1: ", "format is missing"},
    {"name = \"sample\"", "name = \"\"", "2:8: ", "give 1 to 200"},
    {"name = \"sample\"", "name = 5", "2:8: ", "give a string"},
    {"name = \"sample\"", "name = \"a\\tb\"", "2:8: ", "control character"},
    {"name = \"sample\"", "nam = \"sample\"", "2:1: ", "did you mean 'name'?"},
    {"name = \"sample\"", "name = \"sample", "2:15: ", "not valid TOML"},
    {"name = \"sample\"\n", "name = \"sample\"\nname = \"b\"\n", "3:", "not valid TOML"},
    {"[moving]", "[movin]", "3:2: ", "did you mean 'moving'?"},
    {"[moving]", "[zzzzzzzzzzzz]", "3:2: ", "the known keys are format, name, moving"},
    {"[moving]", "[[moving]]", "3:1: ", "give it once"},
    {"mesh = \"part.obj\"\n", "", "3:1: ", "[moving] mesh is missing"},
    {"part.obj", "absent.obj", "4:8: ", "no file 'absent.obj'"},
    {"part.obj", "", "4:8: ", "no file ''"},
    {"mesh = \"part.obj\"", "mesh = [1]", "4:8: ", "is an array; give a string"},
    {"scale_to_m = 0.001\n", "", "3:1: ", "0.001 for millimetres"},
    {"scale_to_m = 0.001", "scale = 0.001", "5:1: ", "did you mean 'scale_to_m'?"},
    {"scale_to_m = 0.001", "scale_to_m = 0", "5:14: ", "above 0"},
    {"scale_to_m = 0.001", "scale_to_m = -1.0", "5:14: ", "above 0"},
    {"scale_to_m = 0.001", "scale_to_m = inf", "5:14: ", "give a number above 0"},
    {"scale_to_m = 0.001", "scale_to_m = true", "5:14: ", "is a boolean; give a number"},
    {"scale_to_m = 0.001", "scale_to_m = \"mm\"", "5:14: ", "is a string; give a number"},
    {"[1.0, 2, 3.5]", "[1.0, 2]", "11:14: ", "has 2 elements; give three"},
    {"[1.0, 2, 3.5]", "[1.0, 0.0, 3.5]", "11:20: ", "[[static]] scale_to_m[1] is 0"},
    {"[0.1, 0.2, 0.3]", "[0.1, nan, 0.3]", "6:20: ", "position_m[1] is nan"},
    {"[0.1, 0.2, 0.3]", "[0.1, 0.2, 1e9]", "6:25: ", "from -100000 to 100000"},
    {"[0.1, 0.2, 0.3]", "0.1", "6:14: ", "give an array of three numbers"},
    {"[0.1, 0.2, 0.3]", "[0.1, \"a\", 0.3]", "6:20: ", "is a string"},
    {"w = 0.6", "w = 0.7", "7:14: ", "has length 1.06301"},
    {"w = 0.6", "w = 0.602", "7:14: ", "divide its components"},
    {"w = 0.6, ", "", "7:14: ", "w is missing"},
    {"w = 0.6", "ww = 0.6", "7:16: ", "did you mean 'w'?"},
    {"w = 0.6", "w = nan", "7:20: ", "w is nan"},
    {"{ w = 0.6, x = 0.0, y = 0.8, z = 0.0 }", "[1, 0, 0, 0]", "7:14: ", "give a table"},
    {"grip_m = [0, 0, 0.5]", "grip = [0, 0, 0.5]", "8:1: ", "did you mean 'grip_m'?"},
    {"[[static]]", "[static]", "9:1: ", "write its heading as [[static]]"},
    {"[[static]]\nmesh = \"part.obj\"\nscale_to_m = [1.0, 2, 3.5]\n", "",
     "1:1: ", "add at least one [[static]]"},
    {"scale_to_m = [1.0, 2, 3.5]", "scale_to_m = 1\ngrip_m = [0, 0, 0]",
     "12:1: ", "unknown key 'grip_m'"},
    {"[rendering]\nk_f_n_per_m = 1500\n", "", "1:1: ", "rendering is missing"},
    {"k_f_n_per_m = 1500\n", "", "12:1: ", "give the stiffness"},
    {"k_f_n_per_m = 1500", "k_f_n_per_m = 0", "13:15: ", "above 0"},
    {"k_f_n_per_m = 1500", "k_f_n_per_m = nan", "13:15: ", "is nan"},
    {"k_f_n_per_m = 1500", "k_f = 1500", "13:1: ", "did you mean 'k_f_n_per_m'?"},
    {"grip_m = [0, 0, 0.5]", "material = \"\"", "8:12: ", "[moving] material: is empty"},
    {"grip_m = [0, 0, 0.5]", "material = 5", "8:12: ", "give a string"},
    {"k_f_n_per_m = 1500", "k_f_n_per_m = 1979-05-27", "13:15: ", "is a date or time"},
};

/// Lines behind kGood, and what is said of them.
struct SceneFileAddition {
  const char* lines;
  const char *place, *says;
};

inline constexpr SceneFileAddition kAdditions[] = {
    {"law = \"penalty\"", "14:7: ", "the laws are: proxy, paper"},
    {"law = \"weighted_region\"", "14:7: ", "the laws are: proxy, paper"},
    {"[[friction]]\nmu = 0.3", "14:1: ", "materials is missing; name two"},
    {"[[friction]]\nmaterials = [\"a\", \"b\"]", "14:1: ", "give the Coulomb coefficient"},
    {"[[friction]]\nmaterials = [\"a\", \"b\"]\nmu = 2.1", "16:6: ", "from 0 to 2"},
    {"[[friction]]\nmaterials = [\"a\"]\nmu = 0.3", "15:13: ", "has 1 elements; give two strings"},
    {"[[friction]]\nmaterials = \"a\"\nmu = 0.3", "15:13: ", "give an array of two strings"},
    {"[[friction]]\nmaterials = [\"a\", 1]\nmu = 0.3", "15:19: ", "materials[1] is"},
    {"[[friction]]\nmaterials = [\"\", \"b\"]\nmu = 0.3", "15:14: ", "materials[0] is empty"},
    {"[[friction]]\nmaterials = [\"a\", \"b\"]\nmu = 0.3\n[[friction]]\nmaterials = [\"b\", "
     "\"a\"]\nmu = 0.2",
     "18:13: ", "have a coefficient already"},
    {"[friction]\nmu = 0.3", "14:1: ", "write its heading as [[friction]]"},
    {"[coupling]\nk_t = 1", "15:1: ", "did you mean 'k_t_n_per_m'?"},
    {"[coupling]\nk_t_n_per_m = 0", "15:15: ", "above 0"},
    {"[coupling]\nk_r_nm_per_rad = 1\nlength_m = 0.1", "16:12: ", "keep one"},
    {"[coupling]\ndamping_ns_per_m = -1", "15:20: ", "from 0"},
    {"[coupling]\ndamping_share = 1.5", "15:17: ", "from 0 to 1"},
    {"[coupling]\nmax_rotation_error_rad = 3.5", "15:26: ", "above 0 and at most 3"},
    {"[coupling]\nmax_translation_error_m = 0", "15:27: ", "above 0"},
    {"[coupling]\nmin_window_s = 0.01\nmax_window_s = 0.009", "16:16: ", "below min_window_s"},
    {"[coupling]\npassivity = 1", "15:13: ", "give true or false"},
    {"[coupling]\npassivity = true", "15:13: ", "give [device] mass_kg"},
    {"[device]\nencoder_step_rad = -1", "15:20: ", "at least 0"},
    {"[device]\nrotor_inertia_kg_m2 = 0", "15:23: ", "above 0"},
    {"[device]\nrotor_inertia_kg_m2 = [1e-4, 1e-4]", "15:23: ", "three"},
    {"[device]\nrotor_damping_nms_per_rad = 1e-3", "15:29: ", "give rotor_inertia_kg_m2 too"},
    {"[[friction]]\nmaterials = [\"a\", \"b\"]\nmu = 0.3\nmu_static = 0.2",
     "17:13: ", "is below mu"},
    {"epsilon_m = 0.0", "14:13: ", "above 0 and at most 0.1"},
    {"epsilon_m = 1", "14:13: ", "at most 0.1"},
    {"[loop]\nrate_hz = 0.5", "15:11: ", "from 1 to 100000"},
    {"[start]\nposition_m = [0, 0, 0]", "14:1: ", "keep one of the two"},
    {"[motion_limits]\nlinear_m_per_s = 1", "14:1: ", "angular_rad_per_s is missing"},
    {"[motion_limits]\nlinear_m_per_s = -1", "15:18: ", "above 0"},
    {"[motion_limits]\norientation = { max_angle_rad = 30 }", "15:33: ", "from 0 to 3.1416"},
    {"[motion_limits]\norientation = { about = \"start\" }", "15:15: ", "max_angle_rad is missing"},
    {"[motion_limits]\norientation = { about = \"goal\", max_angle_rad = 1 }",
     "15:25: ", "give \"start\" or four numbers"},
    {"[motion_limits]\norientation = { about = [1, 1, 0, 0], max_angle_rad = 1 }",
     "15:25: ", "has length 1.41421356; divide"},
    {"[motion_limits]\norientation = { about = [1, 0, 0], max_angle_rad = 1 }",
     "15:25: ", "has 3 elements; give four numbers"},
    {"[motion_limits]\norientation = { angle_rad = 1 }",
     "15:17: ", "did you mean 'max_angle_rad'?"},
    {"[motion_limits]\norientation = 0.5", "15:15: ", "give a table"},
    {"[motion_limits]\nworkspace = { min_m = [0, 0, 0] }", "15:13: ", "max_m is missing"},
    {"[motion_limits]\nworkspace = { min_m = [0, 0, 1], max_m = [1, 1, 0] }",
     "15:42: ", "is below min_m in z"},
    {"[motion_limits]\nworkspace = { min_m = [0, 0, nan], max_m = [1, 1, 0] }",
     "15:30: ", "min_m[2] is nan"},
    {"[motion_limits]\nangular_rad_per_s = 1\norientation = { max_angle_rad = 1 }",
     "14:1: ", "linear_m_per_s is missing"},
    {"[device]\nmass_kg = -0.1", "15:11: ", "at least 0"},
    {"[device]\nmass = 1", "15:1: ", "did you mean 'mass_kg'?"},
    {"[budget]\nconstants_bytes = 0", "15:19: ", "above 0"},
    {"[budget]\nstate_bytes = 1e6", "15:15: ", "give an integer"},
    {"exact_band_m = 0", "14:16: ", "above 0"},
    {"[budget]\npair_visits = 0", "15:15: ", "a whole number from 1"},
    {"[memory]\ngraph_bytes = -1", "15:15: ", "a whole number from 0"},
    {"[memory]\ngraph = 1", "15:1: ", "did you mean 'graph_bytes'?"},
    {"[cleaning]\nplane_tolerance_m = 0", "15:21: ", "above 0"},
    {"[cleaning]\nplane_tolerance = 1", "15:1: ", "did you mean 'plane_tolerance_m'?"},
};

/// The message about `text`, without the file's name; "accepted" if there is none.
std::string message_of(const std::string& text, const ScratchFolder& folder) {
  std::ofstream(folder.file("part.obj")) << "v 0 0 0\n";
  try {
    parse_scene_file(text, "scene.toml", std::filesystem::path(folder.file("")));
  } catch (const InputError& error) {
    const std::string message = error.what();
    REQUIRE(message.rfind("scene.toml:", 0) == 0);
    return message.substr(11);
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_SUITE("tools.scene_file") {
  TEST_CASE("a sound file gives its values and the defaults") {
    const ScratchFolder folder("scene_file");
    std::ofstream(folder.file("part.obj")) << "v 0 0 0\n";
    const SceneFile scene =
        parse_scene_file(kGood, "scene.toml", std::filesystem::path(folder.file("")));
    CHECK(scene.name == "sample");
    CHECK(scene.moving.scale_to_m == std::array<double, 3>{0.001, 0.001, 0.001});
    CHECK(scene.moving.position_m == std::array<double, 3>{0.1, 0.2, 0.3});
    CHECK(scene.moving.quaternion_wxyz[2] == doctest::Approx(0.8));
    CHECK(scene.moving.grip_m == std::array<double, 3>{0, 0, 0.5});
    REQUIRE(scene.statics.size() == 1);
    CHECK(scene.statics[0].scale_to_m == std::array<double, 3>{1.0, 2.0, 3.5});
    CHECK(scene.statics[0].quaternion_wxyz == std::array<double, 4>{1, 0, 0, 0});
    CHECK(scene.statics[0].path == std::filesystem::path(folder.file("part.obj")));
    CHECK(scene.parameters.law == LawId::kProxy);
    CHECK(!scene.coupling.k_t_n_per_m);
    CHECK(!scene.coupling.passivity);
    CHECK(!scene.coupling.allow_active);
    CHECK(scene.friction.empty());
    CHECK(scene.moving.material.empty());
    CHECK(scene.parameters.exact_band_m == 0.005);
    CHECK(!scene.graph_bytes);
    CHECK(!scene.budget.pair_visits);
    CHECK(scene.parameters.k_f_n_per_m == 1500);
    CHECK(scene.parameters.epsilon_m == 1e-4);
    CHECK(scene.parameters.rate_hz == 1000);
    CHECK(scene.parameters.motion_limits_given == 0);
    CHECK(scene.parameters.device.given == 0);
    CHECK(!scene.plane_tolerance_m);
    CHECK(!scene.budget.constants);
  }

  TEST_CASE("orientation and workspace are read, with speeds and without") {
    const ScratchFolder folder("scene_file");
    std::ofstream(folder.file("part.obj")) << "v 0 0 0\n";
    const auto read = [&](const std::string& limits) {
      return parse_scene_file(kGood + ("[motion_limits]\n" + limits), "scene.toml",
                              std::filesystem::path(folder.file("")));
    };
    const SceneFile scene = read(
        "orientation = { about = [0.6, 0.0, 0.0, -0.8], max_angle_rad = 0.52 }\n"
        "workspace = { min_m = [-1, -2, 0], max_m = [1, 2, 0] }\n");
    CHECK(scene.parameters.motion_limits_given == 0);
    REQUIRE(scene.orientation);
    CHECK(scene.orientation->about_xyzw == std::array<double, 4>{0.0, 0.0, -0.8, 0.6});
    CHECK(scene.orientation->max_angle_rad == 0.52);
    CHECK(!scene.orientation->is_free());
    REQUIRE(scene.workspace);
    CHECK(scene.workspace->min_m == std::array<double, 3>{-1, -2, 0});
    CHECK(scene.workspace->max_m == std::array<double, 3>{1, 2, 0});
    const std::array<double, 4> start{0.0, 0.8, 0.0, 0.6};
    const SceneFile about_start = read(
        "linear_m_per_s = 1\nangular_rad_per_s = 2\n"
        "orientation = { about = \"start\", max_angle_rad = 3.1416 }\n");
    CHECK(about_start.parameters.motion_limits_given == 1);
    CHECK(about_start.orientation->about_xyzw == start);
    CHECK(about_start.orientation->is_free());
    CHECK(!about_start.workspace);
    CHECK(read("orientation = { max_angle_rad = 0 }\n").orientation->about_xyzw == start);
    CHECK(!read("linear_m_per_s = 1\nangular_rad_per_s = 2\n").orientation);
  }

  TEST_CASE("parts ask for simplification and disjoint pieces one by one") {
    const ScratchFolder folder("scene_file_parts");
    CHECK(message_of(kGood, folder) == "accepted");
    const SceneFile plain = parse_scene_file(kGood, "scene.toml", folder.file(""));
    CHECK_FALSE(plain.moving.tolerance_m);
    CHECK_FALSE(plain.moving.disjoint);
    std::string text = replaced(kGood, "grip_m", "simplify_m = 2.5e-4\ngrip_m");
    text = replaced(text, "[rendering]", "disjoint = true\n[rendering]");
    const SceneFile asked = parse_scene_file(text, "scene.toml", folder.file(""));
    REQUIRE(asked.moving.tolerance_m);
    CHECK(*asked.moving.tolerance_m == 2.5e-4);
    CHECK_FALSE(asked.moving.disjoint);
    CHECK_FALSE(asked.statics[0].tolerance_m);
    CHECK(asked.statics[0].disjoint);
    // The key, and its former name above.
    const std::string named = replaced(kGood, "grip_m", "tolerance_m = 2.5e-4\ngrip_m");
    CHECK(*parse_scene_file(named, "scene.toml", folder.file("")).moving.tolerance_m == 2.5e-4);
    CHECK(message_of(replaced(named, "grip_m", "simplify_m = 1e-4\ngrip_m"), folder)
              .find("former name of tolerance_m") != std::string::npos);
    for (const char* wrong : {"tolerance_m = 0.0\n", "simplify_m = 0.0\n", "simplify_m = -1e-4\n",
                              "simplify_m = \"a\"\n", "disjoint = 1\n", "simplify = 1e-4\n"}) {
      CAPTURE(wrong);
      const std::string bad = replaced(kGood, "grip_m", std::string(wrong) + "grip_m");
      CHECK(message_of(bad, folder).rfind("8:", 0) == 0);
    }
  }

  TEST_CASE("quaternions of few digits are divided by their length, with a note") {
    const ScratchFolder folder("scene_file");
    std::ofstream(folder.file("part.obj")) << "v 0 0 0\n";
    const auto read = [&](const std::string& text) {
      return parse_scene_file(text, "scene.toml", std::filesystem::path(folder.file("")));
    };
    const std::string given = "quaternion = { w = 0.6, x = 0.0, y = 0.8, z = 0.0 }";
    CHECK(read(kGood).moving.notes.empty());
    for (const char* typed :
         {"{ w = 0.7071, x = 0.7071, y = 0, z = 0 }", "{ w = 0.707, x = 0, y = -0.707, z = 0 }",
          "{ w = 0.5005, x = 0.5, y = 0.5, z = 0.5 }", "{ w = 0.9239, x = 0.3827, y = 0, z = 0 }",
          "{ w = 0.9991, x = 0, y = 0, z = 0 }"}) {
      CAPTURE(typed);
      const SceneFile scene = read(replaced(kGood, given, std::string("quaternion = ") + typed));
      double square = 0.0;
      for (const double x : scene.moving.quaternion_wxyz) square += x * x;
      CHECK(square == doctest::Approx(1.0).epsilon(1e-15));
      REQUIRE(scene.moving.notes.size() == 1);
      CHECK(scene.moving.notes[0].find("scene.toml:7:14: [moving] quaternion has length ") == 0);
      CHECK(scene.statics[0].notes.empty());
    }
    CHECK_THROWS_AS(read(replaced(kGood, given, "quaternion = { w = 0.998, x = 0, y = 0, z = 0 }")),
                    InputError);
    CHECK_THROWS_AS(read(replaced(kGood, given, "quaternion = { w = 1.002, x = 0, y = 0, z = 0 }")),
                    InputError);
    // A fixed part, and the orientation that limits count from.
    const SceneFile scene = read(
        replaced(kGood, "[rendering]",
                 "quaternion = { w = 0.7071, x = 0.7071, y = 0, z = 0 }\n[rendering]") +
        "[motion_limits]\norientation = { about = [0.7071, 0, 0.7071, 0], max_angle_rad = 1 }\n");
    CHECK(scene.statics[0].notes.at(0).find("[[static]] quaternion has length") !=
          std::string::npos);
    CHECK(scene.moving.notes.at(0).find("about has length 0.99999") != std::string::npos);
    CHECK(scene.orientation->about_xyzw[1] == doctest::Approx(std::sqrt(0.5)).epsilon(1e-15));
  }

  TEST_CASE("every optional table is read") {
    const ScratchFolder folder("scene_file");
    std::ofstream(folder.file("part.obj")) << "v 0 0 0\n";
    std::string text = replaced(kGood, "position_m = [0.1, 0.2, 0.3]\n", "");
    text = replaced(text, "quaternion = { w = 0.6, x = 0.0, y = 0.8, z = 0.0 }\n", "");
    text +=
        "law = \"paper\"\nepsilon_m = 5e-4\nexact_band_m = 0.01\n"
        "[start]\nposition_m = [1, 2, 3]\nquaternion = { w = 0, x = 1, y = 0, z = 0 }\n"
        "[motion_limits]\nlinear_m_per_s = 0.5\nangular_rad_per_s = 4\n"
        "[loop]\nrate_hz = 4000\n"
        "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 1\ncoulomb_friction_n = 0.2\n"
        "encoder_step_m = 1e-5\nmax_force_n = 9\nmax_torque_nm = 0.5\nmax_force_rate_n_per_s = "
        "1e3\n"
        "max_torque_rate_nm_per_s = 50\nrotor_inertia_kg_m2 = [1e-4, 2e-4, 3e-4]\n"
        "rotor_damping_nms_per_rad = 2e-3\ncoulomb_torque_nm = 0.01\n"
        "max_rotary_stiffness_nm_per_rad = 7\nmax_stiffness_n_per_m = 2000\nmax_damping_ns_per_m = "
        "3\n"
        "delay_s = 0.001\nencoder_step_rad = 3e-4\n"
        "[budget]\nconstants_bytes = 1000\nstate_bytes = 2000\nstack_bytes = 3000\n"
        "pair_visits = 12\n[memory]\ngraph_bytes = 1000000\n"
        "[cleaning]\nplane_tolerance_m = 2e-6\n"
        "[coupling]\nk_t_n_per_m = 900\nk_r_nm_per_rad = 0.5\ndamping_ns_per_m = 2\n"
        "damping_share = 0.25\nmax_rotation_error_rad = 0.3\nmax_translation_error_m = 0.008\n"
        "min_window_s = 0.002\nmax_window_s = 0.03\npassivity = false\nallow_active = true\n"
        "[[friction]]\nmaterials = [\"steel\", \"pom\"]\nmu = 0.3\nmu_static = 0.4\n";
    text = replaced(text, "grip_m",
                    "material = \"pom\"\nmass_kg = 0.4\ngravity_m_per_s2 = [1, 0, -2]\ngrip_m");
    text = replaced(text, "[[static]]\n", "[[static]]\nmaterial = \"steel\"\n");
    const SceneFile scene =
        parse_scene_file(text, "scene.toml", std::filesystem::path(folder.file("")));
    CHECK(scene.moving.position_m == std::array<double, 3>{1, 2, 3});
    CHECK(scene.moving.quaternion_wxyz == std::array<double, 4>{0, 1, 0, 0});
    CHECK(scene.parameters.epsilon_m == 5e-4);
    CHECK(scene.parameters.rate_hz == 4000);
    CHECK(scene.parameters.motion_limits_given == 1);
    CHECK(scene.parameters.max_angular_speed_rad_per_s == 4);
    const DeviceParameters& d = scene.parameters.device;
    CHECK(d.given == 1);
    CHECK(d.mass_kg + d.damping_ns_per_m + d.coulomb_friction_n + d.encoder_step_m + d.max_force_n +
              d.max_torque_nm + d.max_force_rate_n_per_s + d.max_torque_rate_nm_per_s +
              d.max_stiffness_n_per_m + d.max_damping_ns_per_m + d.delay_s ==
          doctest::Approx(0.1 + 1 + 0.2 + 1e-5 + 9 + 0.5 + 1000 + 50 + 2000 + 3 + 0.001));
    CHECK(scene.budget.constants->bytes == 1000);
    CHECK(scene.budget.state->line == 46);
    CHECK(scene.budget.pair_visits == 12u);
    CHECK(scene.graph_bytes == 1000000u);
    CHECK(scene.parameters.law == LawId::kPaper);
    CHECK(scene.parameters.exact_band_m == 0.01);
    CHECK(scene.budget.stack->bytes == 3000);
    CHECK(scene.plane_tolerance_m == 2e-6);
    CHECK(d.encoder_step_rad == 3e-4);
    CHECK(d.coulomb_torque_nm == 0.01);
    CHECK(d.max_rotary_stiffness_nm_per_rad == 7);
    for (const std::size_t k : {0u, 1u, 2u}) {
      CHECK(d.rotor_inertia_kg_m2[k] == doctest::Approx(1e-4 * static_cast<double>(k + 1)));
      CHECK(d.rotor_damping_nms_per_rad[k] == 2e-3);
    }
    CHECK(scene.parameters.held.mass_kg == 0.4);
    CHECK(scene.parameters.held.gravity_m_per_s2[0] == 1);
    CHECK(scene.parameters.held.gravity_m_per_s2[2] == -2);
    const CouplingRequest& c = scene.coupling;
    CHECK(c.k_t_n_per_m == 900.0);
    CHECK(c.k_r_nm_per_rad == 0.5);
    CHECK(c.damping_ns_per_m == 2.0);
    CHECK(c.damping_share == 0.25);
    CHECK(c.max_rotation_error_rad == 0.3);
    CHECK(c.max_translation_error_m == 0.008);
    CHECK(c.min_window_s == 0.002);
    CHECK(c.max_window_s == 0.03);
    CHECK(c.passivity == false);
    CHECK(c.allow_active);
    CHECK(c.k_t_at.line == scene.budget.stack->line + 7);
    CHECK(scene.moving.material == "pom");
    CHECK(scene.statics[0].material == "steel");
    CHECK(friction_of(scene.friction, "pom", "steel")->mu == 0.3);
    CHECK(friction_of(scene.friction, "steel", "pom")->mu_static == 0.4);
    CHECK(!friction_of(scene.friction, "steel", "steel"));
  }

  TEST_CASE("every defect is refused with its line, column and fix") {
    const ScratchFolder folder("scene_file");
    REQUIRE(message_of(kGood, folder) == "accepted");
    const auto check = [&](const std::string& text, const char* place, const char* says) {
      const std::string message = message_of(text, folder);
      CAPTURE(text);
      CAPTURE(message);
      CHECK(message.rfind(place, 0) == 0);
      CHECK(message.find(says) != std::string::npos);
    };
    for (const SceneFileDefect& edit : kDefects) {
      check(replaced(kGood, edit.from, edit.to), edit.place, edit.says);
    }
    for (const SceneFileAddition& added : kAdditions) {
      check(kGood + std::string(added.lines) + "\n", added.place, added.says);
    }
  }

  TEST_CASE("bytes that are no TOML never do worse than a refusal") {
    const ScratchFolder folder("scene_file");
    const std::string good = kGood;
    for (std::size_t cut = 0; cut < good.size(); ++cut) {
      message_of(good.substr(0, cut), folder);
    }
    for (std::size_t at = 0; at < good.size(); ++at) {
      for (const char c : {'\0', '\xff', '"', '[', '=', '\n'}) {
        std::string damaged = good;
        damaged[at] = c;
        message_of(damaged, folder);
      }
    }
    CHECK(message_of("", folder).find("format is missing") != std::string::npos);
  }

  TEST_CASE("the nearest known word is found, and none when none is near") {
    CHECK(nearest_word("epsilon", {"law", "epsilon_m"}) == "epsilon_m");
    CHECK(nearest_word("k_f_n_per", {"law", "k_f_n_per_m"}) == "k_f_n_per_m");
    CHECK(nearest_word("colour", {"law", "epsilon_m"}).empty());
  }
}
