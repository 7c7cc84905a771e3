// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/headline.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "host_sim/lab/peers/peer_catalog.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr std::uint32_t kQuickRepeats = 2;

std::size_t ticks_of(std::span<const MotionSample> goals) {
  return (goals.size() - 1) / kHeadlineSubsteps + 1;
}

class LawRenderer final : public PlacedRenderer {
 public:
  LawRenderer(std::span<const std::byte> scene, const std::string& name)
      : session_(scene, name), core_(session_.core()) {}
  void reset() override { core_.reset(); }
  void prepare(const MotionSample& goal, std::uint64_t tick) override {
    input_ = input_of(goal, tick);
  }
  void render() override { result_ = core_.step(input_); }
  [[nodiscard]] HandWrench wrench() const override {
    return {result_.wrench_w.force_w.cast<double>(), result_.wrench_w.torque_w.cast<double>(),
            (result_.flags & kFlagBudgetUsedUp) != 0};
  }
  [[nodiscard]] ShownPart part() const override {
    return {result_.proxy_pose_wa.p_wa.cast<double>(), result_.proxy_pose_wa.q_wa.cast<double>()};
  }

 private:
  CoreSession session_;
  HapticCore& core_;
  StepInput input_;
  StepResult result_;
};

Vector vector_of(const PeerVector& v) { return {v[0], v[1], v[2]}; }

class PenaltyRenderer final : public TickRenderer {
 public:
  PenaltyRenderer(const std::array<double, 3>& grip_m, std::unique_ptr<PenaltyPeer> peer,
                  PenaltySum sum)
      : grip_m_(grip_m[0], grip_m[1], grip_m[2]), peer_(std::move(peer)), sum_(sum) {}
  void prepare(const MotionSample& goal, std::uint64_t) override {
    const Rotation q =
        Rotation(goal.q_wxyz[0], goal.q_wxyz[1], goal.q_wxyz[2], goal.q_wxyz[3]).normalized();
    peer_->prepare(peer_pose(Vector(goal.p[0], goal.p[1], goal.p[2]) + q * grip_m_, q));
  }
  void render() override { wrench_ = peer_->render(); }
  [[nodiscard]] HandWrench wrench() const override {
    const bool all = sum_ == PenaltySum::kAll;
    return {vector_of(all ? wrench_.force_n : wrench_.deepest_force_n),
            vector_of(all ? wrench_.torque_nm : wrench_.deepest_torque_nm), wrench_.failures > 0};
  }

 private:
  Vector grip_m_;
  std::unique_ptr<PenaltyPeer> peer_;
  PenaltySum sum_;
  PenaltyWrench wrench_;
};

Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {quantile(values, 0.5), quantile(values, 0.99), values.back()};
}

/// Largest change of force and torque from one tick to the next.
void take_steps(const std::vector<HandWrench>& wrenches, double& force_n, double& torque_nm) {
  for (std::size_t k = 1; k < wrenches.size(); ++k) {
    const HandWrench &now = wrenches[k], &last = wrenches[k - 1];
    force_n = std::max(force_n, (now.force_n - last.force_n).norm());
    torque_nm = std::max(torque_nm, (now.torque_nm - last.torque_nm).norm());
  }
}

struct LawSetting {
  const char* name;
  const char* title;
  LawId law;
  std::uint32_t passes;
  bool drawn;
};
constexpr LawSetting kLaws[] = {
    {kDefaultMethod, "law proxy, 3 passes (default)", LawId::kProxy, 0, true},
    {"proxy_1", "law proxy, 1 pass", LawId::kProxy, 1, true},
    {"proxy_2", "law proxy, 2 passes", LawId::kProxy, 2, false},
    {"proxy_5", "law proxy, 5 passes", LawId::kProxy, 5, false},
    {"paper", "law paper", LawId::kPaper, 0, true}};

HeadlineMeasure measure_scene(const HeadlineScene& scene, std::uint32_t repeats,
                              const TickClock& clock, bool progress) {
  const auto say = [&](const std::string& line) {
    if (progress) std::fprintf(stderr, "%s\n", line.c_str());
  };
  HeadlineMeasure measure;
  measure.name = scene.name;
  measure.title = scene.title;
  measure.moving_pieces = scene.bodies.moving.size();
  measure.fixed_pieces = scene.bodies.fixed.size();
  measure.pairs = scene.pairs();
  measure.ticks = scene.ticks();
  say("headline: " + scene.title + ", " + std::to_string(measure.pairs) + " pairs, " +
      std::to_string(measure.ticks) + " ticks: reference");
  measure.reference = headline_reference(scene);
  const auto add = [&](const std::string& name, const std::string& title, bool drawn,
                       TickRenderer& renderer) {
    say("  " + title);
    HeadlineMethod method =
        measure_renderer(scene.goals, measure.reference, renderer, repeats, clock);
    method.name = name;
    method.title = title;
    method.drawn = drawn;
    measure.methods.push_back(std::move(method));
  };
  // The laws that sum over pairs get them all, so that no budget of visits counts as their error.
  for (const LawSetting& law : kLaws) {
    add(law.name, law.title, law.drawn,
        *law_renderer(scene, law.law, law.passes, law.law != LawId::kProxy));
  }
  bool first = true;
  for (const PenaltyEntry& entry : penalty_catalog()) {
    const auto make = [&] { return entry.make(scene.bodies, kHeadlineStiffness_n_per_m); };
    add(entry.method, entry.title, true, *penalty_renderer(scene, make()));
    if (std::exchange(first, false)) {
      add(entry.method + "_deepest", entry.title + ", deepest only", true,
          *penalty_renderer(scene, make(), PenaltySum::kDeepest));
    }
  }
  return measure;
}

}  // namespace

