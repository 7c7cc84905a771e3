// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A link without a bus: driver, report flow and output guard as over USB, but the bytes go to a
/// peer: in the same process, or behind a socket (socket_peer.hpp). For trying out a loop on a
/// machine without the device; what a bus does to transfers - loss, stalls, unplugging - does not
/// happen here.

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "hal/device_link.hpp"
#include "hal/local/local_peer.hpp"
#include "hal/usb/report_flow.hpp"

namespace haptic::hal {

/// Owner: the link's thread. Reports arrive when they are due by the peer; a command is with the
/// peer at once and counts as delivered at the next turn. Allocates nothing while reports flow.
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

  [[nodiscard]] HalStatus connect() noexcept;
  void serve(std::int64_t timeout_ns) noexcept;
  void lose() noexcept;

  Driver& driver_;
  LocalPeer& peer_;
  const LinkSettings settings_;
  mutable ReportFlow flow_;  ///< its counters are read by `counters`
  std::array<std::uint8_t, kMaxReportBytes> in_{}, out_{};
  bool connected_ = false, busy_ = false;
  std::int64_t next_try_ns_ = 0;
  std::atomic<HalStatus> status_{HalStatus::kDeviceNotFound};
  std::atomic<bool> cancelled_{false};
};

}  // namespace haptic::hal
