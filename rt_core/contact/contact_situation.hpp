// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Names of what touches what.

#include <cstddef>
#include <cstdint>

namespace haptic {

enum class FeatureKind : std::uint8_t { kVertex, kEdge, kFace };

/// Contact situation of one pair (paper Sec. IV): which features of A and B are in contact.
enum class ContactSituation : std::uint8_t {
  kNone = 0,       ///< separated
  kFaceVertex,     ///< one type-A basic contact
  kVertexFace,     ///< one type-B basic contact
  kEdgeEdge,       ///< one type-C basic contact
  kEdgeFace,       ///< two or more basic contacts on a segment
  kFaceFace,       ///< basic contacts that span a polygon
  kSeveralPlanes,  ///< near C-faces of different planes at equal depth
  kCount
};

/// Text as it stands in the replay's `state` column: none, face_vertex, vertex_face, edge_edge,
/// edge_face, face_face, several_planes. Static storage.
[[nodiscard]] constexpr const char* to_text(ContactSituation situation) noexcept {
  constexpr const char* kNames[] = {"none",      "face_vertex", "vertex_face",   "edge_edge",
                                    "edge_face", "face_face",   "several_planes"};
  static_assert(sizeof(kNames) / sizeof(kNames[0]) ==
                static_cast<std::size_t>(ContactSituation::kCount));
  return situation < ContactSituation::kCount ? kNames[static_cast<std::size_t>(situation)]
                                              : "invalid";
}

}  // namespace haptic
