// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/pareto_measure.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

OraclePiece oracle_piece(const Solid& solid) {
  std::vector<WideVec> vertices;
  for (const Vector& v : solid.vertices) vertices.push_back({v[0], v[1], v[2]});
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
