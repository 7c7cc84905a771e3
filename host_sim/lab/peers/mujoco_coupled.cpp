// SPDX-License-Identifier: Apache-2.0
// Virtual coupling with a simulation by MuJoCo. https://mujoco.readthedocs.io, chapters Computation
// (solref, solimp, cones) and XML Reference (option, flag multiccd); version 2.2.
#include <algorithm>
#include <array>
#include <cmath>

#include "host_sim/lab/peers/coupled_peer.hpp"
#include "host_sim/lab/peers/mujoco_model.hpp"

namespace haptic::sim {
namespace {

// As a user would tune it for a hand: contacts as stiff as they are still calm at steps of 1 ms
// (solref of 2 ms, the least that MuJoCo takes, is not: it trembles on the peg), an impedance near
// 1 that is reached within half a millimetre, friction not softened by the cone (impratio).
constexpr double kContactTime_s = 0.004, kImpratio = 10;
constexpr const char* kImpedance = "0.95 0.99 0.0005";
constexpr double kInertiaMargin = 2;  ///< over the least that is stable: no ringing is left
constexpr int kTrialTicks = 1000;

/// True if the solid is a box along its axes; then its middle and half lengths.
bool is_box(const PeerSolid& solid, PeerVector& middle, PeerVector& half) {
  PeerVector low = solid.vertices.front(), high = low;
  for (const PeerVector& v : solid.vertices) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], v[i]);
      high[i] = std::max(high[i], v[i]);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    middle[i] = (low[i] + high[i]) / 2;
    half[i] = (high[i] - low[i]) / 2;
  }
  return solid.vertices.size() == 8 &&
         std::all_of(solid.vertices.begin(), solid.vertices.end(), [&](const PeerVector& v) {
           for (std::size_t i = 0; i < 3; ++i) {
             if (std::min(std::abs(v[i] - low[i]), std::abs(v[i] - high[i])) > 1e-12) return false;
           }
           return true;
         });
}

std::string geom_of(const PeerSolid& solid, std::string& assets, std::size_t& meshes) {
  PeerVector middle{}, half{};
  if (is_box(solid, middle, half)) {
    return "<geom type=\"box\" pos=\"" + mujoco_text(middle) + "\" size=\"" + mujoco_text(half) +
           "\"/>";
  }
  const std::string name = "m" + std::to_string(meshes++);
  assets += "<mesh name=\"" + name + "\" vertex=\"";
  for (const PeerVector& v : solid.vertices) assets += mujoco_text(v) + " ";
  assets += "\"/>";
  return "<geom type=\"mesh\" mesh=\"" + name + "\"/>";
}

std::string model_of(const PenaltyBodies& bodies, const CouplingGains& gains, double mass_kg,
                     double friction, bool free) {
  char words[600];
  std::snprintf(words, sizeof words,
                "<mujoco><compiler settotalmass=\"%.17g\"/><option timestep=\"%.17g\" gravity=\"0 "
                "0 0\" cone=\"elliptic\" solver=\"Newton\" tolerance=\"1e-10\" "
                "integrator=\"implicit\" impratio=\"%g\"><flag multiccd=\"enable\"/></option><size "
                "nconmax=\"600\" njmax=\"2000\"/><default><geom condim=\"%d\" "
                "friction=\"%.17g 0 0\" solref=\"%g 1\" solimp=\"%s\"/></default>",
                mass_kg, gains.tick_s, kImpratio, friction > 0 ? 3 : 1, friction, kContactTime_s,
                kImpedance);
  std::string assets, standing, moving;
  std::size_t meshes = 0;
  if (!free) {
    for (const PeerSolid& solid : bodies.fixed) standing += geom_of(solid, assets, meshes);
  }
  for (const PeerSolid& solid : bodies.moving) moving += geom_of(solid, assets, meshes);
  return std::string(words) + "<asset>" + assets + "</asset><worldbody>" + standing +
         "<body><freejoint/>" + moving + "</body></worldbody></mujoco>";
}

