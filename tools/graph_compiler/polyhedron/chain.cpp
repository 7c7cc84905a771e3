// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/chain.hpp"

#include <algorithm>
#include <cmath>

namespace haptic::tools {

namespace {

using Point2 = std::array<Rational, 2>;

// Projection of a face's plane to two coordinates such that areas that are positive seen along the
// outward normal stay positive: the axis of the largest normal component is dropped.
struct Projection {
  std::size_t first = 0;
  std::size_t second = 1;
  bool mirrored = false;

  Projection(const ExactWorld& world, const ExactFace& face) {
    const ExactPlane& plane = world.planes[face.plane];
    std::size_t axis = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (std::abs(plane.unit_normal[i]) > std::abs(plane.unit_normal[axis])) axis = i;
    }
    first = (axis + 1) % 3;
    second = (axis + 2) % 3;
    mirrored = (plane.unit_normal[axis] < 0.0) != (face.sign < 0);
  }

  [[nodiscard]] Point2 operator()(const Rational3& x) const {
    if (mirrored) return {x[second], x[first]};
    return {x[first], x[second]};
  }
};

Rational cross2(const Point2& a, const Point2& b) { return a[0] * b[1] - a[1] * b[0]; }
Point2 minus(const Point2& a, const Point2& b) { return {a[0] - b[0], a[1] - b[1]}; }

int sign_of(const Rational& q) { return q > 0 ? 1 : (q < 0 ? -1 : 0); }

// Clockwise from `reference`: is direction `a` met before direction `b`? Both differ from the
// reference.
bool clockwise_before(const Point2& reference, const Point2& a, const Point2& b) {
  // Right half (cross < 0) is met first, then the opposite ray, then the left half.
  const auto half = [&](const Point2& d) { return sign_of(cross2(reference, d)) + 1; };
  const int half_a = half(a);
  const int half_b = half(b);
  if (half_a != half_b) return half_a < half_b;
  return sign_of(cross2(a, b)) < 0;
}

// Out-going edge of `at` that turns leftmost for someone who comes from `from`: the first one
// clockwise from the way back.
std::size_t leftmost(const ExactWorld& world, const Projection& project, std::uint32_t from,
                     std::uint32_t at, const Chain& chain,
                     const std::vector<std::size_t>& outgoing) {
  const Point2 origin = project(world.vertices[at].x);
  const Point2 back = minus(project(world.vertices[from].x), origin);
  std::size_t best = outgoing.front();
  for (std::size_t i = 1; i < outgoing.size(); ++i) {
    const Point2 candidate = minus(project(world.vertices[chain[outgoing[i]].second].x), origin);
    const Point2 current = minus(project(world.vertices[chain[best].second].x), origin);
    if (clockwise_before(back, candidate, current)) best = outgoing[i];
  }
  return best;
}

void start_at_smallest(Loop& loop) {
  std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
}

// Determinant of three points, in double.
double determinant(const std::array<double, 3>& a, const std::array<double, 3>& b,
                   const std::array<double, 3>& c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
}

}  // namespace

void cancel(Chain& chain) {
  const auto key = [](const ChainEdge& e) { return std::minmax(e.first, e.second); };
  std::sort(chain.begin(), chain.end(), [&](const ChainEdge& a, const ChainEdge& b) {
    const auto ka = key(a);
    const auto kb = key(b);
    return ka != kb ? ka < kb : a < b;
  });
  Chain kept;
  kept.reserve(chain.size());
  for (std::size_t i = 0; i < chain.size();) {
    std::size_t end = i;
    std::ptrdiff_t forward = 0;
    const std::uint32_t low = std::min(chain[i].first, chain[i].second);
    const std::uint32_t high = std::max(chain[i].first, chain[i].second);
    for (; end < chain.size() && std::min(chain[end].first, chain[end].second) == low &&
           std::max(chain[end].first, chain[end].second) == high;
         ++end) {
      forward += chain[end].first == low ? 1 : -1;
    }
    for (; forward > 0; --forward) kept.emplace_back(low, high);
    for (; forward < 0; ++forward) kept.emplace_back(high, low);
    i = end;
  }
  std::sort(kept.begin(), kept.end());
  chain = std::move(kept);
}

void normalise(Solid& solid) {
  std::stable_sort(solid.faces.begin(), solid.faces.end(),
                   [](const ExactFace& a, const ExactFace& b) {
                     return std::pair(a.plane, a.sign) < std::pair(b.plane, b.sign);
                   });
  std::vector<ExactFace> joined;
  for (ExactFace& face : solid.faces) {
    if (!joined.empty() && joined.back().plane == face.plane && joined.back().sign == face.sign) {
      joined.back().edges.insert(joined.back().edges.end(), face.edges.begin(), face.edges.end());
    } else {
      joined.push_back(std::move(face));
      joined.back().source_face = -1;
    }
  }
  for (ExactFace& face : joined) cancel(face.edges);
  std::erase_if(joined, [](const ExactFace& face) { return face.edges.empty(); });
  solid.faces = std::move(joined);
}

