// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/simulated_device.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/device/matrix_exponential.hpp"
#include "tools/common/error.hpp"
#include "tools/common/toml_file.hpp"

namespace haptic::sim {

namespace {

constexpr std::size_t kLargestFileBytes = std::size_t{1} << 20;
constexpr double kLargestValue = 1.0e6;

[[noreturn]] void refuse(const std::string& path, const toml::source_region& place,
                         const std::string& defect) {
  throw tools::InputError(path + ":" + std::to_string(place.begin.line) + ": " + defect);
}

double number(const std::string& path, std::string_view key, const toml::node& node) {
  const auto value = node.value<double>();
  if (!node.is_number() || !value || !(*value >= 0 && *value <= kLargestValue))
    refuse(path, node.source(), std::string(key) + " must be a number from 0 to 1e6");
  return *value;
}

unsigned samples(const std::string& path, const toml::node& node, double count) {
  const double whole = std::nearbyint(count);
  if (whole > kMaxDelaySamples) {
    refuse(path, node.source(),
           "the delay is more than " + std::to_string(kMaxDelaySamples) + " samples at this rate");
  }
  return static_cast<unsigned>(whole);
}

void read_key(const std::string& path, std::string_view key, const toml::node& node, double rate_hz,
              DeviceModel& model) {
  const std::pair<std::string_view, double DeviceModel::*> fields[] = {
      {"mass_kg", &DeviceModel::mass_kg},
      {"damping_ns_per_m", &DeviceModel::damping_ns_per_m},
      {"rotor_kg_m2", &DeviceModel::rotor_kg_m2},
      {"rotor_damping_nms_per_rad", &DeviceModel::rotor_damping_nms_per_rad},
      {"coulomb_friction_n", &DeviceModel::coulomb_force_n},
      {"coulomb_torque_nm", &DeviceModel::coulomb_torque_nm},
      {"encoder_step_m", &DeviceModel::encoder_step_m},
      {"encoder_step_rad", &DeviceModel::encoder_step_rad},
      {"max_force_n", &DeviceModel::max_force_n},
      {"max_torque_nm", &DeviceModel::max_torque_nm}};
  const double value = number(path, key, node);
  for (const auto& [name, member] : fields) {
    if (name != key) continue;
    model.*member = value;
    return;
  }
  if (key == "delay_s") {
    model.delay_samples = samples(path, node, value * rate_hz);
    return;
  }
  if (key == "delay_samples") {
    if (!node.is_integer()) refuse(path, node.source(), "delay_samples must be a whole number");
    model.delay_samples = samples(path, node, value);
    return;
  }
  for (const std::string_view unused : {"max_force_rate_n_per_s", "max_torque_rate_nm_per_s",
                                        "max_stiffness_n_per_m", "max_damping_ns_per_m"}) {
    if (key == unused) return;
  }
  refuse(path, node.source(), "unknown key '" + std::string(key) + "'");
}

/// Part of a radian of the axis' own oscillation within which the velocity has one extremum.
constexpr double kSubstep_rad = 0.5;
constexpr int kBisections = 60;

/// The time in [low, high] at which `positive`, true at `low` and false at `high`, changes.
template <typename Predicate>
double change_between(double low, double high, const Predicate& positive) {
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (low + high);
    (positive(middle) ? low : high) = middle;
  }
  return high;
}

void check(const DeviceModel& m) {
  const std::pair<const char*, double> inertias[] = {{"mass_kg", m.mass_kg},
                                                     {"rotor_kg_m2", m.rotor_kg_m2}};
  for (const auto& [name, value] : inertias) {
    if (!(value >= 1e-9 && value <= 1e6))
      throw tools::InputError(std::string("device: ") + name + " must be from 1e-9 to 1e6");
  }
  const std::pair<const char*, double> others[] = {
      {"damping_ns_per_m", m.damping_ns_per_m},
      {"rotor_damping_nms_per_rad", m.rotor_damping_nms_per_rad},
      {"coulomb_friction_n", m.coulomb_force_n},
      {"coulomb_torque_nm", m.coulomb_torque_nm},
      {"encoder_step_m", m.encoder_step_m},
      {"encoder_step_rad", m.encoder_step_rad},
      {"max_force_n", m.max_force_n},
      {"max_torque_nm", m.max_torque_nm}};
  for (const auto& [name, value] : others) {
    if (!(value >= 0 && value <= 1e6))
      throw tools::InputError(std::string("device: ") + name + " must be from 0 to 1e6");
  }
  if (m.delay_samples > kMaxDelaySamples) {
    throw tools::InputError("device: a delay of " + std::to_string(m.delay_samples) +
                            " samples; at most " + std::to_string(kMaxDelaySamples));
  }
}

/// Shortened to `limit`, its direction kept; 0: no limit.
Vector limited(const Vector& v, double limit) {
  const double length = v.norm();
  return limit > 0 && length > limit ? Vector(v * (limit / length)) : v;
}

double to_step(double value, double step) {
  return step > 0 ? step * std::nearbyint(value / step) : value;
}

}  // namespace

