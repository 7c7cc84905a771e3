// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/studies/reproduction/figures.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

namespace {

constexpr double kStiffness = 1000.0, kEpsilon_m = 1e-4;

Vector nearest_on(const Vector& from, const Vector& to, const Vector& p) {
  const Vector side = to - from;
  return from + std::clamp(side.dot(p - from) / side.squaredNorm(), 0.0, 1.0) * side;
}

/// Basic contacts of the last tick as application points; contacts of one point are one
/// (rt_core/METHOD.md section 6, row 9).
void collect_points(CoreSession& session, ContactScene& scene) {
  FlatPair flat(session.view(), 0);
  flat.place(place_moving(session.view(), pose_at(scene.x, Rotation::Identity())));
  const PairView pair = session.view().pair(0);
  const double* r = session.view().bodies()[pair.b.record->body].reference_m;
  for (const std::uint32_t node : contact_nodes(session.core(), 0)) {
    Point n{}, app{};
    flat.contact(node, n, app);
    const Vector at = vector_of(app) + Vector(r[0], r[1], r[2]);
    scene.normal = vector_of(n);
    const char type = "ABC"[static_cast<std::size_t>(contact_type(pair.record, node))];
    const auto known = std::find_if(
        scene.points.begin(), scene.points.end(),
        [&](const ApplicationPoint& p) { return (p.app_w - at).norm() <= kEpsilon_m; });
    if (known == scene.points.end()) {
      scene.points.push_back({{node}, std::string(1, type), at, Vector::Zero()});
    } else {
      known->nodes.push_back(node);
      known->types += type;
    }
  }
}

/// Contact frame: z along n, x along the contact edge or the edge of H nearest to pi; the sense of
/// x is the one that makes the torque about it positive, as in the paper's figures.
void set_frame(ContactScene& scene) {
  std::vector<Vector> points;
  for (const ApplicationPoint& p : scene.points) points.push_back(p.app_w);
  scene.region = planar_hull(points, scene.normal);
  scene.pi = scene.x - scene.normal * scene.normal.dot(scene.x - points.front());
  const std::size_t corners = scene.region.size();
  if (corners < 2) return;
  std::size_t nearest = 0;
  scene.pi_inside = corners > 2;
  for (std::size_t k = 0; k < corners; ++k) {
    const Vector &from = scene.region[k], &to = scene.region[(k + 1) % corners];
    const auto distance = [&](std::size_t side) {
      return (nearest_on(scene.region[side], scene.region[(side + 1) % corners], scene.pi) -
              scene.pi)
          .norm();
    };
    if (distance(k) < distance(nearest)) nearest = k;
    scene.pi_inside = scene.pi_inside && scene.normal.dot((to - from).cross(scene.pi - from)) >= 0;
  }
  const Vector &from = scene.region[nearest], &to = scene.region[(nearest + 1) % corners];
  scene.axis_x = (to - from).normalized();
  if (scene.axis_x.dot(scene.torque_nm) < 0) scene.axis_x = -scene.axis_x;
  scene.axis_y = scene.normal.cross(scene.axis_x);
  // Number the points round H, the two of the x edge first.
  const auto order = [&](const ApplicationPoint& p) {
    for (std::size_t k = 0; k < corners; ++k) {
      if ((scene.region[(nearest + k) % corners] - p.app_w).norm() <= kEpsilon_m) return k;
    }
    return corners;
  };
  std::stable_sort(
      scene.points.begin(), scene.points.end(),
      [&](const ApplicationPoint& l, const ApplicationPoint& r) { return order(l) < order(r); });
  for (ApplicationPoint& p : scene.points) {
    const Vector torque = scene.force_n.cross(scene.x - p.app_w);  // eq. (3)
    p.torque_frame = {scene.axis_x.dot(torque), scene.axis_y.dot(torque), scene.normal.dot(torque)};
  }
}

std::string triple(const Vector& v, double factor, int digits) {
  return "(" + fixed(factor * v[0], digits) + ", " + fixed(factor * v[1], digits) + ", " +
         fixed(factor * v[2], digits) + ")";
}

constexpr double kTolerance = HAPTIC_REAL_IS_FLOAT ? 2e-4 : 1e-10;

bool near_to(const Vector& got, double x, double y, double z) {
  return (got - Vector(x, y, z)).cwiseAbs().maxCoeff() < kTolerance;
}

/// Types of the scene's contacts, sorted: "ABCC".
std::string types_of(const ContactScene& scene) {
  std::string types;
  for (const ApplicationPoint& p : scene.points) types += p.types;
  std::sort(types.begin(), types.end());
  return types;
}

void write_lines(SvgPage& page, const ContactScene& scene, double x, double y) {
  for (const std::string& line : contact_lines(scene)) {
    page.text(x, y, line, "start", 13);
    y += 20;
  }
}

void write_key(SvgPage& page, double y, const std::string& force, const std::string& torque) {
  page.text(
      24, y,
      "A: translucent, B: solid. x, y, z: contact frame. Green: contact region H. Arrows: F " +
          force + ", torque " + torque + "; both on the hand about x0.",
      "start", 12, "fill=\"#505050\"");
}

std::string edge_face_picture(const ContactScene& scene) {
  SvgPage page(1040, 600, "Reaction force and torque at an edge-face contact, as Fig. 3");
  const Camera camera({0.75, -1.0, 0.75}, Vector::UnitZ(), {0.04, 0.0, 0.01}, {280, 315}, 1850);
  draw_contact(page, camera, scene, {0.03, 0.045, 2.0});
  write_lines(page, scene, 540, 120);
  write_key(page, 585, "45 mm per N", "2 m per N m");
  return page.finish();
}

std::string face_face_picture(const ContactScene& outside, const ContactScene& inside) {
  SvgPage page(1240, 760, "Reaction force and torque at a face-face contact, as Fig. 4");
  const Camera left({0.75, -0.9, 1.1}, Vector::UnitZ(), {0.03, -0.02, 0.02}, {290, 320}, 1800);
  draw_contact(page, left, outside, {0.026, 0.022, 0.6});
  const Camera right({0.75, -0.9, 1.1}, Vector::UnitZ(), {0.03, -0.02, 0.02}, {900, 320}, 1800);
  draw_contact(page, right, inside, {0.026, 0.022, 0.6});
  page.text(24, 58, "\u03c0(x0) outside H: torque about the nearest edge of H", "start", 14,
            "font-weight=\"bold\"");
  page.text(640, 58, "\u03c0(x0) inside H: no torque", "start", 14, "font-weight=\"bold\"");
  write_lines(page, outside, 24, 600);
  write_lines(page, inside, 640, 600);
  write_key(page, 745, "22 mm per N", "0.6 m per N m");
  return page.finish();
}

std::string table(const ContactScene& scene, const std::string& expected) {
  std::string text = table_head({"point", "type", "torque x (mN m)", "torque y (mN m)"});
  for (std::size_t k = 0; k < scene.points.size(); ++k) {
    const ApplicationPoint& p = scene.points[k];
    text += table_row({"App" + std::to_string(k + 1), p.types, fixed(1e3 * p.torque_frame[0], 2),
                       fixed(1e3 * p.torque_frame[1], 2)});
  }
  const auto three = [](const Vector& v, double factor) {
    return "(" + fixed(factor * v[0], 2) + ", " + fixed(factor * v[1], 2) + ", " +
           fixed(factor * v[2], 2) + ")";
  };
  return text + "\nF = " + three(scene.force_n, 1) + " N, torque = " + three(scene.torque_nm, 1e3) +
         " mN m in W; by hand: " + expected + ".\n\n";
}

}  // namespace

