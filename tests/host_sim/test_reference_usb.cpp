// SPDX-License-Identifier: Apache-2.0
// The reference device on the fake bus, with its faults, as libusb sees it.
#include <doctest/doctest.h>
#include <libusb.h>

#include <cmath>
#include <optional>
#include <vector>

#include "host_sim/device/reference_usb.hpp"
#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = DeviceFaultKind;
constexpr unsigned kHostPatience_ms = 20000;

/// libusb on the device; answers each report with a spring to the origin.
class ReportingHost {
 public:
  explicit ReportingHost(int descriptor) {
    libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
    REQUIRE(libusb_init(&context_) == 0);
    REQUIRE(libusb_wrap_sys_device(context_, descriptor, &handle_) == 0);
    REQUIRE(libusb_claim_interface(handle_, 0) == 0);
  }
  ~ReportingHost() {
    libusb_release_interface(handle_, 0);
    libusb_close(handle_);
    libusb_exit(context_);
  }
  ReportingHost(const ReportingHost&) = delete;
  ReportingHost& operator=(const ReportingHost&) = delete;

  int receive(Bytes& bytes) {
    bytes.assign(128, 0);
    int moved = 0;
    const int status =
        libusb_interrupt_transfer(handle_, ReferenceUsb::kInEndpoint, bytes.data(),
                                  static_cast<int>(bytes.size()), &moved, kHostPatience_ms);
    bytes.resize(static_cast<std::size_t>(moved));
    return status;
  }

  int answer(const hal::ReferenceReport& report) {
    hal::ReferenceCommand command;
    const bool hurt =
        (report.status & (hal::kReferenceWatchdogCut | hal::kReferenceEmergencyStop)) != 0;
    command.drives_on = !hurt && report.accepted_sequence > 0;  // first one without
    command.sequence = report.accepted_sequence + 1;
    command.tick = report.sequence;
    // 200 N/m: 10 uN per 50 nm.
    for (std::size_t k = 0; k < 3; ++k) command.force[k] = -report.position[k] / 50;
    Bytes bytes(hal::kReferenceCommandBytes);
    hal::encode(command, std::span<std::uint8_t, hal::kReferenceCommandBytes>(bytes));
    return send(bytes);
  }

  int send(Bytes& bytes) {
    int moved = 0;
    return libusb_interrupt_transfer(handle_, ReferenceUsb::kOutEndpoint, bytes.data(),
                                     static_cast<int>(bytes.size()), &moved, kHostPatience_ms);
  }

  [[nodiscard]] libusb_device_handle* handle() const { return handle_; }

 private:
  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
};

HandAction circling(double t_s) {
  HandAction action;
  action.target.x0_w = Vector(0.02 * std::sin(4 * t_s), 0.02 * std::cos(4 * t_s) - 0.02, 0);
  return action;
}

/// Model, bus and host in lock-step.
struct Bench {
  Bench() : model(held(), circling), usb(model, DevicePace::kLockStep) { host.emplace(usb.plug()); }

  static ReferenceModelSettings held() {
    ReferenceModelSettings settings;
    settings.hand = *hand_named("firm");
    return settings;
  }

  /// Receives, and answers what is a report. Returns libusb's status of the reception.
  int turn() {
    Bytes bytes;
    const int status = host->receive(bytes);
    if (status != 0) return status;
    log.push_back(bytes);
    hal::ReferenceReport report;
    verdict = hal::decode(bytes, report);
    if (verdict == hal::CodecVerdict::kOk) last = report;
    send_status = host->answer(last);
    return 0;
  }
  void turns(int count) {
    for (int k = 0; k < count; ++k) REQUIRE(turn() == 0);
  }

  ReferenceModel model;
  ReferenceUsb usb;
  std::optional<ReportingHost> host;
  std::vector<Bytes> log;
  hal::ReferenceReport last;
  hal::CodecVerdict verdict = hal::CodecVerdict::kOk;
  int send_status = 0;
};

}  // namespace

