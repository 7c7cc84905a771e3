// SPDX-License-Identifier: Apache-2.0
#include "rt_core/scene/scene_view.hpp"

#include <cstring>

#include "rt_core/scene/scene_check.hpp"

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
};

/// Address of the bytes at `offset`; the caller has checked bounds and alignment.
template <typename T>
std::span<const T> table(std::span<const std::byte> blob, const SectionEntry& entry) noexcept {
  return {reinterpret_cast<const T*>(blob.data() + entry.offset),
          static_cast<std::size_t>(entry.count)};
}

/// In bounds, aligned, ascending and apart from the section before it; gaps filled with zeros.
RtStatus check_section_table(std::span<const std::byte> blob,
                             std::span<const SectionEntry> sections,
                             std::uint64_t table_end) noexcept {
  std::uint64_t end = table_end;
  for (const SectionEntry& s : sections) {
    if (s.element_bytes == 0 || s.offset % kSceneAlignment != 0 || s.offset < end ||
        s.offset > blob.size()) {
      return RtStatus::kBlobBadSectionTable;
    }
    if (s.count > (blob.size() - s.offset) / s.element_bytes) return RtStatus::kBlobBadSectionTable;
    if (s.offset - end >= 2 * kSceneAlignment) return RtStatus::kBlobBadSectionTable;
    for (std::uint64_t i = end; i < s.offset; ++i) {
      if (blob[i] != std::byte{0}) return RtStatus::kBlobBadSectionTable;
    }
    end = s.offset + s.count * s.element_bytes;
  }
  return end == blob.size() ? RtStatus::kOk : RtStatus::kBlobBadSectionTable;
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
  if (blob.size() < sizeof(SceneHeader)) return RtStatus::kBlobTooSmall;
  if (reinterpret_cast<std::uintptr_t>(blob.data()) % kSceneAlignment != 0)
    return RtStatus::kBlobMisaligned;
  header_ = reinterpret_cast<const SceneHeader*>(blob.data());
  if (std::memcmp(header_->magic, kSceneMagic, sizeof(kSceneMagic)) != 0)
    return RtStatus::kBlobBadMagic;
  if (header_->version != kSceneVersion) return RtStatus::kBlobBadVersion;
  if (header_->header_bytes != sizeof(SceneHeader)) return RtStatus::kBlobBadVersion;
  if (header_->byte_count != blob.size()) return RtStatus::kBlobTooSmall;
  if (header_->scalar_bytes != sizeof(Real)) return RtStatus::kBlobWrongScalar;
  if (header_->content_hash != scene_content_hash(blob)) return RtStatus::kBlobBadHash;
  blob_ = blob;
  const std::uint64_t table_at = header_->section_table;
  if (header_->section_count > kMaxSections || table_at != sizeof(SceneHeader))
    return RtStatus::kBlobBadSectionTable;
  if (header_->section_count * sizeof(SectionEntry) > blob.size() - table_at)
    return RtStatus::kBlobBadSectionTable;
  sections_ = {reinterpret_cast<const SectionEntry*>(blob.data() + table_at),
               header_->section_count};
  const RtStatus status = check_section_table(blob, sections_, table_at + sections_.size_bytes());
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
    }
  }
  for (const SectionEntry* s : found) {
    if (s == nullptr) return RtStatus::kBlobMissingSection;
  }
  if (found[0]->count != 1) return RtStatus::kBlobBadCount;
  parameters_ = table<SceneParameters>(blob, *found[0]).data();
  bodies_ = table<BodyRecord>(blob, *found[1]);
  planes_ = table<PlaneRecord>(blob, *found[2]);
  pieces_ = table<PieceRecord>(blob, *found[3]);
  vertices_ = {reinterpret_cast<const Real*>(blob.data() + found[4]->offset),
               static_cast<std::size_t>(3 * found[4]->count)};
  faces_ = table<FaceRecord>(blob, *found[5]);
  loop_vertices_ = table<std::uint16_t>(blob, *found[6]);
  loop_edges_ = table<std::uint16_t>(blob, *found[7]);
  edges_ = table<EdgeRecord>(blob, *found[8]);
  edge_directions_ = table<EdgeDirection>(blob, *found[9]);
  vertex_edge_begin_ = table<std::uint32_t>(blob, *found[10]);
  vertex_edges_ = table<std::uint16_t>(blob, *found[11]);
  pairs_ = table<PairRecord>(blob, *found[12]);
  nodes_ = table<NodeRecord>(blob, *found[13]);
  neighbor_begin_ = table<std::uint32_t>(blob, *found[14]);
  neighbors_ = blob.subspan(found[15]->offset, found[15]->count * found[15]->element_bytes);
  neighbor_count_ = found[15]->count;
  neighbors_wide_ = found[15]->element_bytes == sizeof(std::uint32_t);
  source_vertices_ = table<std::int32_t>(blob, *found[16]);
  text_ = blob.subspan(found[17]->offset, found[17]->count);
  lanes_ = table<Real>(blob, *found[18]);
  arcs_ = table<EdgeArc>(blob, *found[19]);
  return RtStatus::kOk;
}

