// SPDX-License-Identifier: Apache-2.0
#include "tools/c_space/pose_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <vector>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

/// One number, with the unit of a length where `length`. Nothing where it is none.
std::optional<double> number_in(const std::string& word, bool length) {
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  if (word.empty() || end == word.c_str() || !std::isfinite(value)) return std::nullopt;
  const std::string unit(end);
  if (unit.empty()) return value;
  if (!length) return std::nullopt;
  if (unit == "m") return value;
  if (unit == "mm") return value * 1e-3;
  if (unit == "um") return value * 1e-6;
  return std::nullopt;
}

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == ',') {
      words.emplace_back();
    } else if (c != ' ') {
      words.back() += c;
    }
  }
  return words;
}

}  // namespace

Pose pose_from_text(const SceneView& view, const std::string& option, const std::string& text) {
  const SceneParameters& p = view.parameters();
  double place[3], turn[4] = {p.start_q_wa_xyzw[3], p.start_q_wa_xyzw[0], p.start_q_wa_xyzw[1],
                              p.start_q_wa_xyzw[2]};
  std::copy_n(p.start_p_wa_m, 3, place);
  if (text != "start") {
    const std::vector<std::string> words = words_of(text);
    if (words.size() != 3 && words.size() != 7) {
      throw UsageError(option + " '" + text + "': has " + std::to_string(words.size()) +
                       " numbers; give start, or x,y,z, or x,y,z,qw,qx,qy,qz");
    }
    for (std::size_t k = 0; k < words.size(); ++k) {
      const std::optional<double> number = number_in(words[k], k < 3);
      if (!number) {
        throw UsageError(option + " '" + text + "': '" + words[k] + "' is no " +
                         (k < 3 ? "length; write metres, or 5mm" : "number"));
      }
      (k < 3 ? place[k] : turn[k - 3]) = *number;
    }
  }
  const double size = std::hypot(std::hypot(turn[0], turn[1]), std::hypot(turn[2], turn[3]));
  if (!(size > 1e-9)) throw UsageError(option + " '" + text + "': the quaternion is zero");
  Pose pose;
  for (int k = 0; k < 3; ++k) pose.p_wa[k] = static_cast<Real>(place[k]);
  pose.q_wa = Quat(static_cast<Real>(turn[0] / size), static_cast<Real>(turn[1] / size),
                   static_cast<Real>(turn[2] / size), static_cast<Real>(turn[3] / size));
  return pose;
}

}  // namespace haptic::tools