ContactScene touch(const Solid& a, const Solid& b, const Vector& x) {
  ContactScene scene;
  scene.a = a;
  scene.b = b;
  scene.x = x;
  const std::vector<std::byte> bytes = scene_of(a, {&b, 1}, kStiffness, kEpsilon_m);
  CoreSession session(bytes, a.name + " on " + b.name);
  StepInput input;
  input.report_goal_contact = true;
  input.pose_wa = pose_at(x, Rotation::Identity());
  const StepResult result = session.core().step(input);
  scene.situation = result.situation;
  scene.d_near_m = static_cast<double>(result.d_near_m);
  scene.force_n = result.wrench_w.force_w.cast<double>();
  scene.torque_nm = result.wrench_w.torque_w.cast<double>();
  collect_points(session, scene);
  if (!scene.points.empty()) set_frame(scene);
  return scene;
}

void draw_contact(SvgPage& page, const Camera& camera, const ContactScene& scene,
                  const ArrowScale& scale) {
  const std::vector<Facet> body_b = facets_of(scene.b, Vector::Zero(), Rotation::Identity());
  draw_body(page, camera, body_b, {165, 195, 225, 1.0, true, 1.2});
  const std::vector<Facet> body_a = facets_of(scene.a, scene.x, Rotation::Identity());
  draw_body(page, camera, body_a, {240, 190, 150, 0.30, true, 1.2});
  std::vector<Pixel> region;
  for (const Vector& p : scene.region) region.push_back(camera.project(p));
  if (region.size() > 2) page.polygon(region, kRegionColour, 0.45, kRegionColour, 2.5, "region");
  if (region.size() == 2) page.line(region[0], region[1], kRegionColour, 4);
  const Pixel pi = camera.project(scene.pi), x0 = camera.project(scene.x);
  page.line(x0, pi, "#606060", 1.2, true);
  page.dot(pi, 4, "#606060");
  page.label({pi.x - 9, pi.y + 5}, "\u03c0(x0)", "#404040", 13, "end");
  Vector middle = Vector::Zero();
  for (const ApplicationPoint& p : scene.points) middle += p.app_w;
  middle /= static_cast<double>(std::max<std::size_t>(1, scene.points.size()));
  const Pixel centre = camera.project(middle);
  for (std::size_t k = 0; k < scene.points.size(); ++k) {
    const Pixel at = camera.project(scene.points[k].app_w);
    page.dot(at, 5, kRegionColour);
    const bool left = at.x < centre.x;
    page.label({at.x + (left ? -9 : 9), at.y + (at.y < centre.y ? -7 : 17)},
               "App" + std::to_string(k + 1), kRegionColour, 13, left ? "end" : "start");
  }
  const struct {
    const Vector& along;
    const char* name;
  } axes[3] = {{scene.axis_x, "x"}, {scene.axis_y, "y"}, {scene.normal, "z"}};
  // With pi in H the axes in the plane have no part in the result.
  const std::size_t first_axis = scene.pi_inside ? 2 : 0;
  for (const auto& axis : std::span(axes).subspan(first_axis))
    draw_arrow(page, camera, scene.x, scale.axis_m * axis.along, "#404040", 1.4, "");
  draw_arrow(page, camera, scene.x, scale.force_m_per_n * scene.force_n, kForceColour, 3.5, "F");
  if (scene.torque_nm.norm() > 1e-9)
    draw_arrow(page, camera, scene.x, scale.torque_m_per_nm * scene.torque_nm, kTorqueColour, 3.5,
               "\u03c4");
  for (const auto& axis : std::span(axes).subspan(
           first_axis)) {  // next to the shaft: force and torque may lie along an axis
    const Pixel at = camera.project(scene.x + 0.75 * scale.axis_m * axis.along);
    const double dx = at.x - x0.x, dy = at.y - x0.y, length = std::hypot(dx, dy);
    page.label({at.x + 13 * dy / length, at.y - 13 * dx / length + 5}, axis.name, "#404040", 13,
               "middle");
  }
  page.dot(x0, 4.5, kPointColour);
  page.label({x0.x - 9, x0.y - 3}, "x0", kPointColour, 13, "end");
}

