// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/pareto/opponents.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <deque>
#include <functional>
#include <limits>
#include <utility>

#include "host_sim/lab/peers/exhaustive_peer.hpp"
#include "host_sim/lab/peers/peer_catalog.hpp"
#include "host_sim/lab/peers/voxel_peer.hpp"
#include "host_sim/lab/surface_fuzz/surface_scene.hpp"
#include "host_sim/oracle/mesh_pair.hpp"
#include "host_sim/report/quantile.hpp"
#include "host_sim/session/child_run.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/view/gallery.hpp"
#include "tools/common/formatted.hpp"
#include "tools/graph_compiler/program/scene_file.hpp"

namespace haptic::sim {
namespace {

using tools::formatted;

constexpr double kMicro = 1e6;
constexpr double kMasses_kg[] = {0.05, 0.01};
/// Beside the coupling's: of all contacts together, and of each point of a distance field.
constexpr double kPlaneStiffness[] = {8, 64};
constexpr double kPointStiffness[] = {1, 10};
/// Times of the peg's way (headline_scenes.cpp): all of it, in the hole, and out of it again.
constexpr double kPegWay_s = 6.2, kInHole_s = 2.0, kLeaving_s = 5.4;
constexpr double kReachMargin_m = 1e-3;
/// Scenes with more pieces standing are left to the other methods: voxels at tens of milliseconds a
/// tick on every scene would tell no more than one peg and one thread do.
constexpr std::size_t kMostVoxelPieces = 5;

class CoupledRenderer final : public PlacedRenderer {
 public:
  CoupledRenderer(const Vector& grip_m, const CouplingGains& gains,
                  std::unique_ptr<CoupledPeer> peer)
      : grip_m_(grip_m), gains_(gains), peer_(std::move(peer)) {}

  void reset() override { begun_ = failed_ = false; }
  void prepare(const MotionSample& goal, std::uint64_t) override {
    q_ = Rotation(goal.q_wxyz[0], goal.q_wxyz[1], goal.q_wxyz[2], goal.q_wxyz[3]).normalized();
    p_ = Vector(goal.p[0], goal.p[1], goal.p[2]) + q_ * grip_m_;
    goal_ = peer_pose(p_, q_);
    if (!std::exchange(begun_, true)) peer_->begin(goal_);
  }
  void render() override {
    if (failed_) return;
    try {
      peer_->tick(goal_);
    } catch (const std::runtime_error&) {
      failed_ = true;
    }
  }
  [[nodiscard]] HandWrench wrench() const override {
    const PeerPose at = peer_->place();
    const Rotation q(at.q_wxyz[0], at.q_wxyz[1], at.q_wxyz[2], at.q_wxyz[3]);
    Rotation by = q * q_.conjugate();
    if (by.w() < 0) by.coeffs() = -by.coeffs();
    const Eigen::AngleAxisd turn(by);
    HandWrench wrench;
    wrench.force_n = gains_.k_t_n_per_m * (Vector(at.p_wa[0], at.p_wa[1], at.p_wa[2]) - p_);
    wrench.torque_nm = gains_.k_r_nm_per_rad * turn.angle() * turn.axis();
    wrench.flawed = failed_;
    return wrench;
  }
  [[nodiscard]] ShownPart part() const override {
    const PeerPose at = peer_->place();
    const Rotation q(at.q_wxyz[0], at.q_wxyz[1], at.q_wxyz[2], at.q_wxyz[3]);
    return {Vector(at.p_wa[0], at.p_wa[1], at.p_wa[2]) - q * grip_m_, q};
  }

 private:
  Vector grip_m_;
  CouplingGains gains_;
  std::unique_ptr<CoupledPeer> peer_;
  Vector p_ = Vector::Zero();
  Rotation q_ = Rotation::Identity();
  PeerPose goal_;
  bool begun_ = false, failed_ = false;
};

/// Depth of the part in what stands, by searches that share nothing with any method.
class DepthJudge {
 public:
  explicit DepthJudge(const OpponentScene& scene) : grip_m_(scene.grip_m) {
    for (const PeerSolid& a : scene.pieces.moving) {
      for (const PeerSolid& b : scene.pieces.fixed) pairs_.emplace_back(a, b);
    }
    if (!pairs_.empty()) return;
    const auto wide = [](const std::vector<SurfaceTriangle>& surface) {
      std::vector<Triangle> triangles;
      for (const SurfaceTriangle& t : surface) {
        Triangle& out = triangles.emplace_back();
        for (std::size_t k = 0; k < 3; ++k)
          out[k] = {widen(t[k][0]), widen(t[k][1]), widen(t[k][2])};
      }
      return triangles;
    };
    meshes_.emplace(wide(scene.part), wide(scene.standing));
  }

