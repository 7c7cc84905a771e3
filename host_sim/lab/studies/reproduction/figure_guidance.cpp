// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "host_sim/lab/studies/reproduction/drawing.hpp"
#include "host_sim/lab/studies/reproduction/figures.hpp"
#include "host_sim/session/core_session.hpp"
#include "tools/plan/guide_tables.hpp"
#include "tools/plan/search/harmonic_field.hpp"
#include "tools/plan/search/plan_shortening.hpp"
#include "tools/plan/search/translation_plan.hpp"

namespace haptic::sim {
namespace {

constexpr double kStiffness_n_per_m = 800, kContact_m = 5.0e-5;
/// The peg's middle: beside the hole over the block; on the floor.
const Vector kFrom(-0.030, 0, 0.045), kGoal(0, 0, -0.010);
/// The instant of the picture: this deep in the hole, the hand so far beyond the wall.
constexpr double kShownDepth_m = 0.010, kBeyond_m = 0.0055;
constexpr std::size_t kPressTicks = 400;
/// A hand without a will of its own moves by so much for each N and tick, and gives up after a
/// minute.
constexpr double kYield_m_per_n = 2.0e-5;
constexpr std::size_t kMostTicks = 60'000;
constexpr double kAtGoal_m = 1.0e-3;
constexpr const char* kGuideColour = kRegionColour;

SceneParameters parameters() {
  SceneParameters p = tools::default_parameters();
  p.k_f_n_per_m = kStiffness_n_per_m;
  return p;
}

/// One of the two guides that are compared.
struct Guide {
  std::string name;
  tools::Plan plan;
  tools::PlanProof proof;
  tools::SceneBytes scene;
  double mean_clearance_m = 0;
  std::size_t ticks = 0;      ///< of a hand that yields, to the goal; 0: it did not come there
  double most_contact_n = 0;  ///< that it felt of contact on its way
};

/// The scene, both plans through it, and the field.
struct Study {
  tools::SceneBytes plain;
  SceneView view;
  tools::CorneredMotion exact, down;
  tools::HarmonicField field;
  std::array<Guide, 2> guides;
};

Guide guide_of(const std::string& name, const Study& study, const tools::CorneredMotion& motion,
               tools::StepProver& prover, double tolerance_m) {
  Guide guide;
  guide.name = name;
  const double turn_m = static_cast<double>(study.view.pieces()[0].reach_m);
  guide.plan = tools::make_plan(motion, prover, tools::PlanCheck(study.view),
                                {"peg", 1, tolerance_m, kContact_m, turn_m});
  guide.proof = tools::prove_plan(study.view, guide.plan, "the plan");
  const tools::GuideTables tables = tools::guide_tables(study.view, guide.plan);
  guide.scene = tools::SceneBytes(scene_with(square_peg(), five_piece_hole(kPictureHoleHalf_m),
                                             parameters(), kDefaultPairVisits, &tables));
  for (const tools::PlanStation& station : guide.plan.stations)
    guide.mean_clearance_m += station.clearance_m;
  guide.mean_clearance_m /= static_cast<double>(guide.plan.stations.size());
  return guide;
}

/// A hand that goes where contact and guide push it.
void follow(Guide& guide) {
  CoreSession session(guide.scene.span(), "the guided peg", GoalContact::kLeftOut);
  Vector at = kFrom;
  for (std::size_t tick = 0; tick < kMostTicks; ++tick) {
    StepInput input;
    input.pose_wa = pose_at(at, Rotation::Identity());
    const StepResult result = session.core().step(input);
    const Vector contact = result.wrench_w.force_w.cast<double>();
    guide.most_contact_n = std::max(guide.most_contact_n, contact.norm());
    at += kYield_m_per_n * (contact + result.guidance.wrench_w.force_w.cast<double>());
    if ((at - kGoal).norm() > kAtGoal_m) continue;
    guide.ticks = tick + 1;
    return;
  }
}

Study make_study() {
  Study study;
  study.plain = tools::SceneBytes(
      scene_with(square_peg(), five_piece_hole(kPictureHoleHalf_m), parameters()));
  if (SceneView::open(study.plain.span(), study.view) != RtStatus::kOk)
    throw std::runtime_error("the scene of the peg does not open");
  const double tolerance_m = 0.995 * tools::most_tolerance_m(study.view);
  tools::StepProver prover(study.view, tolerance_m);
  const tools::PlanPose start = tools::plan_pose(kFrom, tools::Quatd::Identity());
  const tools::PlanPose goal = tools::plan_pose(kGoal, tools::Quatd::Identity());
  const tools::TranslationResult found = tools::plan_translation(
      study.view, prover, pose_at(kFrom, Rotation::Identity()), start, goal, tolerance_m);
  if (found.verdict != tools::TranslationVerdict::kFound)
    throw std::runtime_error("no translation leads into the hole: " + found.why);
  const double turn_m = static_cast<double>(study.view.pieces()[0].reach_m);
  study.exact = tools::shortened(found.motion, prover, turn_m, {});
  tools::HarmonicDescent down = tools::descend_about(found.space, study.exact);
  study.field = std::move(down.field);
  study.down = std::move(down.motion);
  study.guides[0] = guide_of("shortest of the C-faces", study, study.exact, prover, tolerance_m);
  study.guides[1] = guide_of("harmonic function", study, study.down, prover, tolerance_m);
  for (Guide& guide : study.guides) follow(guide);
  return study;
}

/// What the core says at the instant of the picture.
struct Instant {
  Vector device = Vector::Zero(), felt = Vector::Zero();
  Vector contact_n = Vector::Zero(), guide_n = Vector::Zero();
  ContactSituation situation = ContactSituation::kNone;
  GuideState state = GuideState::kNone;
  std::string place;
  bool same_bits = true;  ///< the contact wrench of all ticks, with the guide and without
};

/// The hand goes down the plan, and in the hole presses the peg against a wall.
Instant make_instant(const Study& study, const Guide& guide) {
  CoreSession led(guide.scene.span(), "the guided peg", GoalContact::kLeftOut);
  CoreSession plain(study.plain.span(), "the peg", GoalContact::kLeftOut);
  std::vector<Vector> motion;
  const std::vector<tools::PlanPose>& corners = study.down.corners;
  constexpr double kStep_m = 1.0e-4;
  for (std::size_t k = 1; k < corners.size(); ++k) {
    const Vector from = tools::place_of(corners[k - 1]), to = tools::place_of(corners[k]);
    const double parts = std::max(1.0, std::ceil((to - from).norm() / kStep_m));
    for (double part = 0; part < parts; ++part) {
      motion.emplace_back(from + part / parts * (to - from));
      if (motion.back().z() < kShownDepth_m) break;
    }
    if (!motion.empty() && motion.back().z() < kShownDepth_m) break;
  }
  const Vector free = motion.back(), beyond(kBeyond_m, free.y(), free.z());
  for (std::size_t k = 1; k <= kPressTicks; ++k) {
    motion.emplace_back(free + static_cast<double>(k) / kPressTicks * (beyond - free));
  }
  Instant now;
  StepResult result;
  for (const Vector& at : motion) {
    StepInput input;
    input.pose_wa = pose_at(at, Rotation::Identity());
    result = led.core().step(input);
    const StepResult without = plain.core().step(input);
    now.same_bits =
        now.same_bits &&
        std::memcmp(&result.wrench_w.force_w, &without.wrench_w.force_w, sizeof(Vec3)) == 0 &&
        std::memcmp(&result.wrench_w.torque_w, &without.wrench_w.torque_w, sizeof(Vec3)) == 0;
  }
  now.device = motion.back();
  now.felt = result.proxy_pose_wa.p_wa.cast<double>();
  now.contact_n = result.wrench_w.force_w.cast<double>();
  now.guide_n = result.guidance.wrench_w.force_w.cast<double>();
  now.situation = result.situation;
  now.state = result.guidance.state;
  now.place = GuideLegs(led.view()).place(now.state, result.guidance.station);
  return now;
}

/// What of a cell lies in the plane y = `at`.
std::vector<Vector> slice_of(const tools::ConvexCell& cell, double at) {
  const tools::CutCell halves = tools::cut(cell, Vector::UnitY(), at);
  if (halves.below.sides.empty() || halves.above.sides.empty()) return {};
  for (const tools::CellSide& side : halves.below.sides) {
    if (side.normal.y() > 0.999 && std::abs(side.offset_m - at) < tools::kCellRounding_m)
      return side.corners;
  }
  return {};
}

/// From the start's end of the field, pale, to the goal's, dark.
std::string field_colour(double value) {
  constexpr std::array<std::array<double, 3>, 3> kStops = {
      {{44, 110, 176}, {120, 196, 190}, {255, 246, 205}}};
  const double at = 2 * std::clamp(value, 0.0, 1.0);
  const std::size_t low = at < 1 ? 0 : 1;
  const double share = at - static_cast<double>(low);
  char text[8];
  std::array<unsigned, 3> mixed{};
  for (std::size_t k = 0; k < 3; ++k) {
    mixed[k] = static_cast<unsigned>(
        std::lround((1 - share) * kStops[low][k] + share * kStops[low + 1][k]));
  }
  std::snprintf(text, sizeof text, "#%02x%02x%02x", mixed[0], mixed[1], mixed[2]);
  return text;
}

/// The paper's loop, as boxes in a row.
void draw_loop(SvgPage& page) {
  page.begin_group("loop");
  const auto box = [&](double x, double y, double wide, const char* fill, const std::string& one,
                       const std::string& two) {
    page.raw(rectangle_at({x, y}, wide, 44, fill, "stroke=\"#404040\" rx=\"5\""));
    page.text(x + wide / 2, y + 19, one, "middle", 13, "font-weight=\"bold\"");
    page.text(x + wide / 2, y + 36, two, "middle", 12);
  };
  box(30, 66, 150, "#f2f2f2", "hand and device", "pose of the part");
  box(270, 40, 250, "#fbe5d6", "contacts tracked in C-space", "felt part: outside of every C-face");
  box(270, 96, 250, "#d9f0e6", "motion planned in C-space", "harmonic function along a channel");
  box(610, 40, 190, "#fbe5d6", "contact force", "spring to the felt part");
  box(610, 96, 190, "#d9f0e6", "guidance force", "down the plan and back to it");
  box(890, 66, 190, "#f2f2f2", "sum to the hand", "contact as without a guide");
  page.arrow({180, 82}, {270, 62}, "#404040", 1.5);
  page.arrow({395, 84}, {395, 96}, "#404040", 1.5);
  page.arrow({520, 62}, {610, 62}, kForceColour, 2);
  page.arrow({520, 118}, {610, 118}, kGuideColour, 2);
  page.arrow({800, 62}, {890, 82}, kForceColour, 2);
  page.arrow({800, 118}, {890, 94}, kGuideColour, 2);
  page.end_group();
}

/// Two forces at a place, each with its newtons.
void draw_forces(SvgPage& page, const Camera& camera, const Instant& now, double m_per_n) {
  draw_arrow(page, camera, now.felt, m_per_n * now.guide_n, kGuideColour, 3,
             "guidance " + fixed(now.guide_n.norm(), 2) + " N");
  draw_arrow(page, camera, now.felt, m_per_n * now.contact_n, kForceColour, 3,
             "contact " + fixed(now.contact_n.norm(), 2) + " N");
}

void draw_physical(SvgPage& page, const Instant& now) {
  page.begin_group("physical");
  page.text(250, 190, "Physical space", "middle", 15, "font-weight=\"bold\"");
  const Vector toward(0.55, -1.0, 0.6);
  const Camera camera(toward, Vector::UnitZ(), {0, 0, 0.0}, {250, 440}, 4300);
  const std::vector<Solid> pieces = five_piece_hole(kPictureHoleHalf_m);
  // The two walls towards the viewer are nearly clear: a cut-away.
  constexpr bool kFront[5] = {false, true, true, false, false};
  std::vector<PaintedBody> bodies;
  for (std::size_t k = 0; k < 5; ++k) {
    bodies.push_back({facets_of(pieces[k], Vector::Zero(), Rotation::Identity()),
                      {165, 195, 225, kFront[k] ? 0.10 : 0.80, false, 0.9}});
  }
  bodies.push_back(
      {facets_of(square_peg(), now.felt, Rotation::Identity()), {240, 190, 150, 0.75, false, 1.3}});
  draw_bodies(page, camera, bodies);
  page.dot(camera.project(now.felt), 4, kPointColour);
  draw_forces(page, camera, now, 0.020);
  page.end_group();
}

void draw_c_space(SvgPage& page, const Study& study, const Instant& now) {
  page.begin_group("c-space");
  page.text(790, 190, "C-space of the translations, cut open at y = 0", "middle", 15,
            "font-weight=\"bold\"");
  const tools::HarmonicField& field = study.field;
  // Towards +y; not in a plane between cells.
  const Camera camera(-Vector::UnitY(), Vector::UnitZ(), {0, 0, 0.023}, {790, 440}, 5200);
  const double at = 0.25 * field.pitch_m;
  const auto drawn = [&](const std::vector<Vector>& polygon) {
    std::vector<Pixel> points;
    for (const Vector& x : polygon) points.push_back(camera.project(x));
    return points;
  };
  page.raw(
      "<clipPath id=\"slice\"><rect x=\"520\" y=\"202\" width=\"540\" height=\"476\"/></clipPath>"
      "<g clip-path=\"url(#slice)\">\n");
  for (std::uint32_t pair = 0; pair < study.view.pair_count(); ++pair) {
    const CObstacle obstacle =
        make_c_obstacle(study.view, pair, pose_at(kFrom, Rotation::Identity()));
    tools::ConvexCell solid = tools::box_cell(Vector::Constant(-1), Vector::Constant(1));
    for (const CFace& face : obstacle.faces)
      solid = tools::cut(solid, face.normal, face.offset_m).below;
    const std::vector<Vector> slice = slice_of(solid, at);
    if (slice.size() >= 3) page.polygon(drawn(slice), "#b9bdb0", 1, "#8a8e80", 0.8, "c-obstacle");
  }
  for (std::size_t k = 0; k < field.cells.size(); ++k) {
    const std::vector<Vector> slice = slice_of(field.cells[k], at);
    if (slice.size() >= 3)
      page.polygon(drawn(slice), field_colour(field.value[k]), 1, "#ffffff", 0.5, "cell");
  }
  for (std::size_t k = 0; k < field.cells.size(); ++k) {
    const std::vector<Vector> slice = slice_of(field.cells[k], at);
    if (tools::area_m2(slice) < 0.3 * field.pitch_m * field.pitch_m) continue;
    Vector middle = Vector::Zero();
    for (const Vector& x : slice) middle += x / static_cast<double>(slice.size());
    Vector along = field.descent[k];
    along.y() = 0;
    along *= 0.33 * field.pitch_m;
    page.arrow(camera.project(middle - along), camera.project(middle + along), "#4a5a60", 0.8);
  }
  for (const Guide& guide : study.guides) {
    const bool harmonic = &guide == &study.guides[1];
    std::vector<Pixel> way;
    for (const tools::PlanPose& pose : guide.plan.poses)
      way.push_back(camera.project(tools::place_of(pose)));
    page.raw(polyline_of(way, harmonic ? kGuideColour : "#303030", harmonic ? 2.6 : 1.4,
                         harmonic ? "" : "5 4"));
  }
  page.raw("</g>\n");
  page.dot(camera.project(kFrom), 5, kPointColour);
  page.label({camera.project(kFrom).x - 8, camera.project(kFrom).y - 10}, "start", kPointColour, 13,
             "end");
  page.dot(camera.project(kGoal), 5, kPointColour);
  page.label({camera.project(kGoal).x, camera.project(kGoal).y + 20}, "goal", kPointColour, 13,
             "middle");
  page.line(camera.project(now.felt), camera.project(now.device), "#7a5a00", 1.6, true);
  page.dot(camera.project(now.device), 4, "#7a5a00");
  page.label({camera.project(now.device).x + 8, camera.project(now.device).y + 16}, "device (HIP)",
             "#7a5a00");
  draw_forces(page, camera, now, 0.011);
  page.dot(camera.project(now.felt), 4.5, kPointColour);
  page.end_group();
}

std::string picture(const Study& study, const Instant& now) {
  SvgPage page(1110, 760, "Contact force and guidance force of an assembly task in C-space");
  draw_loop(page);
  draw_physical(page, now);
  draw_c_space(page, study, now);
  page.begin_group("key");
  for (int k = 0; k < 40; ++k) {
    page.raw(rectangle_at({520 + 4.0 * k, 700}, 4.2, 12, field_colour(1 - k / 39.0)));
  }
  page.text(520, 728, "harmonic function: 1 at the start", "start", 12);
  page.text(684, 710, "0 at the goal; arrows: its descent", "start", 12);
  page.line({890, 706}, {925, 706}, kGuideColour, 2.6);
  page.text(932, 710, "down the function", "start", 12);
  page.line({890, 724}, {925, 724}, "#303030", 1.4, true);
  page.text(932, 728, "shortest of the C-faces", "start", 12);
  page.text(40, 710, "on the plan: " + now.place, "start", 13);
  std::string felt = to_text(now.situation);
  std::replace(felt.begin(), felt.end(), '_', '-');
  page.text(40, 730, "felt: " + felt + "; grey: C-obstacles", "start", 12);
  page.end_group();
  return page.finish();
}

}  // namespace

PartReport guidance_part() {
  const Study study = make_study();
  const Guide& harmonic = study.guides[1];
  const Instant now = make_instant(study, harmonic);
  PartReport report;
  report.title = "Contact force and guidance force (Fig. 1, and its reference [14])";
  bool falls = true;
  for (std::size_t k = 0; k < study.field.cells.size(); ++k) {
    falls = falls && study.field.value[k] > -1e-9 && study.field.value[k] < 1 + 1e-9;
  }
  bool proved = true;
  for (const Guide& guide : study.guides) proved = proved && guide.proof.holds();
  // The hand presses against +x, so contact pushes back; the plan leads down, and off the wall.
  const bool forces = now.contact_n.x() < -0.5 && now.guide_n.z() < 0 && now.guide_n.x() <= 0 &&
                      now.guide_n.norm() > 0.5 &&
                      now.guide_n.norm() <= tools::kDefaultPull_n + tools::kDefaultHold_n &&
                      now.state == GuideState::kOn;
  report.passed = falls && proved && forces && now.same_bits;
  report.markdown =
      "A peg is led into its hole without turning. The cells of the free places are cut along the "
      "C-faces of all pairs, those about the shortest motion are cut finer (" +
      std::to_string(study.field.cells.size()) + " cells of " +
      fixed(1e3 * study.field.pitch_m, 2) + " mm), and Laplace's equation is solved over them (" +
      std::to_string(study.field.rounds) +
      " rounds): 1 at the start, 0 at the goal, no flow through C-faces. The descent is a plan "
      "like "
      "any other: each step is proved, its stations lead the hand.\n\n" +
      picture_line("fig1.svg", "Contact force and guidance force in both spaces") + "\n" +
      table_head({"guide", "length (mm)", "steps proved", "mean clearance (mm)",
                  "a hand that yields is there after (s)", "contact on its way (N)"});
  for (const Guide& guide : study.guides) {
    report.markdown += table_row(
        {guide.name, fixed(1e3 * guide.plan.stations.front().cost_to_go_m, 2),
         std::to_string(guide.proof.certified) + " of " + std::to_string(guide.proof.steps),
         fixed(1e3 * guide.mean_clearance_m, 2),
         guide.ticks > 0 ? fixed(1e-3 * static_cast<double>(guide.ticks), 2) : "never",
         fixed(guide.most_contact_n, 2)});
  }
  report.findings.push_back(
      {"Fig. 1, forces fed to the user", "contact force and guidance force, from C-space",
       "contact " + fixed(now.contact_n.norm(), 2) + " N, guidance " +
           fixed(now.guide_n.norm(), 2) +
           " N at one tick; contact has the same bits without a guide",
       yes_or_no(forces && now.same_bits), "the paper's is a diagram; it prints no numbers"});
  report.findings.push_back(
      {"[14], harmonic function in a channel of cells", "field that guides the user",
       std::to_string(study.field.cells.size()) + " cells, walls exact; its plan has " +
           std::to_string(harmonic.proof.certified) + " of " +
           std::to_string(harmonic.proof.steps) + " steps proved",
       yes_or_no(falls && harmonic.proof.holds()),
       "translations; the function that leads into the channel is left out"});
  report.files = {{"fig1.svg", picture(study, now)}};
  return report;
}

}  // namespace haptic::sim
