// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The contact of the part as the hand feels it: the planes that hold the proxy, and its contact
/// points along them (paper Sec. IV, at a free configuration).

#include <array>
#include <cstdint>

#include "rt_core/base/pose.hpp"
#include "rt_core/contact/basic_contact.hpp"
#include "rt_core/contact/contact_situation.hpp"
#include "rt_core/scene/formed_pairs.hpp"
#include "rt_core/scene/proxy_limits.hpp"

namespace haptic {

/// In place of the number of a pair of pieces: the plane is one of another part that moves, and
/// that part's number is added.
inline constexpr PairIndex kMovingPlanes = PairIndex{1} << 63;

/// A C-face plane that holds the part.
struct FeltPlane {
  PairIndex pair = 0;                  ///< or kMovingPlanes and more
  Vec3 normal_w = Vec3::Zero();        ///< unit, from B to A
  Real gap_m = 0;                      ///< along the plane; within the proxy's tolerance of 0
  std::uint32_t point_count = 0;       ///< contact points along it
  ContactType type = ContactType::kA;  ///< face of A, face of B, or two edges
};

struct FeltContact {
  std::array<FeltPlane, kMaxFeltPlanes> planes;
  std::uint32_t plane_count = 0;
  std::uint32_t point_count = 0;  ///< of all planes
  /// Of all planes together; kSeveralPlanes where their normals differ.
  ContactSituation situation = ContactSituation::kNone;
};

}  // namespace haptic
