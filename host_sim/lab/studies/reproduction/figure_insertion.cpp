// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/figures.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/lab/studies/reproduction/drawing.hpp"
#include "host_sim/lab/studies/reproduction/solid_union.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {
namespace {

constexpr std::size_t kLegTicks = 500;
constexpr std::size_t kInstants = 4;

/// A way point: position of the peg's middle in units of the clearance (x, y) and in m (z), tilt
/// about y.
struct WayPoint6 {
  double x, y, z_m, tilt_rad;
};
constexpr WayPoint6 kWay[kInstants] = {{-0.5, 0.6, 0.050, 0.10},
                                       {0.2, 0.3, 0.020, 0.06},
                                       {1.02, 0.0, 0.004, 0.0},
                                       {0.3, -0.2, -0.0101, 0.0}};

struct Seen {
  Vector x = Vector::Zero();
  Rotation q = Rotation::Identity();
  ContactSituation situation = ContactSituation::kNone;
  double d_near_m = 0, force_n = 0;
  std::string piece;
  std::vector<std::uint32_t> near[5];
};

void draw_column(SvgPage& page, const SceneView& view, const std::vector<Seen>& seen,
                 const std::vector<MotionSample>& motion, std::size_t column) {
  const Seen& now = seen[column];
  const Vector toward(0.75, -1.0, 0.95);
  const double centre = 160 + 310 * static_cast<double>(column);
  const std::vector<Solid> pieces = five_piece_hole(kPictureHoleHalf_m);
  // The two walls towards the viewer are nearly clear: a cut-away.
  constexpr bool kFront[5] = {false, true, true, false, false};

  page.begin_group("physical-" + std::to_string(column + 1));
  const Camera physical(toward, Vector::UnitZ(), {0, 0, -0.004}, {centre, 250}, 2300);
  std::vector<PaintedBody> bodies;
  for (std::size_t k = 0; k < 5; ++k) {
    bodies.push_back({facets_of(pieces[k], Vector::Zero(), Rotation::Identity()),
                      {165, 195, 225, kFront[k] ? 0.10 : 0.80, false, 0.9}});
  }
  bodies.push_back({facets_of(square_peg(), now.x, now.q), {240, 190, 150, 0.85, false, 1.3}});
  draw_bodies(page, physical, bodies);
  page.dot(physical.project(now.x), 4, kPointColour);
  page.end_group();

  page.begin_group("c-space-" + std::to_string(column + 1));
  const Camera space(toward, Vector::UnitZ(), {0, 0, -0.006}, {centre, 595}, 1750);
  std::vector<PaintedBody> solid, clear;
  for (std::uint32_t k = 0; k < 5; ++k) {
    const CObstacle obstacle = make_c_obstacle(view, k, pose_at(now.x, now.q));
    const std::span<const std::uint32_t> near(now.near[k]);
    const std::vector<Facet> facets = facets_of(obstacle, near);
    if (kFront[k]) {
      clear.push_back({facets, {200, 205, 190, 0.05, false, 0.8, "#a0a0a0"}});
    } else {
      solid.push_back({facets, {200, 205, 190, 1.0, false, 0.8, "#606060"}});
    }
  }
  cut_to_union(solid);
  for (PaintedBody& body : solid)  // what faces away is hidden by the union itself
    std::erase_if(body.facets, [&](const Facet& f) { return f.normal.dot(toward) <= 0; });
  draw_bodies(page, space, solid);
  draw_bodies(page, space, clear);
  const std::size_t end = std::min(motion.size() - 1, column * kLegTicks);
  for (std::size_t k = 20; k <= end; k += 20) {
    const auto at = [&](std::size_t i) {
      return space.project({motion[i].p[0], motion[i].p[1], motion[i].p[2]});
    };
    page.line(at(k - 20), at(k), kForceColour, 1.8);
  }
  const Pixel x0 = space.project(now.x);
  page.dot(x0, 4.5, kPointColour);
  page.label({x0.x + 9, x0.y + 4}, "x0", kPointColour, 14);
  page.end_group();
  const std::string contact = now.d_near_m <= 0
                                  ? std::string(to_text(now.situation)) + " with " + now.piece +
                                        ", " + fixed(now.force_n, 2) + " N"
                                  : "free, nearest " + now.piece;
  page.text(centre, 768, std::to_string(column + 1) + ": " + contact, "middle", 13,
            "font-weight=\"bold\"");
}

std::string picture(const SceneView& view, const std::vector<Seen>& seen,
                    const std::vector<MotionSample>& motion) {
  SvgPage page(1260, 830,
               "Peg and hole of five convex pieces in physical space (top) and C-space (bottom), "
               "as Fig. 6");
  for (std::size_t k = 0; k < seen.size(); ++k) draw_column(page, view, seen, motion, k);
  page.text(24, 66, "physical space", "start", 14, "fill=\"#505050\"");
  page.text(24, 440, "C-space", "start", 14, "fill=\"#505050\"");
  page.text(24, 795,
            "The two walls towards the viewer are clear, in both spaces. Below, each piece's "
            "C-obstacle at the orientation of the instant; the peg is the point x0; its path in "
            "red;",
            "start", 12, "fill=\"#505050\"");
  page.text(24, 813,
            "C-faces in contact in orange. Peg 20 x 20 x 60 mm, hole 28 x 28 x 40 mm (wide, so "
            "that the channel in C-space can be seen).",
            "start", 12, "fill=\"#505050\"");
  return page.finish();
}

}  // namespace

