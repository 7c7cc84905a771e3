// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/faults/fault_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/device/pressing_script.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tools/common/error.hpp"
#include "tools/graph_compiler/graph/part_tables.hpp"
#include "tools/graph_compiler/graph/scene_writer.hpp"

namespace haptic::sim {

namespace {

constexpr Real kHuge_n = 1.0e6_r;
constexpr std::int64_t kOld_ns = 100'000'000;

constexpr double kCubeHalf_m = 0.010, kWallHalf_m = 0.050;
static_assert(kCubeHalf_m + kWallHalf_m == kTouchHeight_m);
constexpr double kStiffness_n_per_m = 2000, kDamping_ns_per_m = 2;
/// Two hands: their cubes off the middle of the wall, and over it at the start.
constexpr double kBeside_m = 0.05, kStart_m = 0.005;

}  // namespace

DeviceCommand spoiled(FaultCause cause, DeviceCommand command) {
  for (Real& force_n : command.wrench_d.force_n) {
    if (cause == FaultCause::kServoNotANumber) force_n = std::numeric_limits<Real>::quiet_NaN();
    if (cause == FaultCause::kServoHuge) force_n = kHuge_n;
    if (cause == FaultCause::kServoJump) force_n = -force_n;
  }
  if (cause == FaultCause::kServoOldStamp) command.stamp_ns -= kOld_ns;
  return command;
}

StackStage::StackStage(std::span<const std::byte> scene, const StackSettings& stack)
    : StackStage(scene, std::vector{stack}, 0) {}

StackStage::StackStage(std::span<const std::byte> scene, const std::vector<StackSettings>& stacks,
                       std::size_t faulty)
    : FaultStage(1.0 / stacks.at(0).model.report_rate_hz, hand_at_start()),
      session_(scene, "fault matrix"),
      carrier_(stacks[0].carrier),
      faulty_(faulty),
      has_other_(stacks.size() > 1),
      stack_(session_, devices(stacks)) {}

std::vector<StackDevice> StackStage::devices(const std::vector<StackSettings>& stacks) {
  std::vector<StackDevice> devices;
  for (std::size_t k = 0; k < stacks.size(); ++k) {
    devices.push_back({stacks[k], [this, k](double t_s) {
                         const bool is_left = k != faulty_ && other_plan_;
                         return (is_left ? *other_plan_ : hand()).action(t_s);
                       }});
  }
  return devices;
}

// Without a bus closing does not wait for a ramp, for which the time of the device would have to
// pass.
StackStage::~StackStage() {
  if (carrier_ != StackCarrier::kUsb) return;
  for (std::size_t k = 0; k < (has_other_ ? 2u : 1u); ++k) stack_.unplug(k);
  static_cast<void>(stack_.step());
}

FaultSample StackStage::sample_of(std::size_t hand) {
  const StackTick& tick = stack_.tick(hand);
  FaultSample sample;
  sample.sent = tick.sent;
  sample.acting = tick.acting;
  sample.acts = accepted_[hand];
  sample.accepted = accepted_[hand] =
      stack_.bus(hand).with_model([](const auto& model) { return model.accepted(); });
  sample.drives_on = tick.drives_on;
  sample.watchdog_cuts = tick.cuts;
  sample.arming = tick.servo.arming;
  sample.safety = tick.servo.faults;
  sample.device = tick.state.faults;
  sample.link = tick.link;
  return sample;
}

FaultSample StackStage::pass_period() {
  static_cast<void>(stack_.step());
  if (has_other_) other_ = sample_of(1 - faulty_);
  return sample_of(faulty_);
}

void StackStage::spoil_commands(FaultCause cause) {
  stack_.say_instead([cause](const DeviceCommand& command) { return spoiled(cause, command); },
                     faulty_);
}

void StackStage::lose_servo() {
  stack_.servo_lost();
  stack_.stall_servo(true);
}

void StackStage::release_servo() {
  stack_.stall_servo(false);
  stack_.say_instead(nullptr, faulty_);
}

void StackStage::restart_servo() {
  stack_.stall_servo(false);
  stack_.restart_servo();
}

FaultPlace fault_place() {
  FaultPlace place;
  place.envelope.half_extent_m = Vec3(0, static_cast<Real>(kBoxHalfWidth_m), 0);
  place.envelope.max_angle_rad = static_cast<Real>(kLargestAngle_rad);
  return place;
}

FaultPlace fault_place(CoreSession& session) {
  const PressedPoint touch = touched_point(session);
  if (!(touch.way_m > 0)) {
    throw tools::InputError(
        "the scene's part does not touch anything on its way to the nearest fixed part, or does so "
        "at once; choose another start pose");
  }
  // The sideways axis: near an axis of W, since the envelope's box has the axes of W.
  const Vector up = -touch.along_w;
  Eigen::Index side = 0;
  up.cwiseAbs().minCoeff(&side);
  const Vector y = (Vector::Unit(side) - up[side] * up).normalized();
  Eigen::Matrix3d r_wd;
  r_wd << y.cross(up), y, up;
  const Rotation q_wd(r_wd);
  FaultPlace place = fault_place();
  place.map.q_wd = q_wd.cast<Real>();
  place.map.q_ha = (q_wd.conjugate() * touch.q_wa).cast<Real>();
  place.map.offset_w = (touch.grip_w - kTouchHeight_m * up).cast<Real>();
  place.envelope.centre_w = touch.grip_w.cast<Real>();
  place.envelope.half_extent_m.setZero();
  place.envelope.half_extent_m[side] = static_cast<Real>(kBoxHalfWidth_m * y[side]);
  place.envelope.q_wa = touch.q_wa.cast<Real>();
  return place;
}

StackSettings fault_stack(const FaultSettings& settings, const FaultPlace& place) {
  StackSettings stack = reference_stack(settings.carrier);
  stack.report_clocked = settings.report_clocked;
  stack.model.hand = *hand_named("firm");
  stack.model.max_force_rate_n_per_s *= settings.slew_factor;
  stack.model.max_torque_rate_nm_per_s *= settings.slew_factor;
  stack.limits.slew_n_per_s *= static_cast<Real>(settings.slew_factor);
  stack.limits.slew_nm_per_s *= static_cast<Real>(settings.slew_factor);
  stack.limits.ramp_in_s *= static_cast<Real>(settings.ramp_in_factor);
  stack.map = place.map;
  stack.envelope = place.envelope;
  return stack;
}

namespace {

/// Hand k's cube is so far off the middle of the wall.
double side_m(std::size_t hand) { return hand == 0 ? -kBeside_m : kBeside_m; }

SceneParameters fault_parameters() {
  SceneParameters p = tools::default_parameters();
  p.k_f_n_per_m = kStiffness_n_per_m;
  p.rate_hz = 1000;
  p.coupling.k_t_n_per_m = kStiffness_n_per_m;
  p.coupling.k_r_nm_per_rad = kStiffness_n_per_m * kGripRadius_m * kGripRadius_m;
  p.coupling.damping_ns_per_m = kDamping_ns_per_m;
  p.coupling.damping_share = 1.0;
  p.coupling.max_rotation_error_rad = 0.3;
  p.coupling.max_window_s = 0.02;
  return p;
}

Solid fault_cube() { return centred_box("cube", kCubeHalf_m, kCubeHalf_m, kCubeHalf_m); }
Solid fault_wall() { return centred_box("wall", 0.1, 0.1, kWallHalf_m); }

using Place = std::array<double, 3>;

/// A cube held at `held` over bodies that stand.
std::vector<std::byte> scene_at(const Place& held,
                                const std::vector<std::pair<Solid, Place>>& standing) {
  const Solid cube = fault_cube();
  tools::SceneDescription scene;
  scene.name = "two cubes";
  scene.moving.body = united_body({&cube, 1});
  scene.moving.position_m = held;
  for (const auto& [solid, at] : standing)
    scene.statics.push_back({united_body({&solid, 1}), at, {1, 0, 0, 0}, {0, 0, 0}});
  scene.parameters = fault_parameters();
  scene.parameters.goal_contact = 0;
  return tools::write_scene(scene);
}

std::vector<std::byte> two_hand_scene() {
  const double height_m = kTouchHeight_m + kStart_m;
  const Solid cube = fault_cube(), wall = fault_wall();
  const Place middle{0, 0, 0};
  std::vector<tools::HeldPart> parts(3);
  for (std::uint32_t k = 0; k < kMostHands; ++k) {
    const Place at{side_m(k), 0, height_m};
    tools::HeldPart& part = parts[k];
    part.role = k == 0 ? PartRole::kHand : PartRole::kHand2;
    std::ranges::copy(at, part.start.p_wa_m);
    part.scene = scene_at(at, {{wall, middle}});
    part.others = {2};
  }
  const Place first{side_m(0), 0, height_m}, second{side_m(1), 0, height_m};
  parts[0].pairs.push_back({1, scene_at({side_m(0) - side_m(1), 0, 0}, {{cube, middle}})});
  return tools::with_parts(scene_at(first, {{cube, second}, {wall, middle}}), parts);
}

}  // namespace

std::vector<std::byte> fault_scene(unsigned hands) {
  if (hands > 1) return two_hand_scene();
  const Solid cube = fault_cube(), wall = fault_wall();
  return scene_with(cube, {&wall, 1}, fault_parameters());
}

FaultTrace run_fault(std::span<const std::byte> scene, const FaultCase& cell,
                     const FaultSettings& settings) {
  const bool usb = settings.carrier == StackCarrier::kUsb;
  if (!usb && (!cell.fault->without_bus() || cell.state == FaultState::kAbsent))
    throw tools::InputError(std::string(cell.fault->name) + ", " + to_text(cell.state) +
                            ": there is no bus; use the carrier usb");
  if (settings.hands == 1) {
    StackStage stage(scene, fault_stack(settings, fault_place()));
    return play_fault(stage, cell);
  }
  std::vector<StackSettings> stacks;
  for (const std::size_t hand : {0u, 1u}) {
    FaultPlace place = fault_place();
    place.map.offset_w[0] = static_cast<Real>(side_m(hand));
    stacks.push_back(fault_stack(settings, place));
  }
  StackStage stage(scene, stacks, settings.faulty);
  return play_fault(stage, cell);
}

}  // namespace haptic::sim
