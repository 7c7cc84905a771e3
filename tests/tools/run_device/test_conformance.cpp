// SPDX-License-Identifier: Apache-2.0
// The conformance checks against the firmware in C: the sound one passes, and of firmwares with one
// defect each the check that is meant for it fails. In the time of the device, and once by the
// program, over the socket.
#include <doctest/doctest.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_codec.hpp"
#include "hal/firmware/reference_device.h"
#include "hal/local/device_port.hpp"
#include "tests/support/program_run.hpp"
#include "tools/run_device/conformance.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

enum class Planted {
  kNothing,
  kBlockDamaged,        ///< the block's check sum is wrong
  kBlockOutOfRange,     ///< its watchdog is shorter than two periods
  kAnswersAll,          ///< every request is answered
  kReportDamaged,       ///< now and then a report's check sum is wrong
  kNumberLeftOut,       ///< a sequence number, every fifty reports
  kOtherClock,          ///< the device's time is a tenth too slow
  kNoUnitQuaternion,    ///< orientation of length 0.9
  kBornReady,           ///< drives before a command with bit 0 clear
  kDrivesUncalibrated,  ///< drives that obey though it says not calibrated
  kCheckIgnored,        ///< the CRC of a command is not looked at
  kReservedIgnored,     ///< nor are its reserved bytes
  kNotCounted,          ///< a refused command is not counted
  kReplayTaken,         ///< a sequence is accepted twice
  kNoWrap,              ///< the sequence is compared as a number
  kLongerTaken,         ///< of 57 bytes the first 56 are a command
  kNeverCuts,           ///< no watchdog
  kFedByRefused,        ///< rejected commands feed it
  kCutsTooSoon,         ///< after half of its time
  kCutForgotten,        ///< the next command with bit 0 set lifts the cut
  kCutUnreported,       ///< fault bit 1 is missing
  kPushAtOnce,          ///< drives that go on give at once what is asked for
  kSlewsForEver,        ///< they say for ever that they do not give all of it
  kOldHostRefused,      ///< a host of 1.0 gets no block
  kBlocksDiffer,        ///< and another one than a host of 1.1
  kNameUnended,         ///< its name has no end
  kLateByAMinute,       ///< its latency is beyond the range
  kGapBeyond,           ///< a gap beyond the largest that it states
  kUnwatchedAlone       ///< the watchdog stands still while there is no host
};
struct PlantedIn {
  Planted defect;
  int check;  ///< that has to fail
};
constexpr PlantedIn kPlanted[] = {
    {Planted::kBlockDamaged, 2},       {Planted::kBlockOutOfRange, 2},
    {Planted::kAnswersAll, 2},         {Planted::kReportDamaged, 3},
    {Planted::kNumberLeftOut, 3},      {Planted::kOtherClock, 3},
    {Planted::kNoUnitQuaternion, 3},   {Planted::kBornReady, 5},
    {Planted::kDrivesUncalibrated, 5}, {Planted::kCheckIgnored, 6},
    {Planted::kReservedIgnored, 6},    {Planted::kNotCounted, 6},
    {Planted::kReplayTaken, 7},        {Planted::kNoWrap, 7},
    {Planted::kLongerTaken, 8},        {Planted::kNeverCuts, 9},
    {Planted::kFedByRefused, 9},       {Planted::kCutsTooSoon, 9},
    {Planted::kCutForgotten, 9},       {Planted::kCutUnreported, 9},
    {Planted::kPushAtOnce, 9},         {Planted::kSlewsForEver, 9},
    {Planted::kOldHostRefused, 2},     {Planted::kBlocksDiffer, 2},
    {Planted::kNameUnended, 2},        {Planted::kLateByAMinute, 2},
    {Planted::kGapBeyond, 3},          {Planted::kUnwatchedAlone, 13}};

