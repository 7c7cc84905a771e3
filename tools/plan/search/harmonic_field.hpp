// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A harmonic function along a channel of cells in C-space (Rosell, Vazquez, Perez, Iniguez 2008, J
/// Intell Robot Syst 53:223), for a part that does not turn: the cells of its free places about a
/// motion are cut finer, and Laplace's equation is solved over them with 1 at the start, 0 at the
/// goal and no flow through C-faces. It has no least value but the goal's, so its descent leads
/// there from every cell.
///
/// Here every wall of the channel is exact: a cell ends at the C-faces themselves, however narrow
/// the channel is. Their second function, which leads into the channel from elsewhere, is left out:
/// the guide lets go where the part is off its way.

#include <cstdint>
#include <span>
#include <vector>

#include "tools/plan/search/step_prover.hpp"
#include "tools/plan/search/translation_cells.hpp"

namespace haptic::tools {

struct FieldLimits {
  double cells_along = 28;      ///< pitch of the finer cells: length of the motion over this
  double wide = 0.22;           ///< how far the channel reaches from the motion, in its lengths
  std::uint32_t rounds = 4000;  ///< of the solver, at the most
};

struct HarmonicField {
  std::vector<ConvexCell> cells;
  std::vector<std::vector<Passage>> passages;  ///< through a part of a side
  std::vector<double> value;                   ///< of each cell, from 0 at the goal to 1
  std::vector<Vec3d> descent;                  ///< unit, or zero where nothing flows
  std::uint32_t start_cell = 0, goal_cell = 0;
  double pitch_m = 0;
  std::uint32_t rounds = 0;  ///< of the solver
  double residual = 0;       ///< largest, as a share of the first
};

/// The field over the cells of `space` about the straight ways between `corners`, the first of
/// which is the start, the last the goal. Same input, same field.
/// @throws std::runtime_error when the corners do not lie in joined cells.
[[nodiscard]] HarmonicField make_harmonic_field(const TranslationSpace& space,
                                                std::span<const Vec3d> corners,
                                                const FieldLimits& limits = {});

/// The way down the field: along the flow from cell to lower cell, each step within one cell. The
/// first place is `start`, the last is `goal`.
[[nodiscard]] std::vector<Vec3d> descend(const HarmonicField& field, const Vec3d& start,
                                         const Vec3d& goal);

struct HarmonicDescent {
  HarmonicField field;
  CorneredMotion motion;
};
/// The field about a motion of a part that does not turn, and the motion down it between the same
/// ends. @throws as make_harmonic_field
[[nodiscard]] HarmonicDescent descend_about(const TranslationSpace& space,
                                            const CorneredMotion& about);

}  // namespace haptic::tools
