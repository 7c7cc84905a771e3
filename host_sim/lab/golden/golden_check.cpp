// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/golden/golden_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>

#include "host_sim/oracle/exhaustive.hpp"
#include "host_sim/session/core_session.hpp"
#include "rt_core/base/scalar.hpp"

namespace haptic::sim {

namespace {

struct FamilyRow {
  const char* family;
  double depth, force, torque;
};

/// Single precision. The worst errors measured are behind each row in the same order,
/// "-" where the near set of every case is closer than the rounding and nothing is compared. Where
/// an error is far below half a rounding (6e-8) the floor is 5e-8 for depth and force, 1e-8 for
/// torque: such luck depends on the order of additions.
constexpr FamilyRow kSingleRows[] = {
    {"box_box_edge_edge", 1.0e-7, 1.0e-7, 2.0e-8},      // 2.4e-8, 2.4e-8, 4.3e-9
    {"box_box_edge_face", 6.0e-8, 5.0e-8, 1.0e-8},      // 1.5e-8, 7.8e-9, 8.1e-10
    {"box_box_face_face", 1.0e-7, 1.0e-7, 6.0e-8},      // 2.5e-8, 2.5e-8, 1.4e-8
    {"box_box_generic", 2.8e-7, 1.0e-7, 2.0e-8},        // 6.7e-8, 2.3e-8, 4.2e-9
    {"containment", 1.2e-7, 1.2e-7, 1.0e-8},            // 1.8e-8, 2.9e-8, 1.4e-9
    {"large_offset", 1.4e-2, 1.4e-2, 1.4e-2},           // 3.5e-3, 3.5e-3, -: 1e4 m from the origin
    {"medial_tie", 6.0e-8, 2.0e-7, 1.0e-8},             // 1.3e-8, 5.1e-8, -
    {"needle6_box", 1.0e-7, 5.0e-8, 1.0e-8},            // 2.5e-8, 1.1e-8, -
    {"needle_box", 8.0e-8, 5.0e-8, 1.0e-8},             // 1.9e-8, 1.2e-8, 4.7e-11
    {"path_tetra_box", 2.4e-7, 1.0e-7, 2.0e-8},         // 5.9e-8, -, -
    {"plate_box", 1.6e-7, 1.6e-7, 1.0e-8},              // 3.9e-8, 3.9e-8, -
    {"prism_box_face_face", 1.2e-7, 5.0e-8, 1.0e-8},    // 3.0e-8, 0, 0
    {"prism_box_generic", 1.2e-7, 1.2e-7, 2.2e-8},      // 2.9e-8, 2.8e-8, 5.4e-9
    {"scale_1e-6", 4.4e-7, 1.2e-7, 3.4e-8},             // 1.1e-7, 2.8e-8, 8.5e-9
    {"scale_1e3", 1.0e-7, 8.0e-8, 1.6e-8},              // 2.2e-8, 1.8e-8, 4.0e-9
    {"tetra_box_face_face", 5.0e-8, 5.0e-8, 1.0e-8},    // 1.2e-8, 1.2e-8, 1.0e-9
    {"tetra_box_generic", 2.0e-7, 2.0e-7, 4.2e-8},      // 4.7e-8, 4.8e-8, 1.0e-8
    {"tetra_box_touch", 1.2e-7, 5.0e-8, 1.0e-8},        // 2.8e-8, 0, 0
    {"tetra_right_box_touch", 5.0e-8, 5.0e-8, 1.0e-8},  // 0, 0, 0
};

constexpr bool kSingle = sizeof(Real) == sizeof(float);

WideVec wide(const Vec3& v) { return {widen(v[0]), widen(v[1]), widen(v[2])}; }

/// Compares the cases of one file and writes into the report.
class GoldenRun {
 public:
  GoldenRun(const GoldenFile& file, GoldenReport& report)
      : file_(file),
        compare_(report),
        a_(make_oracle_piece(file.a.vertices, file.a.loops)),
        b_(make_oracle_piece(file.b.vertices, file.b.loops)) {
    size_ = std::max(diameter(file.a.vertices), diameter(file.b.vertices));
    shortest_edge_ = size_;
    for (const OraclePiece* piece : {&a_, &b_}) {
      for (const OracleEdge& e : piece->edges) {
        shortest_edge_ = std::min(
            shortest_edge_, norm(piece->vertices[e.vertex[1]] - piece->vertices[e.vertex[0]]));
      }
    }
    for (const WideVec& v : file.b.vertices) coordinate_ = std::max(coordinate_, norm(v));
    for (const GoldenCase& c : file.cases) coordinate_ = std::max(coordinate_, norm(c.x));
    tolerance_ = golden_tolerance(file.family, coordinate_ > 100 * size_);
    depth_tolerance_ = tolerance_.depth * size_;
    report.tolerance = tolerance_;
    report.cases = file.cases.size();
    report.size_m = static_cast<double>(size_);
    report.depth_tolerance_m = static_cast<double>(depth_tolerance_);
  }

