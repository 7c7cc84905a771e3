// SPDX-License-Identifier: Apache-2.0
// Peg and hole: insertion, tilt and drop-in; and what a single contact makes of the coupling.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/stability/proxy_cases.hpp"
#include "host_sim/shapes/contact_case.hpp"

namespace haptic::sim {
namespace {

constexpr double kPegFree_m = -2e-7;
constexpr double kHoleDepth_m = 0.040;

std::string with_clearance(const std::string& words, double clearance_m) {
  return words + ", clearance " + std::to_string(std::lround(1e6 * clearance_m)) + " um";
}

std::vector<Figure> insertion_figures(double clearance_m, double force_n) {
  const ContactCase c = insertion_case(clearance_m);
  const Trace trace = run_trace(c.scene, LawId::kProxy, c.path);
  const WrenchSteps steps = largest_steps(trace.path());
  const PathPose& end = trace.ticks.back().proxy;
  return {
      at_most("dF (N)", force_n, steps.force_n),
      at_most("dtau (N m)", 1e-4, steps.torque_nm),
      near_to("height over the floor (m)", 0, end.p.z() - kPegHalfLength_m + kHoleDepth_m, 1e-6),
      near_to("offset at the end (m)", clearance_m, end.p.x(), 1e-6),
      {"gap (m)", 0, worst_gap_m(trace.ticks), kPegFree_m, 1}};
}

/// Tilt phi of a peg of width w in a hole of width w + 2 c, `depth` along the peg in it:
/// w cos phi + depth sin phi = w + 2 c.
double free_tilt_rad(double clearance_m, double depth_m) {
  double low = 0, high = 0.5;
  for (int k = 0; k < 60; ++k) {
    const double phi = (low + high) / 2;
    const double width = 2 * kPegHalf_m;
    (width * std::cos(phi) + depth_m * std::sin(phi) > width + 2 * clearance_m ? high : low) = phi;
  }
  return low;
}

std::vector<Figure> tilted_figures(double clearance_m, double torque_nm) {
  const ContactCase c = tilted_peg_case(clearance_m);
  const Trace trace = run_trace(c.scene, LawId::kProxy, c.path);
  const WrenchSteps steps = largest_steps(trace.path());
  double largest_nm = 0, formula_nm = 0;
  for (const TraceTick& tick : trace.path()) {
    if (tick.torque_nm.norm() <= largest_nm) continue;
    largest_nm = tick.torque_nm.norm();
    // The depth along the peg's lower side, from its tip to the rim.
    const double tilt = 2 * std::abs(tick.proxy.q.y());
    const double tip =
        tick.proxy.p.z() - kShortPegHalfLength_m * std::cos(tilt) - kPegHalf_m * std::sin(tilt);
    formula_nm = c.scene.k_r_nm_per_rad * (0.1 - free_tilt_rad(clearance_m, -tip / std::cos(tilt)));
  }
  return {at_most("dF (N)", 0.0018, steps.force_n), at_most("dtau (N m)", 8e-5, steps.torque_nm),
          near_to("tau (N m)", torque_nm, largest_nm, 0.002),
          near_to("tau against k_r (0.1 - free tilt) (N m)", 0, largest_nm - formula_nm, 2e-4)};
}

std::vector<Figure> mouth_figures(double clearance_m) {
  const ContactCase c = mouth_case(clearance_m);
  const Trace trace = run_trace(c.scene, LawId::kProxy, c.path);
  const WrenchSteps steps = largest_steps(trace.path());
  return {at_most("dF of the release (N)", 3.0, steps.force_n),
          near_to("force at the end (N)", 0, trace.ticks.back().force_n.norm(), 1e-3),
          near_to("tip under the rim (m)", -kPush_m,
                  trace.ticks.back().proxy.p.z() - kPegHalfLength_m, 1e-6)};
}

/// A tetrahedron's vertex 1.985 mm deep in a box, 5.91 mm aside of the grip point: paper's law and
/// the proxy's.
struct SingleContact {
  double force_n = 0, torque_nm = 0;
};

SingleContact single_contact(double k_r_nm_per_rad, double rho_m, LawId law) {
  constexpr double kDepth_m = 1.985e-3;
  Solid tetrahedron = paper_tetrahedron();
  const Solid box = paper_box();
  // Vertex 0 is then 20 mm from the grip point: how far it shifts as the part turns shows below
  // k_r 1.
  for (Vector& v : tetrahedron.vertices) v /= 3;
  CoupledScene scene;
  scene.moving = united_body({&tetrahedron, 1});
  scene.statics.push_back(united_body({&box, 1}));
  scene.k_r_nm_per_rad = k_r_nm_per_rad;
  // Vertex 0 points down, turned so far that it lies rho aside.
  const double lever = tetrahedron.vertices[0].norm();
  const Rotation q = turn_about(std::numbers::pi + std::asin(rho_m / lever), Vector::UnitY());
  const double height = box.vertices[3].z() - (q * tetrahedron.vertices[0]).z() - kDepth_m;
  TimedPath path;
  path.pose = [=](double) -> PathPose { return {{0.004, 0.003, height}, q}; };
  path.duration_s = 0.05;
  const Trace trace = run_trace(scene, law, path);
  return {trace.ticks.back().force_n.norm(), trace.ticks.back().torque_nm.norm()};
}

std::vector<Figure> stiffness_figures(double k_r, double force_n, double torque_nm) {
  constexpr double kRho_m = 5.91e-3;
  const SingleContact contact = single_contact(k_r, kRho_m, LawId::kProxy);
  const double formula_n = 1.985e-3 / (1e-3 + kRho_m * kRho_m / k_r);
  std::vector<Figure> figures = {
      near_to("F (N)", force_n, contact.force_n, force_n * (k_r < 0.5 ? 0.02 : 0.002))};
  if (torque_nm > 0) figures.push_back(near_to("tau (N m)", torque_nm, contact.torque_nm, 2e-4));
  // Below, the tilt is no longer small and the contact point moves.
  if (k_r >= 1) figures.push_back(near_to("F over k_eff d", 1, contact.force_n / formula_n, 0.01));
  return figures;
}

std::vector<Figure> paper_figures() {
  const SingleContact contact = single_contact(1, 5.91e-3, LawId::kPaper);
  return {near_to("F (N)", 1.985, contact.force_n, 1e-6),
          near_to("tau (N m)", 0.011732, contact.torque_nm, 2e-6)};
}

std::vector<Figure> central_figures() {
  std::vector<Figure> figures;
  for (const double k_r : {1000.0, 10.0, 1.0, 0.2}) {
    figures.push_back(near_to("F at rho 0, k_r " + std::to_string(k_r) + " (N)", 1.985,
                              single_contact(k_r, 0, LawId::kProxy).force_n, 1e-6));
  }
  return figures;
}

}  // namespace

std::vector<CaseRow> peg_rows() {
  std::vector<CaseRow> rows;
  struct {
    double clearance_m, insertion_n, tilt_nm;
  } const sizes[] = {{1e-3, 0.0088, 0.011}, {1e-4, 0.0096, 0.046}, {1e-5, 0.0097, 0.050}};
  for (const auto& s : sizes) {
    rows.push_back({"insertion", with_clearance("peg wobbling in", s.clearance_m),
                    [s] { return insertion_figures(s.clearance_m, s.insertion_n); }});
    rows.push_back({"tilted_peg", with_clearance("peg tilted in the hole", s.clearance_m),
                    [s] { return tilted_figures(s.clearance_m, s.tilt_nm); }});
    rows.push_back({"mouth", with_clearance("peg slid over the mouth", s.clearance_m),
                    [s] { return mouth_figures(s.clearance_m); }});
  }
  return rows;
}

std::vector<CaseRow> stiffness_rows() {
  return {
      {"single_paper", "vertex 1.985 mm deep, 5.91 mm aside: paper's law", paper_figures},
      {"single_1000", "the same, proxy, k_r 1000",
       [] { return stiffness_figures(1000, 1.984931, 0.011732); }},
      {"single_10", "the same, proxy, k_r 10", [] { return stiffness_figures(10, 1.978051, 0); }},
      {"single_1", "the same, proxy, k_r 1",
       [] { return stiffness_figures(1, 1.914279, 0.011743); }},
      {"single_0.2", "the same, proxy, k_r 0.2", [] { return stiffness_figures(0.2, 1.620, 0); }},
      {"single_central", "vertex under the grip point", central_figures}};
}

}  // namespace haptic::sim
