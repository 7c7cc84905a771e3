// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/cost/cost_scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using tools::append_line;

struct EmbeddedFile {
  const char* path;  ///< below host_sim/scenes
  const char* content;
};
constexpr EmbeddedFile kEmbedded[] = {
#include <generated/cost_scene_files.inc>
};

/// A pose of the motion script of a generated scene.
struct Station {
  const char* phase;
  double t_s;
  double position_mm[3];
  double axis[3];  ///< of any length; 0 0 0: no turn
  double angle_rad;
};

std::string script_text(const std::string& words, std::uint64_t seed,
                        const std::vector<Station>& stations) {
  std::string text;
  append_line(text, "# SPDX-License-Identifier: Apache-2.0");
  append_line(text, "# %s", words.c_str());
  append_line(text, "format = 1\nrate_hz = 1000\nseed = %llu\n",
              static_cast<unsigned long long>(seed));
  append_line(text, "[tremor]\nposition_m = 0.0001\nangle_rad = 0.0015\nband_hz = [8.0, 12.0]");
  for (const Station& s : stations) {
    append_line(text, "\n[[waypoint]]\nphase = \"%s\"\nt_s = %.3f", s.phase, s.t_s);
    append_line(text, "position_m = [%.6f, %.6f, %.6f]", 1e-3 * s.position_mm[0],
                1e-3 * s.position_mm[1], 1e-3 * s.position_mm[2]);
    if (s.angle_rad == 0) continue;
    append_line(text, "axis = [%.3f, %.3f, %.3f]\nangle_rad = %.6f", s.axis[0], s.axis[1],
                s.axis[2], s.angle_rad);
  }
  return text;
}

std::string scene_text(const std::string& name, const std::string& words, const char* moving,
                       const char* fixed, double grip_mm) {
  std::string text;
  append_line(text, "# SPDX-License-Identifier: Apache-2.0");
  append_line(text, "# %s", words.c_str());
  append_line(text, "format = 1\nname = \"%s\"\n", name.c_str());
  append_line(text, "[moving]\nmesh = \"%s\"\nscale_to_m = 0.001", moving);
  append_line(text, "grip_m = [0.0, 0.0, %.6f]\n", 1e-3 * grip_mm);
  append_line(text, "[[static]]\nmesh = \"%s\"\nscale_to_m = 0.001\n", fixed);
  append_line(text, "[rendering]\nk_f_n_per_m = 800.0\n\n[loop]\nrate_hz = 1000");
  return text;
}

/// A scene of host_sim/scenes, from the copy in the program.
CostScene own_scene(const std::string& name, const std::string& words, const std::string& folder) {
  CostScene scene{name, words, {}};
  for (const EmbeddedFile& file : kEmbedded) {
    const std::string path = file.path;
    if (path.starts_with(folder + "/"))
      scene.files.push_back({path.substr(folder.size() + 1), file.content});
  }
  return scene;
}

using Corner_mm = std::array<double, 2>;

/// Corners of a regular polygon with a side across +x.
std::vector<Corner_mm> regular_polygon(std::uint32_t sides, double half_width_mm) {
  const double radius = half_width_mm / std::cos(std::numbers::pi / sides);
  std::vector<Corner_mm> corners;
  for (std::uint32_t k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.5) / sides;
    corners.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return corners;
}

void add_vertex(std::string& obj, double x_mm, double y_mm, double z_mm) {
  append_line(obj, "v %.6f %.6f %.6f", x_mm, y_mm, z_mm);
}

std::string obj_head(const std::string& name) {
  return "# SPDX-License-Identifier: Apache-2.0\n# Unit: millimetre.\no " + name + "\n";
}

