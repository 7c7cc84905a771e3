// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Driver of the reference 6-DOF device (PROTOCOL.md): vendor class, one report in, long or short,
/// and one command out per period, CRC and sequence on both.

#include "hal/drivers/driver.hpp"
#include "hal/drivers/reference_codec.hpp"

namespace haptic::hal {

/// Capabilities of the device of PROTOCOL.md where nothing else is known: 12 N, 0.3 N m, 1 kHz, 20
/// ms.
[[nodiscard]] DeviceCapabilities reference_capabilities() noexcept;

/// A capability block in SI units. Frames are not in it: q_wd and handle_offset_h are identity and
/// zero, since the protocol fixes D and reports the handle point itself.
[[nodiscard]] DeviceCapabilities capabilities_of(const ReferenceBlock& block) noexcept;
[[nodiscard]] DeviceCapabilities capabilities_of(const ReferenceLongBlock& block) noexcept;

/// True for numbers that a hand-held device can have: usable (check_capabilities), report period of
/// 0.1 to 20 ms, watchdog of two periods to 1 s, force of at most 1 kN and torque of at most 100 N
/// m and both above zero where driven, encoder steps below 1 mm and 0.1 rad, latency of at most 100
/// ms, gap of at most 1 m, and no drive behind a displacement.
[[nodiscard]] bool is_plausible(const DeviceCapabilities& capabilities) noexcept;

struct ReferenceSettings {
  /// Test identity of pid.codes: fit for a bench and for the device model, not for distribution.
  /// Who builds hardware uses an identity of their own.
  std::uint16_t vendor_id = 0x1209, product_id = 0x0001;
  /// Limits are read from the device; the numbers of `capabilities` are replaced then, its q_wd and
  /// handle_offset_h are kept. Else `capabilities` as it is.
  bool ask_device = true;
  DeviceCapabilities capabilities = reference_capabilities();
};

/// Reports in a row that advance among themselves, all behind the last one taken: the device counts
/// from elsewhere.
inline constexpr unsigned kReferenceRestartReports = 5;

/// When a wrench acts. The drives are asked for once the device has accepted a command without them
/// and reports say "calibrated" and neither e-stop nor watchdog cut. A wrench is passed on from the
/// first command on that finds the drives confirmed and is itself zero; until then zero is sent and
/// `delivered_d` is zero. After a cut, an e-stop, a lost calibration or drives that dropped by
/// themselves that starts again, and the fault bit stays in the state until then: a cause that was
/// there for one report only is not missed, and force never comes back in one step.
///
/// A device that counts its reports from elsewhere, without having left the bus, has restarted:
/// after kReferenceRestartReports reports it is taken as one that has just come, with
/// kDeviceDriveFault in the state.
class ReferenceDriver final : public Driver {
 public:
  explicit ReferenceDriver(const ReferenceSettings& settings = {}) noexcept;

  /// Reads the capability block, three times at most, 100 ms each: that of 1.1, which a device of
  /// 1.0 answers by its own, or refuses, and is then asked for that.
  /// @retval kStartFailed      it has none, a damaged or an implausible one; or cancelled
  /// @retval kBadCapabilities  those of the settings are implausible
  /// @retval kTimeout, others  of the port
  [[nodiscard]] HalStatus start(UsbPort& port) noexcept override;

  [[nodiscard]] ReportVerdict read(std::span<const std::uint8_t> report, std::int64_t stamp_ns,
                                   DeviceState& state) noexcept override;

  /// Beyond a limit, force and torque are each shortened without turning; a wrench that is not
  /// finite counts as zero. Rounding: half a unit per component. Nothing is sent before the first
  /// report, from which the sequence of commands goes on.
  [[nodiscard]] std::size_t write(const Wrench& wrench_d, std::uint64_t tick,
                                  std::span<std::uint8_t> report,
                                  Wrench& delivered_d) noexcept override;

  /// Drives off, with a sequence that is newer than any of the next 2^30 commands: days.
  [[nodiscard]] std::size_t zero_report(std::span<std::uint8_t> report) const noexcept override;

  /// Told from the first report of a connection on.
  [[nodiscard]] CommandReceipt receipt() const noexcept override;

  [[nodiscard]] std::optional<Real> gap_m() const noexcept override { return gap_m_; }

  /// A command with the drives' bit clear. The drives that go off for it are no fault.
  [[nodiscard]] std::size_t release(std::uint64_t tick,
                                    std::span<std::uint8_t> report) noexcept override;

 private:
  [[nodiscard]] HalStatus ask(UsbPort& port) noexcept;
  [[nodiscard]] bool is_of_version(const ReferenceReport& report) const noexcept;
  void follow_drives(const ReferenceReport& report) noexcept;
  [[nodiscard]] bool follow_restart(const ReferenceReport& report) noexcept;
  [[nodiscard]] std::size_t send(ReferenceCommand& command, std::uint64_t tick,
                                 std::span<std::uint8_t> report) noexcept;
  void follow_refusals(const ReferenceReport& report) noexcept;
  void follow_acceptance(const ReferenceReport& report) noexcept;
  void forget() noexcept;

  ReferenceSettings settings_;

  std::uint8_t minor_ = 0;  ///< of the version that the device speaks
  std::uint32_t largest_gap_um_ = 0;
  std::optional<Real> gap_m_;        ///< by the last report
  bool reported_ = false;            ///< there was a report since start
  std::uint32_t last_sequence_ = 0;  ///< of reports
  bool calibrated_ = false;          ///< by the last report
  bool was_calibrated_ = false;      ///< by any report
  bool may_drive_ = false;           ///< calibrated, neither e-stop nor watchdog cut
  bool cleared_ = false;             ///< it has accepted a command without the drives' bit
  bool asked_off_ = false;           ///< such a command was sent since start ...
  std::uint32_t off_at_ = 0;         ///< ... first with this sequence
  std::uint32_t sequence_ = 0;       ///< of the last command
  bool asked_on_ = false;            ///< the last command asked for the drives ...
  std::uint32_t asked_since_ = 0;    ///< ... as every one since this
  bool confirmed_ = false;           ///< the device has answered that they are on
  bool acting_ = false;              ///< wrenches are passed on
  std::uint32_t held_faults_ = 0;    ///< until acting_
  bool refused_ = false;
  std::uint32_t refused_at_ = 0;  ///< accepted_sequence when it last refused
  std::uint32_t rejected_ = 0;    ///< commands, by the last report
  std::uint32_t accepted_ = 0;    ///< sequence of the command accepted last
  std::uint32_t unanswered_ = 0;  ///< CommandReceipt::unanswered
  bool drives_on_ = false;        ///< by the last report
  unsigned behind_ = 0;           ///< reports in a row that are older than the last one taken ...
  std::uint32_t behind_at_ = 0;   ///< ... and advance, up to this
};

}  // namespace haptic::hal
