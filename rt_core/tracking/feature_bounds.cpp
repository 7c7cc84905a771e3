// SPDX-License-Identifier: Apache-2.0
#include "rt_core/tracking/feature_bounds.hpp"

#include <algorithm>

namespace haptic {
namespace {

/// Odometers are read relative to a reference no farther back than this many pair sizes.
constexpr Real kMaxReading = 64;

std::size_t padded(std::size_t count) noexcept {
  return (count + kLanePadding - 1) / kLanePadding * kLanePadding;
}

void place_keys(FeatureKeys& keys, Arena& arena, std::uint32_t count) noexcept {
  keys.key = arena.take<Real>(padded(count));
  keys.shortlist = arena.take<std::uint16_t>(count);
}

void place_piece(PieceKeys& keys, Arena& arena, const PieceRecord& piece) noexcept {
  place_keys(keys.faces, arena, piece.face_count);
  place_keys(keys.edges, arena, piece.edge_count);
  keys.edge_stamp = arena.take<Real>(piece.edge_count);
  keys.face_support = arena.take<std::uint16_t>(piece.face_count);
}

/// `first`: number of the features' first in the marks.
void reset_keys(FeatureKeys& keys, const NodeMarks& marks, std::uint32_t first) noexcept {
  const std::size_t count = keys.shortlist.size();
  for (std::size_t k = 0; k < keys.key.size(); ++k) {
    const bool needed =
        k < count && marks.feature(NodeScope::kReachable, first + static_cast<std::uint32_t>(k));
    keys.key[k] = needed ? kStaleKey : kDeadKey;
  }
  keys.listed = 0;
  keys.listed_above = kStaleKey;
}

void reset_piece(PieceKeys& keys, const NodeMarks& marks, std::uint32_t first_face,
                 std::uint32_t first_edge) noexcept {
  reset_keys(keys.faces, marks, first_face);
  reset_keys(keys.edges, marks, first_edge);
  std::fill(keys.edge_stamp.begin(), keys.edge_stamp.end(), Real{0});
  std::fill(keys.face_support.begin(), keys.face_support.end(), std::uint16_t{0});
  keys.odometer = 0;
}

/// A difference of odometers in Real, rounded up; what their own sums have lost is added.
Real reading(double now, double reference) noexcept {
  const double lost = now > reference ? kOdometerRounding * now : 0;
  const double difference = (now - reference + lost) * (1 + 4 * static_cast<double>(kRealEpsilon));
  return static_cast<Real>(difference);
}

/// Sum that is not below the exact one.
Real sum_up(Real l, Real r) noexcept {
  const Real sum = l + r;
  return sum + 2 * kRealEpsilon * (sum < 0 ? -sum : sum);
}

void rebase_keys(FeatureKeys& keys, Real odometer) noexcept {
  const std::size_t count = keys.shortlist.size();
  for (std::size_t k = 0; k < count; ++k) {
    if (keys.key[k] < kStaleKey && keys.key[k] > kDeadKey)
      keys.key[k] = sum_up(keys.key[k], odometer);
  }
  keys.listed_above = kStaleKey;  // listed again at the next search
}

void rebase(PieceKeys& keys) noexcept {
  rebase_keys(keys.faces, keys.odometer);
  rebase_keys(keys.edges, keys.odometer);
  for (Real& stamp : keys.edge_stamp) stamp -= keys.odometer;
  keys.odometer = 0;
}

}  // namespace

void FeatureBounds::place(Arena& arena, const PieceRecord& piece_a,
                          const PieceRecord& piece_b) noexcept {
  place_piece(a, arena, piece_a);
  place_piece(b, arena, piece_b);
}

void FeatureBounds::reset(const NodeMarks& marks) noexcept {
  reset_piece(a, marks, marks.features.face_a(0), marks.features.edge_a(0));
  reset_piece(b, marks, marks.features.face_b(0), marks.features.edge_b(0));
  start = live = SearchStart{};
  needed = 0;
  for (const FeatureKeys* keys : {&a.faces, &a.edges, &b.faces, &b.edges}) {
    for (const Real key : keys->key) needed += key == kStaleKey ? 1u : 0u;
  }
  stale = true;
}

void FeatureBounds::advance(const Odometer& now, Real size_m) noexcept {
  if (stale) {
    reference = now;
    return;
  }
  a.odometer = reading(now.of_a, reference.of_a);
  b.odometer = reading(now.of_b, reference.of_b);
  if (std::max(a.odometer, b.odometer) <= kMaxReading * size_m) return;
  rebase(a);
  rebase(b);
  reference = now;
}

}  // namespace haptic
