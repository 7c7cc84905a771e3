// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/scene_view.hpp"

#include <algorithm>
#include <cstring>

#include "rt_core/scene/laws.hpp"
#include "rt_core/scene/scene_check.hpp"
#include "rt_core/scene/scene_needs.hpp"

namespace haptic {
namespace {

constexpr std::uint64_t kFnvOffset = 0xcbf29ce484222325ull;
constexpr std::uint64_t kFnvPrime = 0x100000001b3ull;

/// Element sizes of the known sections; 0 marks kNeighbors, which has two.
struct KnownSection {
  SectionId id;
  std::uint32_t element_bytes;
};
constexpr KnownSection kKnown[] = {
    {SectionId::kParameters, sizeof(SceneParameters)},
    {SectionId::kBodies, sizeof(BodyRecord)},
    {SectionId::kPlanes, sizeof(PlaneRecord)},
    {SectionId::kPieces, sizeof(PieceRecord)},
    {SectionId::kVertices, 3 * sizeof(Real)},
    {SectionId::kFaces, sizeof(FaceRecord)},
    {SectionId::kLoopVertices, sizeof(std::uint16_t)},
    {SectionId::kLoopEdges, sizeof(std::uint16_t)},
    {SectionId::kEdges, sizeof(EdgeRecord)},
    {SectionId::kEdgeDirections, sizeof(EdgeDirection)},
    {SectionId::kVertexEdgeBegin, sizeof(std::uint32_t)},
    {SectionId::kVertexEdges, sizeof(std::uint16_t)},
    {SectionId::kPairs, sizeof(PairRecord)},
    {SectionId::kNodes, sizeof(NodeRecord)},
    {SectionId::kNeighborBegin, sizeof(std::uint32_t)},
    {SectionId::kNeighbors, 0},
    {SectionId::kSourceVertices, sizeof(std::int32_t)},
    {SectionId::kText, 1},
    {SectionId::kVertexLanes, sizeof(Real)},
    {SectionId::kEdgeArcs, sizeof(EdgeArc)},
    {SectionId::kNodeMarks, sizeof(std::uint64_t)},
    {SectionId::kSimplified, sizeof(SimplifiedBody)},
    {SectionId::kConeRanges, sizeof(ConeRange)},
    {SectionId::kConeDirections, 3 * sizeof(Real)},
    {SectionId::kGuide, sizeof(GuideRecord)},
    {SectionId::kGuideStations, sizeof(GuideStation)},
};
/// What a scene of surfaces has in addition to the tables that every scene has.
constexpr SectionId kOfFacets[] = {SectionId::kConeRanges, SectionId::kConeDirections};
constexpr bool is_among(std::span<const SectionId> ids, SectionId id) noexcept {
  return std::find(ids.begin(), ids.end(), id) != ids.end();
}
/// Sections that some scene does without.
constexpr bool is_optional(SectionId id) noexcept {
  return id == SectionId::kNodeMarks || id == SectionId::kSimplified || id == SectionId::kGuide ||
         id == SectionId::kGuideStations || is_among(kOfFacets, id);
}
constexpr std::uint32_t bit_of(SectionId id) noexcept {
  return 1u << static_cast<std::uint32_t>(id);
}

/// Address of the bytes at `offset`; the caller has checked bounds and alignment.
template <typename T>
std::span<const T> table(std::span<const std::byte> blob, const SectionEntry& entry) noexcept {
  return {reinterpret_cast<const T*>(blob.data() + entry.offset),
          static_cast<std::size_t>(entry.count)};
}

std::span<const std::byte> section_bytes(std::span<const std::byte> blob,
                                         const SectionEntry& entry) noexcept {
  return blob.subspan(static_cast<std::size_t>(entry.offset),
                      static_cast<std::size_t>(entry.count * entry.element_bytes));
}

RtStatus check_header(std::span<const std::byte> front, std::uint64_t byte_count) noexcept {
  if (front.size() < sizeof(SceneHeader)) return RtStatus::kBlobTooSmall;
  if (reinterpret_cast<std::uintptr_t>(front.data()) % kSceneAlignment != 0)
    return RtStatus::kBlobMisaligned;
  const auto& header = *reinterpret_cast<const SceneHeader*>(front.data());
  if (std::memcmp(header.magic, kSceneMagic, sizeof(kSceneMagic)) != 0)
    return RtStatus::kBlobBadMagic;
  if (header.version != kSceneVersion) return RtStatus::kBlobBadVersion;
  if (header.header_bytes != sizeof(SceneHeader)) return RtStatus::kBlobBadVersion;
  if (header.byte_count != byte_count) return RtStatus::kBlobTooSmall;
  return header.scalar_bytes == sizeof(Real) ? RtStatus::kOk : RtStatus::kBlobWrongScalar;
}

// In bounds, aligned, ascending, each close behind the one before, the last up to the end.
RtStatus find_sections(std::span<const std::byte> front, std::uint64_t byte_count,
                       std::span<const SectionEntry>& sections) noexcept {
  const auto& header = *reinterpret_cast<const SceneHeader*>(front.data());
  const std::uint64_t table_at = header.section_table;
  if (header.section_count > kMaxSections || table_at != sizeof(SceneHeader))
    return RtStatus::kBlobBadSectionTable;
  if (header.section_count * sizeof(SectionEntry) > front.size() - table_at)
    return RtStatus::kBlobBadSectionTable;
  sections = {reinterpret_cast<const SectionEntry*>(front.data() + table_at), header.section_count};
  std::uint64_t end = table_at + sections.size_bytes();
  for (const SectionEntry& s : sections) {
    if (s.element_bytes == 0 || s.offset % kSceneAlignment != 0 || s.offset < end ||
        s.offset > byte_count) {
      return RtStatus::kBlobBadSectionTable;
    }
    if (s.count > (byte_count - s.offset) / s.element_bytes) return RtStatus::kBlobBadSectionTable;
    if (s.offset - end >= 2 * kSceneAlignment) return RtStatus::kBlobBadSectionTable;
    end = s.offset + s.count * s.element_bytes;
  }
  return end == byte_count ? RtStatus::kOk : RtStatus::kBlobBadSectionTable;
}

RtStatus check_between_sections(std::span<const std::byte> blob,
                                std::span<const SectionEntry> sections) noexcept {
  std::uint64_t end = sizeof(SceneHeader) + sections.size_bytes();
  for (const SectionEntry& s : sections) {
    for (std::uint64_t i = end; i < s.offset; ++i) {
      if (blob[static_cast<std::size_t>(i)] != std::byte{0}) return RtStatus::kBlobBadSectionTable;
    }
    end = s.offset + s.count * s.element_bytes;
  }
  return RtStatus::kOk;
}

}  // namespace

std::uint64_t scene_content_hash(std::span<const std::byte> blob) noexcept {
  std::uint64_t hash = kFnvOffset;
  const std::size_t hash_at = offsetof(SceneHeader, content_hash);
  std::size_t i = 0;
  for (; i + 8 <= blob.size(); i += 8) {
    std::uint64_t word = 0;
    if (i != hash_at) std::memcpy(&word, blob.data() + i, 8);
    hash = (hash ^ word) * kFnvPrime;
    hash ^= hash >> 32;  // carries high input bits down to where the multiplication reaches
  }
  for (; i < blob.size(); ++i) hash = (hash ^ std::to_integer<std::uint64_t>(blob[i])) * kFnvPrime;
  return hash;
}

RtStatus SceneView::bind(std::span<const std::byte> blob) noexcept {
  RtStatus status = check_header(blob, blob.size());
  if (status != RtStatus::kOk) return status;
  header_ = reinterpret_cast<const SceneHeader*>(blob.data());
  if (header_->content_hash != scene_content_hash(blob)) return RtStatus::kBlobBadHash;
  blob_ = blob;
  status = find_sections(blob, blob.size(), sections_);
  if (status == RtStatus::kOk) status = check_between_sections(blob, sections_);
  if (status != RtStatus::kOk) return status;

  const SectionEntry* found[sizeof(kKnown) / sizeof(kKnown[0])] = {};
  for (const SectionEntry& s : sections_) {
    for (std::size_t k = 0; k < sizeof(kKnown) / sizeof(kKnown[0]); ++k) {
      if (kKnown[k].id != s.id) continue;
      const bool size_fits = kKnown[k].element_bytes != 0
                                 ? s.element_bytes == kKnown[k].element_bytes
                                 : s.element_bytes == sizeof(std::uint16_t) ||
                                       s.element_bytes == sizeof(std::uint32_t);
      if (found[k] != nullptr || !size_fits) return RtStatus::kBlobBadSectionTable;
      found[k] = &s;
      found_sections_ |= bit_of(s.id);
    }
  }
  for (std::size_t k = 0; k < sizeof(kKnown) / sizeof(kKnown[0]); ++k) {
    if (found[k] == nullptr && !is_optional(kKnown[k].id)) return RtStatus::kBlobMissingSection;
  }
  if (found[0]->count != 1) return RtStatus::kBlobBadCount;
  parameters_ = table<SceneParameters>(blob, *found[0]).data();
  bodies_ = table<BodyRecord>(blob, *found[1]);
  tables_.planes = table<PlaneRecord>(blob, *found[2]);
  tables_.pieces = table<PieceRecord>(blob, *found[3]);
  tables_.vertices = {reinterpret_cast<const Real*>(blob.data() + found[4]->offset),
                      static_cast<std::size_t>(3 * found[4]->count)};
  tables_.faces = table<FaceRecord>(blob, *found[5]);
  tables_.loop_vertices = table<std::uint16_t>(blob, *found[6]);
  tables_.loop_edges = table<std::uint16_t>(blob, *found[7]);
  tables_.edges = table<EdgeRecord>(blob, *found[8]);
  tables_.edge_directions = table<EdgeDirection>(blob, *found[9]);
  tables_.vertex_edge_begin = table<std::uint32_t>(blob, *found[10]);
  tables_.vertex_edges = table<std::uint16_t>(blob, *found[11]);
  graph_.pairs = table<PairRecord>(blob, *found[12]);
  graph_.nodes = table<NodeRecord>(blob, *found[13]);
  graph_.neighbor_begin = table<std::uint32_t>(blob, *found[14]);
  graph_.neighbors = section_bytes(blob, *found[15]);
  graph_.neighbor_count = found[15]->count;
  graph_.wide = found[15]->element_bytes == sizeof(std::uint32_t);
  tables_.source_vertices = table<std::int32_t>(blob, *found[16]);
  text_ = section_bytes(blob, *found[17]);
  tables_.lanes = table<Real>(blob, *found[18]);
  tables_.arcs = table<EdgeArc>(blob, *found[19]);
  if (found[20] != nullptr) graph_.marks = table<std::uint64_t>(blob, *found[20]);
  if (found[22] != nullptr) tables_.cone_ranges = table<ConeRange>(blob, *found[22]);
  if (found[23] != nullptr) {
    tables_.cone_directions = {reinterpret_cast<const Real*>(blob.data() + found[23]->offset),
                               static_cast<std::size_t>(3 * found[23]->count)};
  }
  facets_ = haptic::has_facets(tables_.pieces);
  return RtStatus::kOk;
}

RtStatus SceneView::open(std::span<const std::byte> blob, SceneView& view) noexcept {
  SceneFault fault;
  return open(blob, view, fault);
}

RtStatus SceneView::open(std::span<const std::byte> blob, SceneView& view,
                         SceneFault& fault) noexcept {
  fault = SceneFault{};
  SceneView v;
  RtStatus status = v.bind(blob);
  if (status != RtStatus::kOk) return status;
  if (kSceneTraits.image && v.header_->content_hash != kSceneTraits.content_hash) {
    return RtStatus::kBlobNotOfImage;
  }
  if (kSceneTraits.table_checks) status = v.check_tables(fault);
  if (status != RtStatus::kOk) return status;
  if (kSceneTraits.image && !covers(kSceneTraits, needs_of(v))) return RtStatus::kBlobNotOfImage;
  view = v;
  return RtStatus::kOk;
}

RtStatus SceneView::check_front(std::span<const std::byte> front,
                                std::uint64_t byte_count) noexcept {
  const RtStatus status = check_header(front, byte_count);
  if (status != RtStatus::kOk) return status;
  std::span<const SectionEntry> sections;
  return find_sections(front, byte_count, sections);
}

RtStatus SceneView::check_tables(SceneFault& fault) const noexcept {
  RtStatus status = check_parameters();
  if (status != RtStatus::kOk) return status;
  status = check_sections();
  if (status != RtStatus::kOk) return status;
  fault = {SectionId::kBodies, 0};
  status = check_bodies(fault);
  if (status != RtStatus::kOk) return status;
  fault = {SectionId::kSimplified, 0};
  status = check::simplified(simplified_bodies(), bodies_, fault.index);
  if (status != RtStatus::kOk) return status;
  fault = {SectionId::kGuide, 0};
  status = check_guide(fault);
  if (status != RtStatus::kOk) return status;
  fault = {SectionId::kConeDirections, 0};
  status = check::unit_directions(tables_.cone_directions, fault.index);
  if (status != RtStatus::kOk) return status;
  std::uint64_t cones = 0;
  for (std::uint32_t i = 0; i < tables_.pieces.size(); ++i) {
    fault = {SectionId::kPieces, i};
    status = check_cones(i, cones);
    if (status == RtStatus::kOk) status = check_piece(i);
    if (status != RtStatus::kOk) return status;
  }
  if (cones != tables_.cone_ranges.size()) return RtStatus::kBlobBadCount;
  status = lists_pairs() ? check_pairs(fault) : check_formed_pairs(fault);
  if (status != RtStatus::kOk) return status;
  fault = {SectionId{0}, 0};
  return check_capacity();
}

/// A scene has the tables of surfaces where a piece is a facet, and only there.
RtStatus SceneView::check_sections() const noexcept {
  for (const SectionId id : kOfFacets) {
    if (((found_sections_ & bit_of(id)) != 0) != facets_)
      return facets_ ? RtStatus::kBlobMissingSection : RtStatus::kBlobBadSectionTable;
  }
  // No depth and no inside.
  return facets_ && has_goal_contact(*parameters_) ? RtStatus::kBlobBadNumber : RtStatus::kOk;
}

std::span<const SimplifiedBody> SceneView::simplified_bodies() const noexcept {
  for (const SectionEntry& s : sections_) {
    if (s.id == SectionId::kSimplified) return table<SimplifiedBody>(blob_, s);
  }
  return {};
}

const GuideRecord* SceneView::guide() const noexcept {
  for (const SectionEntry& s : sections_) {
    if (s.id == SectionId::kGuide) return table<GuideRecord>(blob_, s).data();
  }
  return nullptr;
}

std::span<const GuideStation> SceneView::guide_stations() const noexcept {
  for (const SectionEntry& s : sections_) {
    if (s.id == SectionId::kGuideStations) return table<GuideStation>(blob_, s);
  }
  return {};
}

/// A guide has its stations, and stations have their guide.
RtStatus SceneView::check_guide(SceneFault& fault) const noexcept {
  const bool has_stations = (found_sections_ & bit_of(SectionId::kGuideStations)) != 0;
  if ((guide() != nullptr) != has_stations) return RtStatus::kBlobMissingSection;
  if (!has_stations) return RtStatus::kOk;
  for (const SectionEntry& s : sections_) {
    if (s.id == SectionId::kGuide && s.count != 1) return RtStatus::kBlobBadCount;
  }
  const RtStatus status = check::guide(*guide());
  if (status != RtStatus::kOk) return status;
  fault = {SectionId::kGuideStations, 0};
  return check::guide_stations(guide_stations(), static_cast<double>(guide()->turn_m), fault.index);
}

PieceView SceneView::piece(std::uint32_t index) const noexcept {
  const PieceRecord& r = tables_.pieces[index];
  PieceView v;
  v.record = &r;
  v.vertices = tables_.vertices.data() + 3 * std::size_t{r.vertex_begin};
  v.faces = tables_.faces.data() + r.face_begin;
  v.edges = tables_.edges.data() + r.edge_begin;
  v.edge_directions = tables_.edge_directions.data() + r.edge_begin;
  v.vertex_edge_begin = tables_.vertex_edge_begin.data() + r.vertex_begin;
  v.vertex_edges = tables_.vertex_edges.data();
  v.loop_vertices = tables_.loop_vertices.data();
  v.loop_edges = tables_.loop_edges.data();
  v.planes = tables_.planes.data() + bodies_[r.body].plane_begin;
  v.source_vertices = tables_.source_vertices.data() + r.vertex_begin;
  v.vertex_count = r.vertex_count;
  v.face_count = r.face_count;
  v.edge_count = r.edge_count;
  v.lane_count = r.lane_count;
  if (is_flat(r)) {
    v.cones = tables_.cone_ranges.data() + r.cone_begin;
    v.cone_directions = tables_.cone_directions.data();
  } else {
    v.lanes = tables_.lanes.data() + r.lane_begin;
    v.arcs = tables_.arcs.data() + (r.edge_begin - r.flat_edges);
  }
  return v;
}

PairView SceneView::pair(PairIndex index) const noexcept {
  PairView v;
  v.record = pair_record(index);
  const PairRecord& r = v.record;
  v.a = piece(r.piece_a);
  v.b = piece(r.piece_b);
  if (!lists_pairs()) {
    v.marks = marks_of_pieces(piece_marks(graph_.marks.data(), *v.a.record),
                              piece_marks(graph_.marks.data(), *v.b.record));
    return v;
  }
  if (r.mark_begin != kNotMarked) {
    v.marks = marks_at(graph_.marks.data() + r.mark_begin, r, *v.a.record, *v.b.record);
  }
  v.graph_stored = r.node_begin != kGraphNotStored;
  if (!v.graph_stored) return v;
  v.nodes = graph_.nodes.data() + r.node_begin;
  v.neighbors = {graph_.neighbor_begin.data() + r.node_begin, graph_.neighbors.data(), graph_.wide};
  return v;
}

PairRecord SceneView::pair_record(PairIndex index) const noexcept {
  if (lists_pairs()) return graph_.pairs[static_cast<std::size_t>(index)];
  const auto a = static_cast<std::uint32_t>(index / static_pieces());
  const auto b = bodies_[0].piece_count + static_cast<std::uint32_t>(index % static_pieces());
  return formed_pair(a, tables_.pieces[a], b, tables_.pieces[b]);
}

PairIndex SceneView::find_pair(std::uint32_t piece_a, std::uint32_t piece_b) const noexcept {
  if (!lists_pairs())
    return PairIndex{piece_a} * static_pieces() + (piece_b - bodies_[0].piece_count);
  const auto found = std::lower_bound(
      graph_.pairs.begin(), graph_.pairs.end(), 0, [&](const PairRecord& pair, int) {
        return pair.piece_a < piece_a || (pair.piece_a == piece_a && pair.piece_b < piece_b);
      });
  const bool is_it =
      found != graph_.pairs.end() && found->piece_a == piece_a && found->piece_b == piece_b;
  return is_it ? static_cast<PairIndex>(found - graph_.pairs.begin()) : kNoPair;
}

std::string_view SceneView::text(std::uint32_t offset, std::uint32_t bytes) const noexcept {
  return {reinterpret_cast<const char*>(text_.data()) + offset, bytes};
}

RtStatus SceneView::check_parameters() const noexcept {
  const SceneParameters& p = *parameters_;
  if (find_law(p.law) == nullptr) return RtStatus::kBlobBadNumber;
  if (p.motion_limits_given > 1 || p.goal_contact > 1) return RtStatus::kBlobBadNumber;
  if (p.work_units < kLeastWorkUnits || p.work_units > kMostWorkUnits)
    return RtStatus::kBlobBadNumber;
  if (!check::positive(p.k_f_n_per_m) || !check::positive(p.rate_hz) ||
      p.k_f_n_per_m > kMaxStiffness_n_per_m) {
    return RtStatus::kBlobBadNumber;
  }
  for (const double x : {p.epsilon_m, p.exact_band_m}) {
    if (!check::positive(x) || x > kMaxSceneLength_m) return RtStatus::kBlobBadNumber;
  }
  double q2 = 0.0;
  for (const double x : p.start_p_wa_m) {
    if (!check::is_coordinate(x)) return RtStatus::kBlobBadNumber;
  }
  for (const double x : p.start_q_wa_xyzw) {
    if (!check::finite(x)) return RtStatus::kBlobBadNumber;
    q2 += x * x;
  }
  if (!(q2 > 1.0 - 1e-6 && q2 < 1.0 + 1e-6)) return RtStatus::kBlobBadNumber;
  for (const double x : {p.max_linear_speed_m_per_s, p.max_angular_speed_rad_per_s}) {
    if (!check::finite(x) || x < 0.0) return RtStatus::kBlobBadNumber;
  }
  if (!check::within(p.name_offset, p.name_bytes, text_.size())) return RtStatus::kBlobBadIndex;
  for (const RtStatus status : {check::device(p.device), check::envelope(p.envelope),
                                check::held(p.held), check::coupling(p.coupling)}) {
    if (status != RtStatus::kOk) return status;
  }
  return RtStatus::kOk;
}

}  // namespace haptic
