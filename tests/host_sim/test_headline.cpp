// SPDX-License-Identifier: Apache-2.0
// The headline of error against run time: penalty on each library against closed forms, the whole
// table on a short motion, and deliberately wrong methods, which must be seen as wrong.
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "host_sim/lab/pareto/headline_report.hpp"
#include "host_sim/lab/pareto/pareto_report.hpp"

using namespace haptic;
using namespace haptic::sim;

namespace {

constexpr double kStiffness = 1000;

/// A box over four blocks with gaps between them, so that four pairs push at once.
PenaltyBodies box_on_blocks() {
  PenaltyBodies bodies;
  bodies.moving = {peer_solid(centred_box("box", 0.03, 0.03, 0.02))};
  for (const double x : {-0.02, 0.02}) {
    for (const double y : {-0.02, 0.02}) {
      bodies.fixed.push_back(peer_solid(box_solid("block", Vector(x - 0.015, y - 0.015, -0.05),
                                                  Vector(x + 0.015, y + 0.015, 0))));
    }
  }
  return bodies;
}

PenaltyBodies box_on_block() {
  PenaltyBodies bodies;
  bodies.moving = {peer_solid(centred_box("box", 0.03, 0.03, 0.02))};
  bodies.fixed = {peer_solid(box_solid("block", Vector(-0.1, -0.1, -0.05), Vector(0.1, 0.1, 0)))};
  return bodies;
}

PenaltyWrench rendered(PenaltyPeer& peer, const Vector& p, const Rotation& q) {
  peer.prepare(peer_pose(p, q));
  return peer.render();
}

/// A part on a block: pressed straight down, 0.5 mm deep at the end of 60 ms, and back.
HeadlineScene press_scene() {
  HeadlineScene scene;
  scene.name = "press";
  scene.title = "box on a block";
  const Solid box = centred_box("box", 0.03, 0.03, 0.02);
  const Solid block = box_solid("block", Vector(-0.1, -0.1, -0.05), Vector(0.1, 0.1, 0));
  scene.description.name = scene.name;
  scene.description.moving.body = united_body({&box, 1});
  scene.description.statics.emplace_back();
  scene.description.statics.back().body = united_body({&block, 1});
  scene.description.parameters.k_f_n_per_m = kStiffness;
  scene.bodies = box_on_block();
  MotionScript script;
  script.rate_hz = 1000.0 * kHeadlineSubsteps;
  for (const double z : {0.021, 0.0195, 0.021}) {
    WayPoint point;
    point.phase = "press";
    point.t_s = 0.06 * static_cast<double>(script.waypoints.size());
    point.p[2] = z;
    script.waypoints.push_back(point);
  }
  scene.goals = make_motion(script);
  return scene;
}

/// A renderer whose force and torque are off by a constant.
class WrongRenderer final : public TickRenderer {
 public:
  WrongRenderer(std::unique_ptr<TickRenderer> honest, const Vector& shift_n)
      : honest_(std::move(honest)), shift_n_(shift_n) {}
  void reset() override { honest_->reset(); }
  void prepare(const MotionSample& goal, std::uint64_t tick) override {
    honest_->prepare(goal, tick);
  }
  void render() override { honest_->render(); }
  [[nodiscard]] HandWrench wrench() const override {
    HandWrench wrench = honest_->wrench();
    wrench.force_n += shift_n_;
    wrench.torque_nm -= 0.1 * shift_n_;
    return wrench;
  }

 private:
  std::unique_ptr<TickRenderer> honest_;
  Vector shift_n_;
};

}  // namespace

TEST_SUITE_BEGIN("host_sim.headline");

TEST_CASE("penalty: flat on a block, the stiffness times the depth, upwards") {
  for (const PenaltyEntry& entry : penalty_catalog()) {
    CAPTURE(entry.title);
    const auto peer = entry.make(box_on_block(), kStiffness);
    const PenaltyWrench w = rendered(*peer, {0.004, -0.003, 0.0195}, Rotation::Identity());
    CHECK(w.pairs == 1);
    CHECK(w.failures == 0);
    CHECK(std::abs(w.force_n[0]) < 1e-5);
    CHECK(std::abs(w.force_n[1]) < 1e-5);
    CHECK(w.force_n[2] == doctest::Approx(0.5).epsilon(1e-4));
    const PenaltyWrench free = rendered(*peer, {0.004, -0.003, 0.0205}, Rotation::Identity());
    CHECK(free.pairs == 0);
    CHECK(free.force_n == PeerVector{0, 0, 0});
  }
}