  void run(CoreSession& session) {
    for (const GoldenCase& c : file_.cases) {
      session.core().reset();
      const StepResult result = session.core().step(input_of_case(c));
      check_tracking(c, session.core(), result, GoldenQuantity::kVerdict, GoldenQuantity::kDepth,
                     GoldenQuantity::kNearSet);
      check_wrench(c, session.core(), result);
      check_oracle(c);
      compare_.skip(GoldenQuantity::kOtherRules, c.other_results);
    }
    if (!file_.is_path) return;
    session.core().reset();
    for (const GoldenCase& c : file_.cases) {
      const StepResult result = session.core().step(input_of_case(c));
      check_tracking(c, session.core(), result, GoldenQuantity::kCoherentVerdict,
                     GoldenQuantity::kCoherentDepth, GoldenQuantity::kCoherentNearSet);
    }
  }

 private:
  static OraclePose pose_of_case(const GoldenCase& c) {
    return {rotation_of(c.q_wxyz[0], c.q_wxyz[1], c.q_wxyz[2], c.q_wxyz[3]), c.x};
  }

  void check_tracking(const GoldenCase& c, const HapticCore& core, const StepResult& result,
                      GoldenQuantity verdict, GoldenQuantity depth, GoldenQuantity near_set) {
    if (result.status != RtStatus::kOk) {
      compare_.fail(c, verdict, "a result", std::string("status ") + to_text(result.status));
      return;
    }
    const Wide d = widen(result.d_near_m);
    const bool either = c.touching || std::abs(c.d_near_m) <= (kSingle ? depth_tolerance_ : 0.0L);
    compare_.equal(c, verdict, either || (d > 0) == c.separated,
                   c.separated ? "separated" : "collision", d > 0 ? "separated" : "collision");
    compare_.within(c, depth, std::abs(d - c.d_near_m), depth_tolerance_, text_of(c.d_near_m),
                    text_of(d), size_);
    const auto near = near_nodes(core, 0);
    const bool same = std::equal(near.begin(), near.end(), c.near.begin(), c.near.end());
    if (!same && !near_set_decidable(c)) {
      compare_.skip(near_set);
      return;
    }
    compare_.equal(c, near_set, same, text_of(c.near), text_of(near));
  }

  /// In single precision a gap below the rounding of the depths makes the exact near set, and what
  /// follows from it, unattainable.
  bool near_set_decidable(const GoldenCase& c) const {
    const Wide rounding = 64 * widen(kRealEpsilon) * std::max(coordinate_, size_);
    const bool gap = !c.gap_to_next_m || *c.gap_to_next_m > 2 * rounding;
    return gap && (!c.min_violation_of_rejected_m || *c.min_violation_of_rejected_m > 2 * rounding);
  }

  /// The near node's normal that the core took. Several planes at equal depth (also two opposite
  /// ones): the choice is the core's, so what follows is compared for the plane that it chose.
  struct Choice {
    WideVec normal;
    bool several_planes = false;
  };
  [[nodiscard]] Choice choice_of(const GoldenCase& c, const WideVec& direction) const {
    const std::vector<NodeValue> nodes = all_nodes(a_, b_, pose_of_case(c));
    Choice choice;
    Wide best = -2;
    for (const NodeValue& node : nodes) {
      if (!std::binary_search(c.near.begin(), c.near.end(), node.node)) continue;
      if (best > -2) choice.several_planes |= norm(node.normal - choice.normal) > 1e-6L;
      const Wide along = dot(node.normal, direction);
      if (along <= best) continue;
      best = along;
      choice.normal = node.normal;
    }
    return choice;
  }