std::vector<std::byte> law_scene(const HeadlineScene& scene, LawId law, std::uint32_t passes,
                                 bool all_pairs) {
  tools::SceneDescription description = scene.description;
  description.parameters.law = law;
  description.parameters.coupling.passes = passes;
  if (all_pairs) description.max_pair_visits = static_cast<std::uint32_t>(scene.pairs());
  return tools::write_scene(description);
}

std::unique_ptr<PlacedRenderer> law_renderer(std::span<const std::byte> scene,
                                             const std::string& name) {
  return std::make_unique<LawRenderer>(scene, name);
}

std::unique_ptr<PlacedRenderer> law_renderer(const HeadlineScene& scene, LawId law,
                                             std::uint32_t passes, bool all_pairs) {
  return law_renderer(law_scene(scene, law, passes, all_pairs), scene.name);
}

std::unique_ptr<TickRenderer> penalty_renderer(const HeadlineScene& scene,
                                               std::unique_ptr<PenaltyPeer> peer, PenaltySum sum) {
  return std::make_unique<PenaltyRenderer>(scene.description.grip_m, std::move(peer), sum);
}

HeadlineReference headline_reference(const HeadlineScene& scene) {
  return settled_reference(scene.goals,
                           *law_renderer(scene, LawId::kProxy, kReferencePasses, true));
}

HeadlineReference settled_reference(std::span<const MotionSample> goals, TickRenderer& settled) {
  HeadlineReference reference;
  for (std::size_t k = 0; k < goals.size(); ++k) {
    settled.prepare(goals[k], k);
    settled.render();
    if (k % kHeadlineSubsteps != 0) continue;
    const HandWrench wrench = settled.wrench();
    if (!wrench.force_n.isZero(0) || !wrench.torque_nm.isZero(0))
      reference.in_contact.push_back(reference.wrenches.size());
    reference.largest_force_n = std::max(reference.largest_force_n, wrench.force_n.norm());
    reference.largest_torque_nm = std::max(reference.largest_torque_nm, wrench.torque_nm.norm());
    reference.wrenches.push_back(wrench);
  }
  take_steps(reference.wrenches, reference.force_step_n, reference.torque_step_nm);
  return reference;
}

HeadlineMethod measure_renderer(std::span<const MotionSample> goals,
                                const HeadlineReference& reference, TickRenderer& renderer,
                                std::uint32_t repeats, const TickClock& clock,
                                const std::function<void(std::size_t)>& seen) {
  std::vector<double> least_ns;
  std::vector<HandWrench> wrenches;
  for (std::uint32_t repeat = 0; repeat < std::max(1u, repeats); ++repeat) {
    renderer.reset();
    wrenches.clear();
    for (std::size_t k = 0; k < ticks_of(goals); ++k) {
      renderer.prepare(goals[k * kHeadlineSubsteps], k);
      const double ns = clock.ns_of([&] { renderer.render(); });
      if (repeat == 0) least_ns.push_back(ns);
      least_ns[k] = std::min(least_ns[k], ns);
      wrenches.push_back(renderer.wrench());
      if (seen && repeat + 1 >= repeats) seen(k);
    }
  }
  HeadlineMethod method;
  for (const std::size_t k : reference.in_contact) {
    const HandWrench &ours = wrenches[k], &truth = reference.wrenches[k];
    method.ns.push_back(least_ns[k]);
    method.force_error_n.push_back((ours.force_n - truth.force_n).norm());
    method.torque_error_nm.push_back((ours.torque_nm - truth.torque_nm).norm());
    method.flawed_ticks += ours.flawed ? 1u : 0u;
  }
  take_steps(wrenches, method.force_step_n, method.torque_step_nm);
  method.time_ns = spread_of(method.ns);
  method.force_n = spread_of(method.force_error_n);
  method.torque_nm = spread_of(method.torque_error_nm);
  return method;
}

const HeadlineMethod* HeadlineMeasure::method(const std::string& wanted) const {
  const auto found =
      std::ranges::find_if(methods, [&](const HeadlineMethod& m) { return m.name == wanted; });
  return found == methods.end() ? nullptr : &*found;
}

std::vector<HeadlineMeasure> measure_headline(const MeasurePlan& plan, const TickClock& clock,
                                              bool quick, bool progress) {
  std::vector<HeadlineMeasure> measures;
  const std::uint32_t repeats = quick ? std::min(plan.passes, kQuickRepeats) : plan.passes;
  for (const HeadlineScene& scene : headline_scenes(quick))
    measures.push_back(measure_scene(scene, repeats, clock, progress));
  return measures;
}

}  // namespace haptic::sim
