// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Quadratic programs as the proxy meets them, and two other ways to their solution.

#include <array>
#include <span>
#include <vector>

#include "rt_core/proxy/proxy_qp.hpp"
#include "tests/support/shapes.hpp"

namespace haptic::test {

// Problems: contact points of planes round a body whose device has moved on through them. Every
// problem keeps the proxy's present pose feasible.

/// Radius at which a rotation counts like a displacement. [m]
inline constexpr double kQpLever_m = 0.05;

/// What the problems of one kind have in common.
struct QpFamily {
  const char* name = "";
  int planes = 1;
  int points = 4;             ///< of each plane
  int copies = 1;             ///< of every row
  double tilt_rad = 0;        ///< of the copies' normals
  bool opposite = false;      ///< planes come in pairs n, -n
  double clearance_m = 5e-4;  ///< largest gap; with `opposite`: of both planes together
  double friction = 0;        ///< > 0: every row becomes the four sides of its friction pyramid
};

inline constexpr std::array<QpFamily, 9> kQpFamilies = {{
    {"1 plane", 1, 4, 1, 0, false, 5e-4, 0},
    {"3 planes", 3, 4, 1, 0, false, 5e-4, 0},
    {"8 planes", 8, 4, 1, 0, false, 5e-4, 0},
    {"16 planes", 16, 4, 1, 0, false, 5e-4, 0},
    {"seam, every row 4 times", 3, 4, 4, 0, false, 5e-4, 0},
    {"seam, normals off by 1e-9", 3, 4, 4, 1e-9, false, 5e-4, 0},
    {"seam, normals off by 1e-6", 3, 4, 4, 1e-6, false, 5e-4, 0},
    {"slot of 10 um", 4, 8, 1, 0, true, 1e-5, 0},
    {"3 planes with friction", 3, 4, 1, 0, false, 5e-4, 0.3},
}};

/// The row of a contact point: normal n towards the body, lever of the point about the proxy's
/// origin [m], gap [m], way of the device (translation [m], rotation times kQpLever_m [m]).
QpRow qp_row(const Point& normal, const Point& lever_m, double gap_m,
             const std::array<double, 6>& way_m);

/// A problem of the family: normals all round, points within 40 mm, the device up to 5 mm and
/// 0.1 rad away.
std::vector<QpRow> make_qp(Random& random, const QpFamily& family);

/// A unit vector, uniform over directions.
Point random_direction(Random& random);

// The closest point of a polyhedron by trying every set of up to six rows that could hold it.

struct EnumeratedPoint {
  std::array<long double, 6> z{};
  /// Largest violation of a row at z: z is the best of all points that rows can hold by pushing;
  /// the problem is feasible where this is rounding.
  long double violation = 0;
  int sets = 0;  ///< whose rows are independent
};

/// min |z| over g_i.z >= h_i, at most 12 rows: 2510 sets, each by a Cholesky factor in long double.
/// Sets with rows that depend on each other to 1e-10 of their length are left out; another set
/// holds the same point without them.
EnumeratedPoint enumerate_active_sets(std::span<const QpRow> rows);

// A second way to the closest point of a polyhedron: its dual as a problem of non-negative least
// squares (Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23: LDP by NNLS), with
// Householder factors computed afresh in every step. Double precision for any Real.

struct NnlsResult {
  std::array<double, 6> z{};
  double residual2 = 0;    ///< of the least squares problem; 0: no feasible point
  int steps = 0;           ///< least squares problems solved
  bool converged = false;  ///< not ended by the limit on the steps
};

/// min |z| over g_i.z >= h_i. At least one row.
NnlsResult dual_nnls(std::span<const QpRow> rows);

}  // namespace haptic::test
