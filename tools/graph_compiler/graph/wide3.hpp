// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Vectors of 80-bit long double, in which the geometry of a scene is computed before its one
/// rounding. Only + - * / and square root are used on them: exactly defined by the format, so that
/// every compiler that has it gives the same bits.

#include <array>
#include <cmath>
#include <limits>

namespace haptic::tools {

using Wide = long double;
using Wide3 = std::array<Wide, 3>;
static_assert(std::numeric_limits<Wide>::digits >= 64,
              "scenes are compiled on hosts with 80-bit long double");

template <typename T>
Wide3 widen(const std::array<T, 3>& a) {
  return {static_cast<Wide>(a[0]), static_cast<Wide>(a[1]), static_cast<Wide>(a[2])};
}
template <typename T>
Wide3 widen(const T (&a)[3]) {
  return {static_cast<Wide>(a[0]), static_cast<Wide>(a[1]), static_cast<Wide>(a[2])};
}
inline Wide3 operator+(const Wide3& a, const Wide3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Wide3 operator-(const Wide3& a, const Wide3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Wide3 operator*(Wide s, const Wide3& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline Wide dot(const Wide3& a, const Wide3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Wide3 cross(const Wide3& a, const Wide3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Wide norm(const Wide3& a) { return std::sqrt(dot(a, a)); }
inline Wide3 unit(const Wide3& a) { return (1 / norm(a)) * a; }

/// Smallest double not below x.
inline double rounded_up(Wide x) {
  const double nearest = static_cast<double>(x);
  return static_cast<Wide>(nearest) >= x
             ? nearest
             : std::nextafter(nearest, std::numeric_limits<double>::infinity());
}

}  // namespace haptic::tools
