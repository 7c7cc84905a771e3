#include "rt_core/law/weighted_region_law.hpp"
#include <algorithm>
#include <cmath>
namespace haptic {
Wrench weighted_region_wrench(std::span<const WeightedContact> contacts, Real d, Real k, Real,
                              const HullScratch&) noexcept {
  Wrench w;
  Real sum = 0;
  Vec3 n = Vec3::Zero(), c = Vec3::Zero();
  for (const auto& x : contacts) {
    sum += x.weight;
    n += x.weight * x.normal_w;
    c += x.weight * x.app_w;
  }
  if (!(sum > 0)) return w;
  w.force_w = (-k * d / sum) * n;
  w.torque_w = Vec3(c / sum).cross(w.force_w);
  return w;
}
Real contact_weight(Real f, Real d, Real v, Real o, Real e, Real eo) noexcept {
  const auto r = [](Real t) { return std::min(Real{1}, std::max(Real{0}, 1 - t)); };
  return r((std::abs(f - d) + std::max(v, Real{0})) / e) * r(o / eo);
}
}  // namespace haptic
