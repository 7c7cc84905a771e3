// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_scene_view: what the scene writer makes of a few convex bodies.
#include <algorithm>
#include <cstring>
#include <span>
#include <stdexcept>
#include <utility>

#include "tests/fuzz/fuzz_target.hpp"
#include "tests/support/pruned_scenes.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"

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

/// From here the target presses the part on the plate: a proxy starts free.
constexpr test::Point kFreeStart_m = {0, 0, 0.09};

/// Two parts over a plate, of which the hand may hold either.
std::string parts_blob(const tools::Body& one, const tools::Body& other, const tools::Body& plate) {
  const auto standing = [](const tools::Body& body, double x_m) {
    tools::PlacedBody placed;
    placed.body = body;
    placed.position_m = {x_m, 0.0, kFreeStart_m[2]};
    return placed;
  };
  std::vector<tools::PlacedBody> bodies{standing(one, 0), standing(other, 0.2), {}};
  bodies[2].body = plate;
  std::vector<tools::HeldPart> parts(bodies.size());
  for (std::uint32_t k = 0; k < parts.size(); ++k) {
    parts[k].role = k == 0 ? PartRole::kHand : k == 1 ? PartRole::kPlaced : PartRole::kFixed;
    std::ranges::copy(bodies[k].position_m, parts[k].start.p_wa_m);
    if (k == 2) continue;
    tools::SceneDescription scene = test::scene_of(bodies[k].body, {plate, plate});
    scene.moving = bodies[k];
    scene.statics = {bodies[1 - k], bodies[2]};
    scene.parameters.law = LawId::kProxy;
    scene.parameters.goal_contact = 0;
    const std::vector<std::byte> bytes = tools::write_scene(scene);
    parts[k].scene = bytes;
    parts[k].others = {1 - k, 2};
  }
  const std::vector<std::byte> whole = tools::with_parts(parts[0].scene, parts);
  return {reinterpret_cast<const char*>(whole.data()), whole.size()};
}

/// A part over a plate, and one that its owner moves.
std::string driven_blob(const tools::Body& held, const tools::Body& driven,
                        const tools::Body& plate) {
  constexpr double kBeside_m = 0.2;
  tools::SceneDescription scene = test::scene_of(held, {plate, driven});
  scene.moving.position_m = {0.0, 0.0, kFreeStart_m[2]};
  scene.statics[1].position_m = {kBeside_m, 0.0, kFreeStart_m[2]};
  scene.parameters.law = LawId::kProxy;
  scene.parameters.goal_contact = 0;
  const std::vector<std::byte> around = tools::write_scene(scene);
  tools::SceneDescription standing = scene, pair = scene;
  standing.statics.pop_back();
  pair.statics.erase(pair.statics.begin());
  pair.statics[0].position_m = {0, 0, 0};
  pair.moving.position_m = {-kBeside_m, 0, 0};
  std::vector<tools::HeldPart> parts(3);
  parts[0].role = PartRole::kHand;
  parts[0].scene = tools::write_scene(standing);
  parts[0].others = {1};
  parts[0].pairs.push_back({2, tools::write_scene(pair)});
  parts[2].role = PartRole::kDriven;
  parts[0].start.p_wa_m[2] = parts[2].start.p_wa_m[2] = kFreeStart_m[2];
  parts[2].start.p_wa_m[0] = kBeside_m;
  DrivenRecord record{};
  record.part = 2;
  record.fastest_m_per_s = record.fastest_rad_per_s = 1;
  record.late_s = 0.1;
  record.lead = Lead::kOwner;
  record.push_n = 100;
  record.ratio = kDrivenRatio;
  record.radius_m = 0.1;
  const std::vector<std::byte> whole = tools::with_parts(around, parts, {record});
  return {reinterpret_cast<const char*>(whole.data()), whole.size()};
}

/// A part in each of two hands, over a plate.
std::string two_hand_blob(const tools::Body& first, const tools::Body& second,
                          const tools::Body& plate) {
  constexpr double kBeside_m = 0.2;
  std::vector<tools::HeldPart> parts(3);
  const auto scene_of = [&](const tools::Body& held, const tools::Body& other, double held_x_m,
                            double other_x_m) {
    tools::SceneDescription scene = test::scene_of(held, {other});
    scene.moving.position_m = {held_x_m, 0.0, kFreeStart_m[2]};
    scene.statics[0].position_m = {other_x_m, 0.0, 0.0};
    scene.parameters.law = LawId::kProxy;
    scene.parameters.goal_contact = 0;
    return scene;
  };
  for (std::uint32_t k = 0; k < 2; ++k) {
    const double x_m = k == 0 ? 0 : kBeside_m;
    parts[k].role = k == 0 ? PartRole::kHand : PartRole::kHand2;
    parts[k].scene = tools::write_scene(scene_of(k == 0 ? first : second, plate, x_m, 0));
    parts[k].others = {2};
    parts[k].start.p_wa_m[0] = x_m;
    parts[k].start.p_wa_m[2] = kFreeStart_m[2];
  }
  tools::SceneDescription pair = scene_of(first, second, -kBeside_m, 0);
  pair.moving.position_m[2] = 0;
  parts[0].pairs.push_back({1, tools::write_scene(pair)});
  tools::SceneDescription around = scene_of(first, second, 0, kBeside_m);
  around.statics[0].position_m[2] = kFreeStart_m[2];
  around.statics.push_back({plate, {0, 0, 0}});
  const std::vector<std::byte> whole = tools::with_parts(tools::write_scene(around), parts);
  return {reinterpret_cast<const char*>(whole.data()), whole.size()};
}