DeviceModel read_device_file(const std::string& path, double rate_hz) {
  const toml::table root = tools::read_toml_file(path, kLargestFileBytes, "the device file");
  DeviceModel model;
  const toml::table* device = nullptr;
  for (const auto& [key, node] : root) {
    device = key.str() == "device" ? node.as_table() : nullptr;
    if (device == nullptr) refuse(path, node.source(), "only a [device] table may stand here");
  }
  if (device == nullptr) throw tools::InputError(path + ": has no [device] table; add it");
  for (const auto& [key, node] : *device) read_key(path, key.str(), node, rate_hz, model);
  return model;
}

AxisMotion::AxisMotion(const AxisParameters& parameters, double period_s)
    : parameters_(parameters), period_s_(period_s), rate_(Eigen::Matrix4d::Zero()) {
  const AxisParameters& p = parameters_;
  rate_(0, 1) = 1.0;
  rate_(1, 0) = -p.hand_stiffness / p.inertia;
  rate_(1, 1) = -(p.damping + p.hand_damping) / p.inertia;
  rate_(1, 2) = 1.0 / p.inertia;
  rate_(2, 3) = 1.0;
  step_ = matrix_exponential<Eigen::Matrix4d>(rate_ * period_s);
  const double own_rad_per_s = std::sqrt(p.hand_stiffness / p.inertia);
  substep_s_ = period_s / std::max(1.0, std::ceil(own_rad_per_s * period_s / kSubstep_rad));
}

AxisMotion::Extended AxisMotion::after(const Extended& from, double time_s) const {
  return matrix_exponential<Eigen::Matrix4d>(rate_ * time_s) * from;
}

double AxisMotion::acceleration(const Extended& z) const { return rate_.row(1).dot(z); }

/// Moving in `direction` from `from`: the first time in (0, span_s] at which the velocity vanishes;
/// negative when there is none. Within a span the velocity has one extremum at most.
double AxisMotion::rest_within(const Extended& from, double direction, double span_s) const {
  const auto moving = [&](double t) { return direction * after(from, t)[1] > 0; };
  const auto first = [&](double end) {
    // From rest the velocity is zero at the very beginning; look from where it has a sign.
    double begin = 0;
    if (from[1] == 0) {
      begin = end;
      while (!moving(begin) && begin > 1e-6 * end) begin *= 0.5;
    }
    return change_between(begin, end, moving);
  };
  const Extended end = after(from, span_s);
  if (direction * end[1] <= 0) return first(span_s);
  const bool dips = direction * acceleration(from) < 0 && direction * acceleration(end) > 0;
  if (!dips) return -1;
  const double lowest = change_between(
      0, span_s, [&](double t) { return direction * acceleration(after(from, t)) < 0; });
  return moving(lowest) ? -1 : first(lowest);
}

double AxisMotion::time_to_rest(const Extended& from, double direction, double limit_s) const {
  Extended at = from;
  for (double gone = 0; gone < limit_s; gone += substep_s_) {
    const double span = std::min(substep_s_, limit_s - gone);
    const double rest = rest_within(at, direction, span);
    if (rest >= 0) return gone + rest;
    at = after(at, span);
  }
  return -1;
}

