// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/strangers/drawn_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <stdexcept>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/simplify/face_triangles.hpp"

namespace haptic::sim {
namespace {

using std::numbers::pi;

double signed_area(const Outline& outline) {
  double twice = 0;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const PlanePoint &a = outline[k], &b = outline[(k + 1) % outline.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return twice / 2;
}

Outline turning(Outline outline, bool left) {
  if ((signed_area(outline) > 0) != left) std::ranges::reverse(outline);
  return outline;
}

bool holds(const Outline& outline, const PlanePoint& p) {
  bool odd = false;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const PlanePoint &a = outline[k], &b = outline[(k + 1) % outline.size()];
    if ((a[1] > p[1]) == (b[1] > p[1])) continue;
    if (p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1])) odd = !odd;
  }
  return odd;
}

/// How many others hold the outline.
std::size_t depth_of(const Outlines& all, std::size_t which) {
  std::size_t depth = 0;
  for (std::size_t k = 0; k < all.size(); ++k)
    depth += k != which && holds(all[k], all[which][0]) ? 1u : 0u;
  return depth;
}

Vector lifted(const PlanePoint& p, double z) { return {p[0], p[1], z}; }

void add_walls(DrawnMesh& mesh, const Layer& layer) {
  for (std::size_t k = 0; k < layer.below.size(); ++k) {
    const bool material_inside = depth_of(layer.below, k) % 2 == 0;
    Outline low = layer.below[k], high = layer.above[k];
    if ((signed_area(low) > 0) != material_inside) {
      std::ranges::reverse(low);
      std::ranges::reverse(high);
    }
    for (std::size_t i = 0; i < low.size(); ++i) {
      const std::size_t j = (i + 1) % low.size();
      const Vector a = lifted(low[i], layer.low_mm), b = lifted(low[j], layer.low_mm);
      const Vector c = lifted(high[j], layer.high_mm), d = lifted(high[i], layer.high_mm);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
}

/// Cuts every triangle with a corner of the outlines inside one of its sides, so that triangles
/// meet side to side.
void cut_at_corners(std::vector<tools::FaceTriangle>& triangles,
                    const std::vector<std::vector<tools::Point3>>& loops) {
  constexpr double kOnSide_mm = 1e-9;
  const auto on_side = [](const tools::Point3& p, const tools::Point3& a, const tools::Point3& b) {
    const double x = b[0] - a[0], y = b[1] - a[1], length = std::hypot(x, y);
    const double along = ((p[0] - a[0]) * x + (p[1] - a[1]) * y) / length;
    const double beside = ((p[1] - a[1]) * x - (p[0] - a[0]) * y) / length;
    return std::abs(beside) < kOnSide_mm && along > kOnSide_mm && along < length - kOnSide_mm;
  };
  for (const std::vector<tools::Point3>& loop : loops) {
    for (const tools::Point3& p : loop) {
      // Those that are appended have the corner at one of theirs.
      for (std::size_t t = 0, count = triangles.size(); t < count; ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
          const tools::FaceTriangle whole = triangles[t];
          if (!on_side(p, whole[k], whole[(k + 1) % 3])) continue;
          triangles[t] = {whole[k], p, whole[(k + 2) % 3]};
          triangles.push_back({p, whole[(k + 1) % 3], whole[(k + 2) % 3]});
          break;
        }
      }
    }
  }
}

/// The faces at a height where the outlines of what ends and of what begins differ: a place is part
/// of them where it is in the material of one side only, that is, where the outlines of both sides
/// together hold it an odd number of times.
void add_caps(DrawnMesh& mesh, double z, const Outlines& ending, const Outlines& beginning) {
  struct Border {
    const Outline* outline;
    bool ends;
  };
  std::vector<Border> borders;
  for (const Outline& o : ending)
    if (std::ranges::find(beginning, o) == beginning.end()) borders.push_back({&o, true});
  for (const Outline& o : beginning)
    if (std::ranges::find(ending, o) == ending.end()) borders.push_back({&o, false});
  const auto inside = [&](std::size_t k, std::size_t of) {
    return k != of && holds(*borders[of].outline, (*borders[k].outline)[0]);
  };
  std::vector<std::size_t> depth(borders.size(), 0);
  for (std::size_t k = 0; k < borders.size(); ++k)
    for (std::size_t of = 0; of < borders.size(); ++of) depth[k] += inside(k, of) ? 1u : 0u;
  for (std::size_t k = 0; k < borders.size(); ++k) {
    if (depth[k] % 2 != 0) continue;
    // Material that ends here looks up.
    bool up = borders[k].ends;
    for (std::size_t of = 0; of < borders.size(); ++of)
      if (inside(k, of) && borders[of].ends) up = !up;
    for (const Outline& shared : ending) {
      const bool kept = std::ranges::find(beginning, shared) != beginning.end();
      if (kept && holds(shared, (*borders[k].outline)[0])) up = !up;
    }
    std::vector<std::vector<tools::Point3>> loops;
    const auto add_loop = [&](const Outline& outline, bool left) {
      loops.emplace_back();
      for (const PlanePoint& p : turning(outline, left)) loops.back().push_back({p[0], p[1], z});
    };
    add_loop(*borders[k].outline, true);
    for (std::size_t hole = 0; hole < borders.size(); ++hole)
      if (inside(hole, k) && depth[hole] == depth[k] + 1) add_loop(*borders[hole].outline, false);
    std::vector<tools::FaceTriangle> cut;
    if (!tools::triangulate_face(loops, {0, 0, 1}, cut))
      throw std::logic_error(tools::formatted("outlines at %g mm enclose no area", z));
    cut_at_corners(cut, loops);
    for (const tools::FaceTriangle& t : cut) {
      const auto corner = [&](std::size_t i) { return Vector(t[i][0], t[i][1], t[i][2]); };
      mesh.triangles.push_back({corner(0), corner(up ? 1 : 2), corner(up ? 2 : 1)});
    }
  }
}

/// As the file has it: a float.
Vector rounded(const Vector& p) { return p.cast<float>().cast<double>(); }
std::array<float, 3> float_key(const Vector& p) {
  const Eigen::Vector3f f = p.cast<float>();
  return {f[0], f[1], f[2]};
}

}  // namespace

