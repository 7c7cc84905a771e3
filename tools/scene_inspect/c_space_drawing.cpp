// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/common/formatted.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_inspect/c_space_view.hpp"
#include "tools/scene_inspect/exploded_view.hpp"
#include "tools/scene_inspect/isometric.hpp"

namespace haptic::tools {
namespace {

constexpr double kSheetWidth = 980, kSheetHeight = 640, kSheetTop = 92, kSheetMargin = 24,
                 kSheetRow = 18;

/// Types A, B and C, and several in one plane; the colours of the page.
constexpr std::array<std::array<double, 3>, 4> kTypeColours{
    {{0.902, 0.624, 0.0}, {0.337, 0.706, 0.914}, {0.0, 0.62, 0.451}, {0.725, 0.651, 0.788}}};
constexpr const char* kTypeNames[4] = {"type_A", "type_B", "type_C", "several_types"};
constexpr const char* kTypeTexts[4] = {"A: face of the part, vertex", "B: vertex of the part, face",
                                       "C: edge, edge", "several types in one plane"};

std::size_t kind_of(const DrawnObstacle& drawn, const CFace& face) {
  const ContactType first = drawn.contacts[face.nodes.front()].type;
  const bool one = std::ranges::all_of(
      face.nodes, [&](std::uint32_t node) { return drawn.contacts[node].type == first; });
  return one ? static_cast<std::size_t>(first) : 3;
}

Point3 point3(const Vector& v) { return {v[0], v[1], v[2]}; }

std::vector<Point3> loop_of(const CFace& face) {
  std::vector<Point3> loop;
  for (const Vector& corner : face.polygon) loop.push_back(point3(corner));
  return loop;
}

/// True if the way from the point to the viewer leads through the obstacle: between the planes
/// where it enters and those where it leaves.
bool covers(const DrawnObstacle& drawn, const Vector& point, const Vector& viewer) {
  double in = 0, out = HUGE_VAL;
  for (const CFace& face : drawn.obstacle.faces) {
    const double height = face.normal.dot(point) - face.offset_m, speed = face.normal.dot(viewer);
    if (std::abs(speed) < 1e-12) {
      if (height >= 0) return false;
    } else if (speed < 0) {
      in = std::max(in, height / -speed);
    } else {
      out = std::min(out, -height / speed);
    }
  }
  return in < out;
}

struct Painted {
  double nearness = 0;
  const DrawnObstacle* drawn = nullptr;
  const CFace* face = nullptr;
  bool clear = false;
  Polygon2 polygon;
};

std::vector<Painted> painted_faces(const CSpaceView& space, const Isometric& view) {
  const Vector viewer(view.viewer[0], view.viewer[1], view.viewer[2]);
  std::vector<Painted> faces;
  for (const DrawnObstacle& drawn : space.obstacles) {
    const bool clear = covers(drawn, space.point, viewer);
    for (const CFace& face : drawn.obstacle.faces) {
      if (face.polygon.size() < 3 || face.normal.dot(viewer) <= 1e-9) continue;
      double sum = 0;
      for (const Vector& corner : face.polygon) sum += viewer.dot(corner);
      faces.push_back({sum / static_cast<double>(face.polygon.size()), &drawn, &face, clear,
                       view.at(loop_of(face))});
    }
  }
  // Transparent faces come last: they lie over the point.
  std::stable_sort(faces.begin(), faces.end(), [](const Painted& l, const Painted& r) {
    return l.clear != r.clear ? r.clear : l.nearness < r.nearness;
  });
  return faces;
}

std::string face_svg(const Painted& painted) {
  const CFace& face = *painted.face;
  const std::string fill =
      rgb(kTypeColours[kind_of(*painted.drawn, face)], shade_of(point3(face.normal)));
  const std::string edge =
      std::string("stroke=\"#222\" stroke-linejoin=\"round\" stroke-width=\"1\"") +
      (face.hidden ? " stroke-dasharray=\"5 3\"" : "");
  const char* part = face.hidden ? "class=\"c-face hidden\"" : "class=\"c-face\"";
  std::string svg = polygon_of(
      painted.polygon, formatted("%s fill=\"%s\" fill-opacity=\"%s\" %s", part, fill.c_str(),
                                 painted.clear ? "0.1" : "0.9", edge.c_str()));
  if (face.hidden && !painted.clear)
    svg += polygon_of(painted.polygon, "class=\"seam\" fill=\"url(#seam)\" fill-opacity=\"0.7\"");
  return svg;
}

/// "44", or "44+2" where three basic contacts share the face.
std::string number_of(const CFace& face) {
  std::string text = std::to_string(face.nodes.front());
  if (face.nodes.size() > 1) text += "+" + std::to_string(face.nodes.size() - 1);
  return text;
}

/// The number of a face where it has room, over what was painted before.
std::string numbers_svg(const std::vector<Painted>& faces) {
  std::string svg;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (faces[i].clear) continue;
    const Pixel middle = middle_of(faces[i].polygon);
    double room = 0;
    Pixel place;
    for (const Pixel& corner : faces[i].polygon) {
      for (const double share : {0.0, 0.5}) {
        const Pixel p{middle.x + share * (corner.x - middle.x),
                      middle.y + share * (corner.y - middle.y)};
        double free = distance_to(faces[i].polygon, p);
        for (std::size_t k = i + 1; k < faces.size(); ++k) {
          if (!faces[k].clear && holds(faces[k].polygon, p)) free = 0;
        }
        if (free > room) {
          room = free;
          place = p;
        }
      }
    }
    const std::string number = number_of(*faces[i].face);
    const double needed = 3.2 * static_cast<double>(number.size());
    if (room < needed) continue;
    const int size = std::clamp(static_cast<int>(std::lround(11 * room / needed)), 10, 15);
    svg += text_at(place.x, place.y + 0.35 * size, number, "middle", size,
                   "stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\"");
  }
  return svg;
}

std::string key_svg() {
  std::string svg;
  double x = kSheetMargin;
  for (std::size_t k = 0; k < kTypeColours.size(); ++k) {
    svg += rectangle_at({x, 36}, 18, 14, rgb(kTypeColours[k], 1.0), "stroke=\"#222\"") +
           text_at(x + 24, 48, kTypeTexts[k], "start", 12);
    x += 210;
  }
  svg += rectangle_at({kSheetMargin, 58}, 18, 14, "url(#seam)",
                      "stroke=\"#222\" stroke-dasharray=\"5 3\"") +
         text_at(kSheetMargin + 24, 70,
                 "hidden: the part goes on behind it, no force. Numbers: of a basic contact of the "
                 "face, + how many more. Outlines: in front of the point.",
                 "start", 12);
  return svg;
}

std::string axes_words(const CSpaceView& space) {
  return space.axes.empty() ? "" : ", " + space.a + " in the axes of '" + space.axes + "'";
}

std::string pair_row(const CSpaceView& space, const DrawnObstacle& d) {
  return formatted("pair %llu: piece %u of %s, piece %u of ",
                   static_cast<unsigned long long>(d.pair), d.piece_a, space.a.c_str(), d.piece_b) +
         d.body +
         formatted(": %zu of %zu basic contacts applicable, %zu faces, %zu hidden; %s ",
                   d.applicable, d.contacts.size(), d.obstacle.faces.size(), d.hidden_faces,
                   d.distance_m < 0 ? "overlap" : "plane at") +
         short_length(std::abs(d.distance_m));
}

}  // namespace