std::vector<std::string> contact_lines(const ContactScene& scene) {
  std::vector<std::string> lines;
  lines.push_back(std::string(to_text(scene.situation)) + ", " +
                  std::to_string(scene.points.size()) + " contacts, depth " +
                  fixed(-1e3 * scene.d_near_m, 2) + " mm");
  for (std::size_t k = 0; k < scene.points.size(); ++k) {
    const ApplicationPoint& p = scene.points[k];
    std::string type = p.types.substr(0, 1);
    lines.push_back("App" + std::to_string(k + 1) + " (type " + type + ") at " +
                    triple(p.app_w, 1e3, 1) + " mm: torque x " + fixed(1e3 * p.torque_frame[0], 1) +
                    ", y " + fixed(1e3 * p.torque_frame[1], 1) + " mN m");
  }
  lines.push_back("F = " + triple(scene.force_n, 1, 3) + " N");
  lines.push_back("torque = " + triple(scene.torque_nm, 1e3, 2) + " mN m (W axes)");
  return lines;
}

ContactScene edge_face_scene() {
  return touch(wedge_solid(), box_solid("box", {0, -0.1, -0.04}, {0.1, 0.1, 0}), {0.02, 0, 0.049});
}

ContactScene face_face_outside_scene() {
  return touch(centred_box("box", 0.05, 0.05, 0.05),
               box_solid("obstacle", {0.02, -0.12, -0.04}, {0.12, 0.01, 0}), {0, 0, 0.048});
}

