// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A sound scene file, and every way in which the tests spoil it.

namespace haptic::test {

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
    {"w = 0.6", "w = 0.60001", "7:14: ", "divide its components"},
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
    {"law = \"penalty\"", "14:7: ", "the laws are: proxy, weighted_region, paper"},
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
    {"epsilon_o_m = -1", "14:15: ", "above 0"},
    {"[budget]\npair_visits = 0", "15:15: ", "a whole number from 1"},
    {"[memory]\ngraph_bytes = -1", "15:15: ", "a whole number from 0"},
    {"[memory]\ngraph = 1", "15:1: ", "did you mean 'graph_bytes'?"},
    {"[cleaning]\nplane_tolerance_m = 0", "15:21: ", "above 0"},
    {"[cleaning]\nplane_tolerance = 1", "15:1: ", "did you mean 'plane_tolerance_m'?"},
};

}  // namespace haptic::test
