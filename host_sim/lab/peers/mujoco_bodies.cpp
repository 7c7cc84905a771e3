// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>

#include "host_sim/lab/peers/bodies_peer.hpp"
#include "host_sim/lab/peers/mujoco_model.hpp"

namespace haptic::sim {
namespace {

constexpr double kMass_kg = 0.1;
constexpr double kStiffSteps = 2;  ///< the shortest time of a contact that MuJoCo takes, in steps
constexpr const char* kStiffImpedance = "0.999 0.9999 0.0001";

std::string geoms(const std::vector<PeerBox>& boxes) {
  std::string text;
  for (const PeerBox& box : boxes)
    text += "<geom type=\"box\" pos=\"" + mujoco_text(box.middle) + "\" size=\"" +
            mujoco_text(box.half) + "\"/>";
  return text;
}

double inertia_of(const SprungBody& body) {
  return kMass_kg * body.turn_stiffness_nm_per_rad / body.stiffness_n_per_m;
}

std::string model_of(const PeerAssembly& assembly, bool stiff, unsigned steps) {
  char words[300];
  const double step_s = assembly.tick_s / steps;
  std::snprintf(words, sizeof words,
                "<mujoco><option timestep=\"%.17g\" gravity=\"0 0 0\"/><default><geom "
                "condim=\"%d\" friction=\"%.17g 0 0\"",
                step_s, assembly.friction > 0 ? 3 : 1, assembly.friction);
  std::string text = words;
  if (stiff) {
    std::snprintf(words, sizeof words, " solref=\"%.17g 1\" solimp=\"%s\"", kStiffSteps * step_s,
                  kStiffImpedance);
    text += words;
  }
  text += "/></default><worldbody>" + geoms(assembly.standing);
  for (const SprungBody& body : assembly.bodies) {
    const double inertia = inertia_of(body);
    std::snprintf(words, sizeof words,
                  "<body><freejoint/><inertial pos=\"0 0 0\" mass=\"%.17g\" diaginertia=\"%.17g "
                  "%.17g %.17g\"/>",
                  kMass_kg, inertia, inertia, inertia);
    text += words + geoms(body.boxes) + "</body>";
  }
  return text + "</worldbody></mujoco>";
}

class MujocoBodies final : public BodiesPeer {
 public:
  MujocoBodies(const PeerAssembly& assembly, bool stiff, unsigned steps)
      : assembly_(assembly),
        steps_(steps),
        model_(loaded_mujoco(model_of(assembly, stiff, steps))),
        data_(mj_makeData(model_)) {
    const std::size_t count = assembly_.bodies.size();
    places_.p.resize(count);
    places_.q_wxyz.resize(count);
  }
  MujocoBodies(const MujocoBodies&) = delete;
  MujocoBodies& operator=(const MujocoBodies&) = delete;
  ~MujocoBodies() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }

  void begin(const PeerPlaces& places) override {
    mj_resetData(model_, data_);
    for (std::size_t k = 0; k < places.p.size(); ++k) {
      mju_copy3(coordinates(k), places.p[k].data());
      mju_copy4(coordinates(k) + 3, places.q_wxyz[k].data());
    }
    from_ = places;
    take_places();
  }

  void tick(const PeerPlaces& goals) override {
    for (unsigned step = 0; step < steps_; ++step) {
      const double share = static_cast<double>(step + 1) / steps_;
      for (std::size_t k = 0; k < assembly_.bodies.size(); ++k) draw(k, goals, share);
      mj_step(model_, data_);
    }
    check_mujoco(*data_);
    from_ = goals;
    take_places();
  }

  [[nodiscard]] const PeerPlaces& places() const override { return places_; }

 private:
  [[nodiscard]] mjtNum* coordinates(std::size_t body) const { return data_->qpos + 7 * body; }

  /// Applies the spring of a body, and its damper, to the goal after a share of the tick.
  void draw(std::size_t k, const PeerPlaces& goals, double share) {
    const SprungBody& body = assembly_.bodies[k];
    const mjtNum* const at = coordinates(k);
    const mjtNum* const speed = data_->qvel + 6 * k;
    mjtNum* const applied = data_->xfrc_applied + 6 * (k + 1);  // body 0 is the world
    mjtNum q[4], turn[3], goal_turn[3], own_turn[3];
    for (std::size_t i = 0; i < 4; ++i)
      q[i] = from_.q_wxyz[k][i] + share * (goals.q_wxyz[k][i] - from_.q_wxyz[k][i]);
    mju_normalize4(q);
    mujoco_turn(at + 3, q, turn);
    mujoco_turn(from_.q_wxyz[k].data(), goals.q_wxyz[k].data(), goal_turn);
    mju_rotVecQuat(own_turn, speed + 3, at + 3);  // a free joint turns in the body's own axes
    const double damping = 2 * std::sqrt(kMass_kg * body.stiffness_n_per_m);
    const double turn_damping = 2 * std::sqrt(inertia_of(body) * body.turn_stiffness_nm_per_rad);
    for (std::size_t i = 0; i < 3; ++i) {
      const double way = goals.p[k][i] - from_.p[k][i];
      const double goal = from_.p[k][i] + share * way;
      applied[i] =
          body.stiffness_n_per_m * (goal - at[i]) + damping * (way / assembly_.tick_s - speed[i]);
      applied[3 + i] = body.turn_stiffness_nm_per_rad * turn[i] +
                       turn_damping * (goal_turn[i] / assembly_.tick_s - own_turn[i]);
    }
  }

  void take_places() {
    for (std::size_t k = 0; k < places_.p.size(); ++k) {
      mju_copy3(places_.p[k].data(), coordinates(k));
      mju_copy4(places_.q_wxyz[k].data(), coordinates(k) + 3);
    }
  }

  PeerAssembly assembly_;
  unsigned steps_;
  mjModel* model_;
  mjData* data_;
  PeerPlaces from_, places_;
};

}  // namespace

std::unique_ptr<BodiesPeer> make_mujoco_bodies(const PeerAssembly& assembly, bool stiff,
                                               unsigned steps) {
  return std::make_unique<MujocoBodies>(assembly, stiff, steps);
}

const char* mujoco_version() { return mj_versionString(); }

}  // namespace haptic::sim