AxisState AxisMotion::advance(const AxisState& state, const AxisDrive& drive) const {
  const AxisParameters& p = parameters_;
  Extended z(state.position, state.velocity,
             drive.force + p.hand_stiffness * drive.target + p.hand_damping * drive.target_velocity,
             p.hand_stiffness * drive.target_velocity);
  if (p.coulomb == 0) {
    const Extended end = step_ * z;
    return {end[0], end[1]};
  }
  double left_s = period_s_;
  for (int event = 0; event < kMaxEvents && left_s > 0; ++event) {
    double direction = z[1] > 0 ? 1.0 : -1.0;
    if (z[1] == 0) {
      const double pull = z[2] - p.hand_stiffness * z[0];
      direction = pull > 0 ? 1.0 : -1.0;
      if (std::abs(pull) <= p.coulomb) {  // held: until the moving hand has pulled it loose
        if (z[3] == 0) return {z[0], 0};
        direction = z[3] > 0 ? 1.0 : -1.0;
        const double loose_s = (direction * p.coulomb - pull) / z[3];
        if (loose_s >= left_s) return {z[0], 0};
        z[2] += z[3] * loose_s;
        left_s -= loose_s;
      }
    }
    Extended sliding = z;
    sliding[2] -= direction * p.coulomb;
    const double rest_s = time_to_rest(sliding, direction, left_s);
    const double slide_s = rest_s < 0 ? left_s : rest_s;
    z = slide_s == period_s_ ? Extended(step_ * sliding) : after(sliding, slide_s);
    z[2] += direction * p.coulomb;
    if (rest_s < 0) return {z[0], z[1]};
    z[1] = 0;
    left_s -= slide_s;
  }
  return {z[0], left_s > 0 ? 0.0 : z[1]};
}

HandModel hand_of(const std::string& name, double stiffness_n_per_m, double damping_ns_per_m) {
  constexpr double kLever = kGripRadius_m * kGripRadius_m;
  HandModel hand;
  hand.name = name;
  hand.stiffness_n_per_m = stiffness_n_per_m;
  hand.damping_ns_per_m = damping_ns_per_m;
  hand.stiffness_nm_per_rad = kLever * stiffness_n_per_m;
  hand.damping_nms_per_rad = kLever * damping_ns_per_m;
  return hand;
}

std::optional<HandModel> hand_named(const std::string& name) {
  if (name == "none") return hand_of(name, 0, 0);
  if (name == "loose") return hand_of(name, 100, 0.2);
  if (name == "light") return hand_of(name, 300, 3);
  if (name == "firm") return hand_of(name, 800, 10);
  return std::nullopt;
}

const std::vector<std::string>& hand_names() {
  static const std::vector<std::string> names = {"none", "loose", "light", "firm"};
  return names;
}

Vector rotation_vector(const Rotation& q) {
  const Vector v = q.w() < 0 ? Vector(-q.vec()) : Vector(q.vec());
  const double sine = v.norm(), cosine = std::abs(q.w());
  const double scale = sine < 1e-12 ? 2.0 : 2.0 * std::atan2(sine, cosine) / sine;
  return scale * v;
}

Rotation rotation_of(const Vector& rotation_rad) {
  const double angle = rotation_rad.norm();
  // sin(a / 2) / a, without the quotient where it is 1/2 to the last digit.
  const double scale = angle < 1e-8 ? 0.5 : std::sin(0.5 * angle) / angle;
  Rotation q;
  q.w() = std::cos(0.5 * angle);
  q.vec() = scale * rotation_rad;
  return q.normalized();
}

