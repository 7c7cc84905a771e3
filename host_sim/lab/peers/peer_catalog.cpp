// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/peers/peer_catalog.hpp"

#include <limits>
#include <span>
#include <string_view>
#include <utility>

#include "host_sim/lab/peers/core_peer.hpp"
#include "host_sim/lab/peers/exhaustive_peer.hpp"
#include "host_sim/lab/peers/foreign_peers.hpp"

namespace haptic::sim {
namespace {

/// What the clock alone and the call cost.
class EmptyPeer final : public PeerQuery {
 public:
  void prepare(const PeerPose&) override {}
  void query() override {}
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.verdict_given = false;
    answer.depth_m = std::numeric_limits<double>::quiet_NaN();
    return answer;
  }
};

using Maker = std::unique_ptr<PeerQuery> (*)(const PeerSolid&, const PeerSolid&, double);

/// A method of a library at each of its tolerances.
[[maybe_unused]] void add_tolerances(std::vector<PeerEntry>& entries, const char* method,
                                     Maker make, std::span<const char* const> tolerances,
                                     std::string_view drawn) {
  for (const char* tolerance : tolerances) {
    const double tolerance_m = std::stod(tolerance);
    PeerEntry entry{method, std::string("tol ") + tolerance, "double",
                    [make, tolerance_m](const Solid& a, const Solid& b) {
                      return make(peer_solid(a), peer_solid(b), tolerance_m);
                    }};
    entry.drawn = tolerance == drawn;
    entries.push_back(std::move(entry));
  }
}

void add_own(std::vector<PeerEntry>& entries) {
  PeerEntry empty{"empty", "clock and call", "-",
                  [](const Solid&, const Solid&) { return std::make_unique<EmptyPeer>(); }};
  PeerEntry exhaustive{"exhaustive", "all nodes", "double", [](const Solid& a, const Solid& b) {
                         return std::make_unique<ExhaustivePeer>(peer_solid(a), peer_solid(b));
                       }};
  exhaustive.drawn = exhaustive.all_nodes = true;
  entries.push_back(std::move(empty));
  entries.push_back(std::move(exhaustive));
  for (const bool with_rotation : {false, true}) {
    PeerEntry literal{"paper_literal", with_rotation ? "delta dx-rotation" : "delta dx", "double",
                      [with_rotation](const Solid& a, const Solid& b) {
                        return make_literal_peer(a, b, with_rotation);
                      }};
    literal.drawn = !with_rotation;
    entries.push_back(std::move(literal));
  }
}

void add_core(std::vector<PeerEntry>& entries) {
  PeerEntry core{"ours", "tick", kRealName, [](const Solid& a, const Solid& b) {
                   return make_core_peer(a, {&b, 1});
                 }};
  core.drawn = true;
  entries.push_back(std::move(core));
}

void add_foreign([[maybe_unused]] std::vector<PeerEntry>& entries) {
#if HAPTIC_PEER_CCD
  constexpr const char* kPortal[] = {"1e-3", "1e-8", "1e-12"};
  constexpr const char* kPolytope[] = {"1e-3", "1e-6", "1e-8", "1e-10", "1e-12"};
  add_tolerances(entries, "libccd_mpr", make_ccd_mpr_peer, kPortal, "1e-8");
  add_tolerances(entries, "libccd_epa", make_ccd_epa_peer, kPolytope, "1e-8");
#endif
#if HAPTIC_PEER_FCL
  constexpr const char* kFcl[] = {"1e-3", "1e-6", "1e-10"};
  add_tolerances(entries, "fcl", make_fcl_peer, kFcl, "1e-6");
#endif
#if HAPTIC_PEER_BULLET
  PeerEntry bullet{"bullet_epa", "margin 0", "double", [](const Solid& a, const Solid& b) {
                     return make_bullet_peer(peer_solid(a), peer_solid(b));
                   }};
  bullet.drawn = true;
  entries.push_back(std::move(bullet));
#endif
#if HAPTIC_PEER_ODE
  PeerEntry ode{"ode_boxbox", "default", "double", [](const Solid& a, const Solid& b) {
                  return make_ode_peer(peer_solid(a), peer_solid(b));
                }};
  ode.drawn = ode.boxes_only = true;
  entries.push_back(std::move(ode));
#endif
}

}  // namespace

std::vector<PeerEntry> peer_catalog() {
  std::vector<PeerEntry> entries;
  add_own(entries);
  add_core(entries);
  add_foreign(entries);
  return entries;
}

std::vector<PenaltyEntry> penalty_catalog() {
  std::vector<PenaltyEntry> entries;
#if HAPTIC_PEER_BULLET
  entries.push_back({"penalty_bullet", "penalty on Bullet", make_bullet_penalty});
#endif
#if HAPTIC_PEER_FCL
  entries.push_back({"penalty_fcl", "penalty on FCL", make_fcl_penalty});
#endif
#if HAPTIC_PEER_ODE
  entries.push_back({"penalty_ode", "penalty on ODE", make_ode_penalty});
#endif
#if HAPTIC_PEER_CCD
  entries.push_back({"penalty_ccd_mpr", "penalty on libccd MPR", make_ccd_mpr_penalty});
  entries.push_back({"penalty_ccd_epa", "penalty on libccd GJK-EPA", make_ccd_epa_penalty});
#endif
  return entries;
}

std::vector<PeerLibrary> peer_libraries() {
  return {
      {"libccd", HAPTIC_PEER_CCD_VERSION, "BSD-3-Clause", HAPTIC_PEER_CCD != 0},
      {"FCL", HAPTIC_PEER_FCL_VERSION, "BSD-3-Clause", HAPTIC_PEER_FCL != 0},
      {"Bullet", HAPTIC_PEER_BULLET_VERSION, "Zlib", HAPTIC_PEER_BULLET != 0},
      {"ODE", HAPTIC_PEER_ODE_VERSION, "BSD-3-Clause or LGPL-2.1-or-later", HAPTIC_PEER_ODE != 0}};
}

PeerSolid peer_solid(const Solid& solid) {
  PeerSolid peer;
  for (const Vector& v : solid.vertices) peer.vertices.push_back({v[0], v[1], v[2]});
  peer.loops = solid.loops;
  return peer;
}

PeerPose peer_pose(const Vector& p_wa, const Rotation& q_wa) {
  PeerPose pose;
  pose.p_wa = {p_wa[0], p_wa[1], p_wa[2]};
  pose.q_wxyz = {q_wa.w(), q_wa.x(), q_wa.y(), q_wa.z()};
  const Eigen::Matrix3d r = q_wa.normalized().toRotationMatrix();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      pose.r_wa[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = r(i, j);
  }
  return pose;
}

}  // namespace haptic::sim