TEST_SUITE("host_sim.reference_usb") {
  TEST_CASE("lock-step: the bytes are those of the model alone, each time") {
    std::vector<Bytes> runs[2];
    for (auto& run : runs) {
      Bench bench;
      bench.turns(1500);
      run = bench.log;
    }
    CHECK(runs[0] == runs[1]);
    // Without any bus.
    ReferenceModel model(Bench::held(), circling);
    std::vector<Bytes> alone;
    for (std::uint32_t k = 1; k <= 1500; ++k) {
      model.advance();
      alone.push_back(model.report());
      hal::ReferenceReport report;
      REQUIRE(hal::decode(alone.back(), report) == hal::CodecVerdict::kOk);
      hal::ReferenceCommand command;
      command.drives_on = k > 1;
      command.sequence = k;
      command.tick = k;
      for (std::size_t i = 0; i < 3; ++i) command.force[i] = -report.position[i] / 50;
      Bytes bytes(hal::kReferenceCommandBytes);
      hal::encode(command, std::span<std::uint8_t, hal::kReferenceCommandBytes>(bytes));
      REQUIRE(model.command(bytes));
    }
    CHECK(runs[0] == alone);
    CHECK(model.acting().force_w.norm() > 0.5);
  }

  TEST_CASE("requests: the capability block, and a stall for what the protocol does not have") {
    Bench bench;
    Bytes bytes(64);
    const auto ask = [&](std::uint8_t request, std::uint16_t value) {
      return libusb_control_transfer(bench.host->handle(), 0xc1, request, value, 0, bytes.data(),
                                     64, kHostPatience_ms);
    };
    REQUIRE(ask(1, 1) == 64);
    hal::ReferenceBlock block;
    REQUIRE(hal::decode(bytes, block) == hal::CodecVerdict::kOk);
    CHECK(block == bench.model.block());
    CHECK(ask(1, 2) == LIBUSB_ERROR_PIPE);
    CHECK(ask(2, 1) == LIBUSB_ERROR_PIPE);
    CHECK(ask(1, 1) == 64);
    bench.turns(3);
    CHECK(bench.usb.with_model([](auto& m) { return m.drives_on(); }));
    CHECK(libusb_set_configuration(bench.host->handle(), 1) == 0);
    CHECK_FALSE(bench.usb.with_model([](auto& m) { return m.drives_on(); }));
  }

  TEST_CASE("bus: transfers that fail do not stop time, and reports go on after them") {
    const std::pair<Kind, int> cases[] = {{Kind::kStall, LIBUSB_ERROR_PIPE},
                                          {Kind::kBabble, LIBUSB_ERROR_OVERFLOW},
                                          {Kind::kBusError, LIBUSB_ERROR_IO}};
    for (const auto& [kind, status] : cases) {
      const char* made = to_text(kind);
      CAPTURE(made);
      Bench bench;
      bench.usb.add({kind, 11, 4});
      bench.turns(10);
      for (int k = 0; k < 4; ++k) CHECK(bench.turn() == status);
      REQUIRE(bench.turn() == 0);
      CHECK(bench.last.sequence == 15);
      bench.turns(10);
      CHECK(bench.last.sequence == 25);
      CHECK(bench.last.rejected == 0);
    }
  }

  TEST_CASE("bus: a command that fails or is refused; the host steps the device itself") {
    Bench bench;
    bench.turns(5);
    bench.usb.add({Kind::kStall, 7, 1, 0, true});
    bench.turns(2);
    CHECK(bench.send_status == LIBUSB_ERROR_PIPE);
    bench.usb.add({Kind::kSubmitRefused, 0, 1, 0, true});
    bench.usb.step();
    REQUIRE(bench.turn() == 0);
    CHECK(bench.last.sequence == 8);
    CHECK(bench.send_status == LIBUSB_ERROR_NO_MEM);
    bench.usb.step();
    bench.turns(5);
    CHECK(bench.send_status == 0);
    CHECK(bench.last.rejected == 0);
  }

  TEST_CASE("reports: short, long, corrupt, doubled and lost ones as the host sees them") {
    Bench bench;
    bench.usb.add({Kind::kShort, 5, 1, 6});
    bench.usb.add({Kind::kLong, 6, 1, 4});
    bench.usb.add({Kind::kCorrupt, 7, 1, 1});
    bench.usb.add({Kind::kLost, 8, 3});
    bench.usb.add({Kind::kLong, 12, 1, 1000});
    bench.turns(4);
    REQUIRE(bench.turn() == 0);
    CHECK(bench.log.back().size() == 90);
    CHECK(bench.verdict == hal::CodecVerdict::kBadLength);
    REQUIRE(bench.turn() == 0);
    CHECK(bench.log.back().size() == 100);
    REQUIRE(bench.turn() == 0);
    CHECK(bench.verdict != hal::CodecVerdict::kOk);
    REQUIRE(bench.turn() == 0);
    CHECK(bench.last.sequence == 11);  // 8 to 10 are lost
    CHECK(bench.turn() == LIBUSB_ERROR_OVERFLOW);
  }

  TEST_CASE("unplug and replug: the device keeps its power, or starts again") {
    for (const double power_lost : {0.0, 1.0}) {
      CAPTURE(power_lost);
      Bench bench;
      bench.usb.add({Kind::kUnplug, 31});
      bench.usb.add({Kind::kReplug, 100, 1, power_lost});
      int told = -1;
      bench.usb.on_replug([&told](int descriptor) { told = descriptor; });
      bench.turns(30);
      CHECK(bench.turn() == LIBUSB_ERROR_NO_DEVICE);
      CHECK(told == bench.usb.descriptor());
      CHECK_FALSE(bench.usb.with_model([](auto& m) { return m.drives_on(); }));
      bench.host.emplace(told);
      REQUIRE(bench.turn() == 0);
      CHECK(bench.last.sequence == (power_lost > 0 ? 1u : 100u));
      CHECK(bench.last.accepted_sequence == (power_lost > 0 ? 0u : 30u));
      // Unplugged in the middle of a push: its watchdog has cut.
      const bool cut = (bench.last.status & hal::kReferenceWatchdogCut) != 0;
      CHECK(cut == (power_lost == 0));
      bench.turns(3);
      CHECK((bench.last.status & hal::kReferenceDrivesOn) != 0);
      CHECK(bench.usb.periods() == 104);
    }
  }

  TEST_CASE("unplug without a replug: time stands still, by hand it goes on") {
    Bench bench;
    bench.usb.add({Kind::kUnplug, 5});
    bench.turns(4);
    CHECK(bench.turn() == LIBUSB_ERROR_NO_DEVICE);
    CHECK(bench.usb.periods() == 5);
    bench.host.emplace(bench.usb.plug());
    bench.turns(4);
    CHECK(bench.usb.periods() == 10);
  }

  TEST_CASE("replug: as often as one likes") {
    Bench bench;
    for (int k = 0; k < 100; ++k) {
      bench.host.emplace(bench.usb.plug());
      bench.turns(2);
    }
    CHECK(bench.usb.periods() ==
          301);  // one more when it is plugged than is fetched before the next
  }

  TEST_CASE("device: deaf until its watchdog cuts, emergency stop, encoder jump") {
    Bench bench;
    bench.usb.add({Kind::kDeaf, 11, 30});
    bench.turns(10);
    bench.turns(15);
    CHECK((bench.last.status & hal::kReferenceDrivesOn) != 0);
    bench.turns(7);
    CHECK((bench.last.faults & kDeviceWatchdogCut) != 0);
    CHECK(bench.usb.with_model([](auto& m) { return m.cuts(); }) == 1);
    bench.turns(15);
    CHECK((bench.last.status & hal::kReferenceDrivesOn) != 0);

    bench.usb.add({Kind::kEmergencyStop, 0, 5});
    bench.turns(2);
    CHECK((bench.last.status & hal::kReferenceEmergencyStop) != 0);
    CHECK(bench.usb.with_model([](auto& m) { return m.acting().force_w.norm(); }) == 0);
    bench.turns(10);
    CHECK((bench.last.status & hal::kReferenceEmergencyStop) == 0);
    CHECK((bench.last.status & hal::kReferenceDrivesOn) != 0);

    const std::int32_t before = bench.last.position[0];
    bench.usb.add({Kind::kEncoderJump, 0, 1, 0.005});
    bench.turns(2);
    CHECK(bench.last.position[0] - before > 4'500'000);
  }

  TEST_CASE("real time: a paced device reports by itself") {
    ReferenceModel model(Bench::held(), circling);
    ReferenceUsb usb(model, DevicePace::kRealTime);
    ReportingHost host(usb.plug());
    usb.start();
    Bytes bytes;
    std::uint32_t before = 0;
    for (int k = 0; k < 50; ++k) {
      REQUIRE(host.receive(bytes) == 0);
      hal::ReferenceReport report;
      REQUIRE(hal::decode(bytes, report) == hal::CodecVerdict::kOk);
      CHECK(report.sequence > before);
      before = report.sequence;
      CHECK(host.answer(report) == 0);
    }
    usb.stop();
    const std::uint64_t periods = usb.periods();
    CHECK(periods >= 50);
    CHECK(usb.with_model([](auto& m) { return m.drives_on(); }));
  }
}

}  // namespace haptic::sim
