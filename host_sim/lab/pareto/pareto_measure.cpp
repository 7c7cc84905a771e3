// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pareto_measure.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <utility>

#include "host_sim/timing/tick_times.hpp"
#include "tools/common/error.hpp"

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

std::uint64_t edge_count(const Solid& solid) {
  std::uint64_t corners = 0;
  for (const auto& loop : solid.loops) corners += loop.size();
  return corners / 2;
}

PairClass pair_of(std::string name, std::string content, Solid a, Solid b) {
  PairClass pair{std::move(name), std::move(content), std::move(a), std::move(b)};
  pair.nodes = basic_contact_count(pair.a, pair.b);
  return pair;
}

PairClass hull_pair(std::string name, std::uint32_t vertices, std::uint64_t seed) {
  const Vector axes_a(0.040, 0.030, 0.025), axes_b(0.050, 0.040, 0.030);
  const std::string count = std::to_string(vertices);
  return pair_of(std::move(name), "hulls of " + count + " and " + count + " vertices",
                 ellipsoid_hull(vertices, axes_a, seed),
                 ellipsoid_hull(vertices, axes_b, seed + 1));
}

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

OraclePiece oracle_piece(const Solid& solid) {
  std::vector<WideVec> vertices;
  for (const Vector& v : solid.vertices)
    vertices.push_back({widen(v[0]), widen(v[1]), widen(v[2])});
  return make_oracle_piece(std::move(vertices), solid.loops);
}

/// One timed call; counts the allocations in it when they are counted at all.
template <typename Call>
double timed(const TickClock& clock, HeapCounter heap_calls, double& calls, Call&& call) {
  const std::uint64_t before = heap_calls != nullptr ? heap_calls() : 0;
  const double ns = clock.ns_of(call);
  calls = heap_calls != nullptr ? static_cast<double>(heap_calls() - before) : kNoValue;
  return ns;
}

/// One pass over the motion; `visit(sample index, pose index, first of its recording)`.
template <typename Visit>
void walk(PeerQuery& peer, const TruthfulWorkload& workload, std::size_t stride, Visit&& visit) {
  std::size_t sample = 0;
  for (const Recording& recording : workload.motion.recordings) {
    peer.reset();
    for (std::size_t k = recording.begin; k < recording.end; ++k) {
      if (k % stride == 0) visit(sample++, k, k == recording.begin);
    }
  }
}

