// SPDX-License-Identifier: Apache-2.0
#include "tests/host_sim/lid_and_bin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <span>

#include "tests/support/random.hpp"

namespace haptic::sim::test {
namespace {

using haptic::test::Random;

using Corner = std::array<double, 2>;

/// A point of a profile: how far inside the outline, and how high [mm].
struct ProfilePoint {
  double inset, z;
};

struct Mesh {
  std::vector<std::array<double, 3>> vertices;  ///< [mm]
  std::vector<std::array<std::size_t, 3>> triangles;
};

/// The outline, counter-clockwise, with each side moved inward.
std::vector<Corner> inset(std::span<const Corner> outline, double distance) {
  const std::size_t n = outline.size();
  struct Line {
    double x, y, offset;
  };
  std::vector<Line> sides;
  for (std::size_t i = 0; i < n; ++i) {
    const Corner &from = outline[i], &to = outline[(i + 1) % n];
    const double dx = to[0] - from[0], dy = to[1] - from[1], length = std::hypot(dx, dy);
    const double x = -dy / length, y = dx / length;
    sides.push_back({x, y, x * from[0] + y * from[1] + distance});
  }
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < n; ++i) {
    const Line &l = sides[(i + n - 1) % n], &r = sides[i];
    const double det = l.x * r.y - l.y * r.x;
    corners.push_back(
        {(l.offset * r.y - r.offset * l.y) / det, (l.x * r.offset - r.x * l.offset) / det});
  }
  return corners;
}

/// Triangles of a simple polygon, by ears.
std::vector<std::array<std::size_t, 3>> ears(std::span<const Corner> polygon) {
  const auto area = [&](std::size_t a, std::size_t b, std::size_t c) {
    return (polygon[b][0] - polygon[a][0]) * (polygon[c][1] - polygon[a][1]) -
           (polygon[b][1] - polygon[a][1]) * (polygon[c][0] - polygon[a][0]);
  };
  std::vector<std::size_t> rest;
  for (std::size_t i = 0; i < polygon.size(); ++i) rest.push_back(i);
  std::vector<std::array<std::size_t, 3>> triangles;
  while (rest.size() > 3) {
    const std::size_t n = rest.size();
    std::size_t ear = 0;
    for (; ear + 1 < n; ++ear) {
      const std::size_t a = rest[(ear + n - 1) % n], b = rest[ear], c = rest[(ear + 1) % n];
      const auto blocks = [&](std::size_t p) {
        return p != a && p != b && p != c && area(a, b, p) >= 0 && area(b, c, p) >= 0 &&
               area(c, a, p) >= 0;
      };
      if (area(a, b, c) > 0 && std::ranges::none_of(rest, blocks)) break;
    }
    triangles.push_back({rest[(ear + n - 1) % n], rest[ear], rest[(ear + 1) % n]});
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({rest[0], rest[1], rest[2]});
  return triangles;
}

/// The profile from the middle of the underside round to the middle of the top, swept round the
/// outline; its first and last point become flat ends.
Mesh swept(std::span<const Corner> outline, std::span<const ProfilePoint> profile) {
  Mesh mesh;
  const std::size_t n = outline.size();
  for (const ProfilePoint& p : profile) {
    for (const Corner& c : inset(outline, p.inset)) mesh.vertices.push_back({c[0], c[1], p.z});
  }
  const std::size_t top = (profile.size() - 1) * n;
  for (const auto& [a, b, c] : ears(inset(outline, profile.front().inset))) {
    mesh.triangles.push_back({c, b, a});
  }
  for (std::size_t k = 0; k < top; k += n) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t a = k + i, b = k + (i + 1) % n;
      mesh.triangles.push_back({a, b, b + n});
      mesh.triangles.push_back({a, b + n, a + n});
    }
  }
  for (const auto& [a, b, c] : ears(inset(outline, profile.back().inset))) {
    mesh.triangles.push_back({top + a, top + b, top + c});
  }
  return mesh;
}

/// Upside down, with what was at height `z` at 0.
Mesh turned_over(Mesh mesh, double z) {
  for (auto& v : mesh.vertices) v[2] = z - v[2];
  for (auto& t : mesh.triangles) std::swap(t[0], t[2]);
  return mesh;
}

