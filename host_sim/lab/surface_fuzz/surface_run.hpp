// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One run of the core over a scene of triangle meshes under one seeded motion, every felt pose
/// judged against the meshes as their files hold them.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "host_sim/lab/proxy_fuzz/proxy_judge.hpp"
#include "host_sim/lab/surface_fuzz/surface_scene.hpp"
#include "host_sim/oracle/mesh_pair.hpp"
#include "host_sim/report/failure_log.hpp"
#include "host_sim/session/core_session.hpp"

namespace haptic::sim {

enum class SurfaceMotionKind : std::uint8_t {
  kSmooth,  ///< 0.1 to 0.3 m/s between places about the obstacle, with a wobble
  kWild,    ///< the same, 20 rad/s, and every 20 ticks a jump of up to 40 mm
  kPress,   ///< through the obstacle's middle and 40 mm beyond, from both sides in turn, upright
  kDrag,    ///< over its edges, held 2 to 8 mm below what it touches
  kHole     ///< along the scene's way through, with a wobble, then pressed aside
};
inline constexpr SurfaceMotionKind kSurfaceMotions[] = {
    SurfaceMotionKind::kSmooth, SurfaceMotionKind::kWild, SurfaceMotionKind::kPress,
    SurfaceMotionKind::kDrag, SurfaceMotionKind::kHole};
[[nodiscard]] const char* to_text(SurfaceMotionKind kind);

/// Time between two poses of a motion.
inline constexpr double kMotionPeriod_s = 1e-3;

/// Where the device goes, tick by tick.
class SurfaceMotion {
 public:
  struct Surroundings {
    Vector through_at, through_axis;
    double extent_m = 0, radius_m = 0;  ///< of the obstacle and of the part, about their origins
  };
  SurfaceMotion(const Surroundings& around, SurfaceMotionKind kind, std::uint64_t seed);

  /// Outside of the sphere about the obstacle, unless `begin_at` has moved it.
  [[nodiscard]] Pose start() const { return pose_at(p_, q_); }
  void begin_at(const Vector& p);
  /// Pose of the next tick of 1 ms.
  [[nodiscard]] Pose next();

 private:
  void draw_aim();

  Surroundings around_;
  SurfaceMotionKind kind_;
  Seeded random_;
  Vector p_, aim_, jump_ = Vector::Zero(), spin_ = Vector::UnitZ();
  Rotation q_, turn_to_;
  double speed_m_ = 1e-4, swing_rad_ = 0;
  std::uint64_t tick_ = 0, aims_ = 0;
};

/// What is falsified on purpose, to show that the checks can fail; the last one in the core.
enum class SurfaceFault : std::uint8_t {
  kDisplaced,   ///< the mesh that is judged against lies 20 um off the one that was compiled
  kGoal,        ///< the device's pose is judged in place of the felt one
  kRestless,    ///< in every other tick the felt pose is judged 2 um farther from the device
  kCertificate  ///< a step is certified that ends twenty tolerances deep; of solids
};
[[nodiscard]] std::optional<SurfaceFault> surface_fault_named(const std::string& name);

struct SurfaceTotals {
  std::uint64_t ticks = 0, held = 0;  ///< held: the part is kept from its goal
  // Each of these must be zero.
  std::uint64_t deep = 0;        ///< two triangles cross by more than the tolerance
  std::uint64_t passages = 0;    ///< they do on the straight way of a pass
  std::uint64_t rises = 0;       ///< the energy rose by more than its bound
  std::uint64_t unarrived = 0;   ///< the device stood still, and the part did not come to rest
  std::uint64_t walls = 0;       ///< at rest, kept from its goal, and nothing is near
  std::uint64_t infinite = 0;    ///< a number that is not finite
  std::uint64_t over_caps = 0;   ///< a counter beyond its cap
  std::uint64_t recoveries = 0;  ///< inside an obstacle, by the core's own account
  // Figures; lengths are scaled to a part of 50 mm.
  std::uint64_t ways = 0, unproven = 0;  ///< judged ways; parts of them left at the resolution
  std::uint64_t meeting = 0;             ///< ticks in which two triangles share a point, exactly
  Wide worst_gap_m = 0, worst_way_m = 0;
  Wide largest_rise_j = 0, largest_rest_gap_m = 0;
  std::uint64_t longest_arrival = 0, behind = 0;
  FailureLog failures;

  [[nodiscard]] std::uint64_t failed() const {
    return deep + passages + rises + unarrived + walls + infinite + over_caps + recoveries;
  }
  void add(const SurfaceTotals& other);
};

/// Not movable: it holds a session.
class SurfaceRun {
 public:
  /// `strict`: triangles may not even touch. @throws tools::InputError when the core refuses the
  /// scene.
  SurfaceRun(const CompiledSurface& scene, const SurfaceMotion::Surroundings& way,
             const std::string& label, bool strict, std::optional<SurfaceFault> fault);
  SurfaceRun(const SurfaceRun&) = delete;
  SurfaceRun& operator=(const SurfaceRun&) = delete;

  /// Run `number` of a campaign of this seed: starts clear of the obstacle, runs `ticks` ticks,
  /// then holds the device still until the part is at rest. `poses`: of the device, where they are
  /// wanted.
  [[nodiscard]] SurfaceTotals run(SurfaceMotionKind kind, std::uint64_t ticks, std::uint64_t seed,
                                  std::uint64_t number, std::vector<MotionSample>* poses = nullptr);
  /// The same along a motion of a file, from its first pose on.
  [[nodiscard]] SurfaceTotals run(std::span<const MotionSample> motion);

 private:
  struct Tick;
  /// Ticks of the poses that `pose_at` gives, then the rest with the last of them.
  [[nodiscard]] SurfaceTotals judge(std::uint64_t ticks,
                                    const std::function<Pose(std::uint64_t)>& pose_at,
                                    std::vector<MotionSample>* poses);
  void approach(SurfaceMotion& motion) const;
  [[nodiscard]] OraclePose grip_pose(const WidePose& pose) const;
  [[nodiscard]] Wide potential_j(const WideError& error) const;
  void check_free(const Tick& tick, SurfaceTotals& totals);
  void check_way(const Tick& tick, SurfaceTotals& totals);
  void check_energy(const Tick& tick, SurfaceTotals& totals);
  void check_counts(const Tick& tick, SurfaceTotals& totals);
  [[nodiscard]] bool check_rest(const Tick& tick, std::uint64_t resting, SurfaceTotals& totals);
  void fail(const Tick& tick, const char* kind, const std::string& what, std::uint64_t& count,
            SurfaceTotals& totals) const;

  CoreSession session_;
  WideVec grip_;
  MeshPair meshes_;
  SurfaceMotion::Surroundings around_;
  std::string scene_label_, label_;
  std::optional<SurfaceFault> fault_;
  Wide tolerance_m_ = 0, allowed_m_ = 0;
  std::uint64_t still_ = 0;  ///< ticks in a row without a move, at rest
};

}  // namespace haptic::sim