  [[nodiscard]] double depth_m(const ShownPart& part) {
    const Vector p = part.p + part.q * grip_m_;
    if (meshes_) {
      const OraclePose pose{
          rotation_of(widen(part.q.w()), widen(part.q.x()), widen(part.q.y()), widen(part.q.z())),
          {widen(p[0]), widen(p[1]), widen(p[2])}};
      return static_cast<double>(meshes_->crossing(pose).depth_m);
    }
    double deepest = 0;
    for (ExhaustivePeer& pair : pairs_) {
      pair.prepare(peer_pose(p, part.q));
      pair.query();
      deepest = std::max(deepest, -pair.answer().depth_m);
    }
    return deepest;
  }

 private:
  Vector grip_m_;
  std::deque<ExhaustivePeer> pairs_;
  std::optional<MeshPair> meshes_;
};

std::span<const MotionSample> goals_of(const OpponentScene& scene, const OpponentPlan& plan) {
  const std::size_t most = scene.goals.size() / kHeadlineSubsteps;
  return std::span(scene.goals).first(std::min(plan.ticks, most) * kHeadlineSubsteps);
}

/// Everywhere the part may come, with its points.
SpaceBox reach_of(const OpponentScene& scene, std::span<const MotionSample> goals) {
  constexpr std::size_t kStride = 16;
  SpaceBox box;
  for (std::size_t k = 0; k < goals.size(); k += kStride) {
    const auto& s = goals[k];
    const Rotation q(s.q_wxyz[0], s.q_wxyz[1], s.q_wxyz[2], s.q_wxyz[3]);
    const Vector p = Vector(s.p[0], s.p[1], s.p[2]) + q * scene.grip_m;
    for (const SurfaceTriangle& t : scene.part) {
      for (const Vector& corner : t) box.include(p + q * corner);
    }
  }
  box.low -= Vector::Constant(kReachMargin_m);
  box.high += Vector::Constant(kReachMargin_m);
  return box;
}

class OpponentRun {
 public:
  OpponentRun(OpponentMeasure& measure, const OpponentPlan& plan, const TickClock& clock,
              bool progress)
      : measure_(measure),
        plan_(plan),
        clock_(clock),
        progress_(progress),
        goals_(goals_of(measure.scene, plan)),
        judge_(measure.scene),
        judged_(measure.reference.wrenches.size()) {
    const std::size_t stride =
        measure.scene.pieces.moving.empty() ? plan.mesh_depth_stride : plan.depth_stride;
    const auto& in_contact = measure.reference.in_contact;
    for (std::size_t k = 0; k < in_contact.size(); k += stride) judged_[in_contact[k]] = true;
  }

  void add(const std::string& name, const std::string& title, const std::string& setting,
           PlacedRenderer& renderer, std::uint32_t repeats, std::optional<TurnLimit> limit = {}) {
    say("  " + title + (setting.empty() ? "" : ", " + setting));
    OpponentRow row;
    std::vector<double> depths;
    row.method = measure_renderer(goals_, measure_.reference, renderer, repeats, clock_,
                                  [&](std::size_t tick) {
                                    if (judged_[tick])
                                      depths.push_back(judge_.depth_m(renderer.part()));
                                  });
    std::ranges::sort(depths);
    if (!depths.empty())
      row.depth_m = {quantile(depths, 0.5), quantile(depths, 0.99), depths.back()};
    row.method.name = name;
    row.method.title = title;
    row.setting = setting;
    row.limit = limit;
    say(formatted("    %.3g us, force error of 99 %% %.3g N, depth %.3g um",
                  1e-3 * row.method.time_ns.median, row.method.force_n.p99,
                  kMicro * row.depth_m.median));
    measure_.rows.push_back(std::move(row));
  }

  void add_mujoco() {
    for (const double mass_kg : kMasses_kg) {
      const std::string name = formatted("mujoco_%.0f_g", 1e3 * mass_kg);
      const std::string title = formatted("MuJoCo, coupled body of %.0f g", 1e3 * mass_kg);
      if (scene().pieces.moving.empty()) {
        measure_.skipped.push_back(title + ": its meshes are convex hulls; a thread is none");
        continue;
      }
#if HAPTIC_PEER_MUJOCO
      const TurnLimit limit = mujoco_turn_limit(scene().pieces, scene().gains, mass_kg);
      add(name, title, "",
          *coupled(make_mujoco_coupled(scene().pieces, scene().gains, mass_kg, scene().friction)),
          plan_.repeats, limit);
#else
      measure_.skipped.push_back(title + ": MuJoCo was not found when this was built");
#endif
    }
  }