void put_check(std::vector<std::uint8_t>& bytes) {
  const std::uint32_t check = hal::crc32(std::span(bytes).first(bytes.size() - 4));
  for (std::size_t k = 0; k < 4; ++k)
    bytes[bytes.size() - 4 + k] = static_cast<std::uint8_t>(check >> (8 * k) & 0xffu);
}

/// A board with the firmware in C, and what was planted in it.
class PlantedBoard {
 public:
  explicit PlantedBoard(Planted planted, bool is_short = false) : planted_(planted) {
    haptic_facts facts{};
    facts.twist_sensed = 1;
    facts.is_short = is_short ? 1 : 0;
    facts.sensed_dof = facts.driven_dof = 0x3f;
    facts.report_period_us = 1000;
    facts.watchdog_ms = has(Planted::kBlockOutOfRange) ? 1 : 20;
    facts.max_force = 1'200'000;
    facts.max_torque = 3'000'000;
    facts.latency_us = has(Planted::kLateByAMinute) ? 60'000'000 : 400;
    facts.largest_gap_um = 70'000;
    std::copy_n("planted board", 14, facts.name);
    std::copy_n("007", 4, facts.serial);
    sample_.gap_um = 25'000;
    sample_.gap_is_measured = 1;
    haptic_device_begin(&device_, &facts);
    if (has(Planted::kBornReady)) device_.is_fresh = 0;
    sample_.is_calibrated = 1;
    sample_.orientation[3] = has(Planted::kNoUnitQuaternion) ? 966'367'642 : 1 << 30;
  }

  std::ptrdiff_t answer(const hal::ControlRequest& request, std::span<std::uint8_t> room) {
    hal::ControlRequest asked = request;
    if (has(Planted::kAnswersAll)) asked = {0xc1, 1, 1, 0};
    const bool is_old = is_old_ || room.size() < HAPTIC_LONG_BLOCK_BYTES;
    if (is_old_ && room.size() > HAPTIC_BLOCK_BYTES) room = room.first(HAPTIC_BLOCK_BYTES);
    if (has(Planted::kOldHostRefused) && is_old) return -1;
    device_.facts.mass_mg = has(Planted::kBlocksDiffer) && is_old ? 1 : 0;
    const std::int32_t size = haptic_device_answer(&device_, asked.request_type, asked.request,
                                                   asked.value, room.data(), room.size());
    if (has(Planted::kBlockDamaged) && size > 0) room[60] ^= 1;
    if (has(Planted::kNameUnended) && size == HAPTIC_LONG_BLOCK_BYTES) {
      std::vector<std::uint8_t> bytes(room.begin(), room.begin() + size);
      std::fill_n(bytes.begin() + 76, 24, std::uint8_t{'n'});
      put_check(bytes);
      std::ranges::copy(bytes, room.begin());
    }
    return size;
  }

