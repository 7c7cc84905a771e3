// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Which contact of two uncut bodies a basic contact of two of their pieces is. Cuts repeat planes,
/// and corners of the user's mesh: a face is known by its plane, an edge by the planes of its two
/// faces, a corner by its vertex of the mesh. One that a cut has made is only itself.

#include <array>
#include <compare>
#include <cstdint>

#include "rt_core/contact/near_set.hpp"

namespace haptic {

struct ContactIdentity {
  ContactType type = ContactType::kA;
  std::array<std::uint32_t, 2> of_a{}, of_b{};
  auto operator<=>(const ContactIdentity&) const = default;
};

/// A plane of a body with the side that is outward.
[[nodiscard]] inline std::uint32_t plane_identity(const PieceView& piece,
                                                  std::uint32_t f) noexcept {
  const FaceRecord& face = piece.faces[f];
  return 2 * face.plane + (face.sign < 0 ? 1u : 0u);
}

[[nodiscard]] inline std::array<std::uint32_t, 2> edge_identity(const PieceView& piece,
                                                                std::uint32_t e) noexcept {
  const EdgeRecord& edge = piece.edges[e];
  const std::uint32_t p = plane_identity(piece, edge.face[0]);
  const std::uint32_t q = plane_identity(piece, edge.face[1]);
  return p < q ? std::array{p, q} : std::array{q, p};
}

[[nodiscard]] inline std::array<std::uint32_t, 2> vertex_identity(const PieceView& piece,
                                                                  std::uint32_t v) noexcept {
  const std::int32_t source = piece.source_vertices[v];
  if (source >= 0) return {0, static_cast<std::uint32_t>(source)};
  return {1, piece.record->vertex_begin + v};
}

/// Equal for basic contacts of two pairs of the same bodies that are one. Cost: a few reads.
[[nodiscard]] inline ContactIdentity contact_identity(const PairView& pair,
                                                      const NearNode& node) noexcept {
  ContactIdentity identity;
  identity.type = node.type;
  switch (compiled_type(node.type)) {
    case ContactType::kA:
      identity.of_a = {plane_identity(pair.a, node.i), 0};
      identity.of_b = vertex_identity(pair.b, node.j);
      break;
    case ContactType::kB:
      identity.of_a = vertex_identity(pair.a, node.i);
      identity.of_b = {plane_identity(pair.b, node.j), 0};
      break;
    case ContactType::kC:
      identity.of_a = edge_identity(pair.a, node.i);
      identity.of_b = edge_identity(pair.b, node.j);
      break;
  }
  return identity;
}

}  // namespace haptic
