// SPDX-License-Identifier: Apache-2.0
/// Any bytes as report, command or capability block of the reference device: refused, or the same
/// bytes again when encoded. Then the input as a session of the driver: a capability block, reports
/// and wrenches in any order. Check sums are put right in some of them, or no mutation would pass.
#include <array>
#include <cstring>
#include <optional>
#include <vector>

#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/reference_short.hpp"
#include "tests/fuzz/report_stream.hpp"

namespace {

using namespace haptic;
using namespace haptic::hal;
using fuzz::ReportStream;
using fuzz::require;

template <std::size_t N>
void seal(std::array<std::uint8_t, N>& bytes, std::uint16_t magic) {
  bytes[0] = static_cast<std::uint8_t>(magic & 0xff);
  bytes[1] = static_cast<std::uint8_t>(magic >> 8);
  bytes[2] = kReferenceVersion;
  const std::uint32_t check = crc32(std::span(bytes).first(N - 4));
  for (unsigned k = 0; k < 4; ++k) bytes[N - 4 + k] = static_cast<std::uint8_t>(check >> (8 * k));
}

template <std::size_t N, typename Record>
void round_trip(std::span<const std::uint8_t> bytes) {
  Record record;
  const CodecVerdict verdict = decode(bytes, record);
  if (verdict != CodecVerdict::kOk) {
    require(record == Record{}, "what is refused leaves the record as it was");
    return;
  }
  if (bytes.size() != N) return;  // the other form of a short report
  std::array<std::uint8_t, N> again{};
  encode(record, again);
  require(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()),
          "what decodes encodes to the same bytes");
}

template <std::size_t N, typename Record>
void both_ways(std::span<const std::uint8_t> input, std::uint16_t magic) {
  // A copy of its own, so that the sanitizer sees the first access beyond it.
  const std::vector<std::uint8_t> exact(input.begin(), input.end());
  round_trip<N, Record>(exact);
  std::array<std::uint8_t, N> sealed = ReportStream(input).bytes<N>();
  seal(sealed, magic);
  round_trip<N, Record>(sealed);
}

/// Answers every request with one block.
class BlockPort : public UsbPort {
 public:
  explicit BlockPort(std::span<const std::uint8_t> answer)
      : answer_(answer.begin(), answer.end()) {}
  HalStatus control(const ControlRequest&, std::span<std::uint8_t> bytes, std::size_t& moved,
                    unsigned) noexcept override {
    moved = std::min(bytes.size(), answer_.size());
    std::copy_n(answer_.begin(), moved, bytes.begin());
    return HalStatus::kOk;
  }
  HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  HalStatus read(std::span<std::uint8_t>, std::size_t&, unsigned) noexcept override {
    return HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }

 private:
  std::vector<std::uint8_t> answer_;
};

/// A driver, and with it what its header says about when a wrench may act.
class Session {
 public:
  /// False when the device is not started.
  bool start(ReportStream& input) {
    const std::uint8_t kind = input.byte() % 4;
    std::array<std::uint8_t, kReferenceBlockBytes> block{};
    std::array<std::uint8_t, kReferenceLongBlockBytes> long_block{};
    std::span<const std::uint8_t> answer = block;
    encode(ReferenceBlock{}, block);
    if (kind == 3) {
      long_block = input.bytes<kReferenceLongBlockBytes>();
      long_block[60] = kReferenceMinor;
      seal(long_block, kReferenceBlockMagic);
      answer = long_block;
    } else if (kind != 0) {
      block = input.bytes<kReferenceBlockBytes>();
    }
    if (kind == 2) seal(block, kReferenceBlockMagic);
    BlockPort port(answer);
    const bool started = driver_.start(port) == HalStatus::kOk;
    require(!started || decode_either(answer, block_) == CodecVerdict::kOk,
            "only a valid block starts");
    if (!started) block_ = {};
    require(is_plausible(driver_.capabilities()), "capabilities are plausible at any time");
    return started;
  }

