// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Between the report flow and what carries its bytes: what ends on the carrier is reported to the
/// sink, what is to be sent is handed to the carrier.

#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/zero_command.hpp"

namespace haptic::hal {

/// Receives what ends on the carrier. Called while the carrier is served, on the link's thread.
class TransferSink {
 public:
  virtual ~TransferSink() = default;
  /// A report came; `bytes` are valid during the call.
  virtual void on_report(std::span<const std::uint8_t> bytes) noexcept = 0;
  /// Its transfer is queued again: time to answer it.
  virtual void on_report_done() noexcept = 0;
  /// The OUT transfer ended; `delivered`: whole and without error.
  virtual void on_out_end(bool delivered) noexcept = 0;
};

enum class SendOutcome : std::uint8_t { kSent = 0, kBusy, kFailed };

/// One OUT transfer at most is under way. Owner: the link's thread.
class ReportTransfers {
 public:
  virtual ~ReportTransfers() = default;
  /// Where the next report to the device is written; not while `busy`. Empty: reports go in only.
  [[nodiscard]] virtual std::span<std::uint8_t> out_bytes() noexcept = 0;
  [[nodiscard]] virtual bool busy() const noexcept = 0;
  virtual SendOutcome send(std::size_t bytes) noexcept = 0;
  /// Takes the OUT transfer back, which the device does not accept.
  virtual void cancel_out() noexcept = 0;
  /// The connection is given up.
  [[nodiscard]] virtual bool lost() const noexcept = 0;
  /// Where a zero command goes without this carrier: descriptor and endpoint; no descriptor: nobody
  /// else can send one.
  [[nodiscard]] virtual ZeroCommand zero_target() const noexcept = 0;
};

}  // namespace haptic::hal
