// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/graph/scene_writer.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "rt_core/haptic_core.hpp"
#include "rt_core/proxy/proxy_law.hpp"
#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/graph_limits.hpp"
#include "rt_core/scene/graph_rule.hpp"
#include "rt_core/scene/node_marks.hpp"
#include "rt_core/scene/scene_check.hpp"
#include "rt_core/scene/scene_view.hpp"
#include "rt_core/scene/screen_size.hpp"
#include "tools/common/error.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/graph_compiler/graph/body_geometry.hpp"
#include "tools/graph_compiler/graph/pair_graph.hpp"
#include "tools/graph_compiler/graph/piece_topology.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/graph/scene_tables.hpp"

namespace haptic::tools {
namespace {

// Marks of a pair's basic contacts as the words that a scene stores
// (rt_core/scene/node_marks.hpp).

void set_bit(std::vector<std::uint64_t>& words, std::uint64_t first_word, std::uint64_t k) {
  words[first_word + k / 64] |= std::uint64_t{1} << (k % 64);
}

bool bit(const std::vector<std::uint64_t>& words, std::uint64_t first_word, std::uint64_t k) {
  return has_bit(words.data() + first_word, k);
}

/// The four sets of bits of a pair: nodes and features, reachable and live. Empty where every node
/// is live, and where none is reachable, which says that nothing is known.
/// @throws InputError when the marks are not one per node. Cost: nodes.
std::vector<std::uint64_t> mark_words(const PieceView& a, const PieceView& b,
                                      const PairMarks& marks) {
  const NodeNumbering n = numbering(a, b);
  if (marks.reachable.size() != n.count() || marks.exposed.size() != n.count()) {
    throw InputError("marks of " + std::to_string(marks.reachable.size()) + " and " +
                     std::to_string(marks.exposed.size()) + " basic contacts for a pair of " +
                     std::to_string(n.count()));
  }
  const FeatureNumbering features{n.nfa, n.nea, n.nfb, n.neb};
  const std::uint64_t node_words = haptic::mark_words(n.count());
  const std::uint64_t feature_words = haptic::mark_words(features.count());
  std::vector<std::uint64_t> words(2 * (node_words + feature_words));
  bool any_reachable = false, all_live = true;
  const auto mark = [&](std::uint32_t node, std::uint32_t first, std::uint32_t second) {
    const bool live = marks.live(node);
    all_live = all_live && live;
    if (!marks.reachable[node]) return;
    any_reachable = true;
    for (const bool of_live : {false, true}) {
      if (of_live && !live) continue;
      set_bit(words, of_live ? node_words : 0, node);
      const std::uint64_t at = 2 * node_words + (of_live ? feature_words : 0);
      set_bit(words, at, first);
      set_bit(words, at, second);
    }
  };
  const auto open_face = [&](std::uint32_t node, std::uint32_t face) {
    const std::uint64_t at = 2 * node_words;
    if (marks.exposed[node] && bit(words, at, face)) set_bit(words, at + feature_words, face);
  };
  for (std::uint32_t f = 0; f < n.nfa; ++f) {
    const std::uint32_t face = features.face_a(f);
    for (std::uint32_t v = 0; v < n.nvb; ++v) mark(n.type_a(f, v), face, face);
    for (std::uint32_t v = 0; v < n.nvb; ++v) open_face(n.type_a(f, v), face);
  }
  for (std::uint32_t f = 0; f < n.nfb; ++f) {
    const std::uint32_t face = features.face_b(f);
    for (std::uint32_t v = 0; v < n.nva; ++v) mark(n.type_b(v, f), face, face);
    for (std::uint32_t v = 0; v < n.nva; ++v) open_face(n.type_b(v, f), face);
  }
  for (std::uint32_t e = 0; e < n.nea; ++e) {
    for (std::uint32_t g = 0; g < n.neb; ++g)
      mark(n.type_c(e, g), features.edge_a(e), features.edge_b(g));
  }
  if (all_live || !any_reachable) words.clear();
  return words;
}

/// A pair of the scene, and the words of its marks (empty: none).
struct WrittenPair {
  std::uint32_t a = 0, b = 0;
  std::vector<std::uint64_t> marks;
};

/// The pairs in the order that SceneView expects: pieces of A first, the pieces of all statics
/// within. Those that the workspace never brings together are left out.
/// @throws InputError when the marks do not fit the pairs, or no pair is left.
std::vector<WrittenPair> written_pairs(const SceneTables& t, const SceneDescription& description) {
  const std::uint32_t moving = t.bodies[0].piece_count;
  const std::size_t all = std::size_t{moving} * (t.pieces.size() - moving);
  const std::vector<PairMarks>& given = description.marks;
  if (!given.empty() && given.size() != all) {
    throw InputError("scene '" + description.name + "': marks of " + std::to_string(given.size()) +
                     " pairs for " + std::to_string(all));
  }
  std::vector<WrittenPair> pairs;
  std::size_t pair = 0;
  for (std::uint32_t a = 0; a < moving; ++a) {
    for (std::uint32_t b = moving; b < t.pieces.size(); ++b, ++pair) {
      WrittenPair written{a, b, {}};
      if (!given.empty()) {
        const bool out_of_reach = std::ranges::none_of(given[pair].reachable, std::identity{});
        if (out_of_reach && description.workspace) continue;
        written.marks = mark_words(t.topologies[a].view(), t.topologies[b].view(), given[pair]);
      }
      pairs.push_back(std::move(written));
    }
  }
  if (pairs.empty()) {
    throw InputError("scene '" + description.name +
                     "': within its workspace the moving part never comes near a static one; "
                     "widen [motion_limits] workspace or leave it out");
  }
  return pairs;
}

/// Where pairs are not listed: the marks of each piece that has a feature hidden.
/// @throws InputError when the pieces are too large for the format.
void add_piece_marks(SceneTables& t, const SceneDescription& description) {
  const std::uint32_t moving = t.bodies[0].piece_count;
  const std::span<const PieceRecord> pieces(t.pieces);
  const PieceRecord a = largest_counts(pieces.first(moving));
  const PieceRecord b = largest_counts(pieces.subspan(moving));
  if (basic_contacts(a, b) >= kGraphNotStored) {
    throw InputError("scene '" + description.name + "' has pairs of pieces with up to " +
                     std::to_string(basic_contacts(a, b)) + " basic contacts, the format numbers " +
                     std::to_string(kGraphNotStored) + "; use coarser meshes");
  }
  for (std::size_t i = 0; i < description.open.size(); ++i) {
    const OpenFeatures& open = description.open[i];
    std::vector<std::uint64_t> words(haptic::mark_words(feature_bits(t.pieces[i])));
    std::uint64_t k = 0, set = 0;
    for (const std::vector<bool>* features : {&open.faces, &open.edges, &open.vertices}) {
      for (const bool is_open : *features) {
        if (is_open) set_bit(words, 0, k);
        set += is_open ? 1u : 0u;
        ++k;
      }
    }
    if (set == k) continue;
    t.pieces[i].mark_begin = size32(t.marks);
    t.marks.insert(t.marks.end(), words.begin(), words.end());
  }
}

/// Returns true when the stored neighbors need 32 bits.
bool add_pairs(SceneTables& t, const SceneDescription& description) {
  const std::vector<WrittenPair> pairs = written_pairs(t, description);
  std::vector<GraphSize> sizes;
  std::vector<std::uint64_t> degrees;
  std::vector<LargestFeatures> largest;
  for (const PieceTopology& topology : t.topologies) {
    largest.push_back(largest_features(topology.view()));
  }
  for (const auto& [a, b, marks] : pairs) {
    sizes.push_back(graph_size(t.topologies[a].view(), t.topologies[b].view()));
    // Stored lists would hold what the marks leave out: such a graph is formed.
    degrees.push_back(marks.empty() ? largest_degree(largest[a], largest[b]) : kNeverStored);
    if (sizes.back().nodes >= kGraphNotStored) {
      throw InputError("pieces " + std::to_string(a) + " and " + std::to_string(b) + " have " +
                       std::to_string(sizes.back().nodes) + " basic contacts, the format numbers " +
                       std::to_string(kGraphNotStored) + "; use coarser meshes");
    }
  }
  // Law proxy alone walks no graph: the sets are formed where they are asked for.
  const std::uint64_t graph_bytes = has_goal_contact(t.parameters[0]) ? description.graph_bytes : 0;
  const StoredGraphs choice = choose_stored_graphs(sizes, degrees, graph_bytes);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    add_pair(t, pairs[i].a, pairs[i].b, choice.stored[i], pairs[i].marks);
  }
  return choice.wide;
}

EnvelopeParameters envelope_parameters(const SceneDescription& description) {
  EnvelopeParameters e{};
  const auto& orientation = description.orientation;
  if (orientation && !orientation->is_free()) {
    e.given |= kOrientationGiven;
    std::ranges::copy(orientation->about_xyzw, e.q_wa_xyzw);
    e.max_angle_rad = orientation->max_angle_rad;
  }
  if (description.workspace) {
    e.given |= kWorkspaceGiven;
    std::ranges::copy(description.workspace->min_m, e.min_m);
    std::ranges::copy(description.workspace->max_m, e.max_m);
  }
  return e;
}

SceneParameters finished_parameters(const SceneDescription& description,
                                    std::uint32_t name_offset) {
  SceneParameters p = description.parameters;
  const auto q = unit_quaternion(description.moving.quaternion_wxyz, "start pose");
  for (std::size_t k = 0; k < 3; ++k) {
    p.start_p_wa_m[k] = description.moving.position_m[k];
    p.start_q_wa_xyzw[k] = static_cast<double>(q[k + 1]);
  }
  p.start_q_wa_xyzw[3] = static_cast<double>(q[0]);
  p.envelope = envelope_parameters(description);
  p.name_offset = name_offset;
  p.name_bytes = static_cast<std::uint32_t>(description.name.size());
  return p;
}

std::string metres_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.2g m", value);
  return text;
}

