// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_scene_view: what the scene writer makes of a few convex bodies.
#include <cmath>
#include <cstring>

#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/pruned_scenes.hpp"

namespace haptic::fuzz {
namespace {

std::string written(const tools::SceneDescription& scene) {
  const std::vector<std::byte> bytes = tools::write_scene(scene);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::string blob_of(const tools::Body& moving, const std::vector<tools::Body>& statics,
                    std::uint64_t graph_bytes = tools::kDefaultGraphBytes) {
  tools::SceneDescription scene = test::scene_of(moving, statics);
  scene.graph_bytes = graph_bytes;
  return written(scene);
}

/// The same with an envelope and marks: some nodes that no pose needs, some that only separate.
std::string marked_blob(const tools::Body& moving, const tools::Body& fixed, bool boxed) {
  tools::SceneDescription scene = test::scene_of(moving, {fixed});
  scene = test::with_envelope(scene, {0, 0, 0, 1}, 0.4);
  for (tools::PairMarks& marks : scene.marks) {
    for (std::size_t node = 0; node < marks.exposed.size(); node += 5) marks.exposed[node] = false;
  }
  if (boxed) scene.workspace = tools::WorkspaceBox{{-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}};
  return written(scene);
}

/// From here the poses of the target go into the plate: a proxy is held where it starts free.
constexpr test::Point kFreeStart_m = {0, 0, 0.09};

/// A part that never turns over a plate in pieces, whose seams only separate.
std::string fixed_cut_blob(const tools::Body& moving, LawId law) {
  const test::Point lo = {-0.1, -0.1, -0.03}, hi = {0.1, 0.1, 0};
  tools::SceneDescription scene =
      test::scene_of(moving, {test::cut_box(lo, hi, {0.003}, {{}, {-0.004}})});
  const test::LoadedScene all(scene);
  scene.marks = test::all_marks(all.view);
  test::mark_cuts(all.view, 1, test::box(lo, hi), scene.marks);
  scene.orientation = tools::OrientationEnvelope{{0, 0, 0, 1}, 0.0};
  scene.parameters.law = law;
  scene.moving.position_m = kFreeStart_m;
  return written(scene);
}

/// Calls `change` on every element of one section.
template <typename Element, typename Change>
void change_section(std::string& blob, SectionId id, std::size_t elements_each,
                    const Change& change) {
  SceneHeader header;
  std::memcpy(&header, blob.data(), sizeof header);
  for (std::uint32_t s = 0; s < header.section_count; ++s) {
    SectionEntry entry;
    std::memcpy(&entry, blob.data() + header.section_table + s * sizeof entry, sizeof entry);
    for (std::uint64_t i = 0; entry.id == id && i < entry.count * elements_each; ++i) {
      char* const at = blob.data() + entry.offset + i * sizeof(Element);
      Element element;
      std::memcpy(&element, at, sizeof element);
      change(element);
      std::memcpy(at, &element, sizeof element);
    }
  }
}

/// The scene in another unit, so far out that squares or products of lengths leave the range of
/// double: the writer would not make it. Volumes that overflow stay as they were.
std::string scaled(std::string blob, double factor) {
  const auto real = [&](Real& x) { x = static_cast<Real>(static_cast<double>(x) * factor); };
  const auto volume = [&](double& x) {
    const double wanted = x * factor * factor * factor;
    x = std::isnormal(wanted) ? wanted : x;
  };
  change_section<Real>(blob, SectionId::kVertices, 3, real);
  change_section<PlaneRecord>(blob, SectionId::kPlanes, 1,
                              [&](PlaneRecord& plane) { real(plane.offset_m); });
  change_section<Real>(blob, SectionId::kVertexLanes, 1, real);
  change_section<EdgeArc>(blob, SectionId::kEdgeArcs, 1, [&](EdgeArc& arc) {
    for (auto& tilt : arc.tilt) {
      for (Real& x : tilt) real(x);
    }
  });
  change_section<SceneParameters>(blob, SectionId::kParameters, 1, [&](SceneParameters& p) {
    p.epsilon_m *= factor;
    p.epsilon_o_m *= factor;
    p.coupling.k_r_nm_per_rad *= factor * factor;
  });
  change_section<EdgeDirection>(blob, SectionId::kEdgeDirections, 1,
                                [&](EdgeDirection& edge) { real(edge.length_m); });
  change_section<BodyRecord>(blob, SectionId::kBodies, 1, [&](BodyRecord& body) {
    volume(body.volume_m3);
    for (double& x : body.reference_m) x *= factor;
  });
  change_section<PieceRecord>(blob, SectionId::kPieces, 1, [&](PieceRecord& piece) {
    volume(piece.volume_m3);
    piece.radius_m *= factor;
    for (double& x : piece.centre_m) x *= factor;
    piece.reach_m *= factor;
    piece.vertex_relax_m *= factor;
  });
  return blob;
}

}  // namespace

std::vector<Seed> seeds() {
  const tools::Body tetrahedron = test::tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03},
                                                    {-0.03, -0.04, -0.03}, {0, 0, 0.06});
  const tools::Body small = test::tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const tools::Body table = test::box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0});
  const tools::Body step = test::box({-0.1, -0.1, 0}, {0, 0.1, 0.05});
  const std::string unit = blob_of(small, {small});
  std::string stiff = unit;
  change_section<SceneParameters>(stiff, SectionId::kParameters, 1,
                                  [](SceneParameters& p) { p.k_f_n_per_m = 1e308; });
  tools::SceneDescription proxy = test::scene_of(tetrahedron, {test::join({table, step})});
  proxy.parameters.law = LawId::kProxy;
  proxy.moving.position_m = kFreeStart_m;
  tools::SceneDescription rough = proxy;
  rough.statics[0].friction = kMaxFriction;
  return {{"huge", scaled(unit, 1e100)},
          {"immense", scaled(unit, 1e160)},
          {"tiny", scaled(unit, 1e-100)},
          {"minute", scaled(unit, 1e-160)},
          {"far", blob_of(test::box({1e5, 0, 0}, {1e5 + 1, 1, 1}), {table})},
          {"stiff", stiff},
          {"proxy", written(proxy)},
          {"rough", written(rough)},
          {"marked", marked_blob(tetrahedron, test::join({table, step}), false)},
          {"fixed_cut", fixed_cut_blob(tetrahedron, LawId::kWeightedRegion)},
          {"fixed_cut_proxy", fixed_cut_blob(tetrahedron, LawId::kProxy)},
          {"marked_boxed", marked_blob(step, table, true)},
          {"two_tetrahedra", unit},
          {"tetrahedron_box", blob_of(tetrahedron, {table})},
          {"formed_graph", blob_of(tetrahedron, {table}, 0)},
          {"one_of_two_stored", blob_of(tetrahedron, {tetrahedron, table}, 8000)},
          {"tetrahedron_step", blob_of(tetrahedron, {test::join({table, step})})},
          {"two_statics", blob_of(tetrahedron, {tetrahedron, step})}};
}

}  // namespace haptic::fuzz