TEST_CASE("penalty: on a corner, the torque of the force at the corner") {
  // Turned about z, then tilted about x and y: one vertex is lowest.
  const Rotation q = Rotation(Eigen::AngleAxisd(0.3, Vector::UnitX())) *
                     Rotation(Eigen::AngleAxisd(0.4, Vector::UnitY())) *
                     Rotation(Eigen::AngleAxisd(0.2, Vector::UnitZ()));
  Vector lowest = Vector::Constant(1);
  for (const double x : {-0.03, 0.03}) {
    for (const double y : {-0.03, 0.03}) {
      const Vector corner = q * Vector(x, y, -0.02);
      if (corner.z() < lowest.z()) lowest = corner;
    }
  }
  const double depth_m = 2e-4;
  const Vector expected = lowest.cross(Vector(0, 0, kStiffness * depth_m));
  for (const PenaltyEntry& entry : penalty_catalog()) {
    CAPTURE(entry.title);
    const auto peer = entry.make(box_on_block(), kStiffness);
    const PenaltyWrench w = rendered(*peer, {0.01, 0.02, -lowest.z() - depth_m}, q);
    REQUIRE(w.pairs == 1);
    CHECK(w.force_n[2] == doctest::Approx(kStiffness * depth_m).epsilon(1e-3));
    // GJK-EPA of libccd names a mean of its polytope's points, not the contact.
    if (entry.method == "penalty_ccd_epa") continue;
    for (std::size_t i = 0; i < 3; ++i) {
      // The contact may be named anywhere in the depth: 0.2 N over less than 1 mm.
      CHECK(std::abs(w.torque_nm[i] - expected[static_cast<Eigen::Index>(i)]) < 2e-4);
    }
  }
}

TEST_CASE("penalty: pairs add up, the deepest alone does not") {
  for (const PenaltyEntry& entry : penalty_catalog()) {
    CAPTURE(entry.title);
    const auto peer = entry.make(box_on_blocks(), kStiffness);
    const PenaltyWrench w = rendered(*peer, {0.0011, 0.0007, 0.0195}, Rotation::Identity());
    CHECK(w.pairs == 4);
    CHECK(w.force_n[2] == doctest::Approx(2.0).epsilon(1e-4));
    CHECK(w.deepest_force_n[2] <= 0.5 * (1 + 1e-4));
    CHECK(w.deepest_force_n[2] > 0.1);
  }
}

TEST_CASE("headline: pressed straight on one face every method agrees with the reference") {
  const HeadlineScene scene = press_scene();
  const HeadlineReference reference = headline_reference(scene);
  const TickClock clock;
  CHECK(reference.largest_force_n == doctest::Approx(0.5).epsilon(1e-3));
  REQUIRE(reference.in_contact.size() > 40);
  CHECK(reference.in_contact.size() < scene.ticks() - 20);
  const double exact_n = sizeof(Real) == sizeof(double) ? 1e-6 : 1e-3;
  CHECK(measure_renderer(scene.goals, reference, *law_renderer(scene, LawId::kProxy), 1, clock)
            .force_n.largest < exact_n);
  CHECK(measure_renderer(scene.goals, reference, *law_renderer(scene, LawId::kPaper), 1, clock)
            .force_n.largest < exact_n);
  for (const PenaltyEntry& entry : penalty_catalog()) {
    CAPTURE(entry.title);
    const auto renderer = penalty_renderer(scene, entry.make(scene.bodies, kStiffness));
    CHECK(measure_renderer(scene.goals, reference, *renderer, 1, clock).force_n.largest < 1e-3);
  }
}

