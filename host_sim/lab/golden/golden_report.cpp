// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/golden/golden_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>

namespace haptic::sim {

const char* to_text(GoldenQuantity quantity) {
  constexpr const char* kNames[] = {"verdict",
                                    "d_near",
                                    "near set",
                                    "near normal",
                                    "SCP",
                                    "force",
                                    "torque",
                                    "contact nodes",
                                    "weights",
                                    "weighted force",
                                    "weighted torque",
                                    "path verdict",
                                    "path d_near",
                                    "path near set",
                                    "oracle depth by node",
                                    "oracle applicable count",
                                    "oracle ratio",
                                    "oracle d_near",
                                    "rules not rendered"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(GoldenQuantity::kCount));
  return kNames[static_cast<std::size_t>(quantity)];
}

void GoldenComparison::fail(const GoldenCase& c, GoldenQuantity quantity,
                            const std::string& expected, const std::string& got) {
  ++tally(quantity).failed;
  report_.failures.push_back(report_.path + ": case " + c.id + ": " + to_text(quantity) +
                             ": expected " + expected + ", got " + got);
}

void GoldenComparison::within(const GoldenCase& c, GoldenQuantity quantity, Wide error,
                              Wide tolerance, const std::string& expected, const std::string& got,
                              Wide unit) {
  GoldenTally& t = tally(quantity);
  ++t.compared;
  t.worst_error = std::max(t.worst_error, static_cast<double>(error / unit));
  const Wide ratio = error / tolerance;
  t.worst_ratio =
      std::max(t.worst_ratio, std::isnan(ratio) ? std::numeric_limits<double>::infinity()
                                                : static_cast<double>(ratio));
  if (!(error <= tolerance)) fail(c, quantity, expected + " within " + text_of(tolerance), got);
}

void GoldenComparison::equal(const GoldenCase& c, GoldenQuantity quantity, bool same,
                             const std::string& expected, const std::string& got) {
  GoldenTally& t = tally(quantity);
  ++t.compared;
  if (same) return;
  t.worst_ratio = std::numeric_limits<double>::infinity();
  fail(c, quantity, expected, got);
}

std::string text_of(Wide value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.17Lg", value);
  return buffer;
}
std::string text_of(const WideVec& v) {
  std::string text = "(";
  return text.append(text_of(v.x))
      .append(", ")
      .append(text_of(v.y))
      .append(", ")
      .append(text_of(v.z))
      .append(")");
}
std::string text_of(std::span<const std::uint32_t> list) {
  std::string text = "{";
  for (const std::uint32_t n : list) text += (text.size() > 1 ? ", " : "") + std::to_string(n);
  return text + "}";
}

}  // namespace haptic::sim