/// Enters, touches the rim, presses sideways, wobbles, turns both ways, goes through, comes out,
/// and enters again at 0.4 m/s. `press_mm`: how far the hand goes into the wall.
std::vector<Station> round_peg_stations() {
  return {{"start", 0.0, {0.6, 0.4, 6.0}, {1, 2, 0}, 0.04},
          {"above the rim", 0.4, {0.3, -0.2, 1.0}, {1, 2, 0}, 0.02},
          {"touch the rim", 0.7, {0.3, -0.2, -0.6}, {0, 0, 0}, 0},
          {"find the hole", 1.0, {0.0, 0.0, -1.5}, {0, 0, 0}, 0},
          {"insert", 1.6, {0.02, 0.0, -20.0}, {0, 0, 0}, 0},
          {"press +x", 1.9, {1.0, 0.1, -22.0}, {0, 0, 0}, 0},
          {"press round the wall", 2.3, {-0.6, 0.8, -24.0}, {0, 0, 0}, 0},
          {"press -y", 2.6, {0.1, -1.0, -24.0}, {0, 0, 0}, 0},
          {"wobble about x", 2.9, {0.0, 0.0, -24.0}, {1, 0, 0}, 0.03},
          {"wobble about y", 3.2, {0.0, 0.0, -24.0}, {0, 1, 0}, -0.03},
          {"turn left", 3.6, {0.4, 0.0, -26.0}, {0, 0, 1}, 0.3},
          {"turn right", 4.1, {0.0, 0.4, -26.0}, {0, 0, 1}, -0.3},
          {"through", 4.6, {0.0, 0.0, -38.0}, {0, 0, 0}, 0},
          {"withdraw", 5.2, {0.0, -0.3, -5.0}, {0, 0, 0}, 0},
          {"leave", 5.5, {0.0, 0.0, 5.0}, {0, 0, 0}, 0},
          {"fast entry", 5.65, {0.3, -0.2, -30.0}, {1, 0, 0}, 0.02},
          {"press after it", 5.9, {-0.8, 0.5, -32.0}, {0, 0, 0}, 0},
          {"fast exit", 6.1, {0.0, 0.0, 15.0}, {0, 1, 0}, 0.05}};
}

constexpr double kRoundPegLength_mm = 40, kRoundPegClearance_mm = 0.1;

CostScene round_peg(const std::string& name, std::uint32_t sides, double radius_mm) {
  CostScene scene;
  scene.name = name;
  scene.words =
      tools::formatted("peg of %u sides, %g mm, in a hole of %u pieces", sides, radius_mm, sides);
  scene.files = {{"scene.toml", scene_text(name, scene.words, "peg.obj", "hole.obj", 35)},
                 {"peg.obj", prism_mesh(sides, radius_mm, kRoundPegLength_mm)},
                 {"hole.obj", ring_mesh(sides, radius_mm + kRoundPegClearance_mm, 1.5 * radius_mm,
                                        kRoundPegLength_mm)},
                 {"motion.toml", script_text(scene.words + ": entered slowly, then fast.", 41,
                                             round_peg_stations())}};
  return scene;
}

// A housing with a lid: plates, walls and skirts, and 14 ribs each that interlock with 0.2 mm of
// clearance. Rim of the housing at z = 0, where the plate of the lid rests in its seat.
constexpr int kRibs = 14;
constexpr double kRibPitch_mm = 4, kRibHalf_mm = 0.9, kRibReach_mm = 12;

std::vector<MeshBox> housing_boxes() {
  std::vector<MeshBox> boxes{{{-33, -21, -16}, {33, 21, -12}},  // floor
                             {{30, -21, -12}, {33, 21, 0}},
                             {{-33, -21, -12}, {-30, 21, 0}},
                             {{-30, 18, -12}, {30, 21, 0}},
                             {{-30, -21, -12}, {30, -18, 0}}};
  for (int k = 0; k < kRibs; ++k) {
    const double x = -26 + kRibPitch_mm * k;
    boxes.push_back({{x - kRibHalf_mm, -kRibReach_mm, -12}, {x + kRibHalf_mm, kRibReach_mm, -4}});
  }
  return boxes;
}

