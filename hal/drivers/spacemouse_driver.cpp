// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/spacemouse_driver.hpp"

#include <algorithm>

#include "hal/drivers/spacenav_socket.hpp"

namespace haptic::hal {
namespace {

constexpr unsigned kDescriptor_ms = 500;

/// Where it is none, 0: the descriptor's.
double usable_scale(double full_scale) noexcept {
  return full_scale >= 1 && full_scale <= 32768 ? full_scale : 0;
}

/// From the device's axes to those of D.
Vec3 in_d(const Vec3& device, const SpaceMouseAxes& axes) noexcept {
  Vec3 v = axes.swap_yz ? Vec3(device.x(), device.z(), device.y()) : device;
  if (axes.invert_yz) v = Vec3(v.x(), -v.y(), -v.z());
  return v;
}

}  // namespace

SpaceMouseDriver::SpaceMouseDriver(const SpaceMouseSettings& settings) noexcept
    : settings_(settings), axes_(kCurrentAxes), pose_(settings) {
  settings_.full_scale = usable_scale(settings.full_scale);
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
  profile_.holder = spacenav_holder;
  capabilities_.sensed_dof = kDofAll;
  capabilities_.workspace_radius_m = pose_.reach_m();
  scale_.fill(settings_.full_scale > 0 ? settings_.full_scale : kDisplacementFullScale);
}

HalStatus SpaceMouseDriver::start(UsbPort& port) noexcept {
  if (!fit_) return HalStatus::kDeviceUnfit;
  input_ = SpaceMouseInput{};
  pose_.reset();
  may_be_joined_ = true;
  scale_.fill(settings_.full_scale > 0 ? settings_.full_scale : kDisplacementFullScale);

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

void SpaceMouseDriver::take_axes(std::int64_t stamp_ns) noexcept {
  Vec3 push, turn;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    push[k] = pose_.share_of(input_.axes[i], scale_[i]);
    turn[k] = pose_.share_of(input_.axes[i + 3], scale_[i + 3]);
  }
  pose_.take(in_d(push, axes_), in_d(turn, axes_), stamp_ns);
}

ReportVerdict SpaceMouseDriver::read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                     DeviceState& state) noexcept {
  const SpaceMouseReport kind = decode(report, may_be_joined_, input_);
  if (kind == SpaceMouseReport::kBadLength) return ReportVerdict::kBadLength;
  if (kind == SpaceMouseReport::kUnknown || kind == SpaceMouseReport::kBattery) {
    return ReportVerdict::kNothing;
  }
  if (kind == SpaceMouseReport::kButtons) {
    pose_.advance(stamp_ns);
  } else {
    take_axes(stamp_ns);
  }
  fill(state);
  return ReportVerdict::kState;
}

bool SpaceMouseDriver::rest(std::int64_t stamp_ns, DeviceState& state) noexcept {
  pose_.advance(stamp_ns);
  fill(state);
  return true;
}

void SpaceMouseDriver::fill(DeviceState& state) const noexcept {
  state.pose_dh = record_of(pose_.pose_dh());
  state.twist_d = record_of(pose_.velocity_d());
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