  void check_wrench(const GoldenCase& c, const HapticCore& core, const StepResult& result) {
    const Wide k = file_.k_f_n_per_m;
    const Wide depth = std::abs(c.d_near_m);
    const Wide relative = tolerance_.relative;
    const Wide lever = std::max(size_, lever_of_a());
    const Wide force_tolerance = k * std::max(relative * depth, tolerance_.force * size_);
    const Wide torque_tolerance = k * lever * std::max(relative * depth, tolerance_.torque * size_);
    const WideVec force = wide(result.wrench_w.force_w), torque = wide(result.wrench_w.torque_w);
    const bool in_collision = !c.separated && !c.touching;
    const Choice choice = in_collision ? choice_of(c, force) : Choice{};
    // The direction of the force is a near node's normal: read where it is longer than its own
    // rounding.
    if (c.near_normal && in_collision && norm(force) > 1e3L * force_tolerance) {
      const WideVec expected = choice.several_planes ? choice.normal : *c.near_normal;
      const WideVec n = unit(force);
      compare_.within(c, GoldenQuantity::kNearNormal, norm(n - expected),
                      std::max(relative, 2 * force_tolerance / norm(force)), text_of(expected),
                      text_of(n));
    } else if (c.near_normal) {
      compare_.skip(GoldenQuantity::kNearNormal);
    }
    if (c.scp) {
      const WideVec expected = choice.several_planes ? c.x + depth * choice.normal : *c.scp;
      const WideVec scp = c.x + (1.0L / k) * force;  // eq. (2): SCP - HIP = F / k_F
      compare_.within(c, GoldenQuantity::kScp, norm(scp - expected),
                      depth_tolerance_ + relative * depth, text_of(expected), text_of(scp), size_);
    }
    if (c.force_n) {
      const WideVec expected = choice.several_planes ? k * depth * choice.normal : *c.force_n;
      compare_.within(c, GoldenQuantity::kForce, norm(force - expected), force_tolerance,
                      text_of(expected), text_of(force), k * size_);
    }
    // A margin below this is a discontinuity of the rule within rounding (tests/golden/README.md:
    // 1e-6 m at 0.1 m).
    const bool settled = near_set_decidable(c);
    const bool stable = settled && !choice.several_planes &&
                        (!c.margin_m || *c.margin_m > std::min(1e-6L, 1e-5L * size_));
    if (c.torque_nm && stable) {
      compare_.within(c, GoldenQuantity::kTorque, norm(torque - *c.torque_nm), torque_tolerance,
                      text_of(*c.torque_nm), text_of(torque), k * size_ * lever);
    } else if (c.torque_nm) {
      compare_.skip(GoldenQuantity::kTorque);
    }
    if (c.contact_nodes && in_collision && settled) {
      const auto nodes = contact_nodes(core, 0);
      compare_.equal(
          c, GoldenQuantity::kContactNodes,
          std::equal(nodes.begin(), nodes.end(), c.contact_nodes->begin(), c.contact_nodes->end()),
          text_of(*c.contact_nodes), text_of(nodes));
    } else if (c.contact_nodes) {
      compare_.skip(GoldenQuantity::kContactNodes);
    }
  }

  /// Largest distance of A's vertices from its frame's origin: lever of the torque where that lies
  /// outside the body.
  [[nodiscard]] Wide lever_of_a() const {
    Wide lever = 0;
    for (const WideVec& v : file_.a.vertices) lever = std::max(lever, norm(v));
    return lever;
  }