std::vector<MeshBox> lid_boxes() {
  std::vector<MeshBox> boxes{{{-33, -21, 0}, {33, 21, 3}},  // plate
                             {{29, -15, -3}, {29.8, 15, 0}},
                             {{-29.8, -15, -3}, {-29, 15, 0}},
                             {{-27, 16.8, -3}, {27, 17.8, 0}},
                             {{-27, -17.8, -3}, {27, -16.8, 0}}};
  for (int k = 0; k < kRibs; ++k) {
    const double x = -28 + kRibPitch_mm * k;
    boxes.push_back({{x - kRibHalf_mm, -kRibReach_mm, -11}, {x + kRibHalf_mm, kRibReach_mm, 0}});
  }
  return boxes;
}

CostScene assembly() {
  const std::vector<Station> stations{{"start", 0.0, {3.0, -2.0, 15.0}, {1, 1, 0}, 0.05},
                                      {"touch the ribs", 0.6, {1.6, -0.5, 6.4}, {0, 0, 0}, 0},
                                      {"slide off the ribs", 1.1, {0.3, 0.0, 6.4}, {0, 0, 0}, 0},
                                      {"go in", 1.7, {0.0, 0.0, 2.0}, {0, 0, 0}, 0},
                                      {"seat", 2.2, {0.0, 0.0, -0.5}, {0, 0, 0}, 0},
                                      {"press +x", 2.7, {0.8, 0.2, -0.5}, {0, 0, 0}, 0},
                                      {"press the other way", 3.2, {-0.7, 0.7, -0.6}, {0, 0, 0}, 0},
                                      {"turn left", 3.7, {0.0, 0.0, -0.6}, {0, 0, 1}, 0.03},
                                      {"turn right", 4.2, {0.0, 0.0, -0.6}, {0, 0, 1}, -0.03},
                                      {"tilt", 4.7, {0.0, 0.0, 0.3}, {1, 0, 0}, 0.02},
                                      {"press half way out", 5.3, {0.8, -0.7, 3.0}, {0, 0, 0}, 0},
                                      {"out", 5.9, {0.0, 0.0, 8.0}, {0, 0, 0}, 0},
                                      {"away", 6.4, {5.0, 3.0, 20.0}, {0, 1, 0}, 0.1}};
  CostScene scene{"assembly", "lid of 19 pieces on a housing of 19", {}};
  scene.files = {
      {"scene.toml", scene_text(scene.name, scene.words, "lid.obj", "housing.obj", 3)},
      {"lid.obj", box_mesh("lid", lid_boxes())},
      {"housing.obj", box_mesh("housing", housing_boxes())},
      {"motion.toml", script_text(scene.words + ": put on, pressed, taken off.", 43, stations)}};
  return scene;
}

// Two fields of 40 x 25 posts that point at each other.
constexpr int kPostsX = 40, kPostsY = 25;
constexpr double kPostPitch_mm = 4, kPostHalf_mm = 1.2, kPostLength_mm = 6;

std::vector<MeshBox> posts(double low_mm) {
  std::vector<MeshBox> boxes;
  for (int i = 0; i < kPostsX; ++i) {
    for (int j = 0; j < kPostsY; ++j) {
      const double x = kPostPitch_mm * i, y = kPostPitch_mm * j;
      boxes.push_back({{x - kPostHalf_mm, y - kPostHalf_mm, low_mm},
                       {x + kPostHalf_mm, y + kPostHalf_mm, low_mm + kPostLength_mm}});
    }
  }
  return boxes;
}

/// The fields meet in a corner of 5 x 5 posts: about 100 pairs are near, far from a million.
CostScene pieces1000() {
  const double x = kPostPitch_mm * (kPostsX - 5.5), y = kPostPitch_mm * (kPostsY - 5.5);
  const std::vector<Station> stations{{"far", 0.0, {x, y, 60.0}, {0, 0, 0}, 0},
                                      {"still far", 0.1, {x, y, 50.0}, {0, 0, 0}, 0},
                                      {"near", 0.5, {x, y, 1.0}, {0, 0, 0}, 0},
                                      {"between the posts", 0.8, {x, y, -3.0}, {0, 0, 0}, 0},
                                      {"press", 1.0, {x + 1.2, y + 1.0, -3.2}, {0, 0, 0}, 0},
                                      {"turn", 1.2, {x, y, -3.0}, {0, 0, 1}, 0.01},
                                      {"out", 1.5, {x, y, 20.0}, {0, 0, 0}, 0}};
  CostScene scene{"pieces1000", "two parts of 1000 pieces", {}};
  scene.files = {{"scene.toml", scene_text(scene.name, scene.words, "upper.obj", "lower.obj", 6)},
                 {"upper.obj", box_mesh("upper", posts(0))},
                 {"lower.obj", box_mesh("lower", posts(-kPostLength_mm))},
                 {"motion.toml", script_text(scene.words + ": meet in a corner.", 47, stations)}};
  return scene;
}