  void read(std::span<const std::uint8_t> bytes) {
    const std::vector<std::uint8_t> exact(bytes.begin(), bytes.end());
    const ReportVerdict verdict = fuzz::checked_read(driver_, exact, 0, state_);
    ReferenceReport report;
    const bool valid = decode_either(exact, report) == CodecVerdict::kOk && is_of_version(report);
    const bool newer = !reported_ || is_newer(report.sequence, last_.sequence);
    require((verdict == ReportVerdict::kState) == (valid && newer),
            "valid and newer reports are taken, no others");
    if (verdict != ReportVerdict::kState) return;
    const bool calibrated =
        (report.status & kReferenceCalibrated) != 0 && (report.faults & kDeviceNotHomed) == 0;
    require((state_.link == LinkState::kReady) == calibrated, "ready means calibrated");
    const std::optional<Real> gap_m = driver_.gap_m();
    require(gap_m.has_value() == (report.gripper != 0), "a gap is one of this report");
    require(!gap_m || (*gap_m >= 0 && *gap_m <= driver_.capabilities().largest_gap_m),
            "a gap is within the gripper's");
    require((report.faults & ~state_.faults) == 0, "no fault of the device is lost");
    driving_ = calibrated && (report.status & kReferenceDrivesOn) != 0 &&
               (report.status & (kReferenceWatchdogCut | kReferenceEmergencyStop)) == 0 &&
               (report.faults & (kDeviceWatchdogCut | kDeviceEmergencyStop)) == 0;
    rested_ = rested_ && driving_;
    reported_ = true;
    last_ = report;
  }

  /// `sequence`: of the report in its place, so that a run of reports gets through.
  void read_composed(ReportStream& input) {
    std::array<std::uint8_t, kReferenceReportBytes> bytes = input.bytes<kReferenceReportBytes>();
    bytes[3] &= kReferenceStatusBits;
    if (block_.minor == 0) bytes[3] &= static_cast<std::uint8_t>(~unsigned{kReferenceSlewing});
    bytes[72] &= kReferenceFaultBits;
    std::fill_n(bytes.begin() + 73, 3, std::uint8_t{0});
    std::fill_n(bytes.begin() + 88, 4, std::uint8_t{0});
    if (block_.largest_gap_um > 255) bytes[88] = bytes[12];
    if (bytes[31] % 2 == 0) {
      std::fill_n(bytes.begin() + 28, 16, std::uint8_t{0});
      bytes[43] = 0x40;
    }
    const std::uint32_t sequence = last_.sequence + 1 + bytes[4] % 4;
    for (unsigned k = 0; k < 4; ++k) {
      bytes[4 + k] = static_cast<std::uint8_t>(sequence >> (8 * k));
      // Answers to the commands that were really sent, often.
      if (bytes[11] % 2 == 0) bytes[84 + k] = static_cast<std::uint8_t>(sent_ >> (8 * k));
    }
    seal(bytes, kReferenceReportMagic);
    read(bytes);
  }

  /// The same as a short report.
  void read_composed_short(ReportStream& input) {
    auto bytes = input.bytes<kReferenceShortReportBytes>();
    bytes[3] &= kReferenceStatusBits;
    bytes[3] &= static_cast<std::uint8_t>(~unsigned{kReferenceSlewing});
    bytes[50] &= kReferenceFaultBits;
    for (const std::size_t high : {27u, 31u, 35u}) bytes[high] %= 0x20;
    const std::uint32_t sequence = last_.sequence + 1 + bytes[4] % 4;
    for (unsigned k = 0; k < 4; ++k) {
      bytes[4 + k] = static_cast<std::uint8_t>(sequence >> (8 * k));
      if (bytes[11] % 2 == 0) bytes[52 + k] = static_cast<std::uint8_t>(sent_ >> (8 * k));
    }
    seal(bytes, kReferenceShortReportMagic);
    read(bytes);
  }