/// The proxy stands at coordinates in W: where neighbouring numbers lie farther apart than the
/// depth that counts as free, it can neither touch nor rest.
void check_resolution(const SceneTables& t, const std::string& scene) {
  if (t.parameters[0].law != LawId::kProxy) return;
  double radius_m = 0.0, extent_m = 0.0, coordinate_m = 0.0;
  for (const PieceRecord& piece : t.pieces) {
    if (piece.body == 0) {
      radius_m = std::max(radius_m, piece.reach_m);
      continue;
    }
    extent_m = std::max(extent_m, piece.reach_m);
    for (const double x : t.bodies[piece.body].reference_m)
      coordinate_m = std::max(coordinate_m, std::abs(x) + piece.reach_m);
  }
  const ProxyScale scale = proxy_scale(static_cast<Real>(radius_m), static_cast<Real>(extent_m), 0);
  const double apart_m = static_cast<double>(kRealEpsilon) * coordinate_m;
  if (apart_m <= static_cast<double>(scale.tolerance_m)) return;
  throw InputError("scene '" + scene + "' is refused: a static part reaches " +
                   metres_text(coordinate_m) + " from the origin, where numbers lie " +
                   metres_text(apart_m) + " apart and the proxy must know depths to " +
                   metres_text(static_cast<double>(scale.tolerance_m)) +
                   "; move the scene towards the origin" +
                   (HAPTIC_REAL_IS_FLOAT ? ", use double" : "") + " or choose another law");
}