/// A scene of shapes by their dimensions, held as surfaces.
std::string surface_scene_text(const CostScene& scene, const char* moving, const char* fixed) {
  return "# SPDX-License-Identifier: Apache-2.0\n# " + scene.words + "\nformat = 1\nname = \"" +
         scene.name + "\"\n\n[moving]\n" + moving + "as = \"surface\"\n\n[[static]]\n" + fixed +
         "as = \"surface\"\n\n[rendering]\nk_f_n_per_m = 1000.0\n\n[loop]\nrate_hz = 1000\n";
}

/// A nut runs down its rod, pressed on the flanks, at 1.8 rad/s and up to 3.4.
CostScene thread24() {
  constexpr double kPitch_mm = 2, kTurn_rad = 2.9, kTime_s = 1.6, kPress_mm = 1;
  std::vector<Station> stations{{"start", 0.0, {0, 0, 0}, {0, 0, 0}, 0},
                                {"press", 0.3, {0, 0, -kPress_mm}, {0, 0, 0}, 0}};
  for (int k = 1; k <= 3; ++k) {
    stations.push_back({"turn",
                        0.3 + kTime_s * k,
                        {0, 0, -kPress_mm - kPitch_mm * kTurn_rad * k / (2 * std::numbers::pi)},
                        {0, 0, 1},
                        -std::fmod(kTurn_rad * k, 2 * std::numbers::pi)});
  }
  CostScene scene{"thread24", "M16 nut of six turns on a rod, 24 segments a turn", {}};
  scene.files = {
      {"scene.toml", surface_scene_text(scene,
                                        "shape = \"thread\"\nsize = \"M16\"\ninternal = true\n"
                                        "outer_radius_m = 0.012\nturns = 6\nsegments = 24\n"
                                        "clearance_m = 0.0002\n",
                                        "shape = \"thread\"\nsize = \"M16\"\nturns = 16\n"
                                        "segments = 24\n")},
      {"motion.toml", script_text(scene.words + ": runs down.", 48, stations)}};
  return scene;
}

/// A box goes over a sphere.
CostScene sphere100k() {
  const std::vector<Station> stations{{"above", 0.0, {0, 0, 66}, {0, 0, 0}, 0},
                                      {"press", 0.5, {0, 0, 59}, {0, 0, 0}, 0},
                                      {"slide", 1.5, {12, 8, 57}, {1, 1, 0}, 0.1},
                                      {"turn", 2.5, {-10, 5, 57}, {0, 1, 1}, 0.5},
                                      {"away", 3.0, {0, 0, 70}, {0, 0, 0}, 0}};
  CostScene scene{"sphere100k", "box on a sphere of 100 352 triangles", {}};
  scene.files = {
      {"scene.toml", surface_scene_text(scene,
                                        "shape = \"box\"\nsize_m = [0.02, 0.02, 0.02]\n"
                                        "position_m = [0.0, 0.0, 0.066]\n",
                                        "shape = \"sphere\"\nradius_m = 0.05\nsegments = 448\n")},
      {"motion.toml", script_text(scene.words + ": pressed and slid.", 49, stations)}};
  return scene;
}

}  // namespace

const std::vector<CostSceneName>& cost_scene_names() {
  static const std::vector<CostSceneName> names{
      {"peg", true},       {"ell", true},        {"field", true},    {"peg32", true},
      {"peg64_r10", true}, {"peg64_r5", true},   {"assembly", true}, {"pieces1000", false},
      {"thread24", false}, {"sphere100k", false}};
  return names;
}