  std::vector<std::uint8_t> period() {
    sample_.time_us += has(Planted::kOtherClock) ? 900u : 1000u;
    ++periods_;
    if (has(Planted::kNumberLeftOut) && periods_ % 50 == 0) ++device_.sequence;
    const bool unwatched = has(Planted::kNeverCuts) || (has(Planted::kUnwatchedAlone) && !held_);
    if (unwatched) device_.fed_us = sample_.time_us;
    if (has(Planted::kCutsTooSoon) && sample_.time_us - device_.fed_us >= 10'000)
      device_.fed_us = 0;
    std::vector<std::uint8_t> bytes(HAPTIC_REPORT_BYTES);
    bytes.resize(haptic_device_period(&device_, &sample_, bytes.data(), bytes.size()));
    if (has(Planted::kReportDamaged) && periods_ % 100 == 0) bytes[20] ^= 1;
    if (has(Planted::kDrivesUncalibrated)) {
      bytes[3] &= static_cast<std::uint8_t>(~HAPTIC_CALIBRATED);
      put_check(bytes);
    }
    if (has(Planted::kGapBeyond) && periods_ % 50 == 0 && !device_.facts.is_short) {
      bytes[90] = 2;  // 131 mm
      put_check(bytes);
    }
    if (has(Planted::kSlewsForEver)) device_.slewed_us = 0;
    if (has(Planted::kCutUnreported)) {
      bytes[device_.facts.is_short ? 50 : 72] &= static_cast<std::uint8_t>(~HAPTIC_FAULT_CUT);
      put_check(bytes);
    }
    return bytes;
  }

  void command(std::span<const std::uint8_t> sent) {
    std::vector<std::uint8_t> bytes(sent.begin(), sent.end());
    if (has(Planted::kLongerTaken) && bytes.size() == 57) bytes.resize(56);
    const bool whole = bytes.size() == hal::kReferenceCommandBytes;
    const std::uint32_t sequence = whole ? std::uint32_t{bytes[4]} | std::uint32_t{bytes[5]} << 8u |
                                               std::uint32_t{bytes[6]} << 16u |
                                               std::uint32_t{bytes[7]} << 24u
                                         : 0;
    if (has(Planted::kCheckIgnored) && whole) put_check(bytes);
    if (has(Planted::kReservedIgnored) && is_sealed(bytes)) {
      std::fill_n(bytes.begin() + 36, 16, std::uint8_t{0});
      put_check(bytes);
    }
    if (has(Planted::kReplayTaken) && is_sealed(bytes) && sequence == device_.accepted)
      --device_.accepted;
    if (has(Planted::kNoWrap) && whole && sequence <= device_.accepted) bytes[0] ^= 1;
    if (has(Planted::kCutForgotten)) device_.is_cut = 0;
    const bool accepted =
        haptic_device_command(&device_, bytes.data(), bytes.size(), sample_.time_us) == 1;
    if (accepted && has(Planted::kPushAtOnce)) device_.slewed_us = 1'000'000;
    if (accepted) return;
    if (has(Planted::kNotCounted)) --device_.rejected;
    if (has(Planted::kFedByRefused)) device_.fed_us = sample_.time_us;
  }

  /// Answers every host as a device of 1.0 does.
  void be_old() { is_old_ = true; }
  void host_comes() { held_ = true; }
  void host_goes() {
    held_ = false;
    if (!has(Planted::kUnwatchedAlone)) haptic_device_bus_event(&device_);
  }
  [[nodiscard]] bool drives_on() const { return device_.drive.is_on != 0; }
  [[nodiscard]] bool asked_for_force() const {
    return std::ranges::any_of(device_.drive.force, [](std::int32_t f) { return f != 0; });
  }

 private:
  [[nodiscard]] bool has(Planted defect) const { return planted_ == defect; }
  static bool is_sealed(std::vector<std::uint8_t> bytes) {
    const std::vector<std::uint8_t> as_sent = bytes;
    if (bytes.size() != hal::kReferenceCommandBytes) return false;
    put_check(bytes);
    return bytes == as_sent;
  }

  Planted planted_;
  haptic_device device_{};
  haptic_sample sample_{};
  std::uint64_t periods_ = 0;
  bool held_ = false, is_old_ = false;
};

/// A board in this process whose time passes when a report is waited for.
class BoardCarrier final : public ConformCarrier {
 public:
  explicit BoardCarrier(PlantedBoard& board) : board_(board) {}
  std::string connect() override {
    board_.host_comes();
    return "";
  }
  void disconnect() noexcept override { board_.host_goes(); }
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved) override {
    const std::ptrdiff_t size = board_.answer(request, bytes);
    moved = size > 0 ? static_cast<std::size_t>(size) : 0;
    return size < 0 ? hal::HalStatus::kTransferFailed : hal::HalStatus::kOk;
  }
  std::size_t receive(std::span<std::uint8_t> bytes, std::int64_t) override {
    const std::vector<std::uint8_t> report = board_.period();
    std::ranges::copy(report, bytes.begin());
    forced_ = forced_ || board_.asked_for_force();
    return report.size();
  }
  bool send(std::span<const std::uint8_t> bytes) override {
    board_.command(bytes);
    return true;
  }
  void pass(std::int64_t time_ns) override {
    for (; time_ns > 0; time_ns -= 1'000'000) (void)board_.period();
  }
  std::optional<Endpoints> endpoints() const override { return ends; }
  bool tells_of_its_end() const override { return true; }
  [[nodiscard]] bool forced() const { return forced_; }

