// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/planning/puzzles.hpp"

#include <array>
#include <cmath>
#include <numbers>

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

/// Six walls about a box, 10 mm thick.
std::string shell(const Corner& low_mm, const Corner& high_mm) {
  std::string walls;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Corner low = low_mm, high = high_mm;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] -= k < axis ? 0 : 10;
      high[k] += k < axis ? 0 : 10;
    }
    Corner below = high, above = low;
    below[axis] = low_mm[axis];
    above[axis] = high_mm[axis];
    walls += wall(low, below) + wall(above, high);
  }
  return walls;
}

/// A box that is turned by `own_turn` about z, placed, and turned about z with its place.
std::string turned_wall(const Corner& size_mm, double turn, const Corner& middle_mm,
                        double own_turn) {
  const double c = std::cos(turn), s = std::sin(turn), half = (turn + own_turn) / 2;
  const Corner middle{c * middle_mm[0] - s * middle_mm[1], s * middle_mm[0] + c * middle_mm[1],
                      middle_mm[2]};
  return "[[static]]\n" + shape_text(size_mm, middle) +
         "quaternion = { w = " + tools::short_number(std::cos(half), 17) +
         ", x = 0.0, y = 0.0, z = " + tools::short_number(std::sin(half), 17) + " }\n";
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

constexpr double kRoot2 = std::numbers::sqrt2;

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
  return {name, scene_text(name, parts), "0,0,-4mm,1,0,0,0", clearance_mm};
}

Puzzle corner_puzzle(double clearance_mm) {
  const std::string name = name_of("corner", clearance_mm);
  // At 45 degrees the inner corner lies 30 sqrt(2) from the outer one, and the bar's far side half
  // its length and its width.
  const double long_mm = 2 * (30 * kRoot2 - 8) - 4 * clearance_mm;
  const std::string parts =
      moving_box({long_mm, 8, 8}, {-60, 15, 4.2}) + wall({-110, -10, -5}, {40, 0, 13.4}) +
      wall({30, 0, -5}, {40, 140, 13.4}) + wall({-110, 30, -5}, {0, 140, 13.4}) +
      wall({-120, -10, -5}, {-110, 140, 13.4}) + wall({-120, 140, -5}, {40, 150, 13.4}) +
      wall({-120, -10, -10}, {40, 150, 0}) + wall({-120, -10, 8.4}, {40, 150, 18.4});
  return {name, scene_text(name, parts), "15mm,95mm,4.2mm" + kQuarter, clearance_mm};
}

Puzzle window_puzzle(double clearance_mm) {
  const std::string name = name_of("window", clearance_mm);
  // Turned by 45 degrees, the elbow of 15 mm is 15 sqrt(2) wide, and the wall's own 2 mm take half
  // of themselves.
  const double w = (15 * kRoot2 + 1) / 2 + clearance_mm;
  const std::string parts =
      "[moving]\nmesh = \"ell_insert/insert.obj\"\nscale_to_m = 0.001\nposition_m = [0.0, 0.0, "
      "-0.015]\n" +
      wall({40, w, -60}, {42, 80, 60}) + wall({40, -80, -60}, {42, -w, 60}) +
      wall({40, -w, 15.5}, {42, w, 60}) + wall({40, -w, -60}, {42, w, -15.5}) +
      shell({-60, -80, -60}, {160, 80, 60});
  return {name, scene_text(name, parts), "90mm,0,-15mm,1,0,0,0", clearance_mm};
}

Puzzle slot_puzzle(double clearance_mm) {
  const std::string name = name_of("slot", clearance_mm);
  const double l = 15 + clearance_mm, t = 3 + clearance_mm;
  const std::string parts = moving_box({30, 6, 6}, {0, 0, 30}) + wall({-60, t, 0}, {60, 40, 5}) +
                            wall({-60, -40, 0}, {60, -t, 5}) + wall({-60, -t, 0}, {-l, t, 5}) +
                            wall({l, -t, 0}, {60, t, 5}) + wall({-60, -40, -12}, {60, 40, -8}) +
                            wall({-60, 20, -8}, {60, 40, 0}) + wall({-60, -40, -8}, {60, -20, 0}) +
                            wall({-60, -20, -8}, {-40, 20, 0}) + wall({40, -20, -8}, {60, 20, 0});
  return {name, scene_text(name, parts), "0,0,-4mm" + kQuarter, clearance_mm};
}