std::string c_space_svg(const CSpaceView& space) {
  std::vector<Point3> points{point3(space.point)};
  for (const DrawnObstacle& drawn : space.obstacles) {
    for (const CFace& face : drawn.obstacle.faces) {
      for (const Vector& corner : face.polygon) points.push_back(point3(corner));
    }
  }
  const Isometric view = fitted_view(points, {kSheetMargin, kSheetTop},
                                     kSheetWidth - 2 * kSheetMargin, kSheetHeight - kSheetMargin);
  std::string svg =
      seam_pattern(kSeamColour) +
      heading_at(kSheetMargin, 26, "C-space at one pose: " + space.scene + axes_words(space)) +
      key_svg();
  const std::vector<Painted> faces = painted_faces(space, view);
  const auto first_clear =
      std::ranges::find_if(faces, [](const Painted& face) { return face.clear; });
  for (auto face = faces.begin(); face != first_clear; ++face) svg += face_svg(*face);
  svg += numbers_svg(faces);
  for (auto face = first_clear; face != faces.end(); ++face) svg += face_svg(*face);
  const Pixel point = view.at(point3(space.point));
  svg += formatted(
      "<circle class=\"point\" cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"#c2187f\" stroke=\"#fff\" "
      "stroke-width=\"1.5\"/>\n",
      point.x, point.y);
  svg += text_at(point.x + 9, point.y + 5, space.a, "start", 13,
                 "font-weight=\"bold\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\"");
  svg += scale_svg(view, {kSheetMargin, kSheetTop + kSheetHeight - 4}, kSheetWidth / 8);
  double y = kSheetTop + kSheetHeight + 24;
  for (const DrawnObstacle& drawn : space.obstacles) {
    svg += text_at(kSheetMargin, y, pair_row(space, drawn), "start", 12);
    y += kSheetRow;
  }
  const std::size_t left_out = space.pairs - space.obstacles.size();
  if (left_out > 0) {
    svg += text_at(kSheetMargin, y, std::to_string(left_out) + " pairs are not drawn", "start", 12);
    y += kSheetRow;
  }
  return svg_document(kSheetWidth, y, svg);
}