  std::optional<Endpoints> ends;

 private:
  PlantedBoard& board_;
  bool forced_ = false;
};

std::vector<ConformCheck> checks_of(Planted planted, bool is_short = false) {
  PlantedBoard board(planted, is_short);
  BoardCarrier carrier(board);
  REQUIRE(carrier.connect().empty());
  ConformSettings settings;
  settings.reports = 500;
  const std::vector<ConformCheck> checks = check_conformance(carrier, settings);
  CHECK_FALSE(carrier.forced());
  CHECK_FALSE((planted == Planted::kNothing && board.drives_on()));
  return checks;
}

/// A board behind a DevicePort, in real time.
class ServedBoard final : public hal::PortDevice {
 public:
  ServedBoard(Planted planted, const std::string& path) : board_(planted) {
    REQUIRE(port_.listen(path) == 0);
    thread_ = std::thread([this] { serve(); });
  }
  ~ServedBoard() override {
    stop_ = true;
    thread_.join();
  }
  void begin() override { board_.host_comes(); }
  std::ptrdiff_t control(const hal::ControlRequest& request, std::span<const std::uint8_t>,
                         std::span<std::uint8_t> room) override {
    return board_.answer(request, room);
  }
  void command(std::span<const std::uint8_t> bytes) override { board_.command(bytes); }
  void end() override { board_.host_goes(); }