CostScene cost_scene(const std::string& name) {
  if (name == "peg")
    return own_scene(name, "square peg in a hole of five pieces", "square_peg_five");
  if (name == "ell") return own_scene(name, "L-shaped insert in its recess", "ell_insert");
  if (name == "field") return own_scene(name, "25 pins among 25 posts", "pin_field");
  if (name == "peg32") return round_peg(name, 32, 10);
  if (name == "peg64_r10") return round_peg(name, 64, 10);
  if (name == "peg64_r5") return round_peg(name, 64, 5);
  if (name == "assembly") return assembly();
  if (name == "pieces1000") return pieces1000();
  if (name == "thread24") return thread24();
  if (name == "sphere100k") return sphere100k();
  std::string known;
  for (const CostSceneName& each : cost_scene_names())
    known += (known.empty() ? "" : ", ") + std::string(each.name);
  throw tools::UsageError("no scene '" + name + "'; known are " + known);
}

std::string prism_mesh(std::uint32_t sides, double half_width_mm, double length_mm) {
  std::string obj = obj_head("peg");
  for (const double z : {0.0, length_mm}) {
    for (const Corner_mm& c : regular_polygon(sides, half_width_mm)) add_vertex(obj, c[0], c[1], z);
  }
  for (std::uint32_t k = 1; k <= sides; ++k) {
    const std::uint32_t next = k % sides + 1;
    append_line(obj, "f %u %u %u %u", k, next, sides + next, sides + k);
  }
  std::string lower = "f", upper = "f";
  for (std::uint32_t k = 0; k < sides; ++k) {
    lower += " " + std::to_string(sides - k);
    upper += " " + std::to_string(sides + 1 + k);
  }
  return obj + lower + "\n" + upper + "\n";
}

std::string ring_mesh(std::uint32_t sides, double half_width_mm, double ring_mm, double depth_mm) {
  std::string obj = obj_head("hole");
  const auto inner = regular_polygon(sides, half_width_mm);
  const auto outer = regular_polygon(sides, half_width_mm + ring_mm);
  for (const double z : {-depth_mm, 0.0}) {
    for (const auto& corners : {inner, outer}) {
      for (const Corner_mm& c : corners) add_vertex(obj, c[0], c[1], z);
    }
  }
  for (std::uint32_t k = 0; k < sides; ++k) {
    const std::uint32_t next = (k + 1) % sides;
    const auto in = [&](std::uint32_t corner, bool top) {
      return (top ? 2 * sides : 0) + corner + 1;
    };
    const auto out = [&](std::uint32_t corner, bool top) { return in(corner, top) + sides; };
    append_line(obj, "f %u %u %u %u", in(k, false), in(k, true), in(next, true), in(next, false));
    append_line(obj, "f %u %u %u %u", out(k, false), out(next, false), out(next, true),
                out(k, true));
    append_line(obj, "f %u %u %u %u", in(k, true), out(k, true), out(next, true), in(next, true));
    append_line(obj, "f %u %u %u %u", in(k, false), in(next, false), out(next, false),
                out(k, false));
  }
  return obj;
}

std::string box_mesh(const std::string& name, const std::vector<MeshBox>& boxes) {
  std::string obj = obj_head(name);
  std::size_t first = 1;
  for (const MeshBox& box : boxes) {
    for (unsigned k = 0; k < 8; ++k) {
      add_vertex(obj, (k & 1u) != 0 ? box.high_mm[0] : box.low_mm[0],
                 (k & 2u) != 0 ? box.high_mm[1] : box.low_mm[1],
                 (k & 4u) != 0 ? box.high_mm[2] : box.low_mm[2]);
    }
    constexpr std::size_t kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                          {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& face : kFaces) {
      append_line(obj, "f %zu %zu %zu %zu", first + face[0], first + face[1], first + face[2],
                  first + face[3]);
    }
    first += 8;
  }
  return obj;
}

}  // namespace haptic::sim
