// SPDX-License-Identifier: Apache-2.0
#include "tools/scene_inspect/exploded_view.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <map>

namespace haptic::tools {
namespace {

Point3 to_point(const double* x) { return {x[0], x[1], x[2]}; }

std::vector<Point3> shifted(const std::vector<Point3>& points, const Point3& shift) {
  std::vector<Point3> result;
  for (const Point3& p : points) result.push_back(vec::add(p, shift));
  return result;
}

ExplodedPiece exploded_piece(const PieceView& view, const PieceExposure& exposure,
                             const Point3& shift) {
  ExplodedPiece piece;
  for (std::uint32_t f = 0; f < view.face_count; ++f) {
    ExplodedFace& face = piece.faces.emplace_back();
    for (const std::uint16_t v : view.face_vertices(f)) {
      const auto x = view.vertex(v);
      face.loop.push_back(vec::add(
          {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])},
          shift));
      piece.box.include(face.loop.back());
    }
    if (exposure.face_hidden[f]) {
      face.kind = FaceKind::kSeam;
    } else if (!exposure.face_fragments[f].empty()) {
      face.kind = FaceKind::kPartlyCovered;
      for (const FragmentPolygon& open : exposure.face_fragments[f]) {
        face.open.push_back(shifted(open, shift));
      }
    }
  }
  return piece;
}

/// Centre of volume of the pieces, each taken at its middle; of facets, which have no volume, the
/// mean of their middles.
Point3 centre_of(const SceneView& view, const BodyRecord& body) {
  Point3 sum{0, 0, 0};
  double total = 0.0;
  for (std::uint32_t i = 0; i < body.piece_count; ++i) {
    const PieceRecord& piece = view.pieces()[body.piece_begin + i];
    const double weight = body.volume_m3 > 0 ? piece.volume_m3 : 1.0;
    sum = vec::add(sum, vec::scaled(to_point(piece.centre_m), weight));
    total += weight;
  }
  return vec::scaled(sum, 1.0 / total);
}

/// Names in OBJ end at a blank.
std::string one_word(const std::string& name) {
  std::string word = name;
  for (char& c : word) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) == 0 && c != '.' && c != '-' && byte < 128) c = '_';
    if (byte >= 128) c = '_';
  }
  return word.empty() ? "body" : word;
}

/// Static bodies stand in W; the moving one is lifted above them, by a fifth of its height.
Point3 placement(const std::vector<ExplodedBody>& bodies, std::size_t index) {
  const ExplodedBody& body = bodies[index];
  if (!body.moving) return body.reference_m;
  vec::Box statics;
  for (const ExplodedBody& other : bodies) {
    if (other.moving) continue;
    statics.include(vec::add(other.box.low, other.reference_m));
    statics.include(vec::add(other.box.high, other.reference_m));
  }
  const double height = body.box.high[2] - body.box.low[2];
  Point3 shift{};
  for (std::size_t k = 0; k < 2; ++k) {
    shift[k] = (statics.low[k] + statics.high[k] - body.box.low[k] - body.box.high[k]) / 2;
  }
  shift[2] = statics.high[2] - body.box.low[2] + 0.2 * height;
  return shift;
}

void add_piece(std::string& text, const ExplodedPiece& piece, const Point3& shift,
               std::size_t& vertices) {
  std::map<Point3, std::size_t> numbers;
  std::string faces;
  std::string material;
  for (const ExplodedFace& face : piece.faces) {
    const std::string wanted =
        face.kind == FaceKind::kSeam ? "seam" : "piece_" + std::to_string(piece.number);
    if (wanted != material) faces += "usemtl " + wanted + "\n";
    material = wanted;
    faces += "f";
    for (const Point3& p : face.loop) {
      const auto [at, added] = numbers.emplace(p, vertices + 1);
      if (added) {
        char line[96];
        const Point3 q = vec::add(p, shift);
        std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", q[0], q[1], q[2]);
        text += line;
        vertices += 1;
      }
      faces += " " + std::to_string(at->second);
    }
    faces += "\n";
  }
  text += faces;
}

}  // namespace

std::vector<ExplodedBody> exploded_bodies(const SceneView& view,
                                          const std::vector<PieceExposure>& exposure,
                                          double factor) {
  std::vector<ExplodedBody> bodies;
  for (std::uint32_t b = 0; b < view.bodies().size(); ++b) {
    const BodyRecord& record = view.bodies()[b];
    ExplodedBody& body = bodies.emplace_back();
    body.name = view.text(record.name_offset, record.name_bytes);
    body.moving = b == 0;
    body.reference_m = to_point(record.reference_m);
    const Point3 centre = centre_of(view, record);
    for (std::uint32_t i = 0; i < record.piece_count; ++i) {
      const std::uint32_t index = record.piece_begin + i;
      const Point3 middle = to_point(view.pieces()[index].centre_m);
      const Point3 shift = vec::scaled(vec::sub(middle, centre), factor);
      body.pieces.push_back(exploded_piece(view.piece(index), exposure[index], shift));
      body.pieces.back().number = i;
      body.box.include(body.pieces.back().box.low);
      body.box.include(body.pieces.back().box.high);
    }
  }
  return bodies;
}

std::string material_line(const std::string& name, const std::array<double, 3>& colour) {
  char text[160];
  std::snprintf(text, sizeof text,
                "newmtl %s\nKa %.3f %.3f %.3f\nKd %.3f %.3f %.3f\nd 1\nillum 1\n", name.c_str(),
                colour[0], colour[1], colour[2], colour[0], colour[1], colour[2]);
  return text;
}

std::array<double, 3> piece_colour(std::uint32_t number) {
  static constexpr std::array<double, 3> kColours[] = {
      {0.36, 0.58, 0.80}, {0.45, 0.71, 0.48}, {0.88, 0.76, 0.36}, {0.66, 0.53, 0.76},
      {0.40, 0.72, 0.74}, {0.80, 0.56, 0.63}, {0.62, 0.64, 0.40}, {0.55, 0.60, 0.68},
      {0.72, 0.62, 0.50}, {0.48, 0.50, 0.78}, {0.60, 0.80, 0.62}, {0.83, 0.68, 0.80}};
  return kColours[number % std::size(kColours)];
}

std::string exploded_obj(const std::vector<ExplodedBody>& bodies,
                         const std::string& material_file) {
  std::string text =
      "# Convex pieces of a compiled scene, pushed apart; metres. Material 'seam': faces inside a "
      "part.\nmtllib " +
      material_file + "\n";
  std::size_t vertices = 0;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ExplodedBody& body = bodies[b];
    const std::string name =
        (body.moving ? "moving_" : "static" + std::to_string(b) + "_") + one_word(body.name);
    const Point3 shift = placement(bodies, b);
    text += "o " + name + "\n";
    for (const ExplodedPiece& piece : body.pieces) {
      text += "g " + name + "_piece_" + std::to_string(piece.number) + "\n";
      add_piece(text, piece, shift, vertices);
    }
  }
  return text;
}

std::string exploded_mtl(const std::vector<ExplodedBody>& bodies) {
  std::size_t most = 0;
  for (const ExplodedBody& body : bodies) most = std::max(most, body.pieces.size());
  std::string text = "# Colours of the exploded view.\n" + material_line("seam", kSeamColour);
  for (std::uint32_t i = 0; i < most; ++i) {
    text += material_line("piece_" + std::to_string(i), piece_colour(i));
  }
  return text;
}

}  // namespace haptic::tools
