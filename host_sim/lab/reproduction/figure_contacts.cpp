// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/reproduction/figure_contacts.hpp"

#include <algorithm>

namespace haptic::sim {
namespace {

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
