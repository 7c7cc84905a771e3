// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Exact rational geometry of one body: the plane table, the vertex table and the predicates, each
/// behind a floating-point filter. Local frame: local = (file - centre) * scale with `scale` a
/// power of two, so that the part is about one unit wide at the origin.

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#ifndef HAPTIC_EXACT_GMP
#define HAPTIC_EXACT_GMP 0
#endif
#if HAPTIC_EXACT_GMP
#include <boost/multiprecision/gmp.hpp>
#endif
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace haptic::tools {

#if HAPTIC_EXACT_GMP
using Integer =
    boost::multiprecision::number<boost::multiprecision::gmp_int, boost::multiprecision::et_off>;
using Rational = boost::multiprecision::number<boost::multiprecision::gmp_rational,
                                               boost::multiprecision::et_off>;
#else
using Integer = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>,
                                              boost::multiprecision::et_off>;
using Rational = boost::multiprecision::number<
    boost::multiprecision::rational_adaptor<boost::multiprecision::cpp_int_backend<>>,
    boost::multiprecision::et_off>;
#endif

using Rational3 = std::array<Rational, 3>;

/// A plane n.x = d of the body's table, unoriented; index in ExactWorld::planes = identity
/// everywhere downstream.
struct ExactPlane {
  Rational3 n;
  Rational d;
  std::array<double, 3> n_approx;  ///< n rounded (not unit), for the filter
  double d_approx = 0.0;
  std::array<double, 3> unit_normal;  ///< unit length, nearest doubles
  double unit_offset = 0.0;           ///< local units
};

struct ExactVertex {
  Rational3 x;
  std::array<double, 3> x_approx;  ///< nearest doubles
};

/// A face on a plane: outward normal = sign * plane normal. `edges` is an oriented 1-chain (u ->
/// v), interior on the left seen along the outward normal; a hole is just more edges. No order is
/// implied.
struct ExactFace {
  std::uint32_t plane = 0;
  int sign = 1;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  std::int64_t source_face = -1;  ///< a 0-based face of the file that lies in it; -1: made by a cut
};

/// A solid as its boundary faces. A convex piece is a solid without reflex edges.
struct Solid {
  std::vector<ExactFace> faces;
};

/// Thrown when the work or bit limit of a body is exceeded (METHOD section 8); caught by the
/// decomposition.
class WorkLimitReached : public std::runtime_error {
 public:
  explicit WorkLimitReached(const std::string& text) : std::runtime_error(text) {}
};

/// Planes, vertices and predicates of one body. Deterministic: `work` counts operations, never
/// seconds.
class ExactWorld {
 public:
  std::array<double, 3> centre_m{0, 0, 0};  ///< file frame (metres) = local / scale + centre
  double scale = 1.0;                       ///< power of two [1/m]
  std::vector<ExactPlane> planes;
  std::vector<ExactVertex> vertices;
  std::vector<std::int64_t> source_vertex;  ///< per vertex: 0-based vertex of the file, or -1
  double work = 0.0;  ///< 1 per filtered sign, 20 + bits/8 per exact sign, 200 + bits per new point
  /// A unit takes 37 to 150 ns on the machines seen, so this is 8 to 30 s.
  double work_limit = 2.0e8;
  std::size_t max_coordinate_bits = 65536;

  /// Adds a plane; the caller guarantees that it is not in the table yet (see find_or_add_plane).
  std::uint32_t add_plane(const Rational3& n, const Rational& d);
  /// The plane through exact coefficients, or the existing one that is the same set of points (any
  /// scale or sign); `sign` receives +1 or -1: n = sign * (positive multiple of the table's
  /// normal).
  std::uint32_t find_or_add_plane(const Rational3& n, const Rational& d, int& sign);
  /// Looked up by exact value: equal points have equal indices.
  std::uint32_t find_or_add_vertex(const Rational3& x);

  /// Sign of n.x - d for vertex v and plane p: -1, 0, +1; floating-point filter, then exact.
  int side(std::uint32_t v, std::uint32_t p);
  /// Sign of (n_p x n_q).(x_v - x_u): 0 if p and q are parallel or u and v coincide along their
  /// line.
  int turn(std::uint32_t p, std::uint32_t q, std::uint32_t u, std::uint32_t v);
  /// Point where the segment (u, v) crosses plane p; side(u,p) * side(v,p) < 0. Cached per (edge,
  /// plane).
  std::uint32_t cut_edge(std::uint32_t u, std::uint32_t v, std::uint32_t p);
  /// Throws WorkLimitReached when work > work_limit.
  void charge(double units);

 private:
  /// Coordinates over one positive denominator: signs without the reductions that rationals cost.
  struct Homogeneous {
    std::array<Integer, 3> x;  ///< vertex: numerators; plane: normal
    Integer w;                 ///< vertex: denominator > 0; plane: offset
    std::size_t bits = 0;
  };
  struct CutKey {
    std::uint32_t u, v, plane;
    bool operator==(const CutKey&) const = default;
  };
  struct CutKeyHash {
    std::size_t operator()(const CutKey& key) const;
  };

  void extend_homogeneous();
  /// N.X - D W of the integer forms: the sign of n.x - d, and proportional to it over the vertex's
  /// denominator.
  [[nodiscard]] Integer homogeneous_side(std::uint32_t v, std::uint32_t p) const;

  // None of these is ever iterated, so their order reaches no output.
  std::unordered_map<CutKey, std::uint32_t, CutKeyHash> cut_cache_;
  std::unordered_map<std::uint64_t, std::int8_t> exact_sides_;
  std::unordered_multimap<std::size_t, std::uint32_t> vertex_lookup_;
  std::unordered_multimap<std::size_t, std::uint32_t> plane_lookup_;
  std::vector<Homogeneous> plane_forms_;
  std::vector<Homogeneous> vertex_forms_;
};

/// Number of bits of numerator plus denominator.
std::size_t bit_size(const Rational& q);

/// Nearest double, ties to even: the same bits from every arithmetic back end (their own
/// conversions differ).
double to_double(const Rational& q);

/// Nearest double of v / sqrt(square), square > 0: one rounding for components of a unit normal and
/// for offsets.
double over_root(const Rational& v, const Rational& square);

Rational dot(const Rational3& a, const Rational3& b);
Rational3 cross(const Rational3& a, const Rational3& b);
Rational3 subtract(const Rational3& a, const Rational3& b);

}  // namespace haptic::tools
