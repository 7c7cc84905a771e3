// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/exploded_svg.hpp"

#include <algorithm>
#include <cmath>

#include "tools/common/formatted.hpp"
#include "tools/common/svg.hpp"
#include "tools/scene_facts/coupling_text.hpp"
#include "tools/scene_inspect/exploded_obj.hpp"
#include "tools/scene_inspect/isometric.hpp"

namespace haptic::tools {
namespace {

constexpr double kPanelWidth = 620, kPanelHeight = 520, kTop = 64, kMargin = 24;
constexpr double kRow = 18;
constexpr std::size_t kLegendRows = 12, kLegendColumns = 2;

bool sees(const Isometric& view, const ExplodedFace& face) {
  return vec::dot(face.normal, view.viewer) > 1e-9;
}

/// Fits the body into its panel.
Isometric fitted(const ExplodedBody& body, double left) {
  std::vector<Point3> points;
  for (const ExplodedPiece& piece : body.pieces) {
    for (const ExplodedFace& face : piece.faces) {
      points.insert(points.end(), face.loop.begin(), face.loop.end());
    }
  }
  return fitted_view(points, {left + kMargin, kTop + 40}, kPanelWidth - 2 * kMargin,
                     kPanelHeight - 90);
}

/// One face: on the surface in the piece's colour, inside the part pale and hatched.
std::string face_svg(const Isometric& view, const ExplodedPiece& piece, const ExplodedFace& face) {
  const std::string fill = rgb(piece_colour(piece.number), shade_of(face.normal));
  const Polygon2 outline = view.at(face.loop);
  const std::string edge = "stroke=\"#222\" stroke-width=\"1\" stroke-linejoin=\"round\"";
  if (face.kind == FaceKind::kOpen) return polygon_of(outline, "fill=\"" + fill + "\" " + edge);
  std::string svg = polygon_of(outline, "fill=\"#fdf1e7\"") +
                    polygon_of(outline, "class=\"seam\" fill=\"url(#seam)\"");
  for (const auto& open : face.open) {
    svg += polygon_of(view.at(open),
                      "fill=\"" + fill + "\" stroke=\"" + fill + "\" stroke-width=\"0.6\"");
  }
  return svg + polygon_of(outline, "fill=\"none\" " + edge);
}

/// Faces that the viewer sees, piece after piece in the order of painting.
struct PaintedFace {
  std::size_t painted = 0;  ///< place of its piece in that order
  Polygon2 polygon;
};

/// The numbers of the pieces, each where a face of the piece can be seen; a piece that others cover
/// as a whole has none.
/// @param shown  by number of the piece: set where it has one.
std::string numbers_svg(const std::vector<const ExplodedPiece*>& painted, const Isometric& view,
                        std::vector<bool>& shown) {
  std::vector<PaintedFace> faces;
  for (std::size_t i = 0; i < painted.size(); ++i) {
    for (const ExplodedFace& face : painted[i]->faces) {
      if (sees(view, face)) faces.push_back({i, view.at(face.loop)});
    }
  }
  std::string svg;
  for (std::size_t i = 0; i < painted.size(); ++i) {
    const Pixel* best = nullptr;
    Pixel place;
    double room = 0.0;
    for (const PaintedFace& face : faces) {
      if (face.painted != i || area_of(face.polygon) <= 0.0) continue;
      const Pixel middle = middle_of(face.polygon);
      for (std::size_t k = 0; k <= 2 * face.polygon.size(); ++k) {
        // The middle of the face, then points halfway and most of the way to its corners.
        const Pixel& corner = face.polygon[k % face.polygon.size()];
        const double share = k == 2 * face.polygon.size() ? 0.0
                             : k < face.polygon.size()    ? 0.5
                                                          : 0.75;
        const Pixel p{middle.x + share * (corner.x - middle.x),
                      middle.y + share * (corner.y - middle.y)};
        double free = distance_to(face.polygon, p);
        for (const PaintedFace& other : faces) {
          if (other.painted <= i) continue;
          free = holds(other.polygon, p) ? 0.0 : std::min(free, distance_to(other.polygon, p));
        }
        if (free <= room) continue;
        room = free;
        place = p;
        best = &place;
      }
    }
    if (best == nullptr || room < 3.0) continue;
    shown[painted[i]->number] = true;
    const int size = std::clamp(static_cast<int>(std::lround(1.5 * room)), 9, 18);
    svg +=
        text_at(place.x, place.y + 0.35 * size, std::to_string(painted[i]->number), "middle", size,
                "font-weight=\"bold\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\"");
  }
  return svg;
}

std::string legend_svg(const ExplodedBody& body, const std::vector<bool>& shown, double left) {
  std::string svg;
  const std::size_t room = kLegendRows * kLegendColumns;
  const std::size_t rows = body.pieces.size() > room ? room - 1 : body.pieces.size();
  for (std::size_t i = 0; i <= rows; ++i) {
    const double x =
        left + kMargin +
        static_cast<double>(i / kLegendRows) * (kPanelWidth - kMargin) / kLegendColumns;
    const double y = kTop + kPanelHeight + 16 + static_cast<double>(i % kLegendRows) * kRow;
    if (i == rows) {
      if (rows == body.pieces.size()) break;
      svg += text_at(x, y, "... and " + std::to_string(body.pieces.size() - rows) + " more pieces",
                     "start", 12);
      break;
    }
    const ExplodedPiece& p = body.pieces[i];
    svg += rectangle_at({x, y - 10}, 14, 12, rgb(piece_colour(p.number), 1.0), "stroke=\"#222\"");
    std::string row = formatted("%u: %u vertices, %u edges, %zu faces", p.number, p.vertices,
                                p.edges, p.faces.size());
    if (p.seams > 0) row += formatted(", %zu hidden", p.seams);
    if (p.partly_covered > 0) row += formatted(", %zu in part", p.partly_covered);
    if (!shown[p.number]) row += "; behind others";
    svg += text_at(x + 20, y, row, "start", 12);
  }
  return svg;
}

std::string body_svg(const ExplodedBody& body, double left) {
  const Isometric view = fitted(body, left);
  std::vector<const ExplodedPiece*> painted;
  for (const std::size_t i : painting_order(body.pieces, view.viewer)) {
    painted.push_back(&body.pieces[i]);
  }
  const std::size_t count = body.pieces.size();
  std::string svg = text_at(left + kMargin, kTop + 16,
                            std::string(body.moving ? "moving: " : "static: ") + body.name + ", " +
                                std::to_string(count) + (count == 1 ? " piece" : " pieces"),
                            "start", 15);
  for (const ExplodedPiece* const piece : painted) {
    svg += "<g class=\"piece\">\n";
    for (const ExplodedFace& face : piece->faces) {
      if (sees(view, face)) svg += face_svg(view, *piece, face);
    }
    svg += "</g>\n";
  }
  std::vector<bool> shown(count, false);
  svg += numbers_svg(painted, view, shown);
  return svg + scale_svg(view, {left + kMargin, kTop + kPanelHeight - 14}, kPanelWidth / 5) +
         legend_svg(body, shown, left);
}

}  // namespace

std::string exploded_svg(const std::string& scene, const std::vector<ExplodedBody>& bodies,
                         double factor) {
  std::size_t rows = 1;
  for (const ExplodedBody& body : bodies) {
    rows = std::max(rows, std::min(kLegendRows, body.pieces.size()));
  }
  const double width = kPanelWidth * static_cast<double>(bodies.size());
  const double height = kTop + kPanelHeight + 24 + kRow * static_cast<double>(rows);
  std::string svg = seam_pattern(kSeamColour);
  svg += heading_at(kMargin, 26, scene);
  svg += rectangle_at({kMargin, 36}, 26, 14, "url(#seam)", "stroke=\"#222\"");
  svg +=
      text_at(kMargin + 34, 48,
              formatted("seam: inside the part, no contact. Pieces pushed apart by %.3g of their "
                        "way from the middle; seen from (1, -1, 1), z upward; each part to its "
                        "own scale.",
                        factor),
              "start", 12);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    svg += body_svg(bodies[b], kPanelWidth * static_cast<double>(b));
  }
  return svg_document(width, height, svg);
}

}  // namespace haptic::tools
