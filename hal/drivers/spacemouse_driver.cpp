// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/spacemouse_driver.hpp"

#include <algorithm>
#include <cmath>

#include "rt_core/base/rotation.hpp"

namespace haptic::hal {
namespace {

constexpr unsigned kDescriptor_ms = 500;

/// The setting where it is usable, else its default.
Real usable(Real value, Real least, Real most, Real otherwise) noexcept {
  return value >= least && value <= most ? value : otherwise;
}

SpaceMouseSettings usable(const SpaceMouseSettings& wanted) noexcept {
  const SpaceMouseSettings standard;
  SpaceMouseSettings s = wanted;
  s.full_speed_m_per_s = usable(s.full_speed_m_per_s, 0, 10, standard.full_speed_m_per_s);
  s.full_turn_rad_per_s = usable(s.full_turn_rad_per_s, 0, 100, standard.full_turn_rad_per_s);
  s.dead_zone = usable(s.dead_zone, 0, 0.9_r, standard.dead_zone);
  s.reach_m = usable(s.reach_m, 0, 100, standard.reach_m);
  if (!(s.full_scale >= 1 && s.full_scale <= 32768)) s.full_scale = 0;
  if (s.longest_step_ns <= 0 || s.longest_step_ns > 1'000'000'000) {
    s.longest_step_ns = standard.longest_step_ns;
  }
  return s;
}

/// Share of full speed for a raw value: none inside the dead zone, then rising from none.
Real share_of(std::int16_t raw, double full_scale, Real dead_zone) noexcept {
  const Real share = std::clamp(static_cast<Real>(raw / full_scale), Real{-1}, Real{1});
  const Real beyond = std::abs(share) - dead_zone;
  return beyond > 0 ? std::copysign(beyond / (1 - dead_zone), share) : Real{0};
}

/// From the device's axes to those of D.
Vec3 in_d(const Vec3& device, const SpaceMouseAxes& axes) noexcept {
  Vec3 v = axes.swap_yz ? Vec3(device.x(), device.z(), device.y()) : device;
  if (axes.invert_yz) v = Vec3(v.x(), -v.y(), -v.z());
  return v;
}

}  // namespace

SpaceMouseDriver::SpaceMouseDriver(const SpaceMouseSettings& settings) noexcept
    : settings_(usable(settings)), axes_(kCurrentAxes) {
  const SpaceMouseModel* model = find_spacemouse(settings_.vendor_id, settings_.product_id);
  fit_ = (model != nullptr || settings_.vendor_id == k3DconnexionId) &&
         !is_refused_spacemouse(settings_.vendor_id, settings_.product_id);
  profile_.name = model != nullptr ? model->name : "3Dconnexion device of unknown model";
  profile_.vendor_id = settings_.vendor_id;
  profile_.product_id = settings_.product_id;
  if (model != nullptr) {
    profile_.interface_number = model->interface_number;
    axes_ = model->axes;
  }
  profile_.in_bytes = 64;  // a full-speed packet: nothing that comes can be too long
  profile_.kernel_driver = true;
  capabilities_.sensed_dof = kDofAll;
  capabilities_.workspace_radius_m = settings_.reach_m;
  scale_.fill(settings_.full_scale > 0 ? settings_.full_scale : kSpaceMouseFullScale);
}

HalStatus SpaceMouseDriver::start(UsbPort& port) noexcept {
  if (!fit_) return HalStatus::kDeviceUnfit;
  input_ = SpaceMouseInput{};
  pose_dh_ = Pose{};
  velocity_d_ = Twist{};
  stamped_ = false;
  may_be_joined_ = true;
  scale_.fill(settings_.full_scale > 0 ? settings_.full_scale : kSpaceMouseFullScale);

  // GET_DESCRIPTOR of the interface, type 0x22: report.
  std::array<std::uint8_t, kMaxHidDescriptorBytes> descriptor{};
  std::size_t moved = 0;
  const std::uint16_t interface_number = profile_.interface_number;
  const HalStatus fetched =
      port.control({0x81, 0x06, 0x2200, interface_number}, descriptor, moved, kDescriptor_ms);
  if (fetched == HalStatus::kDeviceGone) return fetched;
  if (fetched == HalStatus::kOk) {
    take_descriptor(std::span(descriptor).first(std::min(moved, descriptor.size())));
  }

  // SET_REPORT, type 2: output.
  std::array<std::uint8_t, 2> light{kSpaceMouseLightReport,
                                    static_cast<std::uint8_t>(settings_.light ? 1 : 0)};
  const HalStatus lit =
      port.control({0x21, 0x09, 0x0200 | kSpaceMouseLightReport, interface_number}, light, moved,
                   kDescriptor_ms);
  if (lit == HalStatus::kDeviceGone) return lit;
  return port.cancelled() ? HalStatus::kTimeout : HalStatus::kOk;
}

void SpaceMouseDriver::take_descriptor(std::span<const std::uint8_t> descriptor) noexcept {
  HidAxes found;
  // Axes found before an error are as good as the rest: ranges that make no sense are not used.
  static_cast<void>(find_hid_axes(descriptor, found));
  for (std::size_t i = 0; i < kHidAxes; ++i) {
    const double declared = full_scale(found.axes[i]);
    if (settings_.full_scale == 0 && declared >= 1.0 && declared <= 32768.0) scale_[i] = declared;
  }
  const HidAxis& x = found.axes[0];
  const HidAxis& rx = found.axes[3];
  may_be_joined_ = !x.found || !rx.found || x.report_id == rx.report_id;
}

void SpaceMouseDriver::integrate(std::int64_t stamp_ns) noexcept {
  // Stamps are of one clock, but the difference of any two numbers must not overflow.
  const auto since = [this](std::int64_t to_ns) {
    return to_ns > reported_ns_
               ? static_cast<std::uint64_t>(to_ns) - static_cast<std::uint64_t>(reported_ns_)
               : 0;
  };
  if (stamped_ && stamp_ns > stamp_ns_) {
    const auto longest = static_cast<std::uint64_t>(settings_.longest_step_ns);
    const std::uint64_t lasted = std::min(since(stamp_ns), longest);
    const std::uint64_t done = std::min(since(stamp_ns_), longest);
    const Real dt_s = static_cast<Real>(lasted - done) * 1.0e-9_r;
    pose_dh_.p_wa += velocity_d_.linear_w * dt_s;
    const Real distance_m = pose_dh_.p_wa.norm();
    if (distance_m > settings_.reach_m) pose_dh_.p_wa *= settings_.reach_m / distance_m;
    pose_dh_.q_wa = so3_exp(velocity_d_.angular_w * dt_s) * pose_dh_.q_wa;
    pose_dh_.q_wa.normalize();
    if (since(stamp_ns) >= longest) velocity_d_ = Twist{};
  }
  stamp_ns_ = stamped_ ? std::max(stamp_ns_, stamp_ns) : stamp_ns;
  stamped_ = true;
}

void SpaceMouseDriver::take_velocity() noexcept {
  Vec3 push, turn;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    push[k] = share_of(input_.axes[i], scale_[i], settings_.dead_zone);
    turn[k] = share_of(input_.axes[i + 3], scale_[i + 3], settings_.dead_zone);
  }
  velocity_d_.linear_w = in_d(push, axes_) * settings_.full_speed_m_per_s;
  velocity_d_.angular_w = in_d(turn, axes_) * settings_.full_turn_rad_per_s;
}

