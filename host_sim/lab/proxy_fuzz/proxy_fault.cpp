// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/proxy_fuzz/proxy_fault.hpp"

#include <cstring>

#include "rt_core/proxy/proxy_law.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

/// Overwrites the only place in the core's memory that holds exactly these numbers.
template <std::size_t count>
void replace(std::span<std::byte> memory, const Real (&from)[count], const Real (&to)[count]) {
  std::size_t found = 0;
  for (std::size_t k = 0; k + sizeof from <= memory.size(); k += sizeof(Real)) {
    if (std::memcmp(memory.data() + k, from, sizeof from) != 0) continue;
    std::memcpy(memory.data() + k, to, sizeof to);
    ++found;
  }
  if (found == 0) throw tools::InputError("the numbers to damage are not in the core's memory");
}

}  // namespace

std::optional<ProxyFault> proxy_fault_named(const std::string& name) {
  if (name == "certificate") return ProxyFault::kCertificate;
  if (name == "spring") return ProxyFault::kSpring;
  if (name == "vertex") return ProxyFault::kVertex;
  if (name == "restless") return ProxyFault::kRestless;
  return std::nullopt;
}

void damage(CoreSession& session, ProxyFault fault) {
  const SceneView& view = session.view();
  const CouplingParameters& c = view.parameters().coupling;
  if (fault == ProxyFault::kSpring) {
    const Real k_t = static_cast<Real>(c.k_t_n_per_m), k_r = static_cast<Real>(c.k_r_nm_per_rad);
    replace<2>(session.state(), {k_t, k_r}, {k_t, k_r * 1.25_r});
    return;
  }
  if (fault == ProxyFault::kCertificate) {
    const ProxyScale scale = proxy_scale(view);
    replace<4>(session.state(), {scale.tolerance_m, scale.skin_m, scale.step_m, scale.turn_rad},
               {20 * scale.tolerance_m, scale.skin_m, scale.step_m, scale.turn_rad});
    return;
  }
  if (fault == ProxyFault::kRestless) return;
  // The scene's bytes are the session's own, mutable memory; the view only promises not to write.
  const PieceView a = view.piece(0);
  std::memcpy(const_cast<Real*>(a.vertices) + 3, a.vertices, 3 * sizeof(Real));
  for (std::uint32_t axis = 0; axis < 3 && a.lanes != nullptr; ++axis) {
    Real* lane = const_cast<Real*>(a.lanes) + std::size_t{axis} * a.lane_count;
    lane[1] = lane[0];
  }
}

void displace(CoreSession& session, const StepResult& last, const Vec3& shift_m) {
  const Vec3& p = last.proxy_pose_wa.p_wa;
  replace<3>(session.state(), {p[0], p[1], p[2]},
             {p[0] + shift_m[0], p[1] + shift_m[1], p[2] + shift_m[2]});
}

}  // namespace haptic::sim