DeviceModel device_of(const SceneParameters& parameters, double rate_hz) {
  const DeviceParameters& d = parameters.device;
  DeviceModel model;
  if (d.given == 0) return model;
  if (d.mass_kg > 0) model.mass_kg = d.mass_kg;
  if (d.damping_ns_per_m > 0) model.damping_ns_per_m = d.damping_ns_per_m;
  model.coulomb_force_n = d.coulomb_friction_n;
  model.encoder_step_m = d.encoder_step_m;
  model.encoder_step_rad = d.encoder_step_rad;
  if (d.rotor_inertia_kg_m2[0] > 0) {
    // The model turns alike about every axis: the lightest rotor with the least damping.
    model.rotor_kg_m2 = *std::ranges::min_element(d.rotor_inertia_kg_m2);
    model.rotor_damping_nms_per_rad = *std::ranges::min_element(d.rotor_damping_nms_per_rad);
  }
  model.coulomb_torque_nm = d.coulomb_torque_nm;
  model.max_force_n = d.max_force_n;
  model.max_torque_nm = d.max_torque_nm;
  const double samples = std::nearbyint(d.delay_s * rate_hz);
  if (!(samples >= 0 && samples <= kMaxDelaySamples)) {
    throw tools::InputError("device: delay_s is more than " + std::to_string(kMaxDelaySamples) +
                            " samples at this rate");
  }
  model.delay_samples = static_cast<unsigned>(samples);
  return model;
}

SimulatedDevice::SimulatedDevice(const DeviceModel& model, const HandModel& hand, double period_s)
    : model_((check(model), model)),
      hand_(hand),
      period_s_(period_s),
      translation_({model.mass_kg, model.damping_ns_per_m, model.coulomb_force_n,
                    hand.stiffness_n_per_m, hand.damping_ns_per_m},
                   period_s),
      rotation_({model.rotor_kg_m2, model.rotor_damping_nms_per_rad, model.coulomb_torque_nm,
                 hand.stiffness_nm_per_rad, hand.damping_nms_per_rad},
                period_s) {
  place({});
}

void SimulatedDevice::place(const DeviceState& state) {
  state_ = state;
  home_ = {state.x0_w, state.q_wa};
  under_way_.assign(model_.delay_samples, Load{});
  delivered_j_ = 0;
}

void SimulatedDevice::drop_wrenches() { under_way_.assign(model_.delay_samples, Load{}); }

HandTarget SimulatedDevice::sensed() const {
  HandTarget seen{state_.x0_w, state_.q_wa};
  if (model_.encoder_step_m > 0) {
    for (int k = 0; k < 3; ++k) {
      seen.x0_w[k] = home_.x0_w[k] + to_step(state_.x0_w[k] - home_.x0_w[k], model_.encoder_step_m);
    }
  }
  if (model_.encoder_step_rad > 0) {
    Vector turn = rotation_vector(state_.q_wa * home_.q_wa.conjugate());
    for (int k = 0; k < 3; ++k) turn[k] = to_step(turn[k], model_.encoder_step_rad);
    seen.q_wa = rotation_of(turn) * home_.q_wa;
  }
  return seen;
}

Load SimulatedDevice::advance(const Load& command, const HandStroke& stroke) {
  under_way_.push_back(command);
  Load acting = under_way_.front();
  under_way_.pop_front();
  acting.force_w = limited(acting.force_w, model_.max_force_n);
  acting.torque_w = limited(acting.torque_w, model_.max_torque_nm);

  const Vector target_velocity = (stroke.to.x0_w - stroke.from.x0_w) / period_s_;
  const Vector target_turn = rotation_vector(stroke.to.q_wa * stroke.from.q_wa.conjugate());
  // Both motions count from where the period begins: the turn within it is a rotation vector, and
  // far from the origin no digits are lost.
  const Vector offset = stroke.from.x0_w - state_.x0_w;
  const Vector turn_to_target = rotation_vector(stroke.from.q_wa * state_.q_wa.conjugate());
  Vector moved, turned;
  for (int k = 0; k < 3; ++k) {
    const AxisState line =
        translation_.advance({0, state_.velocity_w[k]},
                             {acting.force_w[k] + hand_.push_w[k], offset[k], target_velocity[k]});
    const AxisState turn =
        rotation_.advance({0, state_.angular_velocity_w[k]},
                          {acting.torque_w[k], turn_to_target[k], target_turn[k] / period_s_});
    moved[k] = line.position;
    turned[k] = turn.position;
    state_.velocity_w[k] = line.velocity;
    state_.angular_velocity_w[k] = turn.velocity;
  }
  state_.x0_w += moved;
  state_.q_wa = (rotation_of(turned) * state_.q_wa).normalized();
  delivered_j_ += acting.force_w.dot(moved) + acting.torque_w.dot(turned);
  return acting;
}

}  // namespace haptic::sim
