// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Stale upper bounds of what each face and edge of a pair can carry, kept against odometers: the
/// proof, in every tick, that what is not looked at cannot matter.
///
/// For a unit direction n, s(n; q) = min_a n.(x + R a) - max_b n.b is the gap along n. For n fixed
/// in B it changes between two poses by at most |dx| + |(R' - R) a|, for n fixed in A by at most
/// |dx| + |R' - R| |x - b|; the chord of a turn is at most twice the length of the difference of
/// the two (sign-aligned) unit quaternions. Sums of these over the ticks are the odometers. A bound
/// that held when the odometer read o' is raised by no more than o - o' until it reads o. So a
/// feature with key = bound - o' cannot carry a value of T or more while key + o < T. No speed
/// limit enters, and no history but the key.

#include <cstdint>
#include <span>

#include "rt_core/base/arena.hpp"
#include "rt_core/contact/pair_pose.hpp"

namespace haptic {

/// Key of a feature that has never been evaluated: stale, may carry anything.
inline constexpr Real kStaleKey = std::numeric_limits<Real>::max();

/// Key of a feature that no pose needs: it never matters.
inline constexpr Real kDeadKey = -std::numeric_limits<Real>::infinity();

/// Rounding of an odometer's reading, as a share of it: a few units in the last place.
inline constexpr double kOdometerRounding = 0x1p-50;

/// How far the moving body has come, in the two measures of a pair [m]. Only differences matter;
/// double in every build, so that hours of motion lose nothing.
struct Odometer {
  double of_a = 0;  ///< for directions fixed in A
  double of_b = 0;  ///< for directions fixed in B
};

/// Faces or edges of one piece of a pair.
struct FeatureKeys {
  std::span<Real>
      key;  ///< bound minus odometer at its evaluation; padded to kLanePadding with -max
  std::span<std::uint16_t> shortlist;  ///< features whose key can matter soon, ascending
  std::uint32_t listed = 0;
  Real listed_above = kStaleKey;  ///< the shortlist holds every feature with key >= this
};

/// The keys of one piece of a pair: what its features can carry against the other piece.
struct PieceKeys {
  FeatureKeys faces, edges;
  std::span<std::uint16_t>
      face_support;            ///< per face: last known support vertex of the other piece
  std::span<Real> edge_stamp;  ///< odometer at the last evaluation of an edge's bound
  Real odometer = 0;           ///< since the reference; the bound now is key + odometer
};

/// Features a shortlist keeps beyond those that matter now, in metres of odometer.
inline constexpr Real kShortlistSlack_m = 2.0e-3_r;

/// Faces and edge pair of the last D_near of a scope: where the next search of it starts.
struct SearchStart {
  std::uint32_t face_a = 0, face_b = 0;
  std::uint32_t edge_a = 0, edge_b = 0;
  bool is_edges = false;
  bool is_of_a = false;  ///< the best face is one of A
  bool known = false;
};

struct FeatureBounds {
  PieceKeys a, b;
  Odometer reference;        ///< at which both odometers read zero
  SearchStart start;         ///< of reachable nodes
  SearchStart live;          ///< of live nodes
  bool stale = true;         ///< every key is stale
  std::uint32_t needed = 0;  ///< features that a search without history evaluates

  /// Lays the tables out for a pair of these pieces; with a counting arena only the size is
  /// computed.
  void place(Arena& arena, const PieceRecord& piece_a, const PieceRecord& piece_b) noexcept;

  /// Forgets everything: all keys stale but those of features that `marks` say no pose needs.
  void reset(const NodeMarks& marks) noexcept;

  /// Brings the odometers to the present reading. Cost: a few operations; every feature once when
  /// the reading has grown so far beyond `size_m` that keys would lose digits.
  void advance(const Odometer& now, Real size_m) noexcept;
};

}  // namespace haptic