TEST_CASE("headline: a wrong force, torque and stiffness are measured as they are") {
  const HeadlineScene scene = press_scene();
  const HeadlineReference reference = headline_reference(scene);
  const TickClock clock;
  WrongRenderer wrong(law_renderer(scene, LawId::kProxy), Vector(0, 0.3, 0.4));
  const HeadlineMethod method = measure_renderer(scene.goals, reference, wrong, 2, clock);
  CHECK(method.force_n.median == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(method.force_n.largest == doctest::Approx(0.5).epsilon(1e-2));
  CHECK(method.torque_nm.p99 == doctest::Approx(0.05).epsilon(1e-2));
  CHECK(method.force_error_n.size() == reference.in_contact.size());
  // Twice the stiffness: as much error as there is force.
  for (const PenaltyEntry& entry : penalty_catalog()) {
    const auto stiff = penalty_renderer(scene, entry.make(scene.bodies, 2 * kStiffness));
    const HeadlineMethod twice = measure_renderer(scene.goals, reference, *stiff, 1, clock);
    CHECK(twice.force_n.largest == doctest::Approx(reference.largest_force_n).epsilon(1e-2));
    CHECK(twice.force_step_n > 1.5 * reference.force_step_n);
  }
}

TEST_CASE("headline: every scene and method of a quick run, in table, page, picture and ticks") {
  MeasurePlan plan;
  plan.passes = 1;
  const TickClock clock;
  ParetoResult result;
  result.plan = plan;
  result.headline = measure_headline(plan, clock, true, false);
  REQUIRE(result.headline.size() == 4);
  const std::size_t pairs[] = {5, 33, 625, 361};
  const std::string csv = headline_table(result.headline).csv();
  const std::string page = pareto_markdown(result), svg = headline_plot(result.headline);
  for (std::size_t k = 0; k < 4; ++k) {
    const HeadlineMeasure& m = result.headline[k];
    CAPTURE(m.name);
    CHECK(m.pairs == pairs[k]);
    CHECK(m.reference.in_contact.size() > m.ticks / 4);
    CHECK(m.reference.largest_force_n > 0.3);
    const std::size_t libraries = penalty_catalog().size();
    CHECK(m.methods.size() == 5 + libraries + (libraries > 0 ? 1 : 0));
    CHECK(m.methods.front().name == kDefaultMethod);
    for (const PenaltyEntry& entry : penalty_catalog()) {
      REQUIRE(m.method(entry.method) != nullptr);
      CHECK(m.method(entry.method)->force_n.p99 > 0.1);
    }
    for (const HeadlineMethod& method : m.methods) {
      CHECK(csv.find(m.name + "," + std::to_string(m.pairs) + "," + method.name + ",") !=
            std::string::npos);
      CHECK(page.find("| " + method.title + " | ") != std::string::npos);
      CHECK((svg.find(">" + method.title + "<") != std::string::npos) == method.drawn);
      CHECK(method.ns.size() == m.reference.in_contact.size());
      CHECK(method.time_ns.median <= method.time_ns.p99);
      CHECK(method.force_n.p99 <= method.force_n.largest);
    }
    const HeadlineMethod &own = *m.method(kDefaultMethod), &one = *m.method("proxy_1");
    CHECK(own.force_n.p99 < 0.1 * m.method("paper")->force_n.p99);
    if (sizeof(Real) == sizeof(double)) {  // single precision rounds as much as a pass settles
      CHECK(own.force_n.median < one.force_n.median);
      CHECK(own.force_n.p99 < one.force_n.p99);
      CHECK(own.torque_nm.p99 < one.torque_nm.p99);
    }
    CHECK(m.method("paper")->flawed_ticks == 0);
    const std::string ticks = headline_ticks_csv(m);
    CHECK(static_cast<std::size_t>(std::ranges::count(ticks, '\n')) ==
          m.reference.in_contact.size() + 1);
    CHECK(ticks.find("nan") == std::string::npos);
  }
  CHECK(svg.starts_with("<?xml "));
  CHECK(svg.find("nan") == std::string::npos);
  CHECK(svg.find("inf") == std::string::npos);
  CHECK(pareto_json(result).find("\"headline\"") != std::string::npos);
  const std::string heading = "## Error against run time of the default law\n";
  CHECK(page.find(heading) != std::string::npos);
  CHECK(page.find(heading) == page.find("## "));
}

TEST_SUITE_END();
