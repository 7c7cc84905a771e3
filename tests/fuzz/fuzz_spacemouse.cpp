// SPDX-License-Identifier: Apache-2.0
/// The reader of HID report descriptors and the 3Dconnexion driver against any bytes: a byte for
/// the model, two for the descriptor's length, the descriptor, then time steps and reports.
#include "hal/drivers/hid_descriptor.hpp"
#include "hal/drivers/spacemouse_driver.hpp"
#include "tests/fuzz/report_stream.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using haptic::fuzz::ReportStream;
using haptic::fuzz::require;

void check_descriptor(std::span<const std::uint8_t> descriptor) {
  HidAxes found, again;
  const HidVerdict verdict = find_hid_axes(descriptor, found);
  require(verdict <= HidVerdict::kBadNesting, "the verdict is one of the list");
  require(find_hid_axes(descriptor, again) == verdict, "the same bytes, the same verdict");
  for (std::size_t i = 0; i < kHidAxes; ++i) {
    const HidAxis& axis = found.axes[i];
    require(axis.found == again.axes[i].found, "the same bytes, the same axes");
    if (!axis.found) {
      require(full_scale(axis) == 0.0, "no axis has no scale");
      continue;
    }
    require(axis.logical_min < axis.logical_max, "ranges are not empty");
    require(axis.bit_size >= 1 && axis.bit_size <= 32, "sizes are those of a number");
    require(axis.bit_offset <= 1u << 20, "places are within a report");
    require(full_scale(axis) > 0.0, "an axis has a scale");
  }
}

/// Answers the request for the descriptor with it and takes the light.
class DescriptorPort : public UsbPort {
 public:
  explicit DescriptorPort(std::span<const std::uint8_t> descriptor) : descriptor_(descriptor) {}
  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned /*timeout_ms*/) noexcept override {
    moved = bytes.size();
    if ((request.request_type & 0x80u) == 0) return HalStatus::kOk;
    moved = std::min(bytes.size(), descriptor_.size());
    std::copy_n(descriptor_.begin(), moved, bytes.begin());
    return HalStatus::kOk;
  }
  HalStatus write(std::span<const std::uint8_t> /*bytes*/,
                  unsigned /*timeout_ms*/) noexcept override {
    return HalStatus::kTransferFailed;
  }
  HalStatus read(std::span<std::uint8_t> /*bytes*/, std::size_t& /*moved*/,
                 unsigned /*timeout_ms*/) noexcept override {
    return HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }

 private:
  std::span<const std::uint8_t> descriptor_;
};

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ReportStream input(std::span(data, size));
  const auto models = spacemouse_models();
  const SpaceMouseModel& model = models[input.byte() % models.size()];
  const std::size_t length = input.byte() + std::size_t{256} * (input.byte() % 20u);
  const auto descriptor = input.take(length);
  check_descriptor(descriptor);

  SpaceMouseSettings settings;
  settings.vendor_id = model.vendor_id;
  settings.product_id = model.product_id;
  SpaceMouseDriver driver(settings);
  DescriptorPort port(descriptor);
  require(driver.start(port) == HalStatus::kOk, "any descriptor will do");
  for (std::size_t i = 0; i < kHidAxes; ++i) {
    require(driver.full_scale_of(i) >= 1.0 && driver.full_scale_of(i) <= 32768.0,
            "scales are those of 16 bits");
  }

  DeviceState state;
  std::int64_t now_ns = 0;
  while (!input.empty()) {
    // From backward to far beyond any step, in a few bits.
    const auto step = static_cast<std::int8_t>(input.byte());
    now_ns = static_cast<std::int64_t>(
        static_cast<std::uint64_t>(now_ns) +
        (static_cast<std::uint64_t>(std::int64_t{step}) << (step & 0x3f)));
    const DeviceState before = state;
    const ReportVerdict verdict = driver.read(input.report(), now_ns, state);
    if (verdict != ReportVerdict::kState) fuzz::require_same(before, state);
    fuzz::require_usable(state);
    require(vec3_of(state.pose_dh.p_m).norm() <= settings.reach_m * 1.00001_r,
            "the pose stays within reach");
    for (int k = 0; k < 3; ++k) {
      require(std::abs(state.twist_d.linear_m_per_s[k]) <= settings.full_speed_m_per_s * 1.00001_r,
              "speeds are within full speed");
      require(
          std::abs(state.twist_d.angular_rad_per_s[k]) <= settings.full_turn_rad_per_s * 1.00001_r,
          "turns are within full turn");
    }
    Wrench delivered;
    std::array<std::uint8_t, 64> bytes{};
    require(driver.write(Wrench{}, 1, bytes, delivered) == 0, "nothing is ever sent");
  }
  return 0;
}