/// Unit of a scene of which products of four lengths are zero in Real: just above those whose
/// volume would be zero too, which are refused.
constexpr double kLeastUnit_m = HAPTIC_REAL_IS_FLOAT ? 1e-30 : 1e-100;

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

/// After sections were changed: the header's hash is that of its bytes again.
std::string hashed(std::string blob) {
  SceneHeader header;
  std::memcpy(&header, blob.data(), sizeof header);
  header.content_hash = 0;
  std::memcpy(blob.data(), &header, sizeof header);
  header.content_hash = scene_content_hash(std::as_bytes(std::span(blob)));
  std::memcpy(blob.data(), &header, sizeof header);
  return blob;
}

/// The scene in another unit, which the writer need not have made. Only law kProxy uses
/// the coupling; its length keeps to its own limits.
std::string scaled(std::string blob, double factor) {
  const auto real = [&](Real& x) { x = static_cast<Real>(static_cast<double>(x) * factor); };
  const auto volume = [&](double& x) { x *= factor * factor * factor; };
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
    const auto stiffness_at = [&](double length_m) {
      return p.coupling.k_t_n_per_m * length_m * length_m;
    };
    p.coupling.k_r_nm_per_rad =
        std::clamp(p.coupling.k_r_nm_per_rad * factor * factor, stiffness_at(kMinCouplingLength_m),
                   stiffness_at(kMaxSceneLength_m));
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
  return hashed(std::move(blob));
}

std::string stiffened(std::string blob) {
  change_section<SceneParameters>(blob, SectionId::kParameters, 1, [](SceneParameters& p) {
    p.k_f_n_per_m = kMaxStiffness_n_per_m;
  });
  return hashed(std::move(blob));
}

/// A seed that is refused is none: mutation would start where nothing is behind the checks.
std::vector<Seed> loaded(std::vector<Seed> seeds) {
  for (const Seed& seed : seeds) {
    const auto bytes = std::as_bytes(std::span(seed.bytes));
    try {
      const test::LoadedScene scene(std::vector<std::byte>(bytes.begin(), bytes.end()));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("seed " + seed.name + " of fuzz_scene_view: " + error.what());
    }
  }
  return seeds;
}

}  // namespace

std::vector<Seed> seeds() {
  const tools::Body tetrahedron = test::tetrahedron({0.05, 0, -0.03}, {-0.03, 0.04, -0.03},
                                                    {-0.03, -0.04, -0.03}, {0, 0, 0.06});
  const tools::Body small = test::tetrahedron({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1});
  const tools::Body table = test::box({-0.1, -0.1, -0.1}, {0.1, 0.1, 0});
  const tools::Body step = test::box({-0.1, -0.1, 0}, {0, 0.1, 0.05});
  const tools::Body small_block = test::box({-0.04, -0.03, -0.02}, {0.04, 0.03, 0.02});
  const std::string unit = blob_of(small, {small});
  tools::SceneDescription proxy = test::scene_of(tetrahedron, {test::join({table, step})});
  proxy.parameters.law = LawId::kProxy;
  proxy.moving.position_m = kFreeStart_m;
  tools::SceneDescription rough = proxy;
  rough.statics[0].friction = 0.5 * kMaxFriction;
  rough.statics[0].friction_static = kMaxFriction;
  rough.parameters.held.mass_kg = 0.5;
  rough.parameters.held.gravity_m_per_s2[2] = -9.81;
  tools::SceneDescription sheet = proxy;
  sheet.statics.insert(
      sheet.statics.begin(),
      {test::facet({{-0.1, -0.1, 0.01}, {0.1, -0.1, 0.01}, {0, 0.1, 0.02}}), {0, 0, 0}});
  tools::SceneDescription leaf = proxy;
  leaf.moving.body =
      test::facet({{0.05, 0, -0.03}, {0.03, 0.04, -0.02}, {-0.03, 0, 0}, {-0.01, -0.04, -0.01}});
  sheet.parameters.goal_contact = leaf.parameters.goal_contact = 0;
  const std::string huge = scaled(unit, kMaxSceneLength_m);
  return loaded({{"huge", huge},
                 {"huge_stiff", stiffened(huge)},
                 {"tiny", scaled(unit, 1e-8)},
                 {"minute", scaled(unit, kLeastUnit_m)},
                 {"far", blob_of(test::box({1e5, 0, 0}, {1e5 + 1, 1, 1}), {table})},
                 {"stiff", stiffened(unit)},
                 {"proxy", written(proxy)},
                 {"rough", written(rough)},
                 {"sheet", written(sheet)},
                 {"leaf", written(leaf)},
                 {"parts", parts_blob(tetrahedron, small_block, table)},
                 {"driven", driven_blob(tetrahedron, small_block, table)},
                 {"two_hands", two_hand_blob(tetrahedron, small_block, table)},
                 {"marked", marked_blob(tetrahedron, test::join({table, step}), false)},
                 {"fixed_cut", fixed_cut_blob(tetrahedron, LawId::kPaper)},
                 {"fixed_cut_proxy", fixed_cut_blob(tetrahedron, LawId::kProxy)},
                 {"marked_boxed", marked_blob(step, table, true)},
                 {"two_tetrahedra", unit},
                 {"tetrahedron_box", blob_of(tetrahedron, {table})},
                 {"formed_graph", blob_of(tetrahedron, {table}, 0)},
                 {"one_of_two_stored", blob_of(tetrahedron, {tetrahedron, table}, 8000)},
                 {"tetrahedron_step", blob_of(tetrahedron, {test::join({table, step})})},
                 {"two_statics", blob_of(tetrahedron, {tetrahedron, step})}});
}

}  // namespace haptic::fuzz