/// The bounds of the search are computed for epsilon, before the blob is checked as a whole.
void check_epsilon(const SceneParameters& p, const std::string& scene) {
  if (!check::positive(p.epsilon_m) || p.epsilon_m > kMaxSceneLength_m) {
    throw InputError("scene '" + scene + "': epsilon_m is out of its range; give a width above 0");
  }
}

/// Surfaces have no inside, and their planes are formed as they are met.
void check_surfaces(const SceneParameters& p, const std::string& scene) {
  const std::string start = "scene '" + scene + "': a part is a surface, which has no depth: ";
  if (p.law != LawId::kProxy) {
    throw InputError(start + "only [rendering] law = \"proxy\" can render it");
  }
  if (has_goal_contact(p)) {
    throw InputError(start + "leave out [rendering] goal_contact, or make every part a solid");
  }
}

/// A list of pairs has fewer than 2^32.
void check_listed_pairs(const SceneDescription& description) {
  const std::uint64_t moving = description.moving.body.pieces.size();
  std::uint64_t fixed = 0;
  for (const PlacedBody& body : description.statics) fixed += body.body.pieces.size();
  constexpr std::uint64_t kMostPairs = UINT32_MAX - 1;
  if (fixed == 0 || moving <= kMostPairs / fixed || !lists_pairs(description)) return;
  throw InputError("scene '" + description.name + "': " + std::to_string(moving) +
                   " pieces of the moving part and " + std::to_string(fixed) +
                   " of the static ones make " + std::to_string(moving * fixed) +
                   " pairs, limit where they are listed (goal_contact) " +
                   std::to_string(kMostPairs) + "; simplify a part, to " +
                   std::to_string(kMostPairs / fixed) + " pieces of the moving one or " +
                   std::to_string(kMostPairs / moving) + " of the static ones");
}

