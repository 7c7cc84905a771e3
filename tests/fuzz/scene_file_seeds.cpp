// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_scene_file: one scene with every key, one with the least, one with other spellings
/// of the same things, and three that are refused late.
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

const char* const kLeast =
    "format = 1\nname = \"n\"\n[moving]\nmesh = \"tetrahedron.obj\"\nscale_to_m = 0.001\n"
    "[[static]]\nmesh = \"box.stl\"\nscale_to_m = 1\n[rendering]\nk_f_n_per_m = 800\n";

const char* const kEveryKey =
    "# all keys\nformat = 1\nname = \"every key \\u00e9\"\n"
    "[moving]\nmesh = \"tetrahedron.obj\"\nscale_to_m = [0.001, 0.002, 1e-3]\nmaterial = \"pom\"\n"
    "grip_m = [-0.02, 0.012, 0.025]\nmass_kg = 0.3\ngravity_m_per_s2 = [0, 0, -9.81]\n"
    "[start]\nposition_m = [0.02, -0.015, 0.025]\n"
    "quaternion = { w = 0.6, x = 0.8, y = 0.0, z = -0.0 }\n"
    "[[static]]\nmesh = \"box.stl\"\nscale_to_m = 0.001\nposition_m = [0, 1, 2]\nmaterial = "
    "\"steel\"\n"
    "[[static]]\nmesh = \"box.stl\"\nscale_to_m = 0.001\n"
    "quaternion = { w = 1, x = 0, y = 0, z = 0 }\n"
    "[rendering]\nlaw = \"paper\"\nk_f_n_per_m = 800.0\nepsilon_m = 0.0001\n"
    "[loop]\nrate_hz = 1000\n[motion_limits]\nlinear_m_per_s = 1.0\nangular_rad_per_s = 6.0\n"
    "orientation = { about = [0.6, 0.8, 0, 0], max_angle_rad = 0.5 }\n"
    "workspace = { min_m = [-0.1, -0.1, 0], max_m = [0.1, 0.1, 0.2] }\n"
    "[device]\nmass_kg = 0.1\ndamping_ns_per_m = 0.5\ncoulomb_friction_n = 0.1\n"
    "encoder_step_m = 1e-5\nmax_force_n = 12\nmax_torque_nm = 0.3\nmax_force_rate_n_per_s = 1e4\n"
    "max_torque_rate_nm_per_s = 1e3\nmax_stiffness_n_per_m = 3000\nmax_damping_ns_per_m = 5\n"
    "delay_s = 0.0005\nencoder_step_rad = 1e-4\nrotor_inertia_kg_m2 = [1e-4, 2e-4, 1e-4]\n"
    "rotor_damping_nms_per_rad = 1e-3\ncoulomb_torque_nm = 0.01\n"
    "max_rotary_stiffness_nm_per_rad = 5\n[coupling]\nk_t_n_per_m = 700\nlength_m = 0.02\n"
    "damping_ns_per_m = 1\ndamping_share = 0.5\nmax_rotation_error_rad = 0.5\n"
    "max_translation_error_m = 0.01\nmin_window_s = 0.001\nmax_window_s = 0.02\npassivity = true\n"
    "allow_active = false\n[[friction]]\nmaterials = [\"steel\", \"pom\"]\nmu = "
    "0.3\nmu_static = 0.4\n[cleaning]\nplane_tolerance_m = 1e-6\n"
    "[budget]\nconstants_bytes = 1_000_000\nstate_bytes = 0x10000\nstack_bytes = 8192\n";

const char* const kSpellings =
    "format=1\r\nname='literal'\r\nmoving={mesh='''tetrahedron.obj''',scale_to_m=1_0.0e-1,"
    "position_m=[0.0,\n 0,\n +1e0,]}\r\nstatic=[{mesh=\"box.stl\",scale_to_m=1}]\r\n"
    "rendering.law=\"paper\"\r\nrendering.\"k_f_n_per_m\"=0b11\r\nloop.rate_hz=0o1750\r\n";

/// Two shapes without a file.
std::string shapes(const std::string& moving, const std::string& fixed) {
  return "format = 1\nname = \"n\"\n[moving]\n" + moving + "[[static]]\n" + fixed +
         "[rendering]\nk_f_n_per_m = 800\n";
}

}  // namespace

std::vector<Seed> seeds() {
  const std::string least = kLeast;
  return {
      {"least", least},
      {"every_key", kEveryKey},
      {"spellings", kSpellings},
      {"friction_twice",
       least +
           "[[friction]]\nmaterials=['a','b']\nmu=0\n[[friction]]\nmaterials=['b','a']\nmu=2\n"},
      {"unknown_key", least + "law = 1979-05-27T07:32:00Z\nepsilon = nan\n"},
      {"two_poses", least + "[start]\nposition_m = [0, 0, inf]\n"},
      {"not_ascii", "# \xC3\xA9\n" + least + "mesh = '\xC3\xA9' # \xEF\xBB\xB7\n"},
      {"long_strings",
       least + "a = \"\"\"x\\\n  y\"\"\"\"\"\nb = '''\n'''\nc.d.\"e\".f = \"\\\"\"\n"},
      {"box_and_prism", shapes("shape = \"box\"\nsize_m = [1, 2, 3]\n",
                               "shape = \"prism\"\nradius_m = 1\nheight_m = 2\nsides = 5\n")},
      {"cylinder_and_tube",
       shapes(
           "shape = \"cylinder\"\nradius_m = 0.01\nheight_m = 0.1\nsegments = 12\n",
           "shape = \"tube\"\ninner_radius_m = 0.0101\nouter_radius_m = 0.02\nheight_m = 0.1\n")},
      {"sphere_and_capsule",
       shapes("shape = \"sphere\"\nradius_m = 0.01\nsegments = 8\n",
              "shape = \"capsule\"\nradius_m = 0.01\nheight_m = 0.03\nsegments = 12\n")},
      {"threads", shapes("shape = \"thread\"\ndiameter_m = 0.008\npitch_m = 0.00125\nturns = 2.5\n"
                         "fit = \"6g\"\nsegments = 12\n",
                         "shape = \"thread\"\nsize = \"M8\"\nturns = 1.5\ninternal = true\n"
                         "outer_radius_m = 0.007\nclearance_m = 1e-5\nsegments = 16\n")},
      {"bolt_and_nut", shapes("shape = \"bolt\"\nsize = \"M3\"\nlength_m = 0.004\nsegments = 12\n",
                              "shape = \"nut\"\nsize = \"M3\"\nfit = \"6H/6g\"\nsegments = 9\n")},
      {"nested", least + "[device]\nmass_kg = [[[[{ a = [1, true, \"x\"] }]]]]\n"}};
}

}  // namespace haptic::fuzz
