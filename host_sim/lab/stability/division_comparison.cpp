// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/division_comparison.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/report/quantile.hpp"
#include "rt_core/proxy/proxy_law.hpp"

namespace haptic::sim {
namespace {

void add_strength(const Trace& proxy, const Trace& paper, DivisionComparison& result) {
  for (std::size_t k = 0; k < result.ticks; ++k) {
    const Vector &ours = proxy.path()[k].force_n, &theirs = paper.path()[k].force_n;
    const double ours_n = ours.norm(), theirs_n = theirs.norm();
    if (std::min(ours_n, theirs_n) <= kFeltDifference_n) continue;
    ++result.pushed_ticks;
    if (ours.dot(theirs) < std::sqrt(0.5) * ours_n * theirs_n) continue;
    ++result.contact_ticks;
    result.proxy_mean_n += ours_n;
    result.paper_mean_n += theirs_n;
  }
  const double count = static_cast<double>(std::max<std::size_t>(result.contact_ticks, 1));
  result.proxy_mean_n /= count;
  result.paper_mean_n /= count;
}

}  // namespace

double DivisionDifference::quantile_n(double share) const { return quantile(sorted_n, share); }

double DivisionDifference::share_over(double limit_n) const {
  return sim::share_over(sorted_n, limit_n);
}

bool DivisionComparison::same_strength() const {
  return contact_ticks > 0 && std::abs(proxy_mean_n - paper_mean_n) <= 0.2 * paper_mean_n;
}

double most_felt_share(DivisionContact contact) {
  return contact == DivisionContact::kFace ? 0 : contact == DivisionContact::kMixed ? 0.001 : 0.05;
}

bool agrees(const DivisionDifference& difference, DivisionContact contact, double tolerance_n) {
  if (contact == DivisionContact::kJammed)
    return difference.other_contact_share <= most_felt_share(contact);
  if (difference.share_over(kFeltDifference_n) > most_felt_share(contact)) return false;
  if (contact == DivisionContact::kRelease) return true;
  const double share = contact == DivisionContact::kFace ? 1 : 0.99;
  return difference.quantile_n(share) <= 2 * tolerance_n;  // each of the two is within it
}

double wrench_distance_n(const CoupledScene& scene, const TraceTick& a, const TraceTick& b) {
  const double force = (a.force_n - b.force_n).squaredNorm();
  const double torque = (a.torque_nm - b.torque_nm).squaredNorm();
  return std::sqrt(force + torque * scene.k_t_n_per_m / scene.k_r_nm_per_rad);
}

DivisionDifference difference_between(const CoupledScene& scene, const Trace& a, const Trace& b) {
  DivisionDifference result;
  const auto first = a.path(), second = b.path();
  const double tolerance_n = scene.k_t_n_per_m * free_depth_m(scene);
  std::size_t beyond = 0;
  for (std::size_t k = 0; k < first.size(); ++k) {
    result.by_tick_n.push_back(wrench_distance_n(scene, first[k], second[k]));
    const double force_n = std::max(first[k].force_n.norm(), second[k].force_n.norm());
    if (result.by_tick_n.back() > tolerance_n + 2 * std::sqrt(2 * tolerance_n * force_n)) ++beyond;
  }
  result.other_contact_share = static_cast<double>(beyond) / static_cast<double>(first.size());
  result.sorted_n = result.by_tick_n;
  std::ranges::sort(result.sorted_n);
  result.worst_gap_m = worst_gap_m(second);
  return result;
}

double farthest_m(const tools::Body& body) {
  double result = 0;
  for (const tools::ConvexPiece& piece : body.pieces) {
    for (const auto& v : piece.vertices) result = std::max(result, Vector(v[0], v[1], v[2]).norm());
  }
  return result;
}

double free_depth_m(const CoupledScene& scene) {
  double extent_m = 0;
  for (const tools::Body& body : scene.statics) extent_m = std::max(extent_m, farthest_m(body));
  const auto real = [](double value) { return static_cast<Real>(value); };
  return static_cast<double>(
      proxy_scale(real(farthest_m(scene.moving)), real(extent_m), real(scene.tolerance_m))
          .tolerance_m);
}

DivisionComparison compare_divisions(const DivisionCase& contact) {
  const CoupledScene first = contact.divided(contact.divisions.front());
  const Trace reference = run_trace(first, LawId::kProxy, contact.path);
  const Trace paper = run_trace(first, LawId::kPaper, contact.path);
  DivisionComparison result;
  result.tolerance_n = first.k_t_n_per_m * free_depth_m(first);
  result.ticks = reference.path().size();
  add_strength(reference, paper, result);
  for (std::size_t k = 1; k < contact.divisions.size(); ++k) {
    const CoupledScene other = contact.divided(contact.divisions[k]);
    for (const LawId law : {LawId::kProxy, LawId::kPaper}) {
      const bool proxy = law == LawId::kProxy;
      DivisionDifference difference =
          difference_between(first, proxy ? reference : paper, run_trace(other, law, contact.path));
      difference.division = contact.divisions[k].name;
      (proxy ? result.differences : result.paper).push_back(std::move(difference));
    }
  }
  return result;
}

}  // namespace haptic::sim
