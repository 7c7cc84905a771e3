// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A link without a bus: driver, report flow and output guard as over USB, but the bytes go to a
/// peer: in the same process, for trying out a loop without a device, or in another one
/// (process_peer.hpp), which is where every device that is no USB packet device comes in. What a
/// bus does to transfers - loss, stalls - does not happen here.

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "hal/device_link.hpp"
#include "hal/local/local_peer.hpp"
#include "hal/usb/report_flow.hpp"

namespace haptic::hal {

/// Owner: the link's thread. Reports arrive when they are due by the peer; a command takes the
/// place of the one before at once, so that the peer never has an older one in front of it.
/// Allocates nothing while reports flow.
class LocalLink final : public DeviceLink, private ReportTransfers {
 public:
  /// Driver, mailbox and peer outlive the link. Of `settings`, the address means nothing.
  LocalLink(Driver& driver, const DeviceMailbox& mailbox, LocalPeer& peer,
            const LinkSettings& settings);
  ~LocalLink() override;
  LocalLink(const LocalLink&) = delete;
  LocalLink& operator=(const LocalLink&) = delete;

  void observe(LinkObserver* observer) noexcept override { flow_.observe(observer); }
  HalStatus poll(std::int64_t timeout_ns) noexcept override;
  void close() noexcept override;
  void cancel() noexcept override { cancelled_.store(true); }
  void servo_lost() noexcept override { flow_.servo_lost(); }
  void use_mailbox(const DeviceMailbox& mailbox) noexcept override { flow_.use_mailbox(mailbox); }
  void emergency_stop() noexcept override { flow_.emergency_stop(); }
  [[nodiscard]] LinkState state() const noexcept override { return flow_.state(); }
  [[nodiscard]] HeldWrench held() const noexcept override { return flow_.held(); }
  [[nodiscard]] std::optional<double> gap_m() const noexcept override { return flow_.gap_m(); }
  [[nodiscard]] LinkCounters counters() const noexcept override {
    return snapshot(flow_.counters());
  }
  [[nodiscard]] std::string trouble() const override;

 private:
  class Port;

  // The carrier of the flow.
  [[nodiscard]] std::span<std::uint8_t> out_bytes() noexcept override;
  [[nodiscard]] bool busy() const noexcept override { return busy_; }
  SendOutcome send(std::size_t bytes) noexcept override;
  void cancel_out() noexcept override {}
  [[nodiscard]] bool lost() const noexcept override { return peer_.gone(); }
  [[nodiscard]] ZeroCommand zero_target() const noexcept override;

  [[nodiscard]] HalStatus connect();
  [[nodiscard]] HalStatus start_reports();
  void tell(HalStatus why, std::string text);
  [[nodiscard]] std::string named(HalStatus status) const;
  void look_for_peer(std::int64_t timeout_ns) noexcept;
  void serve(std::int64_t timeout_ns) noexcept;
  void lose() noexcept;

  Driver& driver_;
  LocalPeer& peer_;
  const LinkSettings settings_;
  mutable ReportFlow flow_;  ///< its counters are read by `counters`
  std::array<std::uint8_t, kMaxReportBytes> in_{}, out_{};
  bool connected_ = false, busy_ = false;
  std::int64_t next_try_ns_ = 0;
  HalStatus status_ = HalStatus::kDeviceNotFound;
  mutable std::mutex trouble_mutex_;  ///< never taken while reports flow
  std::string trouble_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace haptic::hal