RtStatus SceneView::open(std::span<const std::byte> blob, SceneView& view) noexcept {
  SceneView v;
  RtStatus status = v.bind(blob);
  if (status != RtStatus::kOk) return status;
  status = v.check_parameters();
  if (status != RtStatus::kOk) return status;
  status = v.check_bodies();
  if (status != RtStatus::kOk) return status;
  for (std::uint32_t i = 0; i < v.pieces_.size(); ++i) {
    status = v.check_piece(i);
    if (status != RtStatus::kOk) return status;
  }
  std::uint64_t stored_nodes = 0;
  for (std::uint32_t i = 0; i < v.pairs_.size(); ++i) {
    status = v.check_pair(i, stored_nodes);
    if (status != RtStatus::kOk) return status;
  }
  status = v.check_capacity();
  if (status != RtStatus::kOk) return status;
  view = v;
  return RtStatus::kOk;
}

PieceView SceneView::piece(std::uint32_t index) const noexcept {
  const PieceRecord& r = pieces_[index];
  PieceView v;
  v.record = &r;
  v.vertices = vertices_.data() + 3 * std::size_t{r.vertex_begin};
  v.faces = faces_.data() + r.face_begin;
  v.edges = edges_.data() + r.edge_begin;
  v.edge_directions = edge_directions_.data() + r.edge_begin;
  v.lanes = lanes_.data() + r.lane_begin;
  v.arcs = arcs_.data() + r.edge_begin;
  v.vertex_edge_begin = vertex_edge_begin_.data() + r.vertex_begin;
  v.vertex_edges = vertex_edges_.data();
  v.loop_vertices = loop_vertices_.data();
  v.loop_edges = loop_edges_.data();
  v.planes = planes_.data() + bodies_[r.body].plane_begin;
  v.source_vertices = source_vertices_.data() + r.vertex_begin;
  v.vertex_count = r.vertex_count;
  v.face_count = r.face_count;
  v.edge_count = r.edge_count;
  v.lane_count = r.lane_count;
  return v;
}

PairView SceneView::pair(std::uint32_t index) const noexcept {
  const PairRecord& r = pairs_[index];
  PairView v;
  v.record = &r;
  v.a = piece(r.piece_a);
  v.b = piece(r.piece_b);
  v.graph_stored = r.node_begin != kGraphNotStored;
  if (!v.graph_stored) return v;
  v.nodes = nodes_.data() + r.node_begin;
  v.neighbors = {neighbor_begin_.data() + r.node_begin, neighbors_.data(), neighbors_wide_};
  return v;
}

std::string_view SceneView::text(std::uint32_t offset, std::uint32_t bytes) const noexcept {
  return {reinterpret_cast<const char*>(text_.data()) + offset, bytes};
}

RtStatus SceneView::check_parameters() const noexcept {
  const SceneParameters& p = *parameters_;
  if (p.law != LawId::kPaper && p.law != LawId::kWeightedRegion && p.law != LawId::kProxy)
    return RtStatus::kBlobBadNumber;
  if (p.motion_limits_given > 1 || p.device.given > 1 || p.device.reserved != 0)
    return RtStatus::kBlobBadNumber;
  if (!check::positive(p.k_f_n_per_m) || !check::positive(p.rate_hz) ||
      p.k_f_n_per_m > kMaxStiffness_n_per_m) {
    return RtStatus::kBlobBadNumber;
  }
  for (const double x : {p.epsilon_m, p.epsilon_o_m, p.exact_band_m}) {
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
  const DeviceParameters& d = p.device;
  for (const double x : {p.max_linear_speed_m_per_s, p.max_angular_speed_rad_per_s, d.mass_kg,
                         d.damping_ns_per_m, d.coulomb_friction_n, d.encoder_step_m, d.max_force_n,
                         d.max_torque_nm, d.max_force_rate_n_per_s, d.max_torque_rate_nm_per_s,
                         d.max_stiffness_n_per_m, d.max_damping_ns_per_m, d.delay_s}) {
    if (!check::finite(x) || x < 0.0) return RtStatus::kBlobBadNumber;
  }
  if (!check::within(p.name_offset, p.name_bytes, text_.size())) return RtStatus::kBlobBadIndex;
  return check::coupling(p.coupling);
}

}  // namespace haptic