ContactScene face_face_inside_scene() {
  return touch(centred_box("box", 0.05, 0.05, 0.05),
               box_solid("obstacle", {-0.02, -0.12, -0.04}, {0.12, 0.01, 0}), {0, 0, 0.048});
}

PartReport contacts_part() {
  const ContactScene edge = edge_face_scene(), outside = face_face_outside_scene(),
                     inside = face_face_inside_scene();
  PartReport report;
  report.title = "Force and torque at edge-face and face-face contacts (Figs. 3 and 4)";
  report.markdown = "k_F = 1000 N/m.\n\nEdge-face (Fig. 3):\n\n" +
                    table(edge, "F = (0, 0, 1) N, torque = (20, 0, 0) mN m") +
                    picture_line("fig3.svg", "Edge-face contact") +
                    "\nFace-face, pi(x0) outside H (Fig. 4 left):\n\n" +
                    table(outside, "F = (0, 0, 2) N, torque = (0, -70, 0) mN m") +
                    "Face-face, pi(x0) inside H (Fig. 4 right):\n\n" +
                    table(inside, "F = (0, 0, 2) N, no torque") +
                    picture_line("fig4.svg", "Face-face contacts");
  const bool edge_right = edge.situation == ContactSituation::kEdgeFace && types_of(edge) == "BC" &&
                          near_to(edge.force_n, 0, 0, 1) && near_to(edge.torque_nm, 0.02, 0, 0);
  const bool outside_right = outside.situation == ContactSituation::kFaceFace &&
                             types_of(outside) == "ABCC" && !outside.pi_inside &&
                             near_to(outside.force_n, 0, 0, 2) &&
                             near_to(outside.torque_nm, 0, -0.07, 0);
  const bool inside_right = inside.situation == ContactSituation::kFaceFace && inside.pi_inside &&
                            near_to(inside.force_n, 0, 0, 2) && near_to(inside.torque_nm, 0, 0, 0);
  report.passed = edge_right && outside_right && inside_right;
  const std::string geometry =
      "the paper prints no dimensions; ours can be derived by hand and agree";
  report.findings = {
      {"Fig. 3, edge-face: contacts and torque",
       "one type B, one type C; positive torque about x, none about y (individual signs differ)",
       "types " + types_of(edge) + "; torque x " + fixed(1e3 * edge.axis_x.dot(edge.torque_nm), 1) +
           ", y " + fixed(1e3 * edge.axis_y.dot(edge.torque_nm), 1) + " mN m",
       yes_or_no(edge_right), geometry},
      {"Fig. 4 left, face-face, pi(x0) outside H", "types A, B, C, C; torque about x, none about y",
       "types " + types_of(outside) + "; torque x " +
           fixed(1e3 * outside.axis_x.dot(outside.torque_nm), 1) + ", y " +
           fixed(1e3 * outside.axis_y.dot(outside.torque_nm), 1) + " mN m",
       yes_or_no(outside_right), geometry},
      {"Fig. 4 right, face-face, pi(x0) inside H", "zero torque",
       fixed(1e3 * inside.torque_nm.norm(), 1) + " mN m", yes_or_no(inside_right), ""}};
  report.files = {{"fig3.svg", edge_face_picture(edge)},
                  {"fig4.svg", face_face_picture(outside, inside)}};
  return report;
}

}  // namespace haptic::sim
