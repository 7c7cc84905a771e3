// SPDX-License-Identifier: Apache-2.0
// C-obstacles near the part that the hand holds: of what stands, and of other parts that move.
#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/view/wasm/view_core.hpp"
#include "rt_core/scene/laws.hpp"
#include "tools/c_space/c_obstacle.hpp"
#include "tools/common/movers.hpp"

namespace haptic::sim {

using tools::CFace;
using tools::CObstacle;
using tools::make_c_obstacle;
using tools::Vector;
namespace {

/// Pairs that are looked at for one picture.
constexpr std::size_t kMostNear = 64;
/// Where the core searches no goal pose (a scene with surfaces), the pairs to draw are found by
/// their distance.
constexpr tools::NearLimits kNearby{8, 2'000, 128};

/// Movers whose C-obstacles are drawn.
constexpr std::size_t kMostOthers = 4;
/// A plane that holds the part is a face of the C-obstacle within this.
constexpr double kOnFace_m = 1.0e-5;

void add_unique(std::vector<std::uint32_t>& list, std::uint32_t value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

/// A pair for the page, whose numbers have 32 bits; it does not draw one beyond.
void add_told(std::vector<std::uint32_t>& list, PairIndex pair) {
  if (pair < kNone) add_unique(list, static_cast<std::uint32_t>(pair));
}

/// Type of the basic contacts of a face, or kSeveralTypes.
std::uint32_t kind_of(const PairRecord& pair, const CFace& face) {
  const ContactType first = contact_type(pair, face.nodes.front());
  const bool one = std::all_of(face.nodes.begin(), face.nodes.end(), [&](std::uint32_t node) {
    return contact_type(pair, node) == first;
  });
  return one ? static_cast<std::uint32_t>(first) : kSeveralTypes;
}

/// The same contact seen from the other part: its faces are the other one's.
std::uint32_t reversed_kind(std::uint32_t kind) { return kind == 0 ? 1u : kind == 1 ? 0u : kind; }

Vec3 reference_of(const SceneView& scene) {
  const double* const at = scene.bodies()[0].reference_m;
  return {static_cast<Real>(at[0]), static_cast<Real>(at[1]), static_cast<Real>(at[2])};
}

Pose seen_from(const Pose& frame_wb, const Pose& pose_wa) {
  Pose seen;
  seen.q_wa = (frame_wb.q_wa.conjugate() * pose_wa.q_wa).normalized();
  seen.p_wa = frame_wb.q_wa.conjugate() * (pose_wa.p_wa - frame_wb.p_wa);
  return seen;
}

}  // namespace

std::vector<std::uint32_t> ViewCore::held_pairs() const {
  std::vector<std::uint32_t> pairs;
  const FeltContact& felt = core_->felt_contact();
  for (std::uint32_t k = 0; k < felt.plane_count; ++k) add_told(pairs, felt.planes[k].pair);
  return pairs;
}

std::vector<std::uint32_t> ViewCore::near_pairs() {
  std::vector<std::uint32_t> pairs = held_pairs();
  // Its pairs are those of driven parts where these start, not where they are.
  if (!meets_standing()) return {};
  if (result.has_goal_contact == 0) {
    if (!nearby_) nearby_.emplace(*shown_, kNearby);
    std::size_t too_large = 0;
    for (const tools::NearObstacle& near : nearby_->nearest(felt_wa_, too_large))
      add_told(pairs, near.pair);
    return pairs;
  }
  // The nearest pair first; those that were not searched have a bound, or nothing.
  std::vector<std::pair<Real, std::uint32_t>> others;
  for (std::uint32_t k = 0; k < scene.pair_count; ++k) {
    const Real distance = core_->pair_report(k).d_near_m;
    others.emplace_back(std::isnan(distance) ? std::numeric_limits<Real>::max() : distance, k);
  }
  add_unique(pairs, result.nearest_pair);
  std::sort(others.begin(), others.end());
  for (std::size_t k = 0; k < others.size() && pairs.size() < kMostNear; ++k)
    add_unique(pairs, others[k].second);
  return pairs;
}

void ViewCore::describe_obstacles(std::uint32_t most_pairs, std::uint32_t most_nodes) {
  answer.clear();
  answer.counts = {0, 0};
  for (const std::uint32_t pair : near_pairs()) {
    if (answer.counts[0] == most_pairs) break;
    if (shown_->pair_record(pair).node_count > most_nodes) continue;
    answer.counts[0] += 1;
    describe_obstacle(pair, felt_wa_);
  }
  answer.counts[1] = scene.pair_count - answer.counts[0];
  for (OtherPair* const other : near_others()) describe_other(*other, most_pairs, most_nodes);
}

void ViewCore::describe_obstacle(std::uint32_t pair, const Pose& pose_wa) {
  const PairRecord record = shown_->pair_record(pair);
  const CObstacle obstacle = make_c_obstacle(*shown_, pair, pose_wa);
  const FeltContact& felt = core_->felt_contact();
  const PairReport report = core_->pair_report(pair);
  answer.counts.insert(answer.counts.end(), {pair, shown_->pieces()[record.piece_b].body,
                                             static_cast<std::uint32_t>(obstacle.faces.size())});
  for (const CFace& face : obstacle.faces) {
    FaceRole role = FaceRole::kOther;
    std::uint32_t node = kNone;
    if (report.searched && pair == result.nearest_pair) {
      for (const NearNode& near : report.near) {
        if (!std::binary_search(face.nodes.begin(), face.nodes.end(), near.node)) continue;
        role = FaceRole::kNear;
        node = std::min(node, near.node);
      }
    }
    for (std::uint32_t k = 0; k < felt.plane_count; ++k) {
      const FeltPlane& plane = felt.planes[k];
      if (plane.pair != pair || (plane.normal_w.cast<double>() - face.normal).norm() > kSameNormal)
        continue;
      role = FaceRole::kHolds;
      node = std::min(node, face.nodes.front());
    }
    add_face(kind_of(record, face), role, face, node);
  }
}

void ViewCore::add_face(std::uint32_t kind, FaceRole role, const CFace& face, std::uint32_t node) {
  answer.counts.insert(answer.counts.end(),
                       {kind, static_cast<std::uint32_t>(role), face.hidden ? 1u : 0u, node,
                        static_cast<std::uint32_t>(face.nodes.size()),
                        static_cast<std::uint32_t>(face.polygon.size())});
  for (const Vector& corner : face.polygon)
    answer.numbers.insert(answer.numbers.end(), {corner[0], corner[1], corner[2]});
}

/// Scenes of the held part with each mover that it may meet.
void ViewCore::open_others() {
  if (parts_ == nullptr || !others_.empty()) return;
  const PartScenes& parts = parts_->scenes;
  const std::uint32_t held = parts_->hand().part();
  for (std::uint32_t mover = 0; mover < tools::mover_count(parts); ++mover) {
    const std::uint32_t part = tools::part_of_mover(parts, mover);
    auto other = std::make_unique<OtherPair>();
    other->mover = mover;
    std::span<const std::byte> bytes = parts.pair_scene(held, part);
    other->is_reversed = bytes.empty();
    if (bytes.empty()) bytes = parts.pair_scene(part, held);
    if (bytes.empty() || SceneView::open(bytes, other->scene) != RtStatus::kOk) continue;
    others_.push_back(std::move(other));
  }
}

/// Those that the part touches, then the nearest by their mesh frames.
std::vector<ViewCore::OtherPair*> ViewCore::near_others() {
  open_others();
  const FeltContact& felt = core_->felt_contact();
  std::vector<std::pair<Real, OtherPair*>> ranked;
  for (const auto& other : others_) {
    const PairIndex told = kMovingPlanes + tools::part_of_mover(parts_->scenes, other->mover);
    const bool touches = std::any_of(felt.planes.begin(), felt.planes.begin() + felt.plane_count,
                                     [&](const FeltPlane& plane) { return plane.pair == told; });
    const Real far_m = (felt_mover(other->mover).p_wa - felt_wa_.p_wa).norm();
    ranked.emplace_back(touches ? Real{-1} : far_m, other.get());
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& one, const auto& next) { return one.first < next.first; });
  ranked.resize(std::min(ranked.size(), kMostOthers));
  std::vector<OtherPair*> near;
  for (const auto& [far_m, other] : ranked) near.push_back(other);
  return near;
}

/// Pose of its mesh frame.
Pose ViewCore::felt_mover(std::uint32_t mover) const {
  const std::span<const DrivenState> driven = parts_->hand().driven().states();
  return mover < driven.size() ? driven[mover].felt_wa : parts_->hands.felt_wa(1);
}

/// Its C-obstacles at the turn of the held part. In a reversed pair's scene the held part stands:
/// what the other one may not reach from there is, turned about, what the held one may not.
void ViewCore::describe_other(OtherPair& other, std::uint32_t most_pairs,
                              std::uint32_t most_nodes) {
  const Pose mover_wb = felt_mover(other.mover);
  const Pose standing = other.is_reversed ? felt_wa_ : mover_wb;
  const Pose seen =
      other.is_reversed ? seen_from(felt_wa_, mover_wb) : seen_from(mover_wb, felt_wa_);
  if (!other.search)
    other.search.emplace(other.scene, tools::NearLimits{most_pairs, most_nodes, 128});
  const Vec3 grip_a = reference_of(*shown_), reference = reference_of(other.scene);
  const auto grip_at = [&](const Vector& corner) -> Vector {
    const Vec3 c = corner.cast<Real>();
    // The held part's grip point, from where the reference point of the one that moves is.
    const Vec3 at_w =
        other.is_reversed
            ? Vec3(mover_wb.p_wa + mover_wb.q_wa * reference + felt_wa_.q_wa * (grip_a - c))
            : Vec3(standing.p_wa + standing.q_wa * (c + seen.q_wa * (grip_a - reference)));
    return at_w.cast<double>();
  };
  const Vector felt_grip = (felt_wa_.p_wa + felt_wa_.q_wa * grip_a).cast<double>();
  const PairIndex told = kMovingPlanes + tools::part_of_mover(parts_->scenes, other.mover);
  const FeltContact& felt = core_->felt_contact();
  std::size_t too_large = 0;
  for (const tools::NearObstacle& near : other.search->nearest(seen, too_large)) {
    const PairRecord record = other.scene.pair_record(near.pair);
    answer.counts[0] += 1;
    answer.counts.insert(answer.counts.end(),
                         {kNone, scene.body_count + other.mover,
                          static_cast<std::uint32_t>(near.obstacle.faces.size())});
    for (const CFace& there : near.obstacle.faces) {
      CFace face = there;
      face.normal = (standing.q_wa * there.normal.cast<Real>()).cast<double>();
      for (Vector& corner : face.polygon) corner = grip_at(corner);
      std::uint32_t kind = kind_of(record, there);
      if (other.is_reversed) {
        face.normal = -face.normal;
        std::reverse(face.polygon.begin(), face.polygon.end());
        kind = reversed_kind(kind);
      }
      FaceRole role = FaceRole::kOther;
      for (std::uint32_t k = 0; k < felt.plane_count; ++k) {
        const FeltPlane& plane = felt.planes[k];
        if (plane.pair != told || face.polygon.empty() ||
            (plane.normal_w.cast<double>() - face.normal).norm() > kSameNormal)
          continue;
        const double apart_m = std::abs(face.normal.dot(felt_grip - face.polygon.front()));
        if (apart_m < kOnFace_m) role = FaceRole::kHolds;
      }
      add_face(kind, role, face, role == FaceRole::kHolds ? face.nodes.front() : kNone);
    }
  }
}

}  // namespace haptic::sim
