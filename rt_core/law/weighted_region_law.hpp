#pragma once
#include <span>
#include "rt_core/law/paper_law.hpp"
namespace haptic {
struct WeightedContact {
  Vec3 normal_w = Vec3::Zero(), app_w = Vec3::Zero();
  Real weight = 0;
};
Wrench weighted_region_wrench(std::span<const WeightedContact> contacts, Real d_near_m,
                              Real k_f_n_per_m, Real size_m, const HullScratch& scratch) noexcept;
Real contact_weight(Real f_m, Real d_near_m, Real violation_m, Real outside_m, Real epsilon_m,
                    Real epsilon_o_m) noexcept;
}  // namespace haptic