std::string c_space_obj(const CSpaceView& space, const std::string& material_file) {
  std::string text = "# C-obstacles of a compiled scene at one pose, in " +
                     (space.axes.empty() ? std::string("W") : "the axes of " + space.axes) +
                     "; metres.\nmtllib " + material_file + "\n";
  append_line(text, "o the_part\nv %.9g %.9g %.9g\np 1", space.point[0], space.point[1],
              space.point[2]);
  std::size_t vertices = 1;
  for (const DrawnObstacle& drawn : space.obstacles) {
    append_line(text, "o pair_%llu\ng pair_%llu_part_%u_static_%u",
                static_cast<unsigned long long>(drawn.pair),
                static_cast<unsigned long long>(drawn.pair), drawn.piece_a, drawn.piece_b);
    for (const CFace& face : drawn.obstacle.faces) {
      if (face.polygon.size() < 3) continue;
      text += "# nodes";
      for (const std::uint32_t node : face.nodes) text += " " + std::to_string(node);
      text += std::string("\nusemtl ") + kTypeNames[kind_of(drawn, face)] +
              (face.hidden ? "_hidden" : "") + "\n";
      std::string loop = "f";
      for (const Vector& corner : face.polygon) {
        append_line(text, "v %.9g %.9g %.9g", corner[0], corner[1], corner[2]);
        vertices += 1;
        loop += " " + std::to_string(vertices);
      }
      text += loop + "\n";
    }
  }
  return text;
}

std::string c_space_mtl() {
  std::string text = "# Colours of the C-obstacles: the type of a face's basic contacts.\n";
  for (std::size_t k = 0; k < kTypeColours.size(); ++k) {
    std::array<double, 3> pale = kTypeColours[k];
    for (double& c : pale) c = 0.5 + 0.5 * c;
    text += material_line(kTypeNames[k], kTypeColours[k]) +
            material_line(std::string(kTypeNames[k]) + "_hidden", pale);
  }
  return text;
}

}  // namespace haptic::tools
