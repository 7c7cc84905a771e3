// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Small predicates and the vectors shared by the checks of SceneView::open.

#include <cstdint>
#include <limits>

#include "rt_core/scene/scene_view.hpp"

namespace haptic::check {

/// Neither NaN nor infinite.
template <typename T>
[[nodiscard]] constexpr bool finite(T x) noexcept {
  return x - x == T{0};
}

[[nodiscard]] constexpr bool positive(double x) noexcept { return finite(x) && x > 0.0; }

/// [offset, offset + count) lies in [0, size).
[[nodiscard]] constexpr bool within(std::uint64_t offset, std::uint64_t count,
                                    std::uint64_t size) noexcept {
  return offset <= size && count <= size - offset;
}

[[nodiscard]] constexpr double absolute(double x) noexcept { return x < 0.0 ? -x : x; }

/// A coordinate [m] that the format allows; false for NaN.
[[nodiscard]] constexpr bool is_coordinate(double x) noexcept {
  return absolute(x) <= kMaxSceneLength_m;
}

/// Every number of the coupling is in the range that CouplingParameters and the limits of the
/// format state. Answers kOk or kBlobBadNumber.
[[nodiscard]] RtStatus coupling(const CouplingParameters& c) noexcept;

/// Every number of the device is finite and not negative. Answers kOk or kBlobBadNumber.
[[nodiscard]] RtStatus device(const DeviceParameters& d) noexcept;

/// The held part has no mass and no other number, or a mass whose inertia about the grip point is
/// that of a body with its centre there, within rounding. Answers kOk or kBlobBadNumber.
[[nodiscard]] RtStatus held(const HeldPartParameters& h) noexcept;

/// The given parts of the envelope are a unit quaternion, an angle up to pi, a box that is not
/// empty; the rest is zero. Answers kOk or kBlobBadNumber.
[[nodiscard]] RtStatus envelope(const EnvelopeParameters& e) noexcept;

/// Every number of the guide is positive and finite. Answers kOk or kBlobBadNumber.
[[nodiscard]] RtStatus guide(const GuideRecord& g) noexcept;

/// Two stations at least and kMostGuideStations at most; poses in range and of unit turn, each way
/// the one to the next station, costs that fall to 0. `turn_m`: of the guide. Answers kOk,
/// kBlobBadCount or kBlobBadNumber; `index`: where it stopped.
[[nodiscard]] RtStatus guide_stations(std::span<const GuideStation> stations, double turn_m,
                                      std::uint32_t& index) noexcept;

/// Bodies ascending and in range, distances up to kMaxSceneLength_m; of a solid a mesh of positive
/// volume, of a surface no change of its volume, which is zero. Answers kOk, kBlobBadIndex or
/// kBlobBadNumber; `index`: where it stopped.
[[nodiscard]] RtStatus simplified(std::span<const SimplifiedBody> simplified,
                                  std::span<const BodyRecord> bodies,
                                  std::uint32_t& index) noexcept;

/// All have unit length within rounding. Answers kOk or kBlobBadNumber; `index`: where it stopped.
[[nodiscard]] RtStatus unit_directions(std::span<const Real> directions,
                                       std::uint32_t& index) noexcept;

/// Rounding of stored geometry, as a share of the largest coordinate: vertices are nearest Reals
/// and lie on planes of nearest Reals, so a few ulp; 256 leaves room for data that was rounded once
/// before.
inline constexpr double kGeometryTolerance = 256.0 * static_cast<double>(kRealEpsilon);

/// Vectors of the checks: double for every scalar of the scene.
struct Double3 {
  double x, y, z;
};
[[nodiscard]] inline Double3 to_double3(const Real* r) noexcept {
  return {static_cast<double>(r[0]), static_cast<double>(r[1]), static_cast<double>(r[2])};
}
[[nodiscard]] inline Double3 vertex_of(const PieceView& p, std::uint32_t v) noexcept {
  return to_double3(p.vertices + 3 * std::size_t{v});
}
[[nodiscard]] constexpr Double3 operator+(const Double3& a, const Double3& b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
[[nodiscard]] constexpr Double3 operator-(const Double3& a, const Double3& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
[[nodiscard]] constexpr Double3 operator*(double s, const Double3& a) noexcept {
  return {s * a.x, s * a.y, s * a.z};
}
[[nodiscard]] constexpr double dot(const Double3& a, const Double3& b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
[[nodiscard]] constexpr Double3 cross(const Double3& a, const Double3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace haptic::check