void write_obj(const std::filesystem::path& path, const Mesh& mesh) {
  std::ofstream file(path);
  char line[96];
  for (const auto& v : mesh.vertices) {
    std::snprintf(line, sizeof line, "v %.7f %.7f %.7f\n", v[0], v[1], v[2]);
    file << line;
  }
  for (const auto& t : mesh.triangles) {
    file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  }
}

std::vector<Corner> outline_of(Outline outline, Random& random) {
  const double w = random.uniform(50, 120), h = random.uniform(40, 100);
  const double cut = random.uniform(5, 15), arm = random.uniform(20, 30);
  const auto sides = 5 + static_cast<int>(random.next() % 6);
  switch (outline) {
    case Outline::kRectangle:
      return {{-w / 2, -h / 2}, {w / 2, -h / 2}, {w / 2, h / 2}, {-w / 2, h / 2}};
    case Outline::kOctagon:
      return {{-w / 2 + cut, -h / 2}, {w / 2 - cut, -h / 2}, {w / 2, -h / 2 + cut},
              {w / 2, h / 2 - cut},   {w / 2 - cut, h / 2},  {-w / 2 + cut, h / 2},
              {-w / 2, h / 2 - cut},  {-w / 2, -h / 2 + cut}};
    case Outline::kEll:
      return {{0, 0}, {w, 0}, {w, arm}, {arm, arm}, {arm, h}, {0, h}};
    case Outline::kPolygon:
      break;
  }
  std::vector<Corner> corners;
  for (int k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.5) / sides;
    corners.push_back({w / 2 * std::cos(angle), w / 2 * std::sin(angle)});
  }
  return corners;
}

/// Lengths of both parts [mm].
struct Sizes {
  double height, wall, floor, rim, rim_height, bevel, edge;  ///< of the bin; `edge` may be 0
  double clearance, plate;                                   ///< of the lid
};

std::vector<ProfilePoint> bin_profile(const Sizes& s) {
  std::vector<ProfilePoint> p = {{s.rim + s.bevel, 0}, {s.rim, s.bevel}};
  const double under = s.height - s.rim_height;
  p.push_back({s.rim, under});
  if (s.edge > 0) {
    p.push_back({s.edge / 2, under});
    p.push_back({0, under + s.edge / 2});
    p.push_back({0, s.height - s.edge});
    p.push_back({s.edge, s.height});
    p.push_back({s.rim + s.wall - 0.3 * s.edge, s.height});
    p.push_back({s.rim + s.wall, s.height - 0.3 * s.edge});
  } else {
    p.push_back({0, under});
    p.push_back({0, s.height});
    p.push_back({s.rim + s.wall, s.height});
  }
  p.push_back({s.rim + s.wall, s.floor});
  return p;
}

/// The lid with the underside of its plate at 0.
Mesh lid_of(LidForm form, std::span<const Corner> outline, const Sizes& s, Random& random) {
  const double in = s.rim + s.wall + s.clearance, t = s.plate;
  const double bevel = random.uniform(0.5, 1.5), entry = random.uniform(0.5, 2);
  const double skirt = random.uniform(4, 8), plug = random.uniform(6, 10);
  const double step = random.uniform(1, 2), ring = random.uniform(2, 5);
  const double width = random.uniform(1.5, 3);
  if (form == LidForm::kPlug) {
    return swept(
        outline,
        std::vector<ProfilePoint>{
            {in + entry, -plug}, {in, -plug + entry}, {in, 0}, {0, 0}, {0, t - bevel}, {bevel, t}});
  }
  if (form == LidForm::kStep) {
    return swept(outline, std::vector<ProfilePoint>{{in + step + entry, -plug},
                                                    {in + step, -plug + entry},
                                                    {in + step, -plug / 2},
                                                    {in, -plug / 2 + step / 2},
                                                    {in, 0},
                                                    {0, 0},
                                                    {0, t - bevel},
                                                    {bevel, t},
                                                    {bevel + 4, t},
                                                    {bevel + 4, t + 3},
                                                    {bevel + 5, t + 4}});
  }
  const double out = -(t + s.clearance);
  std::vector<ProfilePoint> p = {{out + bevel, 0},
                                 {out, bevel},
                                 {out, t + skirt},
                                 {-s.clearance - bevel / 2, t + skirt},
                                 {-s.clearance, t + skirt - bevel / 2},
                                 {-s.clearance, t}};
  if (form == LidForm::kBoth) {
    p.push_back({in, t});
    p.push_back({in, t + ring - 0.5});
    p.push_back({in + 0.5, t + ring});
    p.push_back({in + width, t + ring});
    p.push_back({in + width, t});
  }
  return turned_over(swept(outline, p), t);
}

