// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/plausible_values.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "tools/common/formatted.hpp"

namespace haptic::tools {
namespace {

/// Generous limits of people and devices.
constexpr struct {
  const char *table, *key;
  double low, high;
  const char* usual;
} kUsual[] = {{"rendering", "k_f_n_per_m", 5, 2e5, "hands and devices feel 50 to 20 000 N/m"},
              {"rendering", "epsilon_m", 1e-8, 5e-3, "the default is 0.0001 m"},
              {"coupling", "k_t_n_per_m", 5, 2e5, "hands and devices feel 50 to 20 000 N/m"},
              {"loop", "rate_hz", 50, 5e4, "servo loops run at 500 to 10 000 Hz"},
              {"moving", "mass_kg", 1e-5, 10, "a part in the hand has 0.01 to 2 kg"},
              {"moving", "gravity_m_per_s2", 0, 100, "the Earth has 9.81 m/s2"},
              {"device", "mass_kg", 1e-3, 10, "devices have 0.05 to 1 kg"},
              {"device", "delay_s", 0, 0.1, "devices have 0.0005 to 0.01 s"},
              {"device", "encoder_step_m", 0, 2e-3, "devices have 1e-6 to 1e-4 m"},
              {"device", "encoder_step_rad", 0, 0.05, "devices have 1e-5 to 1e-3 rad"},
              {"device", "max_force_n", 0.2, 500, "devices have 3 to 40 N"},
              {"device", "max_torque_nm", 2e-3, 100, "devices have 0.1 to 3 N m"},
              {"motion_limits", "linear_m_per_s", 5e-3, 20, "hands move at 0.1 to 2 m/s"},
              {"motion_limits", "angular_rad_per_s", 0.05, 200, "hands turn at 1 to 10 rad/s"},
              {"guide", "pull_n", 0.01, 100, "guides pull with 0.5 to 3 N"}};

/// The size of a number, or of the largest of an array; 0 stands for "not given" in many keys.
std::optional<double> size_of(const toml::node* node) {
  if (node == nullptr) return std::nullopt;
  if (const auto number = node->value<double>(); node->is_number() && number) {
    return std::abs(*number);
  }
  const toml::array* list = node->as_array();
  if (list == nullptr || list->empty()) return std::nullopt;
  double largest = 0;
  for (const toml::node& each : *list) largest = std::max(largest, size_of(&each).value_or(0));
  return largest;
}

double distance_m(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// So many sizes of the parts apart, and no less than this.
constexpr double kFarSizes = 20, kFar_m = 0.5, kFarGripSizes = 10;
/// Sizes of parts; the kinds of parts that the project tests are within.
constexpr double kSmallest_m = 2e-4, kLargest_m = 10;

}  // namespace

std::vector<std::string> implausible_values(const toml::table& root, const std::string& file) {
  std::vector<std::string> texts;
  for (const auto& usual : kUsual) {
    const toml::table* table = root[usual.table].as_table();
    const toml::node* node = table == nullptr ? nullptr : table->get(usual.key);
    const std::optional<double> size = size_of(node);
    if (!size || *size == 0 || (*size >= usual.low && *size <= usual.high)) continue;
    const toml::source_position at = node->source().begin;
    texts.push_back(
        formatted("%s:%u:%u: [%s] %s is %.9g: %s; is it of the unit that the key names?",
                  file.c_str(), at.line, at.column, usual.table, usual.key, *size, usual.usual));
  }
  return texts;
}

std::string far_start_text(const PartBall& moving, const std::vector<PartBall>& fixed) {
  double gap_m = std::numeric_limits<double>::infinity(), size_m = 2 * moving.radius_m;
  const PartBall* nearest = nullptr;
  for (const PartBall& ball : fixed) {
    size_m = std::max(size_m, 2 * ball.radius_m);
    const double apart_m =
        distance_m(moving.middle_m, ball.middle_m) - moving.radius_m - ball.radius_m;
    if (apart_m >= gap_m) continue;
    gap_m = apart_m;
    nearest = &ball;
  }
  if (nearest == nullptr || gap_m < std::max(kFar_m, kFarSizes * size_m)) return {};
  return formatted(
      "the part starts %.3g m away from the nearest fixed part, '%s', and the largest part is %.3g "
      "m; position_m is in metres: is it of another unit?",
      gap_m, nearest->name.c_str(), size_m);
}

std::string odd_size_text(double diagonal_m) {
  if (diagonal_m >= kSmallest_m && diagonal_m <= kLargest_m) return {};
  return formatted(
      "the part is %.3g m large; scale_to_m is metres per unit of the file, 0.001 for millimetres, "
      "and lengths of a shape are in metres: is it of another unit?",
      diagonal_m);
}

std::string far_grip_text(double farthest_m, double diagonal_m) {
  if (farthest_m < std::max(kFar_m, kFarGripSizes * diagonal_m)) return {};
  return formatted(
      "the grip point is %.3g m away from a part of %.3g m; grip_m is in metres, in the frame of "
      "the "
      "mesh file: is it of another unit?",
      farthest_m, diagonal_m);
}

}  // namespace haptic::tools
