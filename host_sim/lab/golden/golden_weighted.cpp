// SPDX-License-Identifier: Apache-2.0
// The weighted contact region of the core against the golden files.
#include <algorithm>
#include <cmath>
#include <map>

#include "host_sim/lab/golden/golden_check.hpp"
#include "host_sim/oracle/oracle_piece.hpp"
#include "host_sim/session/core_session.hpp"
#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/law/weighted_region_law.hpp"

namespace haptic::sim {
namespace {

using Weights = std::map<std::uint32_t, Wide>;

/// Weights that are known no better than this say nothing: the case is not compared.
constexpr Wide kVagueWeight = 0.05L;

WideVec widened(const Vec3& v) { return {widen(v[0]), widen(v[1]), widen(v[2])}; }

/// The weights that the law gives the near set of the last tick; zeros are left out.
Weights weights_of(const HapticCore& core, const SceneParameters& p) {
  const PairReport pair = core.pair_report(0);
  Weights weights;
  for (const auto& n : pair.near) {
    const Real weight =
        contact_weight(n.f_m, pair.d_near_m, n.violation_m, n.outside_m,
                       static_cast<Real>(p.epsilon_m), static_cast<Real>(p.epsilon_o_m));
    if (weight > 0) weights[n.node] = widen(weight);
  }
  return weights;
}

/// Largest difference of two sets of weights, what is missing being zero.
struct WeightError {
  std::uint32_t node = 0;
  Wide expected = 0, got = 0;
  [[nodiscard]] Wide size() const { return std::abs(got - expected); }
};
WeightError largest_error(const Weights& expected, const Weights& got) {
  WeightError worst;
  const auto weight_in = [](const Weights& weights, std::uint32_t node) {
    const auto it = weights.find(node);
    return it == weights.end() ? Wide{0} : it->second;
  };
  for (const Weights* side : {&expected, &got}) {
    for (const auto& [node, weight] : *side) {
      const WeightError error{node, weight_in(expected, node), weight_in(got, node)};
      if (error.size() >= worst.size()) worst = error;
    }
  }
  return worst;
}

class RegionRun {
 public:
  RegionRun(const GoldenFile& file, GoldenReport& report)
      : file_(file),
        compare_(report),
        a_(make_oracle_piece(file.a.vertices, file.a.loops)),
        b_(make_oracle_piece(file.b.vertices, file.b.loops)),
        size_(std::max(diameter(file.a.vertices), diameter(file.b.vertices))),
        tolerance_(report.tolerance) {
    for (const WideVec& v : file.b.vertices) coordinate_ = std::max(coordinate_, norm(v));
    for (const WideVec& v : file.a.vertices) lever_ = std::max(lever_, norm(v));
    lever_ = std::max(lever_, size_);
    coordinate_ = std::max(coordinate_, size_);
  }

  void compare(const GoldenCase& c, const StepResult& result, const Weights& got) {
    const Weights expected(c.weighted->weights.begin(), c.weighted->weights.end());
    const Wide vague = weight_tolerance(c, expected);
    if (vague > kVagueWeight) {
      compare_.skip(GoldenQuantity::kWeights);
      compare_.skip(GoldenQuantity::kWeightedForce);
      compare_.skip(GoldenQuantity::kWeightedTorque);
      return;
    }
    if (c.d_near_m < 0) {  // the files give no weights where the bodies merely touch
      const WeightError worst = largest_error(expected, got);
      const std::string node = "node " + std::to_string(worst.node) + " at ";
      compare_.within(c, GoldenQuantity::kWeights, worst.size(), vague,
                      node + text_of(worst.expected), text_of(worst.got));
    }
    const Wide k = file_.k_f_n_per_m, depth = std::abs(c.d_near_m);
    const Wide relative = tolerance_.weighted;
    const Wide force_tolerance = k * std::max(relative * depth, tolerance_.force * size_);
    const Wide torque_tolerance =
        k * lever_ * std::max(relative * depth, tolerance_.torque * size_);
    const WideVec force = widened(result.wrench_w.force_w),
                  torque = widened(result.wrench_w.torque_w);
    compare_.within(c, GoldenQuantity::kWeightedForce, norm(force - c.weighted->force_n),
                    force_tolerance, text_of(c.weighted->force_n), text_of(force), k * size_);
    compare_.within(c, GoldenQuantity::kWeightedTorque, norm(torque - c.weighted->torque_nm),
                    torque_tolerance, text_of(c.weighted->torque_nm), text_of(torque),
                    k * size_ * lever_);
  }

 private:
  /// A weight is a length over eps, so a rounding of lengths enters it over eps; that of a crossing
  /// point of edges also over the sine of their angle (rt_core/METHOD.md section 11).
  [[nodiscard]] Wide weight_tolerance(const GoldenCase& c, const Weights& expected) const {
    const Wide rounding = widen(kRealEpsilon);
    const Wide eps = std::min(file_.epsilon_m, file_.epsilon_o_m);
    const Wide straight = rounding * std::max(coordinate_, norm(c.x)) / eps;
    return 1e-12L + straight + rounding * size_ / (least_sine(c, expected) * eps);
  }

  /// Least sine of the angle of the edges of a type C node that has a weight; 1 without one. What
  /// lies below the core's own threshold counts as parallel: the core leaves it out.
  [[nodiscard]] Wide least_sine(const GoldenCase& c, const Weights& expected) const {
    const std::uint64_t faces = a_.face_count() * b_.vertices.size();
    const std::uint64_t first_c = faces + a_.vertices.size() * b_.face_count();
    const WideRotation r = rotation_of(c.q_wxyz[0], c.q_wxyz[1], c.q_wxyz[2], c.q_wxyz[3]);
    const auto direction = [](const OraclePiece& piece, std::uint64_t e) {
      const OracleEdge& edge = piece.edges[e];
      return unit(piece.vertices[edge.vertex[1]] - piece.vertices[edge.vertex[0]]);
    };
    Wide least = 1;
    for (const auto& [node, weight] : expected) {
      if (node < first_c) continue;
      const WideVec u = r * direction(a_, (node - first_c) / b_.edges.size());
      const WideVec v = direction(b_, (node - first_c) % b_.edges.size());
      const Wide sine = norm(cross(u, v));
      least = std::min(least, sine < widen(kMinEdgeSine) ? 1e-30L : sine);
    }
    return least;
  }

  const GoldenFile& file_;
  GoldenComparison compare_;
  OraclePiece a_, b_;
  Wide size_ = 0, lever_ = 0, coordinate_ = 0;
  GoldenTolerance tolerance_;
};

}  // namespace

void check_weighted_region(const GoldenFile& file, GoldenReport& report) {
  const bool given = std::any_of(file.cases.begin(), file.cases.end(),
                                 [](const GoldenCase& c) { return c.weighted.has_value(); });
  if (!given) return;
  tools::SceneDescription description = golden_scene(file, static_cast<double>(file.epsilon_m));
  description.parameters.law = LawId::kWeightedRegion;
  description.parameters.epsilon_o_m = static_cast<double>(file.epsilon_o_m);
  const std::vector<std::byte> scene = tools::write_scene(description);
  CoreSession session(scene, file.path);
  RegionRun run(file, report);
  for (const GoldenCase& c : file.cases) {
    if (!c.weighted) continue;
    session.core().reset();
    const StepResult result = session.core().step(input_of_case(c));
    run.compare(c, result, weights_of(session.core(), session.view().parameters()));
  }
}

}  // namespace haptic::sim