 private:
  void serve() {
    std::int64_t due_ns = hal::monotonic_ns();
    while (!stop_) {
      const std::int64_t now_ns = hal::monotonic_ns();
      if (now_ns >= due_ns) {
        due_ns = std::max(due_ns + kPeriod_ns, now_ns);
        port_.publish(board_.period(), now_ns);
      }
      auto watched = port_.watched();
      const std::int64_t left_ns = std::max<std::int64_t>(due_ns - hal::monotonic_ns(), 0);
      const timespec until{0, left_ns};
      (void)ppoll(watched.data(), watched.size(), &until, nullptr);
      port_.serve(*this);
    }
    port_.drop(*this);
  }
  static constexpr std::int64_t kPeriod_ns = 1'000'000;
  PlantedBoard board_;
  hal::DevicePort port_{100 * kPeriod_ns};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace

TEST_SUITE("tools.conformance") {
  TEST_CASE("conformance: sound firmware passes each check that needs no person") {
    for (const bool is_short : {false, true}) {
      CAPTURE(is_short);
      const std::vector<ConformCheck> checks = checks_of(Planted::kNothing, is_short);
      REQUIRE(checks.size() == 13);
      for (const ConformCheck& check : checks) {
        CAPTURE(check.number);
        CAPTURE(check.found);
        const bool by_hand = check.number == 4 || (check.number >= 10 && check.number <= 12);
        CHECK(check.result == (check.number == 1 ? ConformResult::kNotHere
                               : by_hand         ? ConformResult::kByHand
                                                 : ConformResult::kPassed));
        CHECK(check.number == 1 + (&check - checks.data()));
        CHECK_FALSE(check.found.empty());
      }
      CHECK(conforms(checks));
    }
  }

  TEST_CASE("conformance: each planted defect is found by the check that is meant for it") {
    int found = 0;
    for (const PlantedIn& planted : kPlanted) {
      CAPTURE(static_cast<int>(planted.defect));
      const std::vector<ConformCheck> checks = checks_of(planted.defect);
      REQUIRE(checks.size() == 13);
      const ConformCheck& check = checks[static_cast<std::size_t>(planted.check) - 1];
      CAPTURE(check.found);
      CHECK(check.result == ConformResult::kFailed);
      CHECK_FALSE(conforms(checks));
      found += check.result == ConformResult::kFailed ? 1 : 0;
      for (const ConformCheck& before : checks)
        if (before.number < planted.check) CHECK(before.result != ConformResult::kFailed);
    }
    CHECK(found == std::ssize(kPlanted));
  }

  TEST_CASE("conformance: a device of 1.0 passes too, and what it cannot say is not asked of it") {
    PlantedBoard board(Planted::kNothing);
    board.be_old();
    BoardCarrier carrier(board);
    ConformSettings settings;
    settings.reports = 300;
    const std::vector<ConformCheck> checks = check_conformance(carrier, settings);
    REQUIRE(checks.size() == 13);
    CHECK(conforms(checks));
    CHECK(checks[1].found.find("version 1.0, ") != std::string::npos);
    CHECK(checks[8].found.find("begin at zero") == std::string::npos);
    const std::vector<ConformCheck> now = checks_of(Planted::kNothing);
    CHECK(now[1].found.find("version 1.1, ") != std::string::npos);
    CHECK(now[1].found.find("planted board, serial 007, latency 0.4 ms") != std::string::npos);
    CHECK(now[8].found.find("begin at zero") != std::string::npos);
  }

  TEST_CASE("conformance: endpoints of either speed, and those that fit neither") {
    const auto result_of = [](hal::UsbEndpoint in, hal::UsbEndpoint out) {
      PlantedBoard board(Planted::kNothing);
      BoardCarrier carrier(board);
      carrier.ends = {in, out};
      ConformSettings settings;
      settings.reports = 100;
      return check_conformance(carrier, settings).front().result;
    };
    const hal::UsbEndpoint out{0x01, false, 56, 125'000};
    CHECK(result_of({0x81, false, 96, 125'000}, out) == ConformResult::kPassed);
    CHECK(result_of({0x81, false, 64, 1'000'000}, out) == ConformResult::kPassed);
    CHECK(result_of({0x82, false, 96, 125'000}, out) == ConformResult::kFailed);
    CHECK(result_of({0x81, true, 96, 125'000}, out) == ConformResult::kFailed);
    CHECK(result_of({0x81, false, 60, 1'000'000}, out) == ConformResult::kFailed);
    CHECK(result_of({0x81, false, 96, 1'000'000}, out) == ConformResult::kFailed);
    CHECK(result_of({0x81, false, 96, 125'000}, {0x01, false, 64, 125'000}) ==
          ConformResult::kFailed);
  }

  TEST_CASE("run_device conform: over a socket, exit codes, table and JSON") {
    const sim::test::ScratchFolder folder("conform");
    const std::string path = folder.file("board.sock");
    const auto conform = [&](const std::string& more) {
      return sim::test::run_program(HAPTIC_RUN_DEVICE,
                                    "conform --device unix:" + path + " --reports 200 " + more);
    };
    CHECK(conform("").exit_code == 4);
    {
      const ServedBoard board(Planted::kNothing, path);
      const sim::test::ProgramResult r = conform("--json");
      INFO(r.out << r.err);
      CHECK(r.exit_code == 0);
      CHECK(r.out.find("\"conforming\": true") != std::string::npos);
      CHECK(r.out.find("\"number\": 13") != std::string::npos);
    }
    const ServedBoard board(Planted::kBlockOutOfRange, path);
    const sim::test::ProgramResult r = conform("");
    CHECK(r.exit_code == 1);
    CHECK(r.out.find(" 2  FAILED    capability block") != std::string::npos);
    CHECK(r.out.find("NOT CONFORMING") != std::string::npos);
    CHECK(conform("--reports 1").exit_code == 2);
    CHECK(sim::test::run_program(HAPTIC_RUN_DEVICE, "conform --device nonsense").exit_code == 2);
  }
}
