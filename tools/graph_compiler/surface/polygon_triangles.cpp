// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/surface/polygon_triangles.hpp"

#include <cmath>

#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// A corner that turns less than this share of the sides' lengths is straight: the ear has no area.
constexpr double kStraightSine = 1.0e-12;

class EarCutter {
 public:
  EarCutter(const std::vector<Point3>& points, std::span<const std::uint32_t> loop)
      : points_(points), loop_(loop), n_(static_cast<std::uint32_t>(loop.size())) {
    normal_ = vec::unit(vec::twice_area(points, loop));
    before_.resize(n_);
    after_.resize(n_);
    for (std::uint32_t i = 0; i < n_; ++i) {
      before_[i] = (i + n_ - 1) % n_;
      after_[i] = (i + 1) % n_;
    }
    reflex_.resize(n_);
    for (std::uint32_t i = 0; i < n_; ++i) reflex_[i] = turn_at(i) <= 0.0;
  }

  void run(std::vector<std::array<std::uint32_t, 3>>& out) {
    std::uint32_t left = n_, at = 0;
    while (left > 3) {
      const std::uint32_t ear = find_ear(at, left);
      out.push_back({loop_[before_[ear]], loop_[ear], loop_[after_[ear]]});
      const std::uint32_t b = before_[ear], a = after_[ear];
      after_[b] = a;
      before_[a] = b;
      reflex_[ear] = false;
      reflex_[b] = turn_at(b) <= 0.0;
      reflex_[a] = turn_at(a) <= 0.0;
      at = a;
      --left;
    }
    out.push_back({loop_[before_[at]], loop_[at], loop_[after_[at]]});
  }

 private:
  [[nodiscard]] const Point3& point(std::uint32_t i) const { return points_[loop_[i]]; }

  [[nodiscard]] double turn(const Point3& a, const Point3& b, const Point3& c) const {
    return vec::dot(normal_, vec::cross(vec::sub(b, a), vec::sub(c, b)));
  }
  [[nodiscard]] double turn_at(std::uint32_t i) const {
    return turn(point(before_[i]), point(i), point(after_[i]));
  }

  [[nodiscard]] bool holds_reflex(std::uint32_t ear) const {
    const Point3 &a = point(before_[ear]), &b = point(ear), &c = point(after_[ear]);
    for (std::uint32_t i = 0; i < n_; ++i) {
      if (!reflex_[i] || i == ear || i == before_[ear] || i == after_[ear]) continue;
      const Point3& p = point(i);
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0) return true;
    }
    return false;
  }

  /// The next corner that can be cut off; with none, the one that turns most.
  [[nodiscard]] std::uint32_t find_ear(std::uint32_t from, std::uint32_t left) const {
    std::uint32_t at = from, straight = n_, widest = from;
    double most = -HUGE_VAL;
    for (std::uint32_t k = 0; k < left; ++k, at = after_[at]) {
      const double t = turn_at(at);
      const double size = vec::distance(point(before_[at]), point(at)) *
                          vec::distance(point(at), point(after_[at]));
      if (t > most) {
        most = t;
        widest = at;
      }
      if (std::abs(t) <= kStraightSine * size) {
        if (straight == n_) straight = at;
        continue;
      }
      if (t > 0.0 && !holds_reflex(at)) return at;
    }
    return straight != n_ ? straight : widest;
  }

  const std::vector<Point3>& points_;
  std::span<const std::uint32_t> loop_;
  std::uint32_t n_;
  Point3 normal_{0, 0, 0};
  std::vector<std::uint32_t> before_, after_;
  std::vector<bool> reflex_;
};

}  // namespace

void triangulate_loop(const std::vector<Point3>& points, std::span<const std::uint32_t> loop,
                      std::vector<std::array<std::uint32_t, 3>>& out) {
  if (loop.size() < 3) return;
  EarCutter(points, loop).run(out);
}

}  // namespace haptic::tools
