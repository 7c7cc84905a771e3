// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Damage done to the core on purpose, to show that the checks of the proxy can fail.

#include <optional>
#include <string>

#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

enum class ProxyFault {
  kCertificate,  ///< a step is certified that ends twenty tolerances deep, and rows follow
  kSpring,       ///< the spring turns a quarter too stiff
  kVertex,       ///< one vertex of the part is where another is
  kRestless      ///< now and then the part is found a little off where it was left
};
[[nodiscard]] std::optional<ProxyFault> proxy_fault_named(const std::string& name);

/// Damages the core's memory, or the geometry it reads; nothing for kRestless.
void damage(CoreSession& session, ProxyFault fault);

/// kRestless: moves the part by `shift_m` in the core's memory, from where `last` has left it.
void displace(CoreSession& session, const StepResult& last, const Vec3& shift_m);

}  // namespace haptic::sim