MotionScript motion_of(double seat_m, std::uint64_t seed, Random& random) {
  MotionScript script;
  script.seed = seed;
  script.tremor.position_m = 0.0002;
  script.tremor.angle_rad = 0.0035;
  const auto within = [&](double a) { return random.uniform(-a, a); };
  const auto add = [&](const char* phase, double t_s, std::array<double, 3> p,
                       std::array<double, 3> axis, double angle_rad) {
    WayPoint at;
    at.phase = phase;
    at.t_s = t_s;
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      at.p[k] = p[k] + (k == 2 ? seat_m : 0);
      at.q_wxyz[k + 1] = std::sin(angle_rad / 2) * axis[k] / length;
    }
    at.q_wxyz[0] = std::cos(angle_rad / 2);
    script.waypoints.push_back(at);
  };
  add("start", 0.0, {within(0.01), within(0.01), 0.03}, {1, 2, 0}, 0.1);
  add("touch askew", 0.5, {within(0.006), within(0.006), 0.003}, {1, within(1), 0}, 0.05);
  add("press askew", 0.8, {within(0.006), within(0.006), -0.001}, {1, within(1), 0.2}, 0.03);
  add("find the seat", 1.1, {0.0003, -0.0002, 0.006}, {0, 0, 1}, 0);
  add("seat", 1.5, {0, 0, -0.001}, {0, 0, 1}, 0);
  add("slide", 1.9, {random.uniform(0.0005, 0.002), within(0.002), -0.0012}, {0, 0, 1}, 0);
  add("turn", 2.3, {0, 0, -0.001}, {0, 0, 1}, random.uniform(0.02, 0.08));
  add("tilt", 2.7, {0.0005, 0, -0.0008}, {within(1), 1, 0}, random.uniform(0.02, 0.06));
  add("press deep", 3.0, {0.001, 0.0005, -random.uniform(0.002, 0.006)}, {0, 0, 1}, 0);
  add("release", 3.2, {0, 0, -0.0005}, {0, 0, 1}, 0);
  add("tilt out", 3.6, {0, 0, 0.004}, {1, 0.3, 0}, 0.12);
  add("lift", 4.0, {within(0.01), within(0.01), 0.03}, {1, 0, 0}, 0.2);
  return script;
}

}  // namespace

LidAndBin make_lid_and_bin(const std::filesystem::path& folder, Outline outline, LidForm form,
                           std::uint64_t seed) {
  constexpr const char* kOutlines[] = {"rectangle", "octagon", "polygon", "ell"};
  constexpr const char* kForms[] = {"plug", "step", "cap", "both"};
  Random random(seed);
  LidAndBin result;
  result.name = std::string(kOutlines[static_cast<int>(outline)]) + '_' +
                kForms[static_cast<int>(form)] + '_' + std::to_string(seed);
  const std::vector<Corner> corners = outline_of(outline, random);
  Sizes s{};
  s.height = random.uniform(20, 40);
  s.wall = random.uniform(2, 3);
  s.floor = random.uniform(2, 5);
  s.rim = random.uniform(2, 5);
  s.rim_height = random.uniform(2, 5);
  s.bevel = random.uniform(1, 3);
  s.edge = random.uniform(0.5, 1.2);
  if (random.next() % 3 == 0) s.edge = 0;
  s.clearance = random.uniform(0.2, 0.5);
  s.plate = random.uniform(2, 4);
  write_obj(folder / (result.name + "_bin.obj"), swept(corners, bin_profile(s)));
  write_obj(folder / (result.name + "_lid.obj"), lid_of(form, corners, s, random));
  std::string toml = "format = 1\nname = \"" + result.name + "\"\n";
  toml += "[moving]\nmesh = \"" + result.name + "_lid.obj\"\nscale_to_m = 0.001\n";
  toml += "grip_m = [0.0, 0.0, 0.0]\n";
  toml += "[[static]]\nmesh = \"" + result.name + "_bin.obj\"\nscale_to_m = 0.001\n";
  toml += "[rendering]\nk_f_n_per_m = 1000.0\nepsilon_m = 1e-4\n";
  result.scene = tools::parse_scene_file(toml, result.name + ".toml", folder);
  result.motion = motion_of(0.001 * s.height, seed, random);
  return result;
}

}  // namespace haptic::sim::test
