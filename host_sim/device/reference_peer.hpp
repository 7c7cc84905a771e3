// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The reference device without a bus: ReferenceModel as the other end of a local link, which hands
/// its bytes over in this process. Its periods pass by the clock, on the link's thread.

#include <cstdint>

#include "hal/local/local_peer.hpp"
#include "host_sim/device/reference_model.hpp"

namespace haptic::sim {

/// Owner: the link's thread, as LocalPeer. `model` outlives it and is nobody else's while it is
/// plugged in. Periods that nobody asked for pass all the same, at most kMostPeriods at once.
class ReferencePeer final : public hal::LocalPeer {
 public:
  static constexpr int kMostPeriods = 1000;

  explicit ReferencePeer(ReferenceModel& model);

  hal::HalStatus plug(std::int64_t now_ns) noexcept override;
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved) noexcept override;
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override { return due_ns_; }
  std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                     std::int64_t& sampled_ns) noexcept override;
  void command(std::int64_t now_ns, std::span<const std::uint8_t> bytes) noexcept override;
  void unplug() noexcept override;

 private:
  ReferenceModel& model_;
  std::int64_t period_ns_, due_ns_ = 0;
};

}  // namespace haptic::sim
