// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/realtime/servo_loop.hpp"
#include "hal/usb/bus_recorder.hpp"
#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_thread.hpp"
#include "host_sim/device/bus_player.hpp"
#include "host_sim/device/device_stack.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "host_sim/view/core_tape.hpp"
#include "tests/host_sim/record_bytes.hpp"
#include "tests/host_sim/recorded_input.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::sim;
using haptic::sim::test::put_check;
using haptic::sim::test::record_of;
using Bytes = std::vector<std::uint8_t>;

namespace {

/// A cube over a wall whose surface it touches at z = -20 mm; `half_m`: half the cube's edge.
std::vector<std::byte> scene_bytes(double half_m = 0.01) {
  const Solid wall = box_solid("wall", {-0.1, -0.1, -0.08}, {0.1, 0.1, -0.03});
  return scene_of(centred_box("cube", half_m, half_m, half_m), {&wall, 1}, 800, 1e-4);
}

/// Presses 3 mm into the wall every second; the deadman switch is released for 0.2 s of every two.
HandAction pressing_hand(double t_s) {
  HandAction action;
  action.target.x0_w = Vector(0.004 * std::sin(1.3 * t_s), 0.003 * std::sin(2.1 * t_s),
                              -0.0115 * (1 - std::cos(6.283185307179586 * t_s)));
  action.switches = std::fmod(t_s, 2.0) < 0.2 ? 0u : 1u;
  return action;
}

StackSettings stack_settings(bool report_clocked) {
  StackSettings settings = reference_stack(StackCarrier::kUsb);
  settings.report_clocked = report_clocked;
  settings.model.hand = *hand_named("light");
  return settings;
}

DeviceFaultEvent fault(DeviceFaultKind kind, std::uint64_t report, unsigned count = 1,
                       double amount = 0, bool out = false) {
  return {kind, report, count, amount, out};
}

std::vector<DeviceFaultEvent> hard_day() {
  using K = DeviceFaultKind;
  return {fault(K::kLost, 700, 3),           fault(K::kCorrupt, 900, 7, 2),
          fault(K::kLate, 1200, 1, 6),       fault(K::kDoubled, 1500, 4),
          fault(K::kReordered, 1700, 2),     fault(K::kShort, 1900, 2, 5),
          fault(K::kStall, 2600, 3),         fault(K::kStall, 2900, 2, 0, true),
          fault(K::kBusError, 3100, 2),      fault(K::kBusError, 3300, 4, 0, true),
          fault(K::kSubmitRefused, 3500, 2), fault(K::kSubmitRefused, 3700, 5, 0, true),
          fault(K::kBabble, 3900),           fault(K::kFrozen, 4600, 14),
          fault(K::kLost, 5100, 40),         fault(K::kUnplug, 6500),
          fault(K::kReplug, 6700, 1, 1),     fault(K::kEmergencyStop, 8600, 50),
          fault(K::kEncoderJump, 10700),     fault(K::kUnplugAtResubmit, 12500),
          fault(K::kReplug, 12600),          fault(K::kDeaf, 14700, 60),
          fault(K::kUnplug, 16500, 1),       fault(K::kReplug, 16503, 1, 0)};
}

struct Recorded {
  Bytes file;
  hal::RecorderEnd end;
  std::uint64_t ticks = 0, sends = 0;
  bool armed = false, pushed = false;
};

/// `seconds` of a hard day, recorded while it runs.
Recorded record_stack(const std::string& path, double seconds, bool report_clocked) {
  CoreSession session(scene_bytes(), "wall");
  DeviceStack stack(session, stack_settings(report_clocked), pressing_hand);
  hal::BusRecorder recorder(path, stack.bus_session(), hal::RecorderDrain::kCaller);
  stack.record(&recorder, &hal::BusRecorder::watch, &recorder);
  for (const DeviceFaultEvent& event : hard_day()) stack.bus().add(event);
  Recorded result;
  const auto periods = static_cast<std::uint64_t>(std::llround(seconds / stack.period_s()));
  for (std::uint64_t k = 0; k < periods; ++k) {
    if (k == 4300) stack.stop_link();
    if (k == 5600) stack.suspend();
    if (k == 7600) stack.emergency_stop();
    if (k == 9500) stack.bus().with_model([](auto& model) { model.power_up(); });
    if (k == 10500) stack.restart_servo();
    if (k == 18500) stack.servo_lost();
    stack.stall_servo(k > 13500 && k < 13512);
    const StackTick tick = stack.step();
    result.ticks += tick.servo_ran && !(k > 13500 && k < 13512) ? 1 : 0;
    result.sends = tick.sends;
    result.armed = result.armed || tick.servo.arming == ArmingState::kArmed;
    result.pushed = result.pushed || tick.acting.force_w.norm() > 0.5;
    REQUIRE(recorder.drain());
  }
  stack.record(nullptr, nullptr, nullptr);
  result.end = recorder.finish();
  result.file = read_recording(path);
  return result;
}

PlayResult play(std::span<const std::uint8_t> file, const PlayWatch& watch = {}) {
  CoreSession session(scene_bytes(), "wall");
  return play_session(session, file, "session.hrec", watch);
}

std::string refusal(std::span<const std::uint8_t> file) {
  try {
    static_cast<void>(play(file));
  } catch (const tools::InputError& error) {
    return error.what();
  }
  return "";
}

/// Until the device's period `until`; a device that stands still for 30 s fails the test.
void pass(const ReferenceUsb& bus, std::uint64_t until) {
  for (int k = 0; k < 3000 && bus.periods() < until; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  REQUIRE(bus.periods() >= until);
}

std::uint8_t kind_number(hal::LinkEventKind kind) { return static_cast<std::uint8_t>(kind); }

constexpr std::size_t kFrame = test::kRecordHead, kEventHead = 20;

}  // namespace

TEST_SUITE("host_sim.bus_record") {
  TEST_CASE("20 s with every fault: each tick and each send play back to the same bits") {
    const test::ScratchFolder folder("bus_record");
    for (const bool report_clocked : {false, true}) {
      CAPTURE(report_clocked);
      const Recorded recorded = record_stack(folder.file("day.hrec"), 20, report_clocked);
      REQUIRE(recorded.end.playable());
      CHECK(recorded.armed);
      CHECK(recorded.pushed);
      CHECK(!std::filesystem::exists(folder.file("day.hrec.part")));
      CoreSession own(scene_bytes(), "wall");
      std::optional<CoreTape> tape;
      const PlayResult played =
          play(recorded.file, [&](const ServoParameters& parameters, const ServoInput& input,
                                  const ServoResult& result) {
            if (!tape) tape.emplace(own.view(), parameters);
            (void)tape->take(input, result);
          });
      INFO(played.text);
      CHECK(!played.diverged);
      CHECK(played.complete);
      // What a page gets of it gives every state hash of the core again.
      REQUIRE(tape.has_value());
      CHECK(tape->unmet() == 0);
      CHECK(tape->ticks().size() > 15000);
      std::size_t resets = 0, unequal = 0;
      for (const haptic::tools::RecordedTick& tick : tape->ticks()) {
        resets += (tick.marks & haptic::tools::kMarkReset) != 0 ? 1u : 0u;
        unequal += test::hash_after(own.core(), tick) == tick.state_hash ? 0u : 1u;
      }
      CHECK(unequal == 0);
      CHECK(resets >= 4);  // at each connection
      CHECK(played.ticks == recorded.ticks);
      CHECK(played.sends == recorded.sends);
      CHECK(played.connects == 4);
      CHECK(played.ticks_beyond == 0);
      CHECK(played.duration_s == doctest::Approx(20).epsilon(0.01));
    }
  }

  TEST_CASE("a changed byte is found where it is") {
    const test::ScratchFolder folder("bus_record_byte");
    const Bytes file = record_stack(folder.file("s.hrec"), 0.6, false).file;
    const hal::BusRecord report = record_of(file, kind_number(hal::LinkEventKind::kReport), 399);
    const std::uint64_t sequence = hal::event_of(report).number;
    const std::size_t bytes_at = static_cast<std::size_t>(report.offset) + kFrame + kEventHead;
    const std::size_t count = report.payload.size() - kEventHead;
    for (std::size_t k = 0; k < count; k += 7) {
      CAPTURE(k);
      Bytes changed = file;
      changed[bytes_at + k] ^= 0x10;
      const std::string text = refusal(changed);
      CHECK(text.find("record " + std::to_string(report.number) + " at byte " +
                      std::to_string(report.offset)) != std::string::npos);
      // The record's check sum recomputed: the driver refuses the report.
      put_check(changed, report.offset, kFrame + report.payload.size());
      const PlayResult refused = play(changed);
      CHECK(refused.diverged);
      CHECK(refused.record == report.number);
      CHECK(refused.offset == report.offset);
      CHECK(refused.tick > 0);
    }
    // The report's own check sum recomputed too: it is the position that is another, by a
    // micrometre.
    Bytes moved = file;
    moved[bytes_at + 16] ^= 0x01;
    put_check(moved, bytes_at, count - 4);
    put_check(moved, report.offset, kFrame + report.payload.size());
    const PlayResult other = play(moved);
    CHECK(other.diverged);
    CHECK(other.text.find("pose, twist or switches") != std::string::npos);
    CHECK(other.text.find("record " + std::to_string(report.number)) != std::string::npos);
    CHECK(other.text.find("number " + std::to_string(sequence)) != std::string::npos);
    CHECK(other.tick > 0);
  }

  TEST_CASE("a send or a command of other bytes is found") {
    const test::ScratchFolder folder("bus_record_send");
    const Bytes file = record_stack(folder.file("s.hrec"), 0.6, true).file;
    const hal::BusRecord send = record_of(file, kind_number(hal::LinkEventKind::kSend), 300);
    Bytes changed = file;
    changed[static_cast<std::size_t>(send.offset) + kFrame + kEventHead + 14] ^= 0x01;
    put_check(changed, send.offset, kFrame + send.payload.size());
    const PlayResult played = play(changed);
    CHECK(played.diverged);
    CHECK(played.record == send.number);
    CHECK(played.sends == 300);
    CHECK(played.text.find("bytes expected") != std::string::npos);
  }

  TEST_CASE("a file that ends early is played to its last whole record") {
    const test::ScratchFolder folder("bus_record_cut");
    const Bytes file = record_stack(folder.file("s.hrec"), 0.6, false).file;
    const PlayResult whole = play(file);
    REQUIRE(!whole.diverged);
    std::uint64_t last = 0;
    for (const double share : {0.1, 0.35, 0.62, 0.9}) {
      CAPTURE(share);
      const auto size = static_cast<std::size_t>(share * static_cast<double>(file.size()));
      const PlayResult part = play(std::span(file).first(size));
      INFO(part.text);
      CHECK(!part.diverged);
      CHECK(!part.complete);
      CHECK(!part.cut.empty());
      CHECK(part.ticks + part.ticks_beyond >= last);
      CHECK(part.ticks <= whole.ticks);
      last = part.ticks;
    }
    CHECK(last > whole.ticks * 8 / 10);
    CHECK(refusal(std::span(file).first(10)).find("not a recording") != std::string::npos);
    CHECK(refusal(std::span(file).first(100)).find("ends within the header") != std::string::npos);
  }

  TEST_CASE("another scene is refused with the fix") {
    const test::ScratchFolder folder("bus_record_scene");
    const Bytes file = record_stack(folder.file("s.hrec"), 0.1, false).file;
    CoreSession other(scene_bytes(0.011), "other");
    bool refused = false;
    try {
      static_cast<void>(play_session(other, file, "s.hrec"));
    } catch (const tools::InputError& error) {
      refused = std::string(error.what()).find("name the scene file") != std::string::npos;
    }
    CHECK(refused);
  }

  TEST_CASE("what a ring dropped is counted, and the file is not played") {
    const test::ScratchFolder folder("bus_record_drop");
    hal::BusRecorder recorder(folder.file("s.hrec"), hal::BusSession{},
                              hal::RecorderDrain::kCaller);
    for (int k = 0; k < 5000; ++k) hal::BusRecorder::watch(&recorder, ServoInput{}, ServoResult{});
    const hal::RecorderEnd end = recorder.finish();
    CHECK(end.counts.dropped_ticks == 5000 - 4096);
    CHECK(!end.playable());
    hal::BusRecorder nowhere(folder.file("no/such/folder.hrec"), hal::BusSession{},
                             hal::RecorderDrain::kThread);
    CHECK(nowhere.finish().status == hal::HalStatus::kOsRefused);
  }

  TEST_CASE("run --record, then play: equal; changed, cut, another scene: refused") {
    const test::ScratchFolder folder("bus_record_program");
    const auto write = [&](const std::string& name, const auto& bytes) {
      std::ofstream(folder.file(name), std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
      return "'" + folder.file(name) + "'";
    };
    const std::string scene = write("wall.rtscene", scene_bytes());
    const std::string faults = write("faults.toml", std::string("format = 1\n"
                                                                "[[fault]]\nkind = \"corrupt\"\n"
                                                                "report = 300\ncount = 3\n"
                                                                "[[fault]]\nkind = \"unplug\"\n"
                                                                "report = 600\n"
                                                                "[[fault]]\nkind = \"replug\"\n"
                                                                "report = 700\n"));
    const std::string recording = folder.file("run.hrec");
    const test::ProgramResult run = test::run_program(
        HAPTIC_HOST_SIM, "run --seconds 1.5 --carrier usb --scene " + scene + " --faults " +
                             faults + " --record '" + recording + "'");
    CAPTURE(run.err);
    REQUIRE(run.exit_code == 0);
    const auto played = [&](const std::string& file, const std::string& over) {
      return test::run_program(HAPTIC_HOST_SIM, "play " + file + " --scene " + over);
    };
    // The scene names no device: recorded with what the default one holds, which play finds, too.
    CHECK(run.err.find("is more than the simulated device holds") != std::string::npos);
    CHECK(played("'" + recording + "' --delay 2", scene).exit_code == 3);
    const test::ProgramResult equal = played("'" + recording + "'", scene);
    CAPTURE(equal.err);
    CHECK(equal.exit_code == 0);
    CHECK(equal.out.find("every tick and every send equal") != std::string::npos);
    CHECK(equal.out.find("2 connections") != std::string::npos);
    const Bytes whole = read_recording(recording);
    Bytes bytes = whole;
    bytes[bytes.size() / 2] ^= 1;
    CHECK(played(write("damaged.hrec", bytes), scene).exit_code == 3);
    bytes = whole;
    bytes.resize(bytes.size() / 2);
    const test::ProgramResult cut = played(write("cut.hrec", bytes), scene);
    CHECK(cut.exit_code == 3);
    CHECK(cut.err.find("equal as far as it goes") != std::string::npos);
    CHECK(played("'" + recording + "'", write("other.rtscene", scene_bytes(0.011))).exit_code == 3);
    const hal::BusRecord send = record_of(whole, kind_number(hal::LinkEventKind::kSend), 200);
    bytes = whole;
    bytes[static_cast<std::size_t>(send.offset) + kFrame + kEventHead + 14] ^= 0x01;
    put_check(bytes, send.offset, kFrame + send.payload.size());
    const test::ProgramResult other = played(write("other.hrec", bytes), scene);
    CHECK(other.exit_code == 1);
    CHECK(other.out.find("DIVERGED at tick") != std::string::npos);
  }

  TEST_CASE("threads in real time: what each tick saw is played back") {
    const test::ScratchFolder folder("bus_record_threads");
    for (const bool report_clocked : {false, true}) {
      CAPTURE(report_clocked);
      CoreSession session(scene_bytes(), "wall");
      const StackSettings settings = stack_settings(report_clocked);
      ReferenceModel model(settings.model, pressing_hand);
      ReferenceUsb bus(model, DevicePace::kRealTime);
      hal::ReferenceDriver driver;
      hal::MailboxMemory mailbox;
      hal::BusSession header;
      header.scene_hash = session.view().header().content_hash;
      header.driver = driver.profile().name;
      header.report_clocked = report_clocked;
      header.servo.limits = settings.limits;
      header.link.limits = settings.limits;
      header.link.answer_wait_ns = report_clocked ? 500'000 : 0;
      header.link.retry_ns = 20'000'000;
      header.link.wake_servo = report_clocked;
      header.link.address.wrapped_fd = bus.plug();
      hal::BusRecorder recorder(folder.file("t.hrec"), header, hal::RecorderDrain::kThread);
      hal::LinkCounters counters;
      {
        hal::UsbLink link(driver, mailbox, header.link);
        link.tape(&recorder);
        bus.on_replug([&link](int descriptor) { link.set_wrapped_fd(descriptor); });
        using K = DeviceFaultKind;
        for (const DeviceFaultEvent& event :
             {fault(K::kLost, 400, 2), fault(K::kCorrupt, 500, 6, 1), fault(K::kStall, 600, 2),
              fault(K::kBusError, 650, 3, 0, true), fault(K::kUnplug, 800),
              fault(K::kReplug, 900, 1, 1), fault(K::kEmergencyStop, 1500, 20)})
          bus.add(event);
        ServoTick tick(session.core(), header.servo, session.view().header().capacity, nullptr);
        hal::ServoLoopSettings loop_settings;
        loop_settings.report_clocked = report_clocked;
        hal::ServoLoop loop(tick, mailbox, loop_settings);
        loop.watch(&hal::BusRecorder::watch, &recorder);
        hal::UsbThread usb(link, {});
        REQUIRE(usb.start().create_error == 0);
        std::atomic<bool> stop{false};
        std::thread servo([&] { (void)loop.run(stop); });
        bus.start();
        pass(bus, 2000);
        loop.emergency_stop();
        pass(bus, 2100);
        usb.stop();
        counters = link.counters();
        stop = true;
        servo.join();
        bus.stop();
      }
      const hal::RecorderEnd end = recorder.finish();
      // A machine that stands still for a second drops records: then there is nothing to compare.
      REQUIRE(end.status == hal::HalStatus::kOk);
      if (!end.playable()) {
        MESSAGE("records were dropped, nothing compared");
        continue;
      }
      const PlayResult played = play(read_recording(folder.file("t.hrec")));
      INFO(played.text);
      CHECK(!played.diverged);
      // Between the two the link was being closed, and went on for some turns.
      CHECK(played.connects == counters.connects);
      CHECK(played.reports > 0);
      CHECK(played.reports <= counters.reports);
      CHECK(played.sends > 0);
      CHECK(played.sends <= counters.sent);
      CHECK(played.ticks > 0);
    }
  }
}