std::uint32_t facets_of(double radius_mm, double chord_mm) {
  const double half = std::acos(1 - std::min(chord_mm, radius_mm) / radius_mm);
  return std::max(8u, 4u * static_cast<std::uint32_t>(std::ceil(pi / half / 4)));
}

Outline circle_outline(double radius_mm, std::uint32_t facets, PlanePoint at, double phase_rad) {
  Outline outline;
  for (std::uint32_t k = 0; k < facets; ++k) {
    const double angle = phase_rad + 2 * pi * k / facets;
    outline.push_back({at[0] + radius_mm * std::cos(angle), at[1] + radius_mm * std::sin(angle)});
  }
  return outline;
}

Outline flats_outline(std::uint32_t sides, double across_mm) {
  return circle_outline(across_mm / 2 / std::cos(pi / sides), sides, {0, 0}, pi / sides);
}

Outline rectangle_outline(double width_mm, double height_mm, PlanePoint at) {
  const double x = width_mm / 2, y = height_mm / 2;
  return {{at[0] - x, at[1] - y},
          {at[0] + x, at[1] - y},
          {at[0] + x, at[1] + y},
          {at[0] - x, at[1] + y}};
}

void append_arc(Outline& outline, double radius_mm, double from_rad, double to_rad,
                std::uint32_t chords, PlanePoint centre) {
  for (std::uint32_t k = 0; k <= chords; ++k) {
    const double angle = from_rad + (to_rad - from_rad) * k / chords;
    const PlanePoint p{centre[0] + radius_mm * std::cos(angle),
                       centre[1] + radius_mm * std::sin(angle)};
    const auto near = [&](const PlanePoint& q) {
      return std::hypot(p[0] - q[0], p[1] - q[1]) < 1e-9;
    };
    if (outline.empty() || (!near(outline.back()) && !near(outline.front()))) outline.push_back(p);
  }
}