  void check_oracle(const GoldenCase& c) {
    const OraclePose pose = pose_of_case(c);
    const std::vector<NodeValue> nodes = all_nodes(a_, b_, pose);
    // Sides that are exactly zero come out within a few roundings of Wide.
    const Wide zero = 1e-15L * size_ + 64 * 0x1p-64L * coordinate_;
    std::uint32_t closed = 0, strict = 0;
    Wide d_near = -std::numeric_limits<Wide>::infinity();
    for (const NodeValue& node : nodes) {
      closed += node.violation_m <= zero ? 1u : 0u;
      strict += node.violation_m < -zero ? 1u : 0u;
      if (node.violation_m <= zero) d_near = std::max(d_near, node.depth_m);
    }
    if (c.applicable_closed) {
      compare_.equal(c, GoldenQuantity::kOracleApplicable, closed == *c.applicable_closed,
                     std::to_string(*c.applicable_closed), std::to_string(closed));
    }
    if (c.applicable_strict) {
      compare_.equal(c, GoldenQuantity::kOracleApplicable, strict == *c.applicable_strict,
                     std::to_string(*c.applicable_strict), std::to_string(strict));
    }
    // Short edges turn by the rounding of the decimals over their length; the lever of that turn is
    // the size.
    const Wide fine =
        1e-14L * size_ + 64 * 0x1p-64L * std::max(coordinate_, size_) * (size_ / shortest_edge_);
    compare_.within(c, GoldenQuantity::kOracleDepth, std::abs(d_near - c.d_near_m), fine,
                    text_of(c.d_near_m), text_of(d_near));
    const PairTruth truth = search_pair(a_, b_, pose, size_, precision_of_real());
    const Wide error = std::max({truth.lower_m - c.d_near_m, c.d_near_m - truth.upper_m, 0.0L});
    compare_.within(c, GoldenQuantity::kOracleDepth, error, fine, text_of(c.d_near_m),
                    text_of(truth.reference_m));
    for (const auto& [number, depth] : c.depth_by_node) {
      const auto it =
          std::lower_bound(nodes.begin(), nodes.end(), number,
                           [](const NodeValue& node, std::uint32_t n) { return node.node < n; });
      const bool found = it != nodes.end() && it->node == number;
      compare_.within(c, GoldenQuantity::kOracleDepthByNode,
                      found ? std::abs(it->depth_m - depth) : 1.0L, fine,
                      "node " + std::to_string(number) + " at " + text_of(depth),
                      found ? text_of(it->depth_m) : "no such node");
    }
    if (c.ratio_max) {
      const Wide ratio = largest_ratio(a_, b_, pose, nodes, zero);
      // The ratio divides by distances from c to planes, at least the thinnest half width: allow
      // for slivers.
      compare_.within(c, GoldenQuantity::kOracleRatio, std::abs(ratio - *c.ratio_max),
                      1e-9L * std::max(1.0L, std::abs(ratio)), text_of(*c.ratio_max),
                      text_of(ratio));
    }
  }

  const GoldenFile& file_;
  GoldenComparison compare_;
  OraclePiece a_, b_;
  Wide size_ = 0, shortest_edge_ = 0, coordinate_ = 0, depth_tolerance_ = 0;
  GoldenTolerance tolerance_;
};

}  // namespace

GoldenTolerance golden_tolerance(const std::string& family, bool far_away) {
  if (sizeof(Real) == sizeof(double)) {
    const Wide share = far_away ? 1e-10L : 1e-12L;
    return {share, share, share, 1e-9L};
  }
  for (const FamilyRow& row : kSingleRows) {
    if (family == row.family) return {widen(row.depth), widen(row.force), widen(row.torque), 0};
  }
  const Wide share = far_away ? 2e-2L : 1e-6L;
  return {share, share, share, 0};
}

const char* to_text(GoldenQuantity quantity) {
  constexpr const char* kNames[] = {"verdict",
                                    "d_near",
                                    "near set",
                                    "near normal",
                                    "SCP",
                                    "force",
                                    "torque",
                                    "contact nodes",
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

StepInput input_of_case(const GoldenCase& c) {
  const auto& q = c.q_wxyz;
  const Wide s = 1.0L / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  StepInput in;
  in.report_goal_contact = true;
  in.pose_wa.p_wa =
      Vec3(static_cast<Real>(c.x.x), static_cast<Real>(c.x.y), static_cast<Real>(c.x.z));
  in.pose_wa.q_wa = Quat(static_cast<Real>(s * q[0]), static_cast<Real>(s * q[1]),
                         static_cast<Real>(s * q[2]), static_cast<Real>(s * q[3]));
  return in;
}

GoldenReport check_golden_file(const GoldenFile& file) {
  GoldenReport report;
  report.path = file.path;
  report.family = file.family;
  report.epsilon_m = golden_epsilon_m(file);
  GoldenRun run(file, report);
  const std::vector<std::byte> scene = tools::write_scene(golden_scene(file, report.epsilon_m));
  CoreSession session(scene, file.path);
  const std::uint32_t nodes = session.view().pair_record(0).node_count;
  if (nodes != file.node_count) {
    report.failures.push_back(file.path + ": nodes: expected " + std::to_string(file.node_count) +
                              ", got " + std::to_string(nodes));
  }
  run.run(session);
  return report;
}

}  // namespace haptic::sim
