// SPDX-License-Identifier: Apache-2.0
#pragma once
/// From convex pieces to the bytes of a compiled scene: topology tables, arcs and bounds of the
/// search, contact graphs with symmetrised arcs in CSR where they fit, capacities, content hash.
/// Needs the core and the standard library
/// alone, so tests of the core use it too.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rt_core/scene/capacity.hpp"
#include "rt_core/scene/scene_format.hpp"
#include "tools/graph_compiler/graph/convex_piece.hpp"
#include "tools/graph_compiler/graph/coupling_defaults.hpp"
#include "tools/graph_compiler/graph/pruning_marks.hpp"
#include "tools/graph_compiler/graph/scene_account.hpp"
#include "tools/graph_compiler/graph/stored_graphs.hpp"

namespace haptic::tools {

/// Result of a simplification of a body; as in SimplifiedBody: no change of volume of a surface.
struct BodySimplification {
  double distance_m = 0.0, volume_change_m3 = 0.0;
};

/// A body and where it stands. Static: pose of the body frame in W. Moving: ignored except for the
/// start pose.
struct PlacedBody {
  Body body;
  std::array<double, 3> position_m{0, 0, 0};
  std::array<double, 4> quaternion_wxyz{1, 0, 0, 0};
  /// Origin of the body's coordinates in its mesh frame: mesh = body + mesh_origin_m. Lets a part
  /// that lies far from the origin of its file keep coordinates near zero, hence all their digits.
  /// Poses and grip stay in the mesh frame.
  std::array<double, 3> mesh_origin_m{0, 0, 0};
  /// Static: Coulomb coefficient against the moving body; moving: 0.
  double friction = 0.0;
  double friction_static = 0.0;  ///< the same while the parts stick; below `friction`: that
  std::optional<BodySimplification> simplified{};  ///< absent: the body is that of its mesh
};

/// Width of the near set [m], band of exact separations [m] and loop [Hz] where nothing is said.
inline constexpr double kDefaultEpsilon_m = 1.0e-4;
inline constexpr double kDefaultExactBand_m = 5.0e-3;
inline constexpr double kDefaultRate_hz = 1000.0;

/// Assumed duration of a unit of work [s]; host_lab wcet measures it: 61 to 66 ns in the dearest
/// ticks of a peg in its hole, so a bound fitted with it may be a tenth over its share.
inline constexpr double kUnitPrice_s = 61.0e-9;

/// Share of a period that the units of work of a tick may take, and the same of a scene with a
/// surface, whose many facets are near at once. The mean tick of solids takes a hundredth of it;
/// one in which contacts change takes what it needs to arrive.
inline constexpr double kWorkShare = 0.5, kSurfaceWorkShare = 0.65;

/// Share of a period that the bound of a tick is kept to, as long as every near pair has this many
/// units.
inline constexpr double kBoundShare = 0.65;
inline constexpr std::uint32_t kUnitsOfPair = 90;

/// Units of work that a tick may spend at a rate, where the scene does not say: 8197 at 1 kHz and
/// with `surfaces` 10656, and fewer where the bound, with the `begun` units that come on top, would
/// be more than its share; but never fewer of them than kUnitsOfPair for each of `near_slots` pairs
/// and what the dearest pair takes for a valid set and a search, `dearest`. (Where facets are
/// screened in bulk and meet by thousands the writer allows more.)
[[nodiscard]] constexpr std::uint32_t work_units_at(double rate_hz, std::uint32_t near_slots,
                                                    std::uint32_t begun, std::uint32_t dearest,
                                                    bool surfaces) {
  const double of_period = 1 / (rate_hz * kUnitPrice_s);
  const double most = (surfaces ? kSurfaceWorkShare : kWorkShare) * of_period + 0.5;
  const double least =
      std::min(most, std::max(double{kUnitsOfPair} * near_slots, double{1} * dearest));
  const double units = std::clamp(kBoundShare * of_period - begun, least, most);
  return static_cast<std::uint32_t>(
      std::clamp(units, double{kLeastWorkUnits}, double{kMostWorkUnits}));
}

/// Units of work of a tick in which every piece of two parts has one of the other next to it: a
/// rule of thumb, two in each pass.
[[nodiscard]] constexpr double contact_units(double pieces, std::uint32_t passes) {
  return 2.0 * passes * pieces;
}

/// The proxy law with everything that can be asked of it, and the defaults above; no stiffness,
/// which every scene must give, and no gain of the coupling, which the writer derives from it.
[[nodiscard]] constexpr SceneParameters default_parameters() {
  SceneParameters p{};
  p.law = LawId::kProxy;
  p.epsilon_m = kDefaultEpsilon_m;
  p.exact_band_m = kDefaultExactBand_m;
  p.rate_hz = kDefaultRate_hz;
  p.coupling.damping_share = kDefaultDampingShare;
  p.goal_contact = 1;
  return p;
}

/// The plan that leads the hand, as the tick reads it.
struct GuideTables {
  GuideRecord record{};
  std::vector<GuideStation> stations;
};

/// Everything that a scene file says, after its meshes have become convex pieces.
struct SceneDescription {
  std::string name;
  PlacedBody moving;
  std::vector<PlacedBody> statics;
  std::array<double, 3> grip_m{0, 0, 0};  ///< x_0^A in the moving body's frame
  /// name_offset, name_bytes and start pose are filled by the writer; so are epsilon_o_m when it is
  /// zero, with epsilon_m, work_units, with those of the rate, and what complete_coupling
  /// completes. Of a held part with a mass the writer sets inertia and centre from the solid, of
  /// uniform density.
  SceneParameters parameters = default_parameters();
  std::uint64_t graph_bytes = kDefaultGraphBytes;      ///< room for stored contact graphs
  std::uint32_t max_pair_visits = kDefaultPairVisits;  ///< in one tick; never more than pairs
  /// Limits of the motion: orientations and places of the grip; absent: free.
  std::optional<OrientationEnvelope> orientation;
  std::optional<WorkspaceBox> workspace;
  bool prune = true;  ///< false: every basic contact is kept, with any marks
  /// By pair in the order of the written pairs (pieces of A first, the pieces of all statics
  /// within); empty: nothing pruned.
  std::vector<PairMarks> marks;
  /// By piece, moving part first, of a scene that does not list its pairs, which then have no other
  /// marks; empty: all are open.
  std::vector<OpenFeatures> open;
  std::vector<PieceExposure> exposure;  ///< by piece, moving part first; empty: nothing hidden
  std::optional<GuideTables> guide;
};

/// True if the scene lists its pairs (rt_core/scene/formed_pairs.hpp).
[[nodiscard]] bool lists_pairs(const SceneDescription& description);

/// True if some part is a surface.
[[nodiscard]] bool has_surfaces(const SceneDescription& description);

/// Bytes of the scene, kSceneAlignment-aligned offsets, ready for SceneView::open (which has
/// accepted them). Byte-identical for equal input on every compiler. Geometry is rounded to Real
/// once, at the end. `account`, where given, is filled; `progress` gets the fraction of the
/// pieces done. Cost: see vertex_relaxation.
/// @throws InputError when a limit of the format is exceeded (names piece, count and limit).
std::vector<std::byte> write_scene(const SceneDescription& description,
                                   SceneAccount* account = nullptr,
                                   const std::function<void(double)>& progress = {});

}  // namespace haptic::tools