Outline rounded_outline(double width_mm, double height_mm, double radius_mm, std::uint32_t facets) {
  Outline outline;
  const double x = width_mm / 2 - radius_mm, y = height_mm / 2 - radius_mm;
  const PlanePoint centres[] = {{x, y}, {-x, y}, {-x, -y}, {x, -y}};
  for (std::uint32_t k = 0; k < 4; ++k)
    append_arc(outline, radius_mm, k * pi / 2, (k + 1) * pi / 2, facets, centres[k]);
  return outline;
}

Outline gear_outline(std::uint32_t teeth, double module_mm, double thinner_mm,
                     std::uint32_t chords) {
  const double pitch = module_mm * teeth / 2, tip = pitch + module_mm,
               root = pitch - 1.25 * module_mm;
  const double pressure = 20 * pi / 180, base = pitch * std::cos(pressure);
  const auto involute = [](double angle) { return std::tan(angle) - angle; };
  // Half of a tooth's angle at the base circle.
  const double half = pi / (2 * teeth) - thinner_mm / (2 * pitch) + involute(pressure);
  const double lowest = std::max(base, root);
  Outline outline;
  for (std::uint32_t tooth = 0; tooth < teeth; ++tooth) {
    const double middle = 2 * pi * tooth / teeth;
    for (const double side : {-1.0, 1.0}) {
      const auto add = [&](double radius) {
        const double angle =
            middle + side * (half - involute(std::acos(std::min(1.0, base / radius))));
        outline.push_back({radius * std::cos(angle), radius * std::sin(angle)});
      };
      const auto add_root = [&] {
        if (root >= base - 1e-9) return;
        const double angle = middle + side * half;
        outline.push_back({root * std::cos(angle), root * std::sin(angle)});
      };
      if (side < 0) add_root();
      for (std::uint32_t k = 0; k <= chords; ++k) {
        const double share = static_cast<double>(side < 0 ? k : chords - k) / chords;
        add(lowest + (tip - lowest) * share);
      }
      if (side > 0) add_root();
    }
  }
  return outline;
}

Outline moved_outline(const Outline& outline, PlanePoint by, double turn_rad) {
  const double c = std::cos(turn_rad), s = std::sin(turn_rad);
  Outline moved;
  for (const auto& [x, y] : outline)
    moved.push_back({c * x - s * y + by[0], s * x + c * y + by[1]});
  return moved;
}

Outline mirrored_outline(const Outline& outline) {
  Outline mirrored;
  for (const auto& [x, y] : outline) mirrored.push_back({-x, y});
  std::ranges::reverse(mirrored);
  return mirrored;
}

Outline grown_outline(const Outline& outline, double by_mm) {
  const double side = signed_area(outline) > 0 ? 1 : -1;
  const std::size_t n = outline.size();
  const auto outward = [&](std::size_t from, std::size_t to) {
    const double x = outline[to][0] - outline[from][0], y = outline[to][1] - outline[from][1];
    const double length = std::hypot(x, y);
    return Eigen::Vector2d(side * y / length, -side * x / length);
  };
  Outline grown;
  for (std::size_t k = 0; k < n; ++k) {
    const Eigen::Vector2d in = outward((k + n - 1) % n, k), out = outward(k, (k + 1) % n);
    // The corner of both sides: |in + out|^2 = 2 (1 + in . out).
    const Eigen::Vector2d step = by_mm / (1 + in.dot(out)) * (in + out);
    grown.push_back({outline[k][0] + step[0], outline[k][1] + step[1]});
  }
  return grown;
}

DrawnMesh& DrawnMesh::operator+=(const DrawnMesh& other) {
  triangles.insert(triangles.end(), other.triangles.begin(), other.triangles.end());
  return *this;
}