ReportVerdict SpaceMouseDriver::read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                     DeviceState& state) noexcept {
  const SpaceMouseReport kind = decode(report, may_be_joined_, input_);
  if (kind == SpaceMouseReport::kBadLength) return ReportVerdict::kBadLength;
  if (kind == SpaceMouseReport::kUnknown || kind == SpaceMouseReport::kBattery) {
    return ReportVerdict::kNothing;
  }
  integrate(stamp_ns);
  take_velocity();
  reported_ns_ = stamp_ns_;
  fill(state);
  return ReportVerdict::kState;
}

bool SpaceMouseDriver::rest(std::int64_t stamp_ns, DeviceState& state) noexcept {
  integrate(stamp_ns);
  fill(state);
  return true;
}

void SpaceMouseDriver::fill(DeviceState& state) const noexcept {
  state.pose_dh = record_of(pose_dh_);
  state.twist_d = record_of(velocity_d_);
  state.twist_valid = true;
  state.link = LinkState::kReady;
  state.switches = input_.buttons;
  state.faults = 0;
}

std::size_t SpaceMouseDriver::write(const Wrench& /*wrench_d*/, std::uint64_t /*tick*/,
                                    std::span<std::uint8_t> /*report*/,
                                    Wrench& delivered_d) noexcept {
  delivered_d = Wrench{};
  return 0;
}

std::size_t SpaceMouseDriver::zero_report(std::span<std::uint8_t> /*report*/) const noexcept {
  return 0;
}

}  // namespace haptic::hal
