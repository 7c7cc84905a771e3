// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Exact convex decomposition of solids on boundary chains, with its certificate (METHOD sections
/// 4-8).

#include <functional>

#include "tools/graph_compiler/graph/convex_piece.hpp"
#include "tools/graph_compiler/polyhedron/chain.hpp"
#include "tools/graph_compiler/polyhedron/flatten.hpp"

namespace haptic::tools {

// Pieces of solids that overlap, cut until no two of them do (METHOD section 6, option
// "disjoint").

/// Convex pieces without common interior. Parts that an earlier solid covers are taken from the
/// later ones and kept in `removed`, for the certificate: pieces and removed parts of a solid
/// together are the solid, and every removed part lies in a piece.
struct DisjointPieces {
  std::vector<Solid> pieces;
  std::vector<std::uint32_t> piece_solid;
  std::vector<Solid> removed;
  std::vector<std::uint32_t> removed_solid;
};

/// Subtracts the pieces of earlier solids from those of later ones, plane by plane, and merges what
/// is left within each solid. Pieces of one solid must not overlap.
/// @throws WorkLimitReached, BrokenChain
DisjointPieces make_disjoint(ExactWorld& world, const std::vector<Solid>& pieces,
                             const std::vector<std::uint32_t>& piece_solid);

struct DecompositionLimits {
  std::size_t max_pieces = 4000;
  int strategies = 12;
  bool disjoint = false;  ///< solids that overlap are cut apart; otherwise they stay a cover
};

/// METHOD section 7: what was proved about the pieces, exactly.
struct Certificate {
  bool convex = false;        ///< every vertex of a piece on the inner side of all its planes
  bool partition = false;     ///< all (plane, line, vertex) counts zero, per solid
  bool disjoint = false;      ///< a face plane separates every two pieces of one solid
  bool volume_equal = false;  ///< exact rational equality per solid
  bool cover = false;         ///< solids of the body overlap: kept as a cover of the union
  std::size_t nonzero_counts = 0;
  std::size_t removed = 0;  ///< parts of solids that pieces of other solids cover (disjoint)
  double volume_m3 = 0.0;   ///< sum over solids, less the removed parts
  [[nodiscard]] bool holds() const { return convex && partition && disjoint && volume_equal; }
};

struct Decomposition {
  std::vector<Solid> pieces;  ///< over FlatBody::world (which has grown by cut planes and points)
  std::vector<std::uint32_t> piece_solid;  ///< index of the solid that each piece belongs to
  Certificate certificate;
  std::size_t face_plane_only_pieces = 0;  ///< what strategies without mitre planes reached
  double thinnest_m = 0.0;
  double work = 0.0;
  std::vector<std::string> warnings;
};

/// Progress of the long part: fraction of the work in [0, 1].
using Progress = std::function<void(double)>;

/// @throws InputError when a limit is exceeded or the certificate fails; `file` names the mesh in
/// messages.
Decomposition decompose(FlatBody& body, const std::string& file, const DecompositionLimits& limits,
                        const Progress& progress = {});

/// Checks pieces against the solids they came from, from scratch. Used by `decompose` and by tests
/// on mutated pieces. With `removed` (solids cut apart, see make_disjoint) pieces and removed parts
/// together must be the solids, every removed part must lie in a piece, and no two pieces may
/// overlap, or `partition` and `disjoint` fail.
Certificate certify(ExactWorld& world, const std::vector<FlatSolid>& solids,
                    const std::vector<Solid>& pieces, const std::vector<std::uint32_t>& piece_solid,
                    const DisjointPieces* removed = nullptr);

/// Rounds exact pieces to doubles in the body's (scaled file) frame: planes stored once, vertices
/// nearest doubles, face loops counter-clockwise, volumes and centre exact before rounding. A part
/// that was clean keeps its vertices to within 4 ulp. `order`, where given, is filled: for each
/// piece of the body its index in the decomposition.
Body to_body(const FlatBody& body, const Decomposition& decomposition, const std::string& name,
             std::vector<std::size_t>* order = nullptr);

}  // namespace haptic::tools
