// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The default law beside what haptics uses for the same task, a part that a spring draws: virtual
/// coupling with a simulation by MuJoCo, and voxels with points. Same motion, same coupling
/// stiffness; force against the settled law, depth of the part that each method shows.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/lab/pareto/headline.hpp"
#include "host_sim/lab/peers/coupled_peer.hpp"
#include "host_sim/lab/peers/distance_field.hpp"
#include "host_sim/report/part_report.hpp"

namespace haptic::sim {

/// Name under which they are asked for.
inline constexpr const char* kOpponentsName = "opponents";
/// Coulomb coefficient of the scenes with friction, between both parts.
inline constexpr double kOpponentFriction = 0.2;

/// How much a run does; the full one is that of the command.
struct OpponentPlan {
  std::uint32_t repeats = 3;                 ///< of the motion; the least time of a tick counts
  std::vector<double> voxels_m{2e-4, 1e-4};  ///< edges; both clearances are 0.1 mm
  double spacing_m = 5e-4;                   ///< of the points of a distance field
  std::uint32_t depth_stride = 4;            ///< ticks from one look at the depth to the next
  std::uint32_t mesh_depth_stride = 16;      ///< the same of meshes
  std::size_t ticks = SIZE_MAX;              ///< of the motion, from its start, at most
  bool quick = false;                        ///< the short motion
};

struct OpponentScene {
  std::string name;   ///< for files: letters, digits, underscores
  std::string title;  ///< in words
  double friction = 0;
  std::vector<std::byte> scene, settled;  ///< of the default law; of the reference
  CouplingGains gains;
  Vector grip_m = Vector::Zero();
  PenaltyBodies pieces;                         ///< empty: the parts are surfaces
  std::vector<SurfaceTriangle> part, standing;  ///< part: A's axes about the grip; standing: W
  std::vector<MotionSample> goals;              ///< kHeadlineSubsteps per tick
};

/// Square peg without and with friction, round peg, nut on bolt.
[[nodiscard]] std::vector<OpponentScene> opponent_scenes(const OpponentPlan& plan);

/// One method on one scene.
struct OpponentRow {
  HeadlineMethod method;
  std::string setting;  ///< in words: what it was tuned to
  Spread depth_m;       ///< of the part that it shows, in the ticks in contact; 0: it is outside
  std::optional<TurnLimit> limit;
};

struct OpponentMeasure {
  OpponentScene scene;
  HeadlineReference reference;
  std::vector<OpponentRow> rows;     ///< the default law first
  std::vector<std::string> skipped;  ///< methods that this build or scene has not, and why

  [[nodiscard]] const OpponentRow* row(const std::string& name) const;
};

/// A part that a renderer shows, by a virtual coupling.
[[nodiscard]] std::unique_ptr<PlacedRenderer> coupled_renderer(const Vector& grip_m,
                                                               const CouplingGains& gains,
                                                               std::unique_ptr<CoupledPeer> peer);

[[nodiscard]] OpponentMeasure measure_opponents(const OpponentScene& scene,
                                                const OpponentPlan& plan, const TickClock& clock,
                                                bool progress);

[[nodiscard]] ReportTable opponent_table(const std::vector<OpponentMeasure>& measures);
/// The section for people, heading of the second level; empty without measures.
[[nodiscard]] std::string opponent_markdown(const std::vector<OpponentMeasure>& measures);

}  // namespace haptic::sim
