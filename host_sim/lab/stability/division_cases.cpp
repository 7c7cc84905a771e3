// SPDX-License-Identifier: Apache-2.0
// The same motions on a block whole and cut; work round closed loops.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/stability/proxy_cases.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/shapes/contact_case.hpp"
#include "host_sim/shapes/wander.hpp"

namespace haptic::sim {
namespace {

double lowest_m(const Solid& solid, const Rotation& q) {
  double lowest = 0;
  for (const Vector& v : solid.vertices) lowest = std::min(lowest, (q * v).z());
  return lowest;
}

/// Differences of the force between two bodies under the same motion.
struct Differences {
  std::vector<double> force_n;

  void add(const CoupledScene& whole, const CoupledScene& cut, const TimedPath& path) {
    const Trace a = run_trace(whole, LawId::kProxy, path);
    const Trace b = run_trace(cut, LawId::kProxy, path);
    for (std::size_t k = a.begin; k < a.ticks.size(); ++k)
      force_n.push_back((a.ticks[k].force_n - b.ticks[k].force_n).norm());
  }
  void sort() { std::ranges::sort(force_n); }
};

struct Blocks {
  tools::Body whole;
  std::vector<tools::Body> cut;
};

Blocks blocks(Seeded& random) {
  // Centred, so that random planes meet its middle.
  const Solid solid = centred_box("block", 0.06, 0.06, 0.025);
  Blocks result{united_body({&solid, 1}), {}};
  for (int k = 0; k < 4; ++k)
    result.cut.push_back(random_cuts(result.whole, {0.06, 0.06, 0.025}, 11, random));
  return result;
}

CoupledScene scene_of(const Solid& moving, const tools::Body& fixed) {
  CoupledScene scene;
  scene.moving = united_body({&moving, 1});
  scene.statics.push_back(fixed);
  return scene;
}

/// Face, edge and vertex on the top, away from its rim.
std::vector<Figure> top_figures() {
  Seeded random(20260602);
  const Blocks b = blocks(random);
  const Solid box = centred_box("box", 0.022, 0.018, 0.02);
  const Solid tetrahedron = paper_tetrahedron();
  struct {
    const Solid* solid;
    Rotation about;
    double turn_rad;
  } const contacts[] = {
      {&box, Rotation::Identity(), 0.03},
      {&box, turn_about(0.6, Vector::UnitY()), 0.05},
      {&box, turn_about(0.6, Vector::UnitY()) * turn_about(0.7, Vector::UnitX()), 0.1},
      {&tetrahedron, Rotation::Identity(), 0.03},
      {&tetrahedron, turn_about(std::numbers::pi, Vector::UnitX()), 0.15}};
  Differences differences;
  for (const tools::Body& cut : b.cut) {
    for (const auto& c : contacts) {
      Wander w;
      w.centre = {0, 0, 0.025 - lowest_m(*c.solid, c.about) - 0.0025};
      w.reach_m = {0.015, 0.015, 0.001};
      w.about = c.about;
      w.turn_rad = c.turn_rad;
      TimedPath path;
      path.pose = wander(w, random);
      path.duration_s = 2.4;
      path.retreat_w = {0, 0, 0.02};
      differences.add(scene_of(*c.solid, b.whole), scene_of(*c.solid, cut), path);
    }
  }
  differences.sort();
  return {{"ticks", 48000, static_cast<double>(differences.force_n.size()), 48000, 50000},
          at_most("median (N)", 1e-12, quantile(differences.force_n, 0.5)),
          at_most("p99 (N)", 1e-6, quantile(differences.force_n, 0.99)),
          at_most("largest (N)", 0.015, quantile(differences.force_n, 1)),
          at_most("share over 0.01 N", 2.0 / 48000, share_over(differences.force_n, 0.01))};
}

/// Around the block's own edges, where the moment of a release depends on the iteration's way.
std::vector<Figure> rim_figures() {
  Seeded random(20260603);
  const Blocks b = blocks(random);
  const Solid box = centred_box("box", 0.022, 0.018, 0.02);
  Differences differences;
  for (const tools::Body& cut : b.cut) {
    for (int k = 0; k < 4; ++k) {
      Wander w;
      const double side = random.uniform(-0.03, 0.03);
      w.centre = k % 2 == 0 ? Vector(0.075, side, 0.035) : Vector(side, -0.070, 0.035);
      w.reach_m = {0.015, 0.015, 0.012};
      w.turn_rad = 0.3;
      TimedPath path;
      path.pose = wander(w, random);
      path.duration_s = 1.5;
      path.retreat_w = k % 2 == 0 ? Vector(0.06, 0, 0.06) : Vector(0, -0.06, 0.06);
      differences.add(scene_of(box, b.whole), scene_of(box, cut), path);
    }
  }
  differences.sort();
  return {at_most("median (N)", 1e-12, quantile(differences.force_n, 0.5)),
          at_most("share over 0.01 N", 0.05, share_over(differences.force_n, 0.01))};
}

std::vector<Figure> loop_figures(const ContactLoop& loop, double design_1000, double design_4000) {
  std::vector<Figure> figures;
  for (const double ticks : {1000.0, 4000.0}) {
    const Trace trace = run_trace(loop.scene, LawId::kProxy, loop.path_of(ticks));
    const double work_j = hand_work_j(trace.path().last(static_cast<std::size_t>(ticks) + 1));
    const double design_j = ticks < 2000 ? design_1000 : design_4000;
    // Not less than nothing except for the rule's own error; not more than the design lost.
    figures.push_back({"work, " + std::to_string(std::lround(ticks)) + " ticks (J)", design_j,
                       work_j, -1e-8, 2 * std::abs(design_j)});
  }
  return figures;
}

}  // namespace

std::vector<CaseRow> division_rows() {
  return {{"division_top", "block cut by random planes: contacts on its top", top_figures},
          {"division_rim", "block cut by random planes: round its edges", rim_figures}};
}

std::vector<CaseRow> energy_rows() {
  static constexpr double kDesign[5][2] = {
      {7e-9, -3e-9}, {8e-5, 4e-6}, {1.4e-7, 1.4e-8}, {1e-4, 1e-4}, {2.8e-8, 7e-9}};
  std::vector<CaseRow> rows;
  for (std::size_t k = 0; k < 5; ++k) {
    const ContactLoop loop = contact_loops()[k];
    rows.push_back({"loop_" + loop.name, "closed loop: " + loop.title,
                    [loop, k] { return loop_figures(loop, kDesign[k][0], kDesign[k][1]); }});
  }
  return rows;
}

}  // namespace haptic::sim
