// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The scenes of the campaign against several moving bodies: bodies of convex pieces or of facets,
/// their roles, and a compiled scene for every pair of them. The grip point of a body is the origin
/// of its mesh frame.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/surface_fuzz/fuzz_meshes.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "rt_core/bodies/body_law.hpp"

namespace haptic::sim {

enum class BodyRole : std::uint8_t {
  kHand,    ///< a spring to the goal of a device
  kDriver,  ///< ten thousand times as stiff; what it meets yields
  kLoose    ///< a stiff spring to an anchor that gives way
};
[[nodiscard]] const char* to_text(BodyRole role);

inline constexpr std::size_t kNoCarrier = SIZE_MAX;

/// Where the goal of a body goes: about `home`, and turned up to `tilt_rad`.
struct BodyRange {
  Vector home = Vector::Zero(), reach_m = Vector::Zero();
  double tilt_rad = 0;
  /// Number of an earlier body that carries all of this and the start too: they are seen from its
  /// goal, and from its start.
  std::size_t carrier = kNoCarrier;
  Rotation turn = Rotation::Identity();  ///< of the home
};

struct FuzzBody {
  std::string name;
  BodyRole role = BodyRole::kHand;
  std::vector<Solid> pieces;  ///< empty: a surface
  FuzzMesh surface;
  BodyRange range;
  Vector start = Vector::Zero();
  Rotation start_turn = Rotation::Identity();
  std::optional<MovingBody> is;  ///< for the law, of a body that is not of the campaign's own
  double yield_n = 0.5;          ///< of a loose part: force that its anchor holds
  double sink_m = 0;             ///< > 0: by its weight it sinks by this in a tick, at most
  double fastest_m_per_s = 0, fastest_rad_per_s = 0;  ///< of its goal; 0: the campaign's

  [[nodiscard]] bool is_surface() const { return pieces.empty(); }
  /// Every vertex lies within it of the origin.
  [[nodiscard]] double radius_m() const;
  /// The surface, or the faces of the pieces.
  [[nodiscard]] std::vector<Triangle> triangles() const;
};

/// The springs of a scene's drivers.
struct DriverSpring {
  double ratio = 1e4;   ///< of its stiffness to a hand's
  double push_n = 100;  ///< force that it presses with at most; 0: no limit
};

struct BodiesScene {
  std::string of_case, name;
  std::vector<FuzzBody> bodies;
  std::vector<Solid> standing;  ///< in W; a driver goes through it
  double share = 1;             ///< of the ticks; less where they take longer
  DriverSpring driver;
  // For a scene that is not the campaign's own:
  std::optional<ProxyScale> scale;
  std::uint32_t passes = 0, work_units = 0;  ///< of a tick; 0: the law's default, no budget
  bool keeps_starts = false;                 ///< every run begins at the starts of the bodies

  /// No coordinate of a body or of what stands is larger, but for drags.
  [[nodiscard]] double extent_m() const;
  /// Radius of the smallest body that is felt: of hands and loose parts.
  [[nodiscard]] double felt_radius_m() const;
};

/// In place of the number of a body: all that stands.
inline constexpr std::size_t kFuzzStanding = SIZE_MAX;

/// Two bodies that may touch, compiled: `a` moves, `b` alone stands at its mesh frame.
struct CompiledBodyPair {
  std::size_t a = 0, b = kFuzzStanding;
  std::vector<std::byte> blob;
  /// In W, where it is not all that stands in the scene.
  std::optional<FuzzBody> standing = std::nullopt;
};

struct CompiledBodies {
  BodiesScene scene;
  std::vector<CompiledBodyPair> pairs;

  /// More move than one law moves in a tick: loose ones take turns, as only programs have them.
  [[nodiscard]] bool takes_turns() const { return scene.bodies.size() > kMostMovingBodies; }
};

/// Compiles every pair of bodies, for law `proxy`, and every hand and loose part against what
/// stands. @throws tools::InputError when the writer refuses one.
[[nodiscard]] CompiledBodies compiled_bodies(BodiesScene scene, double friction);

}  // namespace haptic::sim
