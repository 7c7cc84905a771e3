// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/tolerance_proposal.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"
#include "tools/graph_compiler/surface/surface_part.hpp"
#include "tools/scene_facts/facts_text.hpp"

namespace haptic::tools {
namespace {

/// Shares of the diagonal of the larger part between which the tolerances are tried.
constexpr double kFirstShare = 1.0e-5, kLastShare = 0.02;
constexpr std::array<double, 3> kSteps{1.0, 2.0, 5.0};
/// Share of half the narrowest passage.
constexpr double kPassageShare = 0.9;

/// One part on the row of tolerances.
class Side {
 public:
  explicit Side(const ProposalPart& part) : part_(part), pieces_(part.pieces) {
    if (!part.mesh.triangles.empty()) collapse_ = std::make_unique<EdgeCollapse>(part.mesh);
  }
  void run(double tolerance_m, const std::function<void(double)>& tell) {
    if (!collapse_) return;
    collapse_->run(tolerance_m, 0, tell);
    SurfaceOptions options;
    options.weld_radius_m = part_.weld_radius_m;
    options.count_crossings = false;
    pieces_ = make_surface_part(raw_mesh(collapse_->result(), {}), options).facets.size();
  }
  [[nodiscard]] double widest_m(double reach_m) const {
    if (!collapse_) return reach_m;
    const auto passage =
        narrowest_passage(part_.mesh, part_.closed, part_.weld_radius_m, 2.0 * reach_m);
    return passage ? std::min(reach_m, kPassageShare * 0.5 * passage->width_m) : reach_m;
  }
  [[nodiscard]] std::size_t pieces() const { return pieces_; }
  [[nodiscard]] bool can_change() const { return collapse_ != nullptr; }

 private:
  const ProposalPart& part_;
  std::size_t pieces_;
  std::unique_ptr<EdgeCollapse> collapse_;
};

/// A pair of polyhedra takes about as many units as so many pairs of facets: its planes are looked
/// for among those of all features, not of two.
constexpr double kPieceWeight = 6.3;

std::string microseconds(double x_s) { return formatted("%.0f us", 1.0e6 * x_s); }

}  // namespace

ContactCost contact_cost(std::size_t pieces_a, std::size_t pieces_b, std::uint32_t passes) {
  ContactCost cost;
  cost.pairs = pieces_a + pieces_b;
  cost.units = contact_units(static_cast<double>(cost.pairs), passes);
  cost.tick_s = kUnitPrice_s * cost.units;
  return cost;
}

double contact_share(std::size_t pieces, bool surface, double rate_hz, std::uint32_t passes) {
  // Where every piece has a pair, the pairs raise the budget to its largest.
  const auto slots = static_cast<std::uint32_t>(
      std::min<std::size_t>(pieces, std::numeric_limits<std::uint32_t>::max()));
  return (surface ? 1.0 : kPieceWeight) * contact_cost(pieces, 0, passes).units /
         work_units_at(rate_hz, slots, 0, 0, surface);
}

std::optional<ToleranceProposal> propose_tolerance(const ProposalPart& a, const ProposalPart& b,
                                                   std::uint32_t passes, double units,
                                                   double most_m,
                                                   const std::function<void(double)>& tell) {
  Side of_a(a), of_b(b);
  if (!of_a.can_change() && !of_b.can_change()) return std::nullopt;
  const double size_m = std::max(a.diagonal_m, b.diagonal_m);
  const double widest_m = of_b.widest_m(of_a.widest_m(std::min(most_m, kLastShare * size_m)));
  std::optional<ToleranceProposal> proposal;
  double decade_m = std::pow(10.0, std::floor(std::log10(kFirstShare * size_m)));
  for (std::size_t step = 0;; step = (step + 1) % kSteps.size()) {
    const double tolerance_m = kSteps[step] * decade_m;
    if (step + 1 == kSteps.size()) decade_m *= 10.0;
    if (tolerance_m < kFirstShare * size_m) continue;
    if (!(tolerance_m <= widest_m)) break;
    of_a.run(tolerance_m, tell);
    of_b.run(tolerance_m, tell);
    if (!proposal || of_a.pieces() + of_b.pieces() < proposal->pieces_a + proposal->pieces_b) {
      proposal = {tolerance_m, of_a.pieces(), of_b.pieces()};
    }
    if (contact_cost(of_a.pieces(), of_b.pieces(), passes).units <= units) break;
  }
  return proposal;
}

std::string contact_cost_text(const std::string& a, const std::string& b, std::size_t pieces_a,
                              std::size_t pieces_b, std::uint32_t passes, const TickBudget& budget,
                              bool tried, const std::optional<ToleranceProposal>& proposal) {
  const ContactCost now = contact_cost(pieces_a, pieces_b, passes);
  std::string text =
      a + " on " + b + ", if they lay on each other all over: " + grouped(pieces_a) + " and " +
      grouped(pieces_b) + " pieces, about " + grouped(now.pairs) + " near pairs, " +
      microseconds(now.tick_s) + formatted(" a tick at %.0f ns a unit; ", 1.0e9 * kUnitPrice_s) +
      (budget.units < budget.of_rate_units
           ? "the budget is " + microseconds(kUnitPrice_s * budget.units)
           : "one that comes in time has " + microseconds(kUnitPrice_s * budget.of_rate_units));
  if (!tried) return text + "; --propose-tolerance finds the tolerance_m that meets it";
  if (!proposal)
    return text + "; no tolerance_m that keeps holes, walls and the clearance leaves fewer";
  const ContactCost then = contact_cost(proposal->pieces_a, proposal->pieces_b, passes);
  text += formatted("; tolerance_m = %.2g", proposal->tolerance_m) + " leaves about " +
          grouped(proposal->pieces_a) + " and " + grouped(proposal->pieces_b) + " pieces, " +
          microseconds(then.tick_s) + " a tick";
  if (then.units > budget.least_units()) {
    text += ": not enough, and a larger one would close holes, walls or the clearance";
  }
  return text;
}

}  // namespace haptic::tools
