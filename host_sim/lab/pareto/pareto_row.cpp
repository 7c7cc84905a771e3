// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pareto_row.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "host_sim/timing/tick_times.hpp"

namespace haptic::sim {
namespace {

constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();
constexpr double kFineBand_m = 1e-9;

/// Angle to the nearest of the normals that attain D_near [deg]; NaN when the method gave none.
double normal_error_deg(const PeerVector& n, const std::vector<WideVec>& normals) {
  const WideVec given{widen(n[0]), widen(n[1]), widen(n[2])};
  if (norm(given) < 0.5L) return kUndefined;
  Wide least = std::numeric_limits<Wide>::infinity();
  for (const WideVec& truth : normals)  // atan2 keeps the digits of small angles
    least = std::min(least, std::atan2(norm(cross(given, truth)), dot(given, truth)));
  return static_cast<double>(least) * 180.0 / std::numbers::pi;
}

/// Error of the depth at one pose [m]; NaN when the method gave no value that D_near is.
double depth_error_m(const PeerAnswer& answer, const PairTruth& truth) {
  if (std::isnan(answer.depth_m)) return kUndefined;
  const Wide d = widen(answer.depth_m);
  if (truth.reference_m <= 0) return static_cast<double>(std::abs(d - truth.reference_m));
  if (answer.separated != SeparatedValue::kPlane) return kUndefined;
  if (d < truth.lower_m) return static_cast<double>(truth.lower_m - d);
  return d > truth.upper_m ? static_cast<double>(d - truth.upper_m) : 0.0;
}

bool wrong(const PeerAnswer& answer, const PairTruth& truth, double band_m) {
  if (!answer.verdict_given) return false;
  const double d = static_cast<double>(truth.reference_m);
  return (d > band_m && answer.penetrating) || (d < -band_m && !answer.penetrating);
}

double largest_of(const std::vector<double>& values) {
  return values.empty() ? kUndefined : *std::max_element(values.begin(), values.end());
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? kUndefined : sum / static_cast<double>(values.size());
}

ParetoRow row_of(std::span<const PoseSample> samples, std::span<const NearTruth> truths,
                 PairState state) {
  ParetoRow row;
  row.state = to_text(state);
  std::vector<double> tick, query, errors, shallow, deep, angles, points, heap;
  for (const PoseSample& s : samples) {
    const NearTruth& truth = truths[s.pose];
    if (state_of(truth) != state) continue;
    tick.push_back(s.tick_ns);
    query.push_back(s.query_ns);
    heap.push_back(s.heap_calls);
    row.wrong_verdicts += wrong(s.answer, truth.truth, kVerdictBand_m) ? 1u : 0u;
    row.wrong_verdicts_beyond_1nm += wrong(s.answer, truth.truth, kFineBand_m) ? 1u : 0u;
    if (s.answer.penetrating) points.push_back(s.answer.patch_points);
    const double error = depth_error_m(s.answer, truth.truth);
    if (!std::isnan(error)) {
      errors.push_back(error);
      (truth.truth.reference_m < -widen(kShallow_m) ? deep : shallow).push_back(error);
    }
    const bool comparable =
        state == PairState::kContact || s.answer.separated == SeparatedValue::kPlane;
    const double angle =
        comparable ? normal_error_deg(s.answer.normal_w, truth.normals) : kUndefined;
    if (!std::isnan(angle)) angles.push_back(angle);
  }
  row.poses = tick.size();
  const TimeFigures times = figures(std::move(tick));
  row.query_ns = figures(std::move(query)).median;
  row.median_ns = times.median;
  row.p99_ns = times.p99;
  row.p999_ns = times.p999;
  row.max_ns = times.largest;
  row.max_error_m = largest_of(shallow);
  row.max_error_deep_m = largest_of(deep);
  row.median_error_m = errors.empty() ? kUndefined : figures(std::move(errors)).median;
  row.normal_error_deg = largest_of(angles);
  row.patch_points = mean_of(points);
  row.heap_calls = mean_of(heap);
  return row;
}

void append(std::string& text, const char* format, double value) {
  text += ',';
  if (std::isnan(value)) return;
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, format, value);
  text += buffer;
}

}  // namespace

PairState state_of(const NearTruth& truth) {
  if (truth.truth.reference_m <= 0) return PairState::kContact;
  return truth.truth.reference_m < widen(kNearState_m) ? PairState::kNear : PairState::kFar;
}

const char* to_text(PairState state) {
  constexpr const char* kNames[] = {"contact", "near", "far"};
  return kNames[static_cast<std::size_t>(state)];
}

std::vector<ParetoRow> rows_of(std::span<const PoseSample> samples,
                               std::span<const NearTruth> truths) {
  std::vector<ParetoRow> rows;
  for (const PairState state : {PairState::kContact, PairState::kNear, PairState::kFar}) {
    ParetoRow row = row_of(samples, truths, state);
    if (row.poses > 0) rows.push_back(std::move(row));
  }
  return rows;
}

std::string pareto_csv(std::span<const ParetoRow> rows) {
  std::string text = std::string(kParetoHeader) + "\n";
  for (const ParetoRow& r : rows) {
    text += r.pair + "," + r.method + "," + r.setting + "," + r.scalar + "," + r.state;
    for (const double ns : {r.query_ns, r.median_ns, r.p99_ns, r.p999_ns, r.max_ns})
      append(text, "%.1f", ns);
    for (const double e : {r.median_error_m, r.max_error_m, r.max_error_deep_m, r.normal_error_deg})
      append(text, "%.3g", e);
    text += "," + std::to_string(r.wrong_verdicts);
    append(text, "%.2f", r.patch_points);
    append(text, "%.2f", r.heap_calls);
    text += '\n';
  }
  return text;
}

}  // namespace haptic::sim
