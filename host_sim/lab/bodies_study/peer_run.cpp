// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/bodies_study/peer_run.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>

#include "host_sim/lab/bodies_fuzz/bodies_session.hpp"
#include "host_sim/lab/peers/bodies_peer.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

/// A function of its own, by whose name its instructions are counted.
[[gnu::noinline]] void peer_tick(BodiesPeer& peer, const PeerPlaces& goals) { peer.tick(goals); }

namespace {

PeerVector peer_vector(const Vector& v) { return {v[0], v[1], v[2]}; }

PeerPlaces peer_places(const std::vector<BodyPlace>& places) {
  PeerPlaces result;
  for (const BodyPlace& place : places) {
    result.p.push_back(peer_vector(place.p));
    result.q_wxyz.push_back({place.q.w(), place.q.x(), place.q.y(), place.q.z()});
  }
  return result;
}

/// @throws tools::InputError: it is no box along its axes.
PeerBox peer_box(const Solid& solid) {
  Vector low = solid.vertices[0], high = low;
  for (const Vector& v : solid.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const bool is_box =
      solid.vertices.size() == 8 && std::ranges::all_of(solid.vertices, [&](const Vector& v) {
        return ((v - low).array().abs().min((v - high).array().abs()) < 1e-12).all();
      });
  if (!is_box) throw tools::InputError(solid.name + ": not a box; the engine is given boxes alone");
  return {peer_vector((low + high) / 2), peer_vector((high - low) / 2)};
}

[[maybe_unused]] PeerAssembly peer_assembly(const BodiesCostCase& of) {
  PeerAssembly assembly;
  assembly.friction = of.friction;
  const std::vector<MovingBody> springs = moving_bodies(of.scene);
  for (std::size_t k = 0; k < springs.size(); ++k) {
    SprungBody body;
    for (const Solid& piece : of.scene.bodies[k].pieces) body.boxes.push_back(peer_box(piece));
    body.stiffness_n_per_m = static_cast<double>(springs[k].spring.k_t_n_per_m);
    body.turn_stiffness_nm_per_rad = static_cast<double>(springs[k].spring.k_r_nm_per_rad);
    assembly.bodies.push_back(std::move(body));
  }
  for (const Solid& piece : of.scene.standing) assembly.standing.push_back(peer_box(piece));
  return assembly;
}

std::unique_ptr<BodiesPeer> peer_of([[maybe_unused]] const BodiesCostCase& of,
                                    const std::string& way) {
  for (const BodiesPeerWay& each : bodies_peer_ways()) {
    if (each.name != way) continue;
#if HAPTIC_PEER_MUJOCO
    return make_mujoco_bodies(peer_assembly(of), each.stiff, each.steps);
#endif
  }
  throw tools::UsageError("--peer " + way + ": " + bodies_peer_words());
}

std::vector<BodyPlace> body_places(const PeerPlaces& places) {
  std::vector<BodyPlace> result;
  for (std::size_t k = 0; k < places.p.size(); ++k) {
    const auto& [w, x, y, z] = places.q_wxyz[k];
    result.push_back(
        {Vector(places.p[k][0], places.p[k][1], places.p[k][2]), Rotation(w, x, y, z)});
  }
  return result;
}

/// Fowler-Noll-Vo, of 64 bits.
void add_to_peer_hash(std::uint64_t& hash, const PeerPlaces& places) {
  const auto add = [&](double number) {
    unsigned char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001b3ull;
  };
  for (const PeerVector& p : places.p) std::ranges::for_each(p, add);
  for (const auto& q : places.q_wxyz) std::ranges::for_each(q, add);
}

}  // namespace

const std::vector<BodiesPeerWay>& bodies_peer_ways() {
#if HAPTIC_PEER_MUJOCO
  static const std::vector<BodiesPeerWay> ways{{"default", "MuJoCo", false, 1},
                                               {"stiff", "MuJoCo, stiff", true, 1},
                                               {"fine", "MuJoCo, stiff, ten steps", true, 10}};
#else
  static const std::vector<BodiesPeerWay> ways;
#endif
  return ways;
}

std::string bodies_peer_words() {
#if HAPTIC_PEER_MUJOCO
  return std::string("MuJoCo ") + mujoco_version();
#else
  return "MuJoCo was not found when this was built; install libmujoco-dev and build again";
#endif
}

BodiesPeerRun run_bodies_peer(const BodiesCostCase& of, const std::string& way, std::size_t ticks) {
  const std::unique_ptr<BodiesPeer> peer = peer_of(of, way);
  BodiesPeerRun run;
  run.state_hash = 0xcbf29ce484222325ull;
  peer->begin(peer_places(of.goals(0)));
  for (std::size_t t = 0; t < ticks; ++t) {
    const PeerPlaces goals = peer_places(of.goals(1e-3 * static_cast<double>(t)));
    const auto start = std::chrono::steady_clock::now();
    peer_tick(*peer, goals);
    const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - start;
    run.ns.push_back(taken.count());
    run.places.push_back(body_places(peer->places()));
    add_to_peer_hash(run.state_hash, peer->places());
  }
  return run;
}

}  // namespace haptic::sim