  void add_voxels(double voxel_m) {
    const std::string edge = formatted("%g mm", 1e3 * voxel_m);
    const std::string suffix = formatted("_%.0f_um", kMicro * voxel_m);
    const SpaceBox reach = reach_of(scene(), goals_);
    for (const VoxelForm form : {VoxelForm::kTangentPlanes, VoxelForm::kDistanceField}) {
      const bool planes = form == VoxelForm::kTangentPlanes;
      const VoxelScene voxels(scene().part, scene().standing, reach, voxel_m,
                              planes ? voxel_m : plan_.spacing_m);
      // The coarser voxels decide for the finer ones too.
      std::optional<VoxelSettings>& best = best_[planes ? 0 : 1];
      if (!best) best = tuned(voxels, form);
      add((planes ? "voxels" : "field") + suffix,
          (planes ? "voxels and points, " : "distance field and points, ") + edge,
          formatted("%zu points, ", voxels.points().size()) + words_of(*best),
          *coupled(make_voxel_peer(voxels, scene().gains, *best)), 1);
    }
  }

  void say(const std::string& line) const {
    if (progress_) std::fprintf(stderr, "%s\n", line.c_str());
  }

 private:
  [[nodiscard]] const OpponentScene& scene() const { return measure_.scene; }
  [[nodiscard]] std::unique_ptr<PlacedRenderer> coupled(std::unique_ptr<CoupledPeer> peer) const {
    return coupled_renderer(scene().grip_m, scene().gains, std::move(peer));
  }

  [[nodiscard]] std::string words_of(const VoxelSettings& of) const {
    std::string words = formatted("%.0f N/m%s", of.contact_n_per_m,
                                  of.form == VoxelForm::kTangentPlanes ? "" : " a point");
    if (of.form == VoxelForm::kDistanceField)
      words += of.along == PushAlong::kGradient ? ", along the gradient" : ", along normals";
    return words;
  }

  /// As a user would: by trying what renders this very motion best, by the 99 % of its force error.
  [[nodiscard]] VoxelSettings tuned(const VoxelScene& voxels, VoxelForm form) const {
    std::vector<VoxelSettings> tries;
    const double k_t = scene().gains.k_t_n_per_m;
    if (form == VoxelForm::kTangentPlanes) {
      for (const double share : kPlaneStiffness)
        tries.push_back({form, PushAlong::kPointNormal, share * k_t});
    } else {
      for (const PushAlong along : {PushAlong::kPointNormal, PushAlong::kGradient}) {
        for (const double share : kPointStiffness) tries.push_back({form, along, share * k_t});
      }
    }
    double least = std::numeric_limits<double>::infinity();
    VoxelSettings best = tries.front();
    for (const VoxelSettings& settings : tries) {
      const auto renderer = coupled(make_voxel_peer(voxels, scene().gains, settings));
      const HeadlineMethod method =
          measure_renderer(goals_, measure_.reference, *renderer, 1, clock_);
      say(formatted("    %s: force error of 99 %% %.3g N", words_of(settings).c_str(),
                    method.force_n.p99));
      if (method.flawed_ticks > 0 || !(method.force_n.p99 < least)) continue;
      least = method.force_n.p99;
      best = settings;
    }
    return best;
  }

