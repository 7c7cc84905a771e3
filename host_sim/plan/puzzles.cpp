// SPDX-License-Identifier: Apache-2.0
#include "host_sim/plan/puzzles.hpp"

#include <array>

#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

using Corner = std::array<double, 3>;

std::string vector_text(const Corner& v) {
  return "[" + std::to_string(v[0]) + ", " + std::to_string(v[1]) + ", " + std::to_string(v[2]) +
         "]";
}

std::string shape_text(const Corner& size_mm, const Corner& middle_mm) {
  Corner size{}, middle{};
  for (std::size_t k = 0; k < 3; ++k) {
    size[k] = 1e-3 * size_mm[k];
    middle[k] = 1e-3 * middle_mm[k];
  }
  return "shape = \"box\"\nsize_m = " + vector_text(size) +
         "\nposition_m = " + vector_text(middle) + "\n";
}

std::string wall(const Corner& low_mm, const Corner& high_mm) {
  Corner size{}, middle{};
  for (std::size_t k = 0; k < 3; ++k) {
    size[k] = high_mm[k] - low_mm[k];
    middle[k] = (high_mm[k] + low_mm[k]) / 2;
  }
  return "[[static]]\n" + shape_text(size, middle);
}

std::string moving_box(const Corner& size_mm, const Corner& middle_mm) {
  return "[moving]\n" + shape_text(size_mm, middle_mm);
}

std::string scene_text(const std::string& name, const std::string& parts) {
  return "format = 1\nname = \"" + name + "\"\n" + parts + "[rendering]\nk_f_n_per_m = 800.0\n";
}

/// "corner_64".
std::string name_of(const std::string& kind, double size) {
  return kind + "_" + tools::short_number(size, 4);
}

const std::string kQuarter = ",0.70710678118654752,0,0,0.70710678118654752";

}  // namespace

Puzzle peg_puzzle(double clearance_mm) {
  const std::string name = name_of("peg", clearance_mm);
  const double a = 10 + clearance_mm;
  const std::string parts =
      moving_box({20, 20, 60}, {6, 4, 55}) +
      "quaternion = { w = 0.9961946980917455, x = 0.0616284167162193, y = 0.0616284167162193, z = "
      "0.0 }\n" +
      wall({a, -30, -40}, {30, 30, 0}) + wall({-30, -30, -40}, {-a, 30, 0}) +
      wall({-a, a, -40}, {a, 30, 0}) + wall({-a, -30, -40}, {a, -a, 0}) +
      wall({-a, -a, -40}, {a, a, -35});
  return {name, scene_text(name, parts), "0,0,-4mm,1,0,0,0"};
}

Puzzle corner_puzzle(double long_mm) {
  const std::string name = name_of("corner", long_mm);
  const std::string parts =
      moving_box({long_mm, 8, 8}, {-60, 15, 4.2}) + wall({-110, -10, -5}, {40, 0, 13.4}) +
      wall({30, 0, -5}, {40, 140, 13.4}) + wall({-110, 30, -5}, {0, 140, 13.4}) +
      wall({-120, -10, -10}, {40, 140, 0}) + wall({-120, -10, 8.4}, {40, 140, 18.4});
  return {name, scene_text(name, parts), "15mm,95mm,4.2mm" + kQuarter};
}

Puzzle window_puzzle(double wide_mm) {
  const std::string name = name_of("window", wide_mm);
  const double w = wide_mm / 2;
  const std::string parts =
      "[moving]\nmesh = \"ell_insert/insert.obj\"\nscale_to_m = 0.001\nposition_m = [0.0, 0.0, "
      "-0.015]\n" +
      wall({40, w, -60}, {42, 80, 60}) + wall({40, -80, -60}, {42, -w, 60}) +
      wall({40, -w, 15.5}, {42, w, 60}) + wall({40, -w, -60}, {42, w, -15.5});
  return {name, scene_text(name, parts), "90mm,0,-15mm,1,0,0,0"};
}

Puzzle slot_puzzle(double clearance_mm) {
  const std::string name = name_of("slot", clearance_mm);
  const double l = 15 + clearance_mm / 2, t = 3 + clearance_mm / 2;
  const std::string parts = moving_box({30, 6, 6}, {0, 0, 30}) + wall({-60, t, 0}, {60, 40, 5}) +
                            wall({-60, -40, 0}, {60, -t, 5}) + wall({-60, -t, 0}, {-l, t, 5}) +
                            wall({l, -t, 0}, {60, t, 5}) + wall({-60, -40, -12}, {60, 40, -8}) +
                            wall({-60, 20, -8}, {60, 40, 0}) + wall({-60, -40, -8}, {60, -20, 0});
  return {name, scene_text(name, parts), "0,0,-4mm" + kQuarter};
}

Puzzle chamber_puzzle(double clearance_mm) {
  const std::string name = name_of("chamber", clearance_mm);
  const double h = 10 + clearance_mm;
  const std::string parts =
      moving_box({20, 20, 20}, {-12, 7, -15}) + wall({-40, -40, -40}, {40, 40, -30}) +
      wall({30, -40, -30}, {40, 40, 30}) + wall({-40, -40, -30}, {-30, 40, 30}) +
      wall({-30, 30, -30}, {30, 40, 30}) + wall({-30, -40, -30}, {30, -30, 30}) +
      wall({h, -40, 30}, {40, 40, 34}) + wall({-40, -40, 30}, {-h, 40, 34}) +
      wall({-h, h, 30}, {h, 40, 34}) + wall({-h, -40, 30}, {h, -h, 34}) +
      "[motion_limits]\norientation = { max_angle_rad = 0.0 }\n";
  return {name, scene_text(name, parts), "0,0,60mm,1,0,0,0", clearance_mm >= 0};
}

Puzzle cage_puzzle() {
  const std::string parts =
      moving_box({20, 20, 20}, {0, 0, 0}) + wall({-20, -20, 11}, {20, 20, 20}) +
      wall({-20, -20, -20}, {20, 20, -11}) + wall({11, -20, -11}, {20, 20, 11}) +
      wall({-20, -20, -11}, {-11, 20, 11}) + wall({-11, 11, -11}, {11, 20, 11}) +
      wall({-11, -20, -11}, {11, -11, 11});
  return {"cage", scene_text("cage", parts), "0,0,60mm,1,0,0,0", false};
}

}  // namespace haptic::sim
