// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/shapes/fasteners.hpp"

namespace haptic::tools {
namespace {

/// Fundamental deviation of one class such as "6g" [m]; nothing when it is none.
std::optional<double> deviation_m(std::string_view grade, double pitch_m) {
  if (grade.size() != 2 || grade[0] < '3' || grade[0] > '9') return std::nullopt;
  const double step_um = 11.0 * (1e3 * pitch_m);
  switch (grade[1]) {
    case 'h':
    case 'H':
      return 0.0;
    case 'g':
    case 'G':
      return 1e-6 * (15.0 + step_um);
    case 'f':
      return 1e-6 * (30.0 + step_um);
    case 'e':
      return 1e-6 * (50.0 + step_um);
    default:
      return std::nullopt;
  }
}

}  // namespace

const std::vector<FastenerSize>& fastener_sizes() {
  static const std::vector<FastenerSize> kSizes{{"M3", 3e-3, 0.5e-3, 5.5e-3, 2.0e-3, 2.4e-3},
                                                {"M4", 4e-3, 0.7e-3, 7e-3, 2.8e-3, 3.2e-3},
                                                {"M5", 5e-3, 0.8e-3, 8e-3, 3.5e-3, 4.7e-3},
                                                {"M6", 6e-3, 1e-3, 10e-3, 4.0e-3, 5.2e-3},
                                                {"M8", 8e-3, 1.25e-3, 13e-3, 5.3e-3, 6.8e-3},
                                                {"M10", 10e-3, 1.5e-3, 16e-3, 6.4e-3, 8.4e-3},
                                                {"M12", 12e-3, 1.75e-3, 18e-3, 7.5e-3, 10.8e-3},
                                                {"M14", 14e-3, 2e-3, 21e-3, 8.8e-3, 12.8e-3},
                                                {"M16", 16e-3, 2e-3, 24e-3, 10e-3, 14.8e-3},
                                                {"M18", 18e-3, 2.5e-3, 27e-3, 11.5e-3, 15.8e-3},
                                                {"M20", 20e-3, 2.5e-3, 30e-3, 12.5e-3, 18e-3}};
  return kSizes;
}

const FastenerSize* fastener_size(std::string_view name) {
  for (const FastenerSize& size : fastener_sizes()) {
    if (size.name == name) return &size;
  }
  return nullptr;
}

std::optional<double> fit_clearance_m(std::string_view fit, bool internal, double pitch_m) {
  std::vector<std::string_view> grades{fit.substr(0, fit.find('/'))};
  if (grades[0].size() < fit.size()) grades.push_back(fit.substr(grades[0].size() + 1));
  std::optional<double> result;
  for (const std::string_view grade : grades) {
    const auto deviation = deviation_m(grade, pitch_m);
    if (!deviation) return std::nullopt;
    const bool is_internal = grade[1] < 'a';  // capital letters come first
    if (is_internal != internal) continue;
    if (result) return std::nullopt;
    result = 0.5 * *deviation;
  }
  return result;
}

}  // namespace haptic::tools