class MujocoCoupled final : public CoupledPeer {
 public:
  /// `free`: without what stands.
  MujocoCoupled(const PenaltyBodies& bodies, const CouplingGains& gains, double mass_kg,
                double friction, bool free)
      : gains_(gains),
        model_(loaded_mujoco(model_of(bodies, gains, mass_kg, friction, free))),
        data_(mj_makeData(model_)) {
    std::copy_n(model_->body_inertia + 3, 3, own_inertia_.begin());
    mju_user_warning = [](const char*) {};  // else it writes a file where the program was started
    couple(gains.k_r_nm_per_rad, own_inertia_);
  }
  MujocoCoupled(const MujocoCoupled&) = delete;
  MujocoCoupled& operator=(const MujocoCoupled&) = delete;
  ~MujocoCoupled() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }

  /// Sets the stiffness in rotation and the principal moments, and damps critically. The free
  /// joint's damping is taken implicitly by the integrator.
  void couple(double k_r_nm_per_rad, const std::array<double, 3>& inertia_kgm2) {
    gains_.k_r_nm_per_rad = k_r_nm_per_rad;
    std::copy_n(inertia_kgm2.begin(), 3, model_->body_inertia + 3);
    mj_setConst(model_, data_);
    mj_resetData(model_, data_);
    mj_forward(model_, data_);
    std::array<mjtNum, 36> mass{};
    mj_fullM(model_, mass.data(), data_->qM);
    for (std::size_t i = 0; i < 6; ++i) {
      const double stiffness = i < 3 ? gains_.k_t_n_per_m : gains_.k_r_nm_per_rad;
      damping_[i] = 2 * std::sqrt(stiffness * mass[7 * i]);
      model_->dof_damping[i] = damping_[i];
    }
  }

  [[nodiscard]] double least_inertia_kgm2() const {
    return std::min({model_->body_inertia[3], model_->body_inertia[4], model_->body_inertia[5]});
  }
  [[nodiscard]] const std::array<double, 3>& own_inertia_kgm2() const { return own_inertia_; }
  void couple_raised(double k_r_nm_per_rad, double least_kgm2) {
    std::array<double, 3> raised = own_inertia_;
    for (double& moment : raised) moment = std::max(moment, least_kgm2);
    couple(k_r_nm_per_rad, raised);
  }

  void begin(const PeerPose& grip) override {
    mj_resetData(model_, data_);
    mju_copy3(data_->qpos, grip.p_wa.data());
    mju_copy4(data_->qpos + 3, grip.q_wxyz.data());
    last_ = place_ = grip;
  }

  void tick(const PeerPose& goal) override {
    mju_copy3(place_.p_wa.data(), data_->qpos);
    mju_copy4(place_.q_wxyz.data(), data_->qpos + 3);
    mjtNum turn[3], hand_turn[3], pull[3], back[4], own[3];
    mujoco_turn(data_->qpos + 3, goal.q_wxyz.data(), turn);
    mujoco_turn(last_.q_wxyz.data(), goal.q_wxyz.data(), hand_turn);
    mjtNum* const applied = data_->qfrc_applied;
    mju_negQuat(back, data_->qpos + 3);
    mju_rotVecQuat(own, hand_turn, back);
    for (std::size_t i = 0; i < 3; ++i) {
      const double speed = (goal.p_wa[i] - last_.p_wa[i]) / gains_.tick_s;
      applied[i] = gains_.k_t_n_per_m * (goal.p_wa[i] - data_->qpos[i]) + damping_[i] * speed;
      pull[i] = gains_.k_r_nm_per_rad * turn[i];
    }
    mju_rotVecQuat(applied + 3, pull, back);  // a free joint turns in the body's own axes
    for (std::size_t i = 0; i < 3; ++i) applied[3 + i] += damping_[3 + i] * own[i] / gains_.tick_s;
    mj_step(model_, data_);
    check_mujoco(*data_);
    last_ = goal;
  }

  [[nodiscard]] PeerPose place() const override { return place_; }

  /// True if it comes to rest in free air, let go askew.
  [[nodiscard]] bool is_stable() {
    constexpr double kAskew_m = 1e-3, kAskew_rad = 0.02;
    PeerPose at, goal;
    begin(at);
    goal.p_wa = {kAskew_m, -kAskew_m, kAskew_m};
    const double half = kAskew_rad / 2, side = std::sin(half) / std::sqrt(3.0);
    goal.q_wxyz = {std::cos(half), side, side, side};
    last_ = goal;
    try {
      for (int k = 0; k < kTrialTicks; ++k) tick(goal);
    } catch (const std::runtime_error&) {
      return false;
    }
    mjtNum turn[3];
    mujoco_turn(place_.q_wxyz.data(), goal.q_wxyz.data(), turn);
    return mju_norm3(turn) < kAskew_rad / 2;
  }

 private:
  CouplingGains gains_;
  mjModel* model_;
  mjData* data_;
  std::array<double, 3> own_inertia_{};
  std::array<double, 6> damping_{};
  PeerPose last_, place_;
};

/// Between a value that holds and one that does not, to 1 %; the one that holds.
template <typename Holds>
double bisected(double holding, double failing, const Holds& holds) {
  while (std::max(holding, failing) > 1.01 * std::min(holding, failing)) {
    const double middle = std::sqrt(holding * failing);
    (holds(middle) ? holding : failing) = middle;
  }
  return holding;
}

TurnLimit limit_of(MujocoCoupled& body, double k_r_nm_per_rad) {
  TurnLimit limit;
  const auto& own = body.own_inertia_kgm2();
  limit.own_inertia_kgm2 = *std::min_element(own.begin(), own.end());
  limit.most_k_r_nm_per_rad = bisected(1e-6, 1e6, [&](double k_r) {
    body.couple(k_r, own);
    return body.is_stable();
  });
  limit.least_inertia_kgm2 = bisected(1.0, 1e-12, [&](double inertia) {
    body.couple(k_r_nm_per_rad, {inertia, inertia, inertia});
    return body.is_stable();
  });
  body.couple_raised(k_r_nm_per_rad, kInertiaMargin * limit.least_inertia_kgm2);
  limit.used_inertia_kgm2 = body.least_inertia_kgm2();
  return limit;
}

}  // namespace

TurnLimit mujoco_turn_limit(const PenaltyBodies& bodies, const CouplingGains& gains,
                            double mass_kg) {
  MujocoCoupled body(bodies, gains, mass_kg, 0, true);
  return limit_of(body, gains.k_r_nm_per_rad);
}

std::unique_ptr<CoupledPeer> make_mujoco_coupled(const PenaltyBodies& bodies,
                                                 const CouplingGains& gains, double mass_kg,
                                                 double friction) {
  const TurnLimit limit = mujoco_turn_limit(bodies, gains, mass_kg);
  auto peer = std::make_unique<MujocoCoupled>(bodies, gains, mass_kg, friction, false);
  peer->couple_raised(gains.k_r_nm_per_rad, kInertiaMargin * limit.least_inertia_kgm2);
  return peer;
}

}  // namespace haptic::sim
