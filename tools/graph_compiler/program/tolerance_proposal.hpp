// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Cost of contact all over for a scene with surfaces, and the simplification that its rate asks
/// for.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/graph_compiler/simplify/edge_collapse.hpp"

namespace haptic::tools {

/// Near pairs of pieces, and the time of a tick in which the two parts lie on each other all over.
/// A rule of thumb, not a bound: every piece has one of the other part next to it, and a near pair
/// takes two units of work in each pass.
struct ContactCost {
  std::size_t pairs = 0;
  double units = 0.0, tick_s = 0.0;
};
ContactCost contact_cost(std::size_t pieces_a, std::size_t pieces_b, std::uint32_t passes);

/// The part of a tick's work at a rate that contact all over `pieces` takes, each with one piece of
/// another part next to it: of a solid, or of a surface, whose ticks have more work.
double contact_share(std::size_t pieces, bool surface, double rate_hz, std::uint32_t passes);

/// A surface that may be simplified; empty `mesh`: a part that stays as it is, of `pieces` pieces.
struct ProposalPart {
  TriangleMesh mesh;
  std::size_t pieces = 0;
  double weld_radius_m = 0.0, diagonal_m = 0.0;
  bool closed = false;
};

struct ToleranceProposal {
  double tolerance_m = 0.0;
  std::size_t pieces_a = 0, pieces_b = 0;  ///< that it leaves
};

/// The smallest of a row of tolerances (1, 2 and 5 times powers of ten) at which the contact of the
/// two parts takes no more units than given; the largest that keeps holes and walls where none
/// does; absent where none of the two can be simplified.
/// @param most_m  no tolerance above this: half of the clearance, where it is known.
/// Cost: that of simplifying both parts with the tolerance proposed.
std::optional<ToleranceProposal> propose_tolerance(const ProposalPart& a, const ProposalPart& b,
                                                   std::uint32_t passes, double units,
                                                   double most_m,
                                                   const std::function<void(double)>& tell);

/// Units of work that a tick may spend by the scene, and those that it has time for at its rate.
struct TickBudget {
  double units = 0.0, of_rate_units = 0.0;
  [[nodiscard]] double least_units() const { return std::min(units, of_rate_units); }
};

/// One sentence: near pairs and time, and how to meet the budget or the rate.
/// @param tried  the proposal was asked for.
std::string contact_cost_text(const std::string& a, const std::string& b, std::size_t pieces_a,
                              std::size_t pieces_b, std::uint32_t passes, const TickBudget& budget,
                              bool tried, const std::optional<ToleranceProposal>& proposal);

}  // namespace haptic::tools
