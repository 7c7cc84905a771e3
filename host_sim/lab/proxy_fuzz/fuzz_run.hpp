// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One run of the proxy under one motion: a core over its scene, and the judge.

#include <memory>
#include <string>
#include <vector>

#include "host_sim/lab/proxy_fuzz/proxy_campaign.hpp"
#include "host_sim/lab/proxy_fuzz/proxy_judge.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

/// A free pose near the obstacle; the scene's own where none is found.
void draw_start(const FuzzScene& scene, ProxyJudge& judge, Seeded& random, Vector& p, Rotation& q);

/// Not movable: it holds pointers into itself.
class FuzzRun {
 public:
  /// @throws tools::InputError when the core refuses the scene.
  FuzzRun(const FuzzScene& scene, double friction, std::span<const std::byte> blob,
          std::optional<ProxyFault> fault, bool to_rest = false);
  FuzzRun(const FuzzRun&) = delete;
  FuzzRun& operator=(const FuzzRun&) = delete;

  /// Starts at a free pose and runs `ticks` ticks; where the run is `to_rest` the device then
  /// stands still until the part has arrived.
  [[nodiscard]] ProxyFuzzTotals run(FuzzMotionKind kind, std::uint64_t ticks, std::uint64_t seed);

 private:
  struct Tick;
  void check_path(const Tick& tick, ProxyFuzzTotals& totals);
  void check_free(const Tick& tick, ProxyFuzzTotals& totals);
  void check_energy(const Tick& tick, ProxyFuzzTotals& totals);
  void check_output(const Tick& tick, ProxyFuzzTotals& totals);
  void check_caps(const Tick& tick, ProxyFuzzTotals& totals);
  void check_still(const Tick& tick, ProxyFuzzTotals& totals);
  [[nodiscard]] bool check_rest(const Tick& tick, ProxyFuzzTotals& totals);
  void fail(const Tick& tick, const char* kind, const std::string& what, std::uint64_t& count,
            ProxyFuzzTotals& totals) const;

  const FuzzScene& scene_;
  double friction_;
  CoreSession session_;
  ProxyJudge judge_;
  std::string label_;            ///< of the running motion, for failures
  std::vector<WidePose> goals_;  ///< of the present run of ticks without a move
  std::uint64_t still_ = 0;      ///< ticks in it
  std::uint64_t possible_ = 0;   ///< of them at its end: ticks in which a move was possible
  std::uint64_t rejected_ = 0;   ///< ticks in a row with every pass rejected
  bool to_rest_ = false;
  std::uint64_t resting_ = 0;  ///< ticks since the device has stood still
  bool turned_ = false;        ///< the anchor has turned the goal
};

}  // namespace haptic::sim
