// SPDX-License-Identifier: Apache-2.0
// Runs the cases of the cost of several bodies: by their law, and one part by its own.
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>

#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/lab/bodies_study/cost_cases.hpp"
#include "host_sim/lab/bodies_study/peer_run.hpp"
#include "rt_core/proxy/proxy_law.hpp"
#include "rt_core/scene/formed_pairs.hpp"
#include "tools/common/error.hpp"
#include "tools/common/formatted.hpp"

namespace haptic::sim {
namespace {

/// A part under the law of one, over what stands.

class OnePart {
 public:
  explicit OnePart(const CompiledBodies& compiled) : blob_(compiled.pairs[0].blob) {
    const RtStatus opened = SceneView::open(std::as_const(blob_).span(), view_);
    if (opened != RtStatus::kOk)
      throw tools::InputError(std::string("not a usable pair: ") + to_text(opened));
    const std::uint32_t moving = view_.bodies()[0].piece_count;
    NearScratch::Size size;
    size.fit(largest_counts(view_.pieces().first(moving)),
             largest_counts(view_.pieces().subspan(moving)));
    const auto lay_out = [&](Arena& arena) {
      proxy_.place(arena, view_);
      scratch_.place(arena, size);
    };
    Arena counting;
    lay_out(counting);
    memory_ = tools::SceneBytes(counting.used());
    Arena arena(memory_.span().data());
    lay_out(arena);
    proxy_.read_scene(view_);
    Proxy::Parameters parameters;
    const MovingBody body = moving_bodies(compiled.scene)[0];
    parameters.spring = body.spring;
    parameters.radius_m = body.radius_m;
    parameters.scale = bodies_scale(compiled.scene);
    parameters.epsilon_m = static_cast<Real>(view_.parameters().epsilon_m);
    proxy_.configure(parameters);
    proxy_.reset();  // it starts at its first goal
  }
  OnePart(const OnePart&) = delete;
  OnePart& operator=(const OnePart&) = delete;

  [[nodiscard]] ProxyTick tick(const GripPose& goal) { return proxy_.tick(goal, scratch_); }
  [[nodiscard]] const GripPose& pose() const { return proxy_.pose(); }

 private:
  tools::SceneBytes blob_, memory_;
  SceneView view_;
  NearScratch scratch_;
  Proxy proxy_;
};

/// Fowler-Noll-Vo, of 64 bits.
constexpr std::uint64_t kCostHashStart = 0xcbf29ce484222325ull, kCostHashFactor = 0x100000001b3ull;

void add_to_hash(std::uint64_t& hash, const GripPose& pose) {
  const auto add = [&](Real number) {
    unsigned char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * kCostHashFactor;
  };
  for (int i = 0; i < 3; ++i) add(pose.x0_w[i]);
  for (int i = 0; i < 4; ++i) add(pose.q_wa.coeffs()[i]);
}

BodiesWork work_of(const ProxyWork& work, bool spent) {
  return {work.units(), work.qp_steps, work.qp_programs, work.rows, spent};
}

}  // namespace

BodiesCostRun run_bodies_cost(const BodiesCostCase& of, std::size_t ticks) {
  const CompiledBodies compiled = compiled_bodies(of.scene, of.friction);
  std::unique_ptr<OnePart> part;
  std::unique_ptr<BodiesSession> session;
  if (of.of_one_part) {
    part = std::make_unique<OnePart>(compiled);
  } else {
    session = std::make_unique<BodiesSession>(compiled, of.work_units, std::nullopt);
  }
  BodiesCostRun run;
  if (session) run.units_bound = session->units_bound();
  run.state_hash = kCostHashStart;
  for (std::size_t t = 0; t < ticks; ++t) {
    std::vector<GripPose> goals;
    for (const BodyPlace& place : of.goals(1e-3 * static_cast<double>(t)))
      goals.push_back(grip_pose_at(place.p, place.q));
    if (session && t == 0) session->begin(goals);
    const auto start = std::chrono::steady_clock::now();
    BodiesWork work;
    if (part) {
      const ProxyTick told = part->tick(goals[0]);
      work = work_of(told.work, told.spent);
    } else {
      const BodiesTick told = session->tick(goals);
      work = work_of(told.work, told.spent);
    }
    const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
    run.ticks.push_back(work);
    run.ns.push_back(taken.count());
    if (part) {
      add_to_hash(run.state_hash, part->pose());
      continue;
    }
    for (std::uint32_t k = 0; k < session->law().body_count(); ++k)
      add_to_hash(run.state_hash, session->law().pose(k));
  }
  return run;
}

void print_bodies_cost_run(std::size_t number, bool is_short, const std::string& peer) {
  std::vector<BodiesCostCase> cases = bodies_cost_cases();
  const std::size_t first_of_size = cases.size();
  for (BodiesCostCase& of : bodies_size_cases()) cases.push_back(std::move(of));
  if (number >= cases.size())
    throw tools::UsageError("--once: there are " + std::to_string(cases.size()) + " cases");
  const bool is_of_size = number >= first_of_size;
  const std::size_t ticks = is_of_size ? bodies_size_ticks(is_short) : bodies_cost_ticks(is_short);
  std::size_t done = 0;
  std::uint64_t hash = 0;
  if (!peer.empty()) {
    const BodiesPeerRun run = run_bodies_peer(cases[number], peer, ticks);
    done = run.ns.size();
    hash = run.state_hash;
  } else {
    const BodiesCostRun run = run_bodies_cost(cases[number], ticks);
    done = run.ticks.size();
    hash = run.state_hash;
  }
  std::printf("%zu ticks, final state hash %016llx\n", done, static_cast<unsigned long long>(hash));
}

}  // namespace haptic::sim
