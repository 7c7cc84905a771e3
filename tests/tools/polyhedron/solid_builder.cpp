// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/polyhedron/solid_builder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace haptic::tools::test {

Rational3 AffineMap::operator()(const Rational3& x) const {
  Rational3 y;
  for (std::size_t i = 0; i < 3; ++i) {
    y[i] = (Rational(m[i][0]) * x[0] + Rational(m[i][1]) * x[1] + Rational(m[i][2]) * x[2]) /
           Rational(divisor);
  }
  return y;
}

AffineMap AffineMap::rotation(long w, long x, long y, long z, long size) {
  AffineMap map;
  map.m = {{{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
            {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
            {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}}};
  map.divisor = (w * w + x * x + y * y + z * z) * size;
  return map;
}

long TestRandom::between(long low, long high) {
  return low + static_cast<long>(words_.next() % static_cast<std::uint64_t>(high - low + 1));
}

FlatBody empty_body() { return {}; }

void add_face(FlatBody& body, Solid& solid, const std::vector<std::vector<Rational3>>& loops) {
  // Newell's sum over the outer loop: along the outward normal with any number of corners that are
  // reflex.
  Rational3 n{0, 0, 0};
  const std::vector<Rational3>& outer = loops.front();
  for (std::size_t i = 0; i < outer.size(); ++i) {
    const Rational3 c = cross(outer[i], outer[(i + 1) % outer.size()]);
    for (std::size_t k = 0; k < 3; ++k) n[k] += c[k];
  }
  ExactFace face;
  face.plane = body.world.find_or_add_plane(n, dot(n, outer.front()), face.sign);
  face.source_face = static_cast<std::int64_t>(solid.faces.size());
  for (const std::vector<Rational3>& loop : loops) {
    std::vector<std::uint32_t> corners;
    for (const Rational3& x : loop) corners.push_back(body.world.find_or_add_vertex(x));
    for (std::size_t i = 0; i < corners.size(); ++i) {
      face.edges.emplace_back(corners[i], corners[(i + 1) % corners.size()]);
    }
  }
  solid.faces.push_back(std::move(face));
}

Solid prism(FlatBody& body, const std::vector<std::vector<Point2i>>& loops, long low, long high,
            const AffineMap& map) {
  const auto lifted = [&](const Point2i& p, long z) {
    return map({Rational(p[0]), Rational(p[1]), Rational(z)});
  };
  Solid solid;
  std::vector<std::vector<Rational3>> top;
  std::vector<std::vector<Rational3>> bottom;
  for (const std::vector<Point2i>& loop : loops) {
    top.emplace_back();
    bottom.emplace_back();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point2i& a = loop[i];
      const Point2i& b = loop[(i + 1) % loop.size()];
      top.back().push_back(lifted(a, high));
      bottom.back().insert(bottom.back().begin(), lifted(a, low));
      add_face(body, solid, {{lifted(a, low), lifted(b, low), lifted(b, high), lifted(a, high)}});
    }
  }
  add_face(body, solid, top);
  add_face(body, solid, bottom);
  return solid;
}

Solid cells(FlatBody& body, const std::set<Cell>& occupied, const AffineMap& map) {
  Solid solid;
  for (const Cell& cell : occupied) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (int step = -1; step <= 1; step += 2) {
        Cell next = cell;
        next[axis] += step;
        if (occupied.contains(next)) continue;
        const std::size_t j = (axis + 1) % 3;
        const std::size_t k = (axis + 2) % 3;
        std::vector<Rational3> square;
        // Counter-clockwise seen from +axis; reversed for the face that looks the other way.
        for (const std::array<int, 2>& corner : {std::array{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
          Rational3 x;
          x[axis] = Rational(cell[axis] + (step > 0 ? 1 : 0));
          x[j] = Rational(cell[j] + corner[0]);
          x[k] = Rational(cell[k] + corner[1]);
          square.push_back(map(x));
        }
        if (step < 0) std::reverse(square.begin(), square.end());
        add_face(body, solid, {square});
      }
    }
  }
  normalise(solid);
  drop_straight_vertices(solid);
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    solid.faces[f].source_face = static_cast<std::int64_t>(f);
  }
  return solid;
}

void add_solid(FlatBody& body, Solid solid) {
  body.solids.push_back({std::move(solid), {static_cast<std::uint32_t>(body.solids.size())}});
}

std::vector<Point2i> polygon(std::size_t n, long x, long y, long radius) {
  std::vector<Point2i> loop;
  for (std::size_t i = 0; i < n; ++i) {
    const double angle =
        2.0 * std::numbers::pi * (static_cast<double>(i) + 0.3) / static_cast<double>(n);
    loop.push_back({x + std::lround(static_cast<double>(radius) * std::cos(angle)),
                    y + std::lround(static_cast<double>(radius) * std::sin(angle))});
  }
  return loop;
}

std::vector<Point2i> reversed(std::vector<Point2i> loop) {
  std::reverse(loop.begin(), loop.end());
  return loop;
}

}  // namespace haptic::tools::test
