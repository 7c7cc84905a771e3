// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The sections of a scene as the writer fills them: bodies with the geometry and the bounds of
/// their pieces, then pairs with their graphs and marks. Private to the scene writer.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "rt_core/scene/scene_format.hpp"
#include "tools/graph_compiler/graph/edge_arcs.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/graph/scene_account.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::tools {

// Lays tables out as the sections of a compiled scene (rt_core/scene/scene_format.hpp): header,
// table of sections, sections at multiples of kSceneAlignment, zeros between them.

class BlobBuilder {
 public:
  /// Appends a section; sections appear in the blob in the order of the calls.
  template <typename T>
  void add(SectionId id, const std::vector<T>& elements) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(id, sizeof(T), elements.size(), std::as_bytes(std::span(elements)));
  }
  void add_bytes(SectionId id, std::uint32_t element_bytes, std::uint64_t count,
                 std::span<const std::byte> bytes);

  /// The blob with its content hash. May be called again with another capacity.
  [[nodiscard]] std::vector<std::byte> finish(const SceneCapacity& capacity) const;

 private:
  struct Section {
    SectionId id;
    std::uint32_t element_bytes;
    std::uint64_t count;
    std::vector<std::byte> bytes;
  };
  std::vector<Section> sections_;
};

/// The sections as they grow, body by body and pair by pair.
struct SceneTables {
  std::vector<SceneParameters> parameters;
  std::vector<BodyRecord> bodies;
  std::vector<PlaneRecord> planes;
  std::vector<PieceRecord> pieces;
  std::vector<std::array<Real, 3>> vertices;
  std::vector<FaceRecord> faces;
  std::vector<std::uint16_t> loop_vertices, loop_edges;
  std::vector<EdgeRecord> edges;
  std::vector<EdgeDirection> edge_directions;
  std::vector<Real> lanes;
  std::vector<EdgeArc> arcs;
  std::vector<std::uint32_t> vertex_edge_begin{0};
  std::vector<std::uint16_t> vertex_edges;
  std::vector<PairRecord> pairs;
  std::vector<NodeRecord> nodes;
  std::vector<std::uint32_t> neighbor_begin{0};
  std::vector<std::uint32_t> neighbors;
  std::vector<std::uint64_t> marks;
  std::vector<ConeRange> cone_ranges;  ///< in cone_directions
  /// Two halves of one section: normals of the sides of facets, by edge, then directions of cones.
  std::vector<std::array<Real, 3>> side_normals, cone_directions;
  std::uint32_t cone_base = 0;  ///< directions of the bodies before; not a section
  std::vector<std::int32_t> source_vertices;
  std::vector<char> text;
  std::vector<PieceTopology> topologies;  ///< of all pieces; not a section
  SceneAccount account;                   ///< not a section
};

/// How many, as records hold it.
template <typename T>
[[nodiscard]] std::uint32_t size32(const std::vector<T>& v) {
  return static_cast<std::uint32_t>(v.size());
}

/// Offset of `words` in the text section, which grows by them.
std::uint32_t add_text(SceneTables& t, const std::string& words);

/// Appends a body with its pieces; the parameters and the bodies before it stand already.
/// @param grip_m    null for a static body.
/// @param progress  gets the fraction of the piece done.
/// @throws InputError when the body is empty, a limit of the format is exceeded, or the pieces do
/// not
///         make up the volume that is stated.
void add_body(SceneTables& t, const PlacedBody& placed, const std::array<double, 3>* grip_m,
              const std::function<void(double)>& progress);

/// Appends a pair; its graph too where it is stored, its marks where it has any (not empty).
void add_pair(SceneTables& t, std::uint32_t piece_a, std::uint32_t piece_b, bool stored,
              const std::vector<std::uint64_t>& marks);

/// All sections in the order of the format; `wide`: neighbors of 32 bits.
BlobBuilder sections_of(const SceneTables& t, bool wide);

}  // namespace haptic::tools