  OpponentMeasure& measure_;
  const OpponentPlan& plan_;
  const TickClock& clock_;
  bool progress_;
  std::span<const MotionSample> goals_;
  DepthJudge judge_;
  std::vector<bool> judged_;                          ///< by tick
  std::array<std::optional<VoxelSettings>, 2> best_;  ///< by form
};

void take_gains(OpponentScene& scene) {
  const CoreSession session(scene.scene, scene.name);
  const CouplingParameters& coupling = session.view().parameters().coupling;
  scene.gains.k_t_n_per_m = coupling.k_t_n_per_m;
  scene.gains.k_r_nm_per_rad = coupling.k_r_nm_per_rad;
}

OpponentScene of_pieces(const HeadlineScene& from, double friction) {
  OpponentScene scene;
  scene.name = from.name + (friction > 0 ? "_friction" : "");
  scene.title = from.title + formatted(friction > 0 ? ", friction %g" : "", friction);
  scene.friction = friction;
  HeadlineScene changed = from;
  changed.description.statics.front().friction = friction;
  scene.scene = law_scene(changed, LawId::kProxy, 0, false);
  scene.settled = law_scene(changed, LawId::kProxy, kReferencePasses, true);
  const auto& grip = from.description.grip_m;
  scene.grip_m = Vector(grip[0], grip[1], grip[2]);
  scene.pieces = from.bodies;
  scene.part = boundary_of(scene.pieces.moving);
  scene.standing = boundary_of(scene.pieces.fixed);
  scene.goals = from.goals;
  if (friction > 0) {
    // In the hole alone: with friction it hangs on a tick whether a peg on the rim falls in.
    const auto sample = [&](double t_s) {
      const double share = t_s / kPegWay_s;
      return kHeadlineSubsteps *
             static_cast<std::size_t>(share * static_cast<double>(from.ticks()));
    };
    scene.goals.assign(from.goals.begin() + static_cast<std::ptrdiff_t>(sample(kInHole_s)),
                       from.goals.begin() + static_cast<std::ptrdiff_t>(sample(kLeaving_s)));
  }
  take_gains(scene);
  return scene;
}

std::vector<SurfaceTriangle> shifted(const std::vector<Triangle>& triangles, const Vector& by) {
  std::vector<SurfaceTriangle> out;
  for (const Triangle& t : triangles) {
    SurfaceTriangle& to = out.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      to[k] = Vector(static_cast<double>(t[k].x), static_cast<double>(t[k].y),
                     static_cast<double>(t[k].z)) +
              by;
    }
  }
  return out;
}

OpponentScene nut_scene(bool quick) {
  OpponentScene scene;
  scene.name = "nut_on_bolt";
  scene.title = "nut on a bolt M10, 0.1 mm of clearance on each";
  tools::SceneFile file =
      tools::parse_scene_file(gallery_file(scene.name, "scene.toml"), scene.name, ".");
  // Neither the voxels of 1999 nor those of 2008 have friction.
  for (tools::FrictionPair& pair : file.friction) pair.mu = pair.mu_static = 0;
  CompiledSurface compiled = compiled_surface(file);
  scene.scene = std::move(compiled.blob);
  file.coupling.passes = kReferencePasses;
  scene.settled = compiled_surface(file).blob;
  const CoreSession session(scene.scene, scene.name);
  const auto& grip = session.view().bodies().front().reference_m;
  scene.grip_m = Vector(grip[0], grip[1], grip[2]);
  scene.part = shifted(compiled.moving, -scene.grip_m);
  scene.standing = shifted(compiled.fixed, Vector::Zero());
  const TemporaryFolder folder;
  const std::string motion = folder.file("motion.toml");
  write_whole_file(motion, std::string(gallery_file(scene.name, "motion.toml")));
  MotionScript script = read_motion_script(motion);
  script.rate_hz *= kHeadlineSubsteps;
  if (quick) {
    for (WayPoint& point : script.waypoints) point.t_s /= 6;
  }
  scene.goals = make_motion(script);
  take_gains(scene);
  return scene;
}

}  // namespace

std::unique_ptr<PlacedRenderer> coupled_renderer(const Vector& grip_m, const CouplingGains& gains,
                                                 std::unique_ptr<CoupledPeer> peer) {
  return std::make_unique<CoupledRenderer>(grip_m, gains, std::move(peer));
}

std::vector<OpponentScene> opponent_scenes(const OpponentPlan& plan) {
  const std::vector<HeadlineScene> pegs = headline_scenes(plan.quick);
  std::vector<OpponentScene> scenes;
  scenes.push_back(of_pieces(pegs[0], 0));
  scenes.push_back(of_pieces(pegs[0], kOpponentFriction));
  scenes.push_back(of_pieces(pegs[1], 0));
  scenes.push_back(nut_scene(plan.quick));
  return scenes;
}

const OpponentRow* OpponentMeasure::row(const std::string& name) const {
  const auto found =
      std::ranges::find_if(rows, [&](const OpponentRow& r) { return r.method.name == name; });
  return found == rows.end() ? nullptr : &*found;
}

OpponentMeasure measure_opponents(const OpponentScene& scene, const OpponentPlan& plan,
                                  const TickClock& clock, bool progress) {
  OpponentMeasure measure;
  measure.scene = scene;
  const auto goals = goals_of(measure.scene, plan);
  if (progress) {
    std::fprintf(stderr, "opponents: %s, %zu ticks: reference\n", scene.title.c_str(),
                 goals.size() / kHeadlineSubsteps);
  }
  measure.reference = settled_reference(goals, *law_renderer(scene.settled, scene.name));
  OpponentRun run(measure, plan, clock, progress);
  run.add(kDefaultMethod, "law proxy (default)", "", *law_renderer(scene.scene, scene.name),
          plan.repeats);
  run.add_mujoco();
  if (scene.friction > 0) {
    measure.skipped.push_back("voxels and points: neither form has friction");
  } else if (scene.pieces.fixed.size() > kMostVoxelPieces) {
    measure.skipped.push_back("voxels and points: the square peg stands for the round one");
  } else {
    for (const double voxel_m : plan.voxels_m) run.add_voxels(voxel_m);
  }
  return measure;
}

}  // namespace haptic::sim