Puzzle ring_puzzle(double clearance_mm) {
  const std::string name = name_of("ring", clearance_mm);
  // The bar is 10 mm thick, the ring 4 mm high: as of the window. Across, the bar leaves it 0.5 mm
  // more than the clearance on either side, so that it cannot slip over the elbow askew.
  const double least = 10 * kRoot2 + 2, hole = least + 2 * clearance_mm, y = least / 2 - 0.5;
  const std::string parts =
      "[moving]\nshape = \"tube\"\nsegments = 4\nheight_m = 0.004\ninner_radius_m = " +
      std::to_string(1e-3 * hole / 2) +
      "\nouter_radius_m = " + std::to_string(1e-3 * (hole + 10) / kRoot2) +
      "\nposition_m = [0.0, 0.0, -0.03]\nquaternion = { w = 0.92387953251128674, x = 0.0, y = 0.0, "
      "z = 0.38268343236508977 }\n" +
      wall({-5, -y, -50}, {5, y, 5}) + wall({5, -y, -5}, {60, y, 5}) +
      wall({-30, -30, -60}, {30, 30, -50}) + wall({60, -30, -30}, {70, 30, 30});
  return {name, scene_text(name, parts),
          "35mm,0,0,0.65328148243818829,0.27059805007309851,0.65328148243818829,"
          "0.27059805007309851",
          clearance_mm};
}

Puzzle twist_puzzle(double clearance_mm) {
  const std::string name = name_of("twist", clearance_mm);
  constexpr double kWide = 30, kThick = 6, kHalfTurn = std::numbers::pi / 24, kFar = 40;
  // Half the sides of the box about the blade when it is turned by half the angle of two plates.
  const double l = (kWide * std::cos(kHalfTurn) + kThick * std::sin(kHalfTurn)) / 2 + clearance_mm;
  const double t = (kThick * std::cos(kHalfTurn) + kWide * std::sin(kHalfTurn)) / 2 + clearance_mm;
  std::string parts = moving_box({kWide, kThick, 16}, {0, 0, 15});
  for (int plate = 0; plate < 5; ++plate) {
    const double low = -10.0 * plate - 1, high = low + 2, angle = 2 * kHalfTurn * plate;
    for (const double side : {-1.0, 1.0}) {
      parts += turned_wall({kFar - t, 2 * kFar, high - low}, angle,
                           {0, side * (kFar + t) / 2, (low + high) / 2}, std::numbers::pi / 2);
      parts += turned_wall({kFar - l, 2 * t, high - low}, angle,
                           {side * (kFar + l) / 2, 0, (low + high) / 2}, 0);
    }
  }
  parts += shell({-30, -30, -70}, {30, 30, 40});
  return {name, scene_text(name, parts), "0,0,-58mm,0.86602540378443865,0,0,0.5", clearance_mm};
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
  return {name, scene_text(name, parts), "0,0,60mm,1,0,0,0", clearance_mm, clearance_mm >= 0};
}

Puzzle cage_puzzle() {
  const std::string parts =
      moving_box({20, 20, 20}, {0, 0, 0}) + wall({-20, -20, 11}, {20, 20, 20}) +
      wall({-20, -20, -20}, {20, 20, -11}) + wall({11, -20, -11}, {20, 20, 11}) +
      wall({-20, -20, -11}, {-11, 20, 11}) + wall({-11, 11, -11}, {11, 20, 11}) +
      wall({-11, -20, -11}, {11, -11, 11});
  return {"cage", scene_text("cage", parts), "0,0,60mm,1,0,0,0", 1, false};
}

}  // namespace haptic::sim
