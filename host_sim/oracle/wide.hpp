// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Vectors and rotations in `long double` (64-bit significand on x86-64) for the oracle. Written
/// apart from rt_core and from Eigen on purpose: the oracle must not share a defect with what it
/// checks.

#include <cmath>

namespace haptic::sim {

using Wide = long double;

/// The same number in more digits.
template <typename Number>
[[nodiscard]] constexpr Wide widen(Number value) {
  return static_cast<Wide>(value);
}

template <typename Number>
struct Triple {
  Number x = 0, y = 0, z = 0;

  [[nodiscard]] friend Triple operator+(const Triple& a, const Triple& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  [[nodiscard]] friend Triple operator-(const Triple& a, const Triple& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  [[nodiscard]] friend Triple operator*(Number s, const Triple& a) {
    return {s * a.x, s * a.y, s * a.z};
  }
  [[nodiscard]] friend Number dot(const Triple& a, const Triple& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
  }
  [[nodiscard]] friend Triple cross(const Triple& a, const Triple& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }
};
using WideVec = Triple<Wide>;

[[nodiscard]] inline Wide norm(const WideVec& a) { return std::sqrt(dot(a, a)); }
/// `a` must not be zero.
[[nodiscard]] inline WideVec unit(const WideVec& a) { return (1.0L / norm(a)) * a; }

/// Rotation matrix by rows; maps A-vectors to W.
struct WideRotation {
  WideVec row[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

  [[nodiscard]] WideVec operator*(const WideVec& v) const {
    return {dot(row[0], v), dot(row[1], v), dot(row[2], v)};
  }
};

/// The rotation of the quaternion w, x, y, z of any length but zero: the length is divided out
/// without a root, so integer quaternions of the golden vectors give their rational matrix to the
/// last bit of `Wide`.
[[nodiscard]] inline WideRotation rotation_of(Wide w, Wide x, Wide y, Wide z) {
  const Wide s = 1.0L / (w * w + x * x + y * y + z * z);
  WideRotation r;
  r.row[0] = {(w * w + x * x - y * y - z * z) * s, 2 * (x * y - w * z) * s,
              2 * (x * z + w * y) * s};
  r.row[1] = {2 * (x * y + w * z) * s, (w * w - x * x + y * y - z * z) * s,
              2 * (y * z - w * x) * s};
  r.row[2] = {2 * (x * z - w * y) * s, 2 * (y * z + w * x) * s,
              (w * w - x * x - y * y + z * z) * s};
  return r;
}

}  // namespace haptic::sim