/// The bodies that are not the solids of their meshes.
void add_simplified(BlobBuilder& blob, const SceneDescription& description) {
  std::vector<SimplifiedBody> simplified;
  std::uint32_t body = 0;
  const auto add = [&](const PlacedBody& placed) {
    if (placed.simplified) {
      simplified.push_back(
          {body, 0, placed.simplified->distance_m, placed.simplified->volume_change_m3});
    }
    ++body;
  };
  add(description.moving);
  for (const PlacedBody& placed : description.statics) add(placed);
  if (!simplified.empty()) blob.add(SectionId::kSimplified, simplified);
}

/// A tick in which planes and lists change takes so many contact_units(); a scene keeps to its rate
/// where that is up to so many of its budgets, for few ticks take as much.
constexpr double kContactSpare = 1.5, kContactShare = 3.0;

double area_m2(const ConvexPiece& facet) {
  const auto& loop = facet.faces[0].loop;
  const auto at = [&](std::size_t k) {
    const std::array<double, 3>& v = facet.vertices[loop[k]];
    return Eigen::Vector3d(v[0], v[1], v[2]);
  };
  Eigen::Vector3d twice = Eigen::Vector3d::Zero();
  for (std::size_t k = 2; k < loop.size(); ++k) twice += (at(k - 1) - at(0)).cross(at(k) - at(0));
  return twice.norm() / 2;
}

/// Facets of both sides that meet where all of the smaller surface lies on the other.
double facets_in_contact(const SceneDescription& description) {
  struct Side {
    double facets = 0, area_m2 = 0;
    void add(const PlacedBody& placed) {
      for (const ConvexPiece& piece : placed.body.pieces) area_m2 += tools::area_m2(piece);
      facets += static_cast<double>(placed.body.pieces.size());
    }
  } of_a, of_b;
  of_a.add(description.moving);
  for (const PlacedBody& placed : description.statics) of_b.add(placed);
  const double least_m2 = std::min(of_a.area_m2, of_b.area_m2);
  if (!(least_m2 > 0)) return of_a.facets + of_b.facets;
  return least_m2 * (of_a.facets / of_a.area_m2 + of_b.facets / of_b.area_m2);
}

/// Units of work that a tick may have begun beyond its budget, without those of any one pair.
std::uint32_t begun_without_pair(const SceneTables& t, const SceneCapacity& capacity) {
  if (capacity.max_work_units == 0) return 0;
  const std::uint32_t moving = t.bodies[0].piece_count;
  const bool friction =
      std::ranges::any_of(t.bodies, [](const BodyRecord& body) { return body.friction > 0; });
  const bool facets = has_facets(t.pieces);
  const std::uint64_t visits =
      begun_visits(t.pieces, moving, capacity.pair_count > capacity.near_slots);
  return static_cast<std::uint32_t>(
      begun_units(PairWork{}, near_looks(capacity.near_slots, t.parameters[0].coupling.near_pairs),
                  visits, friction, facets));
}

}  // namespace

bool has_surfaces(const SceneDescription& description) {
  const auto is_surface = [](const PlacedBody& placed) {
    return std::ranges::any_of(placed.body.pieces, &ConvexPiece::is_facet);
  };
  return is_surface(description.moving) || std::ranges::any_of(description.statics, is_surface);
}