std::vector<MotionSample> insertion_motion(double half_width_m) {
  const double clearance = half_width_m - 0.010;
  std::vector<MotionSample> motion;
  for (std::size_t tick = 0; tick <= (kInstants - 1) * kLegTicks; ++tick) {
    const std::size_t leg = std::min(tick / kLegTicks, kInstants - 2);
    const double s = static_cast<double>(tick - leg * kLegTicks) / kLegTicks;
    const double b = s * s * s * (10 + s * (-15 + 6 * s));  // minimum jerk
    const WayPoint6 &from = kWay[leg], &to = kWay[leg + 1];
    const auto mixed = [b](double l, double r) { return l + b * (r - l); };
    // A tilted peg needs more room: its tilt shrinks with the clearance.
    const double tilt =
        mixed(from.tilt_rad, to.tilt_rad) * clearance / (kPictureHoleHalf_m - 0.010);
    motion.push_back(sample_at(
        static_cast<double>(tick) * 1e-3,
        {clearance * mixed(from.x, to.x), clearance * mixed(from.y, to.y), mixed(from.z_m, to.z_m)},
        Rotation(Eigen::AngleAxisd(tilt, Vector::UnitY()))));
  }
  return motion;
}

PartReport insertion_part() {
  const std::vector<Solid> pieces = five_piece_hole(kPictureHoleHalf_m);
  const std::vector<std::byte> bytes = scene_of(square_peg(), pieces, 1000.0, 1e-4);
  CoreSession session(bytes, "peg and hole");
  const std::vector<MotionSample> motion = insertion_motion(kPictureHoleHalf_m);
  std::vector<Seen> seen;
  PartReport report;
  report.title = "Peg into a hole of five convex pieces (Fig. 6)";
  report.markdown = table_head(
      {"instant", "z of x0 (mm)", "D_near (mm)", "nearest piece", "situation", "force (N)"});
  for (std::size_t tick = 0; tick < motion.size(); ++tick) {
    const StepResult result =
        session.core().step(input_of(motion[tick], tick, GoalContact::kAsked));
    if (tick % kLegTicks != 0) continue;
    const MotionSample& s = motion[tick];
    Seen now;
    now.x = Vector(s.p[0], s.p[1], s.p[2]);
    now.q = Rotation(s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2], s.q_wxyz[3]);
    now.situation = result.situation;
    now.d_near_m = static_cast<double>(result.d_near_m);
    now.force_n = static_cast<double>(result.wrench_w.force_w.norm());
    now.piece = pieces[result.nearest_pair].name;
    for (std::uint32_t k = 0; k < 5; ++k) {
      const auto near = near_nodes(session.core(), k);
      if (session.core().pair_report(k).d_near_m <= 0) now.near[k].assign(near.begin(), near.end());
    }
    report.markdown += table_row({std::to_string(seen.size() + 1), fixed(1e3 * now.x[2], 1),
                                  fixed(1e3 * now.d_near_m, 3), now.piece, to_text(now.situation),
                                  fixed(now.force_n, 2)});
    seen.push_back(std::move(now));
  }
  const bool agrees = session.core().pair_count() == 5 && seen[0].d_near_m > 0 &&
                      seen[3].situation == ContactSituation::kFaceFace && seen[3].piece == "floor";
  report.passed = agrees;
  report.markdown += "\n" + picture_line("fig6.svg", "Peg and hole in both spaces");
  report.findings.push_back(
      {"Fig. 6, peg into hole", "hole decomposed into five convex polyhedra; five C-obstacles",
       std::to_string(session.core().pair_count()) + " pairs; inserted to the floor (" +
           to_text(seen[3].situation) + ")",
       yes_or_no(agrees), "the paper prints no dimensions"});
  report.files = {{"fig6.svg", picture(session.view(), seen, motion)}};
  return report;
}

}  // namespace haptic::sim