ParetoRow named(ParetoRow row, const PairClass& pair, const PeerEntry& entry,
                const std::string& setting) {
  row.pair = pair.name;
  row.method = entry.method;
  row.setting = setting;
  row.scalar = entry.scalar;
  return row;
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

ReportTable pareto_rows(std::span<const ParetoRow> rows) {
  ReportTable table(
      "pair,method,setting,scalar,state,poses,query_ns,median_ns,p99_ns,p999_ns,max_ns,"
      "median_error_m,max_error_m,max_error_deep_m,normal_error_deg,wrong_verdicts,"
      "wrong_verdicts_beyond_1nm,patch_points,heap_calls");
  const auto ns = [](double value) { return shown_as("%.1f", value); };
  const auto error = [](double value) { return shown_as("%.3g", value); };
  for (const ParetoRow& r : rows) {
    table.add({r.pair, r.method, r.setting, r.scalar, r.state, r.poses, ns(r.query_ns),
               ns(r.median_ns), ns(r.p99_ns), ns(r.p999_ns), ns(r.max_ns), error(r.median_error_m),
               error(r.max_error_m), error(r.max_error_deep_m), error(r.normal_error_deg),
               r.wrong_verdicts, r.wrong_verdicts_beyond_1nm, shown_as("%.2f", r.patch_points),
               shown_as("%.2f", r.heap_calls)});
  }
  return table;
}

std::string pareto_csv(std::span<const ParetoRow> rows) {
  return pareto_rows(rows).csv({"poses", "wrong_verdicts_beyond_1nm"});
}

std::uint64_t basic_contact_count(const Solid& a, const Solid& b) {
  return std::uint64_t{a.loops.size()} * b.vertices.size() +
         std::uint64_t{a.vertices.size()} * b.loops.size() + edge_count(a) * edge_count(b);
}

std::vector<PairClass> pair_classes(std::uint64_t seed) {
  const Solid box = centred_box("box", 0.050, 0.040, 0.030);
  std::vector<PairClass> pairs;
  pairs.push_back(pair_of("W1", "tetrahedron and box", paper_tetrahedron(), box));
  pairs.push_back(pair_of("W2", "two boxes", centred_box("box a", 0.030, 0.025, 0.020), box));
  pairs.back().boxes = true;
  pairs.push_back(pair_of("W3", "12-prism and box", prism_solid(12, 0.025, 0.060), box));
  pairs.push_back(hull_pair("W4", 32, seed + 40));
  pairs.push_back(hull_pair("W5", 64, seed + 50));
  pairs.push_back(hull_pair("W6", 200, seed + 60));
  return pairs;
}

double TruthfulWorkload::penetrating_share() const {
  std::size_t inside = 0;
  for (const NearTruth& truth : truths) inside += state_of(truth) == PairState::kContact ? 1u : 0u;
  return static_cast<double>(inside) / static_cast<double>(truths.size());
}

TruthfulWorkload truthful_workload(const PairClass& pair, std::size_t pose_count,
                                   std::uint64_t seed) {
  TruthfulWorkload workload;
  workload.motion = contact_workload(pair.a, pair.b, pose_count, seed);
  NearReference reference(oracle_piece(pair.a), oracle_piece(pair.b));
  for (const WorkloadPose& pose : workload.motion.poses) {
    workload.poses.push_back(peer_pose(pose.p_wa, pose.q_wa));
    const Rotation& q = pose.q_wa;
    workload.truths.push_back(
        reference.at({rotation_of(widen(q.w()), widen(q.x()), widen(q.y()), widen(q.z())),
                      {widen(pose.p_wa[0]), widen(pose.p_wa[1]), widen(pose.p_wa[2])}}));
  }
  return workload;
}

std::vector<PoseSample> measure_motion(PeerQuery& peer, const TruthfulWorkload& workload,
                                       std::size_t stride, const MeasurePlan& plan,
                                       const TickClock& clock) {
  std::vector<PoseSample> samples;
  std::vector<char> first;
  for (std::uint32_t pass = 0; pass < plan.passes; ++pass) {
    walk(peer, workload, stride, [&](std::size_t i, std::size_t k, bool starts) {
      peer.prepare(workload.poses[k]);
      double calls = 0;
      const double ns = timed(clock, plan.heap_calls, calls, [&peer] { peer.query(); });
      if (pass == 0) {
        samples.push_back({k, ns, ns, calls, peer.answer()});
        first.push_back(starts ? 1 : 0);
      }
      samples[i].tick_ns = std::min(samples[i].tick_ns, ns);
      samples[i].heap_calls = std::min(samples[i].heap_calls, calls);
    });
  }
  for (PoseSample& s : samples) s.query_ns = s.tick_ns;
  if (peer.has_query_only()) {
    for (PoseSample& s : samples) s.query_ns = std::numeric_limits<double>::infinity();
    for (std::uint32_t pass = 0; pass < plan.passes; ++pass) {
      walk(peer, workload, stride, [&](std::size_t i, std::size_t k, bool) {
        peer.prepare(workload.poses[k]);
        double calls = 0;
        const double ns = timed(clock, nullptr, calls, [&peer] { peer.query_only(); });
        samples[i].query_ns = std::min(samples[i].query_ns, ns);
      });
    }
  }
  if (peer.coherent()) {
    std::size_t i = 0;
    std::erase_if(samples, [&](const PoseSample&) { return first[i++] != 0; });
  }
  return samples;
}

std::vector<PoseSample> measure_first_ticks(PeerQuery& peer, const TruthfulWorkload& workload,
                                            std::size_t stride, const MeasurePlan& plan,
                                            const TickClock& clock) {
  std::vector<PoseSample> samples;
  for (std::size_t k = 0; k < workload.poses.size(); k += stride) {
    PoseSample sample;
    sample.pose = k;
    sample.tick_ns = std::numeric_limits<double>::infinity();
    for (std::uint32_t pass = 0; pass < plan.passes; ++pass) {
      peer.reset();
      peer.prepare(workload.poses[k]);
      const double ns = timed(clock, plan.heap_calls, sample.heap_calls, [&peer] { peer.query(); });
      sample.tick_ns = std::min(sample.tick_ns, ns);
    }
    sample.query_ns = sample.tick_ns;
    sample.answer = peer.answer();
    samples.push_back(sample);
  }
  return samples;
}

MethodResult measure_method(const PeerEntry& entry, const PairClass& pair,
                            const TruthfulWorkload& workload, const MeasurePlan& plan,
                            const TickClock& clock) {
  MethodResult result;
  std::unique_ptr<PeerQuery> peer;
  try {
    peer = entry.make(pair.a, pair.b);
  } catch (const tools::InputError& error) {
    result.refusal = error.what();
    return result;
  }
  const std::uint64_t visits = pair.nodes * workload.poses.size();
  // Odd, so that no pattern of the motion is met in step.
  if (entry.all_nodes && visits > plan.node_visits)
    result.stride = (visits / plan.node_visits) | 1u;
  const auto samples = measure_motion(*peer, workload, result.stride, plan, clock);
  for (const PoseSample& s : samples) {
    if (state_of(workload.truths[s.pose]) == PairState::kContact)
      result.contact_ns.push_back(s.tick_ns);
  }
  std::sort(result.contact_ns.begin(), result.contact_ns.end());
  for (ParetoRow& row : rows_of(samples, workload.truths))
    result.rows.push_back(named(std::move(row), pair, entry, entry.setting));
  if (peer->coherent() && entry.drawn) {
    const std::size_t most =
        std::clamp<std::size_t>(plan.node_visits / 64 / pair.nodes, 20, plan.first_ticks);
    const std::size_t stride = std::max<std::size_t>(1, workload.poses.size() / most) | 1u;
    const auto firsts = measure_first_ticks(*peer, workload, stride, plan, clock);
    for (ParetoRow& row : rows_of(firsts, workload.truths))
      result.rows.push_back(named(std::move(row), pair, entry, kFirstTickSetting));
  }
  return result;
}

}  // namespace haptic::sim