bool lists_pairs(const SceneDescription& description) {
  SceneParameters p = description.parameters;
  p.envelope = envelope_parameters(description);
  std::size_t fixed = 0;
  for (const PlacedBody& body : description.statics) fixed += body.body.pieces.size();
  return haptic::lists_pairs(p, description.moving.body.pieces.size(), fixed,
                             has_surfaces(description));
}

std::vector<std::byte> write_scene(const SceneDescription& description, SceneAccount* account,
                                   const std::function<void(double)>& progress) {
  if (description.statics.empty()) {
    throw InputError("scene '" + description.name +
                     "' has no static part; add at least one [[static]]");
  }
  check_listed_pairs(description);
  SceneTables t;
  const std::uint32_t name_offset = add_text(t, description.name);
  t.parameters.push_back(finished_parameters(description, name_offset));
  check_epsilon(t.parameters[0], description.name);
  if (has_surfaces(description)) check_surfaces(t.parameters[0], description.name);
  double pieces = static_cast<double>(description.moving.body.pieces.size());
  for (const PlacedBody& body : description.statics) {
    pieces += static_cast<double>(body.body.pieces.size());
  }
  const auto tell = [&](double of_piece) {
    if (progress) progress((static_cast<double>(t.pieces.size()) + of_piece) / pieces);
  };
  add_body(t, description.moving, &description.grip_m, tell);
  double radius_m = 0.0;
  for (const PieceRecord& piece : t.pieces) radius_m = std::max(radius_m, piece.reach_m);
  complete_coupling(t.parameters[0], radius_m);
  set_held_part(t.parameters[0].held, description.moving, description.grip_m);
  for (const PlacedBody& body : description.statics) add_body(t, body, nullptr, tell);
  check_resolution(t, description.name);
  bool wide = false;
  if (lists_pairs(description)) {
    wide = add_pairs(t, description);
  } else {
    add_piece_marks(t, description);
  }
  const std::size_t moving = t.bodies[0].piece_count;
  const std::uint64_t pairs =
      lists_pairs(description) ? t.pairs.size() : moving * (t.pieces.size() - moving);
  const auto visits = static_cast<std::uint32_t>(
      std::max<std::uint64_t>(1, std::min<std::uint64_t>(description.max_pair_visits, pairs)));
  SceneParameters& parameters = t.parameters[0];
  const auto capacity_now = [&] {
    return scene_capacity(t.bodies, t.pieces, t.pairs, t.marks, visits, parameters);
  };
  SceneCapacity capacity = capacity_now();
  if (parameters.work_units == 0) {
    // Without a budget, the bound is what may have been begun.
    const std::uint32_t begun = capacity.max_work_units;
    parameters.work_units =
        work_units_at(parameters.rate_hz, capacity.near_slots, begun,
                      begun - begun_without_pair(t, capacity), has_surfaces(description));
    if (is_screened(t.pieces, t.bodies[0].piece_count)) {
      const double in_contact =
          kContactSpare * contact_units(facets_in_contact(description), parameters.coupling.passes);
      if (in_contact > kContactShare * parameters.work_units) {
        parameters.work_units =
            static_cast<std::uint32_t>(std::min<double>(in_contact, double{kMostWorkUnits}));
      }
    }
    capacity = capacity_now();
  }
  BlobBuilder builder = sections_of(t, wide);
  add_simplified(builder, description);
  if (description.guide) {
    builder.add(SectionId::kGuide, std::vector<GuideRecord>{description.guide->record});
    builder.add(SectionId::kGuideStations, description.guide->stations);
  }
  // The state's size depends on the opened scene, so the blob is opened once without it.
  const SceneBytes provisional{builder.finish(capacity)};
  SceneView view;
  const RtStatus status = SceneView::open(provisional.span(), view);
  if (status != RtStatus::kOk) {
    throw InputError("scene '" + description.name + "' is refused: " + to_text(status));
  }
  capacity.state_bytes = HapticCore::state_bytes(view);
  if (account != nullptr) *account = std::move(t.account);
  return builder.finish(capacity);
}

}  // namespace haptic::tools