Vector DrawnMesh::middle_mm() const {
  Vector low = triangles[0][0], high = low;
  for (const auto& triangle : triangles) {
    for (const Vector& p : triangle) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  return 0.5 * (low + high);
}

DrawnMesh operator+(DrawnMesh a, const DrawnMesh& b) {
  a += b;
  return a;
}

Layer straight(double low_mm, double high_mm, Outlines outlines) {
  return {low_mm, high_mm, outlines, outlines};
}

DrawnMesh layered_mesh(const std::vector<Layer>& layers) {
  DrawnMesh mesh;
  Outlines ending;
  for (const Layer& layer : layers) {
    add_caps(mesh, layer.low_mm, ending, layer.below);
    add_walls(mesh, layer);
    ending = layer.above;
  }
  add_caps(mesh, layers.back().high_mm, ending, {});
  return mesh;
}

DrawnMesh prism_of(double low_mm, double high_mm, Outlines outlines) {
  return layered_mesh({straight(low_mm, high_mm, std::move(outlines))});
}

DrawnMesh block_mesh(const Vector& low_mm, const Vector& high_mm) {
  const Vector size = high_mm - low_mm, middle = 0.5 * (high_mm + low_mm);
  return prism_of(low_mm[2], high_mm[2],
                  {rectangle_outline(size[0], size[1], {middle[0], middle[1]})});
}

std::vector<Layer> filleted_layers(const Outline& outline, double low_mm, double high_mm,
                                   double fillet_mm, std::uint32_t chords, bool below, bool above) {
  struct Level {
    double z, inwards;
  };
  std::vector<Level> levels;
  const auto angle = [&](std::uint32_t k) { return pi / 2 * k / chords; };
  if (!below) levels.push_back({low_mm, 0});
  for (std::uint32_t k = 0; below && k <= chords; ++k) {
    levels.push_back(
        {low_mm + fillet_mm * (1 - std::cos(angle(k))), fillet_mm * (1 - std::sin(angle(k)))});
  }
  for (std::uint32_t k = 0; above && k <= chords; ++k) {
    levels.push_back(
        {high_mm - fillet_mm * (1 - std::sin(angle(k))), fillet_mm * (1 - std::cos(angle(k)))});
  }
  if (!above) levels.push_back({high_mm, 0});
  std::vector<Layer> layers;
  Outline last = grown_outline(outline, -levels[0].inwards);
  for (std::size_t k = 1; k < levels.size(); ++k) {
    const Outline next = grown_outline(outline, -levels[k].inwards);
    layers.push_back({levels[k - 1].z, levels[k].z, {last}, {next}});
    last = next;
  }
  return layers;
}

DrawnMesh turned_mesh(const Outline& half, std::uint32_t facets) {
  const Outline section = turning(half, true);
  constexpr double kAxis = 1e-12;
  const auto at = [&](const PlanePoint& p, std::uint32_t k) {
    const double angle = 2 * pi * (k % facets) / facets;
    return Vector(p[0] * std::cos(angle), p[0] * std::sin(angle), p[1]);
  };
  DrawnMesh mesh;
  for (std::size_t i = 0; i < section.size(); ++i) {
    const PlanePoint &a = section[i], &b = section[(i + 1) % section.size()];
    for (std::uint32_t k = 0; k < facets; ++k) {
      if (a[0] > kAxis) mesh.triangles.push_back({at(a, k), at(a, k + 1), at(b, k + 1)});
      if (b[0] > kAxis) mesh.triangles.push_back({at(a, k), at(b, k + 1), at(b, k)});
    }
  }
  std::erase_if(mesh.triangles,
                [](const auto& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  return mesh;
}

DrawnMesh shape_drawn(const tools::Shape& shape) {
  const tools::RawMesh raw = tools::shape_mesh(shape, "shape");
  DrawnMesh mesh;
  for (const tools::RawFace& face : raw.faces) {
    const auto corner = [&](std::size_t k) {
      const tools::Point3& p = raw.vertices[face.vertices[k]];
      return Vector(1e3 * p[0], 1e3 * p[1], 1e3 * p[2]);
    };
    if (face.vertices.size() <= 4) {
      for (std::size_t k = 2; k < face.vertices.size(); ++k)
        mesh.triangles.push_back({corner(0), corner(k - 1), corner(k)});
      continue;
    }
    std::vector<tools::Point3> loop;
    Vector normal = Vector::Zero();
    for (std::size_t k = 0; k < face.vertices.size(); ++k) {
      const Vector p = corner(k);
      loop.push_back({p[0], p[1], p[2]});
      if (k >= 2) normal += (corner(k - 1) - corner(0)).cross(p - corner(0));
    }
    std::vector<tools::FaceTriangle> cut;
    if (!tools::triangulate_face({loop}, {normal[0], normal[1], normal[2]}, cut))
      throw std::logic_error("a face of a shape encloses no area");
    for (const tools::FaceTriangle& t : cut) {
      mesh.triangles.push_back({Vector(t[0][0], t[0][1], t[0][2]),
                                Vector(t[1][0], t[1][1], t[1][2]),
                                Vector(t[2][0], t[2][1], t[2][2])});
    }
  }
  return mesh;
}

DrawnMesh finer_mesh(const DrawnMesh& mesh, std::uint32_t times) {
  DrawnMesh fine = mesh;
  for (std::uint32_t time = 0; time < times; ++time) {
    DrawnMesh next;
    for (const auto& [a, b, c] : fine.triangles) {
      const Vector ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
      for (const auto& t : {std::array{a, ab, ca}, std::array{b, bc, ab}, std::array{c, ca, bc},
                            std::array{ab, bc, ca}})
        next.triangles.push_back(t);
    }
    fine = std::move(next);
  }
  return fine;
}

DrawnMesh noisy_mesh(const DrawnMesh& mesh, double noise_mm, std::uint64_t seed) {
  Seeded random(seed);
  std::map<std::array<float, 3>, Vector> moved;
  DrawnMesh noisy = mesh;
  for (auto& triangle : noisy.triangles) {
    for (Vector& p : triangle) {
      const auto [at, fresh] = moved.try_emplace(float_key(p), p);
      if (fresh) {
        for (int k = 0; k < 3; ++k) at->second[k] += noise_mm * random.uniform(-1, 1);
      }
      p = at->second;
    }
  }
  return noisy;
}

DrawnMesh placed_mesh(const DrawnMesh& mesh, const Rotation& turn, const Vector& move_mm) {
  DrawnMesh placed = mesh;
  for (auto& triangle : placed.triangles)
    for (Vector& p : triangle) p = turn * p + move_mm;
  return placed;
}

std::size_t open_sides(const DrawnMesh& mesh) {
  std::map<std::array<float, 6>, long> sides;
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto a = float_key(triangle[k]), b = float_key(triangle[(k + 1) % 3]);
      if (a == b) continue;
      const bool forth = a < b;
      const auto &low = forth ? a : b, &high = forth ? b : a;
      sides[{low[0], low[1], low[2], high[0], high[1], high[2]}] += forth ? 1 : -1;
    }
  }
  std::size_t open = 0;
  for (const auto& [side, count] : sides) open += static_cast<std::size_t>(std::abs(count));
  return open;
}

std::string stl_file(const DrawnMesh& mesh, bool as_text) {
  std::string file;
  const auto normal_of = [](const std::array<Vector, 3>& t) {
    const Vector n = (t[1] - t[0]).cross(t[2] - t[0]);
    return n.norm() > 0 ? Vector(n.normalized()) : n;
  };
  if (as_text) {
    file = "solid part\n";
    for (const auto& t : mesh.triangles) {
      const Vector n = normal_of(t);
      tools::append_line(file, "facet normal %.6e %.6e %.6e\n outer loop", n[0], n[1], n[2]);
      for (const Vector& p : t)
        tools::append_line(file, "  vertex %.6e %.6e %.6e", p[0], p[1], p[2]);
      file += " endloop\nendfacet\n";
    }
    return file + "endsolid part\n";
  }
  file.assign(80, ' ');
  const auto append = [&](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    file.append(bytes, sizeof value);
  };
  append(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    for (const Vector& v : {normal_of(t), t[0], t[1], t[2]})
      for (const float number : float_key(v)) append(number);
    append(std::uint16_t{0});
  }
  return file;
}

std::vector<Triangle> file_triangles(const DrawnMesh& mesh) {
  std::vector<Triangle> triangles;
  for (const auto& corners : mesh.triangles) {
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector p = rounded(corners[k]);
      triangle[k] = {1e-3L * widen(p[0]), 1e-3L * widen(p[1]), 1e-3L * widen(p[2])};
    }
    if (!has_no_area(triangle)) triangles.push_back(triangle);
  }
  return triangles;
}

}  // namespace haptic::sim