  void write(const Wrench& asked) {
    std::array<std::uint8_t, kMaxReportBytes> bytes{};
    Wrench delivered;
    const std::size_t length = driver_.write(asked, 7, bytes, delivered);
    require(length == (reported_ ? kReferenceCommandBytes : 0), "commands follow a first report");
    const DeviceCapabilities& c = driver_.capabilities();
    require(is_finite(delivered), "what is delivered is finite");
    constexpr Real kSlack = 1 + 8 * kRealEpsilon;
    require(delivered.force_w.norm() <= c.max_force_n * kSlack, "force limit");
    require(delivered.torque_w.norm() <= c.max_torque_nm * kSlack, "torque limit");
    const bool acts = !delivered.force_w.isZero(0) || !delivered.torque_w.isZero(0);
    require(!acts || (driving_ && rested_), "a wrench needs drives, and a zero before it");
    if (length == 0) return;
    ReferenceCommand command;
    require(decode(std::span(bytes).first(length), command) == CodecVerdict::kOk,
            "commands are valid");
    require(!commanded_ || command.sequence == sent_ + 1, "commands are counted");
    require(command.drives_on || !acts, "no wrench without drives");
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const auto of = [](std::int32_t units, double unit) {
        return static_cast<Real>(units * unit);
      };
      require(delivered.force_w[k] == of(command.force[at], kReferenceForceUnit_n) &&
                  delivered.torque_w[k] == of(command.torque[at], kReferenceTorqueUnit_nm),
              "delivered is what the bytes say");
      require((c.driven_dof >> k & 1u) != 0 || command.force[at] == 0, "driven forces only");
      require((c.driven_dof >> (k + 3) & 1u) != 0 || command.torque[at] == 0,
              "driven torques only");
    }
    const bool tiny = asked.force_w.cwiseAbs().maxCoeff() < 0.6e-5_r &&
                      asked.torque_w.cwiseAbs().maxCoeff() < 0.6e-7_r;
    const bool nothing = tiny || !is_finite(asked) || is_undriven(asked, c.driven_dof);
    rested_ = rested_ || (driving_ && nothing);
    commanded_ = true;
    sent_ = command.sequence;
  }

 private:
  static bool is_undriven(const Wrench& asked, std::uint32_t driven_dof) {
    const Wrench rest = project_wrench(asked, driven_dof);
    return rest.force_w.cwiseAbs().maxCoeff() < 0.6e-5_r &&
           rest.torque_w.cwiseAbs().maxCoeff() < 0.6e-7_r;
  }

  [[nodiscard]] bool is_of_version(const ReferenceReport& report) const {
    if (block_.minor == 0 && (report.status & kReferenceSlewing) != 0) return false;
    return report.gripper == 0 ||
           (block_.largest_gap_um != 0 && report.gripper <= block_.largest_gap_um + 1);
  }

  ReferenceDriver driver_;
  ReferenceLongBlock block_;
  DeviceState state_;
  ReferenceReport last_;
  bool reported_ = false, commanded_ = false;
  bool driving_ = false;  ///< by the last report a wrench may act
  bool rested_ = false;   ///< zero was asked for since it may
  std::uint32_t sent_ = 0;
};

void run_session(std::span<const std::uint8_t> bytes) {
  ReportStream input(bytes);
  Session session;
  if (!session.start(input)) return;
  while (!input.empty()) {
    switch (input.byte() % 6) {
      case 0:
        session.read(input.report());
        break;
      case 1: {
        auto sealed = input.bytes<kReferenceReportBytes>();
        seal(sealed, kReferenceReportMagic);
        session.read(sealed);
        break;
      }
      case 2:
        session.read_composed(input);
        break;
      case 3:
        session.write(input.wrench());
        break;
      case 5:
        session.read_composed_short(input);
        break;
      default:
        session.write(Wrench{});
        break;
    }
  }
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> input(data, size);
  both_ways<kReferenceReportBytes, ReferenceReport>(input, kReferenceReportMagic);
  both_ways<kReferenceShortReportBytes, ReferenceShortReport>(input, kReferenceShortReportMagic);
  both_ways<kReferenceShortGripperBytes, ReferenceShortReport>(input, kReferenceShortReportMagic);
  both_ways<kReferenceCommandBytes, ReferenceCommand>(input, kReferenceCommandMagic);
  both_ways<kReferenceBlockBytes, ReferenceBlock>(input, kReferenceBlockMagic);
  both_ways<kReferenceLongBlockBytes, ReferenceLongBlock>(input, kReferenceBlockMagic);
  run_session(input);
  return 0;
}
