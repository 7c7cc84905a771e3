// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The host of a conformance check: it reads reports, sends one command at a time and sees in the
/// reports after it how the device took it. It never asks for a force.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/drivers/reference_codec.hpp"
#include "tools/run_device/conform_carrier.hpp"

namespace haptic::tools {

/// Owner: one thread.
class ConformHost {
 public:
  using Bytes = std::vector<std::uint8_t>;

  explicit ConformHost(ConformCarrier& carrier) : carrier_(carrier) {}

  [[nodiscard]] ConformCarrier& carrier() { return carrier_; }
  /// Asks for the capability block once, as a host of 1.1. Empty, or the defect; `block` is
  /// unchanged then. A device that stalls is asked again as by a host of 1.0.
  [[nodiscard]] std::string ask_block();
  /// As a host of 1.0. Empty, or what is wrong with the answer: it must say the same.
  [[nodiscard]] std::string ask_old_block();
  [[nodiscard]] const hal::ReferenceBlock& block() const { return block_.first; }
  [[nodiscard]] const hal::ReferenceLongBlock& long_block() const { return block_; }
  [[nodiscard]] bool speaks_1_1() const { return block_.minor != 0; }
  [[nodiscard]] std::uint32_t period_us() const { return block().report_period_us; }
  [[nodiscard]] std::uint32_t watchdog_us() const { return 1000u * block().watchdog_ms; }
  /// Time from zero to the largest force and torque when the drives go on.
  [[nodiscard]] std::uint32_t slew_us() const;

  /// Waits for the next report. False: none came or it is none, see `trouble`.
  [[nodiscard]] bool next();
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] const hal::ReferenceReport& report() const { return report_; }
  /// Lower 32 bits of the device's clock, in the last report and in the one before it [us].
  [[nodiscard]] std::uint32_t time_us() const { return time_us_; }
  [[nodiscard]] std::uint32_t time_before_us() const { return time_before_us_; }
  [[nodiscard]] bool is_short() const { return short_; }
  [[nodiscard]] bool says(hal::ReferenceStatusBit bit) const { return (report_.status & bit) != 0; }

  /// A command without a wrench.
  [[nodiscard]] static Bytes command(std::uint32_t sequence, bool drives_on);
  /// Sends it and waits until a report shows what became of it.
  struct Outcome {
    bool accepted = false;
    std::uint32_t counted = 0;  ///< rejected meanwhile
    unsigned sent = 0;          ///< how often: again where no report showed anything
  };
  [[nodiscard]] Outcome exchange(std::span<const std::uint8_t> bytes, std::uint32_t sequence);
  /// The next command in the order; true: accepted, and nothing was counted as rejected.
  [[nodiscard]] bool accept(bool drives_on);
  /// Sends what must be refused. Empty, or what is wrong with how the device took it.
  [[nodiscard]] std::string refuse(const Bytes& bytes);
  /// Drives off, then on. Empty, or why they are not.
  [[nodiscard]] std::string bring_up();
  /// Where they are on: a command in time for the watchdog.
  void feed();

 private:
  ConformCarrier& carrier_;
  [[nodiscard]] std::string ask(std::size_t room, hal::ReferenceLongBlock& read, bool& stalled);
  [[nodiscard]] std::string defect_of_version(std::size_t size) const;

  hal::ReferenceLongBlock block_;
  hal::ReferenceReport report_;
  std::string trouble_;
  std::uint32_t time_us_ = 0, time_before_us_ = 0, fed_us_ = 0;
  bool short_ = false;
};

}  // namespace haptic::tools
