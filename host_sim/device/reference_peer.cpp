// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/reference_peer.hpp"

#include <algorithm>
#include <cmath>

#include "hal/drivers/reference_codec.hpp"

namespace haptic::sim {

ReferencePeer::ReferencePeer(ReferenceModel& model)
    : model_(model), period_ns_(std::llround(1e9 * model.period_s())) {}

hal::HalStatus ReferencePeer::plug(std::int64_t now_ns) noexcept {
  model_.bus_event();
  due_ns_ = now_ns + period_ns_;
  return hal::HalStatus::kOk;
}

void ReferencePeer::unplug() noexcept { model_.bus_event(); }

hal::HalStatus ReferencePeer::control(const hal::ControlRequest& request,
                                      std::span<std::uint8_t> bytes, std::size_t& moved) noexcept {
  moved = 0;
  if (request.request_type != hal::kReferenceBlockRequestType ||
      request.request != hal::kReferenceBlockRequest)
    return hal::HalStatus::kTransferFailed;  // as a stall
  moved = model_.answer_into(bytes);
  return moved > 0 ? hal::HalStatus::kOk : hal::HalStatus::kTransferFailed;
}

std::size_t ReferencePeer::report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                                  std::int64_t& /*sampled_ns*/) noexcept {
  if (now_ns < due_ns_ || bytes.size() < hal::kReferenceReportBytes) return 0;
  for (int k = 0; k < kMostPeriods && due_ns_ <= now_ns; ++k) {
    model_.advance();
    due_ns_ += period_ns_;
  }
  // Where its host was away for longer, its time stood still.
  if (due_ns_ <= now_ns) due_ns_ = now_ns + period_ns_;
  return model_.report_into(bytes);
}

void ReferencePeer::command(std::int64_t /*now_ns*/, std::span<const std::uint8_t> bytes) noexcept {
  static_cast<void>(model_.command(bytes));
}

}  // namespace haptic::sim