void drop_straight_vertices(Solid& solid) {
  std::vector<std::uint32_t> starts;
  for (const ExactFace& face : solid.faces) {
    for (const ChainEdge& e : face.edges) starts.push_back(e.first);
  }
  std::sort(starts.begin(), starts.end());
  std::vector<std::uint32_t> straight;
  for (std::size_t i = 0; i < starts.size();) {
    std::size_t end = i;
    while (end < starts.size() && starts[end] == starts[i]) ++end;
    if (end - i == 2) straight.push_back(starts[i]);
    i = end;
  }
  if (straight.empty()) return;
  const auto is_straight = [&](std::uint32_t v) {
    return std::binary_search(straight.begin(), straight.end(), v);
  };
  for (ExactFace& face : solid.faces) {
    // Edges are sorted by their start, so the successor of a straight vertex is found by bisection.
    const Chain& edges = face.edges;
    Chain kept;
    kept.reserve(edges.size());
    for (const ChainEdge& e : edges) {
      if (is_straight(e.first)) continue;
      std::uint32_t end = e.second;
      for (std::size_t steps = 0; is_straight(end); ++steps) {
        const auto next = std::lower_bound(edges.begin(), edges.end(), ChainEdge{end, 0});
        if (next == edges.end() || next->first != end || steps > edges.size()) {
          throw BrokenChain("a straight edge has no end");
        }
        end = next->second;
      }
      kept.emplace_back(e.first, end);
    }
    std::sort(kept.begin(), kept.end());
    face.edges = std::move(kept);
  }
}

std::vector<Loop> trace_loops(ExactWorld& world, const ExactFace& face) {
  Chain chain = face.edges;
  std::sort(chain.begin(), chain.end());
  std::vector<bool> used(chain.size(), false);
  const Projection project(world, face);
  std::vector<Loop> loops;
  std::vector<std::size_t> outgoing;
  for (std::size_t first = 0; first < chain.size(); ++first) {
    if (used[first]) continue;
    Loop loop;
    std::size_t edge = first;
    while (true) {
      used[edge] = true;
      loop.push_back(chain[edge].first);
      const std::uint32_t from = chain[edge].first;
      const std::uint32_t at = chain[edge].second;
      outgoing.clear();
      const auto begin = std::lower_bound(chain.begin(), chain.end(), ChainEdge{at, 0});
      for (auto it = begin; it != chain.end() && it->first == at; ++it) {
        const auto index = static_cast<std::size_t>(it - chain.begin());
        if (!used[index] || index == first) outgoing.push_back(index);
      }
      if (outgoing.empty()) throw BrokenChain("a face's boundary is not closed");
      if (outgoing.size() == 1) {
        edge = outgoing.front();
      } else {
        world.charge(200.0);
        edge = leftmost(world, project, from, at, chain, outgoing);
      }
      if (edge == first) break;
    }
    start_at_smallest(loop);
    loops.push_back(std::move(loop));
  }
  std::sort(loops.begin(), loops.end());
  return loops;
}

bool is_outer(ExactWorld& world, const ExactFace& face, const Loop& loop) {
  world.charge(static_cast<double>(loop.size()));
  const std::array<double, 3>& n = world.planes[face.plane].unit_normal;
  const std::array<double, 3>& o = world.vertices[loop.front()].x_approx;
  double sum = 0.0;
  double bound = 0.0;
  for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
    const std::array<double, 3>& a = world.vertices[loop[i]].x_approx;
    const std::array<double, 3>& b = world.vertices[loop[i + 1]].x_approx;
    const std::array<double, 3> p{a[0] - o[0], a[1] - o[1], a[2] - o[2]};
    const std::array<double, 3> q{b[0] - o[0], b[1] - o[1], b[2] - o[2]};
    sum += determinant(n, p, q);
    bound += std::hypot(p[0], p[1], p[2]) + std::hypot(q[0], q[1], q[2]);
  }
  // Coordinates are about one unit and exact to 2^-53 of that.
  if (std::abs(sum) > 1.0e-13 * bound) return (sum > 0.0) == (face.sign > 0);
  const Projection project(world, face);
  Rational area = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    area += cross2(project(world.vertices[loop[i]].x),
                   project(world.vertices[loop[(i + 1) % loop.size()]].x));
  }
  return area > 0;
}

int locate_in_chain(const ExactWorld& world, const ExactFace& face, const Chain& chain,
                    const Rational3& point) {
  const Projection project(world, face);
  const Point2 p = project(point);
  int winding = 0;
  for (const ChainEdge& e : chain) {
    const Point2 a = minus(project(world.vertices[e.first].x), p);
    const Point2 b = minus(project(world.vertices[e.second].x), p);
    const int turn = sign_of(cross2(a, b));
    if (turn == 0 && a[0] * b[0] + a[1] * b[1] <= 0) return 0;
    // Half-open crossings of the ray to the right: each vertex of the chain counts once.
    if (a[1] <= 0 && b[1] > 0 && turn > 0) ++winding;
    if (b[1] <= 0 && a[1] > 0 && turn < 0) --winding;
  }
  return winding != 0 ? 1 : -1;
}

std::vector<std::uint32_t> vertices_of(const Solid& solid) {
  std::vector<std::uint32_t> all;
  for (const ExactFace& face : solid.faces) {
    for (const ChainEdge& e : face.edges) {
      all.push_back(e.first);
      all.push_back(e.second);
    }
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace haptic::tools
