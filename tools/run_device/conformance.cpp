// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/conformance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "hal/drivers/reference_codec.hpp"
#include "rt_core/exchange/device_exchange.hpp"
#include "tools/run_device/conform_host.hpp"

namespace haptic::tools {
namespace {

constexpr int kTries = 5;
constexpr std::size_t kWrenchBegin = 12, kWrenchEnd = 36;  // bytes of a command

using Bytes = ConformHost::Bytes;

/// Outcome of a check that was made: empty `defect` is a pass.
struct Finding {
  std::string defect, figures;
};

std::string ms_of(std::uint32_t time_us) {
  char text[32];
  (void)std::snprintf(text, sizeof text, "%.3g ms", 1e-3 * time_us);
  return text;
}

/// The check sum put right after a change of the bytes before it.
void seal(Bytes& bytes) {
  const std::uint32_t check = hal::crc32(std::span(bytes).first(bytes.size() - 4));
  for (std::size_t k = 0; k < 4; ++k)
    bytes[bytes.size() - 4 + k] = static_cast<std::uint8_t>(check >> (8 * k) & 0xffu);
}

class Checks {
 public:
  Checks(ConformCarrier& carrier, const ConformSettings& settings)
      : carrier_(carrier), settings_(settings), host_(carrier) {}

  std::vector<ConformCheck> run() {
    descriptors();
    made(2, "capability block", block());
    if (checks_.back().result != ConformResult::kPassed)
      return all_not_done("no host goes on without a valid block");
    made(3, "reports", reports());
    by_hand(
        4, "pose and velocity",
        "let go of the handle: position within two encoder steps, velocity 0; then move it along "
        "x, y, z and turn it about each: signs as in section 2");
    if (!host_.trouble().empty()) return all_not_done(host_.trouble());
    checks_.push_back(before_the_first_off());
    unready_ = host_.block().driven_dof != 0 ? host_.bring_up() : "";
    ready_made(6, "damaged commands", [&] { return damaged_commands(); });
    ready_made(7, "sequence", [&] { return sequence(); });
    ready_made(8, "length of commands", [&] { return lengths(); });
    driven_made(9, "watchdog", [&] { return watchdog(); });
    by_hand(10, "emergency stop",
            "press it in the middle of a push: supply open, bits set; released, no force until a "
            "command with bit 0 clear");
    by_hand(
        11, "limits",
        "ask for twice the largest force in ten directions: the force measured has the direction "
        "asked for and the stated norm");
    by_hand(
        12, "wrench",
        "zero with the drives on: the handle stays; 1 N along each axis, measured on the hand: in "
        "the direction of section 2");
    if (carrier_.tells_of_its_end()) {
      driven_made(13, "host lost", [&] { return host_lost(); });
    } else {
      by_hand(13, "cable pulled",
              "pull it in the middle of a push: drives off within the watchdog's time; plugged in "
              "again, no force before section 9");
    }
    (void)host_.accept(false);
    carrier_.disconnect();
    return std::move(checks_);
  }

 private:
  void add(int number, const char* name, ConformResult result, std::string found) {
    checks_.push_back({number, name, result, std::move(found)});
  }
  void by_hand(int number, const char* name, const char* how) {
    add(number, name, ConformResult::kByHand, how);
  }
  void made(int number, const char* name, const Finding& f) {
    const bool passed = f.defect.empty();
    add(number, name, passed ? ConformResult::kPassed : ConformResult::kFailed,
        passed ? f.figures : f.defect);
  }
  /// On a device that can be used as it stands.
  template <typename Check>
  void ready_made(int number, const char* name, Check check) {
    if (unready_.empty()) return made(number, name, check());
    add(number, name, ConformResult::kNotDone,
        unready_ + "; put that right and run this again (sections 8, 9)");
  }
  template <typename Check>
  void driven_made(int number, const char* name, Check check) {
    if (host_.block().driven_dof == 0)
      return add(number, name, ConformResult::kNotHere, "no motors");
    ready_made(number, name, check);
  }
  std::vector<ConformCheck> all_not_done(const std::string& why) {
    static constexpr const char* kNames[] = {
        "descriptors", "capability block", "reports",  "pose and velocity",
        "power-up",    "damaged commands", "sequence", "length of commands",
        "watchdog",    "emergency stop",   "limits",   "wrench",
        "host lost"};
    for (int k = static_cast<int>(checks_.size()); k < 13; ++k)
      add(k + 1, kNames[k], ConformResult::kNotDone, why);
    carrier_.disconnect();
    return std::move(checks_);
  }

  // 1
  void descriptors() {
    const auto ends = carrier_.endpoints();
    if (!ends) return add(1, "descriptors", ConformResult::kNotHere, "no USB");
    constexpr std::int64_t kMicroframe_ns = 125'000, kFrame_ns = 1'000'000;
    const bool high = ends->in.packet_bytes == hal::kReferenceReportBytes;
    Finding f;
    f.figures = high ? "high speed, 96 bytes in" : "full speed, packets of 64 bytes in";
    if (ends->in.address != 0x81 || ends->out.address != 0x01)
      f.defect = "the endpoints are not 0x81 and 0x01";
    else if (ends->in.bulk || ends->out.bulk)
      f.defect = "the endpoints are bulk, not interrupt";
    else if (!high && ends->in.packet_bytes != 64)
      f.defect = "endpoint 0x81 has packets of " + std::to_string(ends->in.packet_bytes) +
                 " bytes: 96 at high speed, 64 at full speed";
    else if (ends->out.packet_bytes != hal::kReferenceCommandBytes)
      f.defect = "endpoint 0x01 has packets of " + std::to_string(ends->out.packet_bytes) +
                 " bytes, not 56";
    else if (ends->in.interval_ns != (high ? kMicroframe_ns : kFrame_ns))
      f.defect = "bInterval of endpoint 0x81 is not 1";
    made(1, "descriptors", f);
  }

  // 2
  Finding block() {
    Finding f;
    f.defect = host_.ask_block();
    if (!f.defect.empty()) return f;
    std::array<std::uint8_t, 64> room{};
    std::size_t moved = 0;
    constexpr std::uint16_t kNoVersion = 0x00ff;
    const hal::ControlRequest others[] = {
        {hal::kReferenceBlockRequestType, 0x7f, hal::kReferenceVersion, 0},
        {hal::kReferenceBlockRequestType, hal::kReferenceBlockRequest, kNoVersion, 0}};
    for (const hal::ControlRequest& other : others) {
      const hal::HalStatus status = carrier_.control(other, room, moved);
      if (status == hal::HalStatus::kTransferFailed) continue;
      char text[96];
      (void)std::snprintf(text, sizeof text, "request 0x%02x with value 0x%04x does not stall: %s",
                          unsigned{other.request}, unsigned{other.value}, hal::to_text(status));
      f.defect = text;
      return f;
    }
    f.defect = host_.ask_old_block();
    if (!f.defect.empty()) return f;
    const std::string again = host_.ask_block();
    if (!again.empty()) f.defect = "after a stall: " + again;
    const hal::ReferenceLongBlock& b = host_.long_block();
    f.figures = (host_.speaks_1_1() ? "version 1.1, " : "version 1.0, ") +
                std::to_string(b.first.report_period_us) + " us, watchdog " +
                std::to_string(b.first.watchdog_ms) + " ms";
    if (const std::string_view name = hal::text_of(b.name); !name.empty())
      f.figures += ", " + std::string(name);
    if (const std::string_view serial = hal::text_of(b.serial); !serial.empty())
      f.figures += ", serial " + std::string(serial);
    if (b.latency_us != 0) f.figures += ", latency " + ms_of(b.latency_us);
    return f;
  }

  // 3
  Finding reports() {
    Finding f;
    if (settings_.say)
      settings_.say("reading " + std::to_string(settings_.reports) + " reports, one every " +
                    ms_of(host_.period_us()));
    if (!host_.next()) return {host_.trouble(), ""};
    const std::int64_t period = host_.period_us();
    const bool was_short = host_.is_short();
    std::uint64_t not_fetched = 0, left_out = 0, late = 0;
    std::int64_t time_passed = 0, steps_passed = 0;
    for (std::uint32_t k = 1; k < settings_.reports; ++k) {
      const std::uint32_t last = host_.report().sequence;
      if (!host_.next()) return {"report " + std::to_string(k) + ": " + host_.trouble(), ""};
      if (host_.is_short() != was_short) return {"both forms of report are sent", ""};
      const std::int64_t step = std::int64_t{host_.report().sequence - last};
      if (!hal::is_newer(host_.report().sequence, last))
        return {"report " + std::to_string(k) + ": its sequence is not newer than the one before",
                ""};
      const std::int64_t time = std::int64_t{host_.time_us() - host_.time_before_us()};
      time_passed += time;
      steps_passed += step;
      not_fetched += static_cast<std::uint64_t>(step - 1);
      left_out += 2 * (step * period - time) > period ? 1u : 0u;
      late += 2 * (time - step * period) > period ? 1u : 0u;
    }
    const std::uint64_t most = settings_.reports / 1000;
    if (left_out > most)
      f.defect = "between two reports the sequence goes on faster than the device's time, " +
                 std::to_string(left_out) +
                 " times: a number is left out, or the time stands still";
    else if (late > most)
      f.defect = "between two reports the device's time goes on by more than its period, " +
                 std::to_string(late) + " times";
    else if (std::abs(time_passed - steps_passed * period) > steps_passed * period / 50)
      f.defect = "the device's time goes on by " + std::to_string(time_passed / steps_passed) +
                 " us a report, and its period is " + std::to_string(period) + " us";
    else if (not_fetched > settings_.reports - settings_.reports / 10)
      f.defect = std::to_string(not_fetched) +
                 " reports did not come: the device offers fewer than it counts, or this machine "
                 "is too slow";
    f.figures = std::to_string(settings_.reports) + " right" +
                (not_fetched > 0 ? ", " + std::to_string(not_fetched) +
                                       " more that this machine did not fetch in time"
                                 : "");
    return f;
  }

  // 5. Fresh: nothing was accepted since power-up.
  ConformCheck before_the_first_off() {
    const bool fresh = host_.report().accepted_sequence == 0;
    const bool calibrated = host_.says(hal::kReferenceCalibrated);
    ConformCheck check{5, "power-up", ConformResult::kNotHere, "no motors"};
    if (host_.block().driven_dof == 0) return check;
    check.result = ConformResult::kByHand;
    check.found = "switch the device off and on and run this again: it has accepted commands";
    if (!fresh && calibrated) return check;
    check.found.clear();
    if (fresh) check.found = stays_off("the drives go on before a command with bit 0 clear");
    if (check.found.empty() && !calibrated && host_.accept(false))
      check.found = stays_off("the drives go on before the device is calibrated");
    check.result = check.found.empty() ? ConformResult::kPassed : ConformResult::kFailed;
    if (check.found.empty())
      check.found = calibrated ? "no drives before a command with bit 0 clear"
                               : "no drives before it is calibrated";
    return check;
  }

  /// After a command with bit 0 set, for five reports.
  std::string stays_off(const char* defect) {
    const auto because = [this](const char* text) {
      return host_.trouble().empty() ? std::string(text) : host_.trouble();
    };
    if (!host_.accept(true)) return because("a command with bit 0 set is not accepted");
    for (int k = 0; k < 5; ++k) {
      if (host_.says(hal::kReferenceDrivesOn)) return defect;
      if (!host_.next()) return host_.trouble();
    }
    return "";
  }

  // 6
  Finding damaged_commands() {
    unsigned count = 0;
    const auto refused = [&](std::size_t bit, bool sealed) -> std::string {
      host_.feed();
      // A device that takes it in spite of the damage gets no force by it.
      const bool is_wrench = bit >= 8 * kWrenchBegin && bit < 8 * kWrenchEnd;
      Bytes bytes = ConformHost::command(host_.report().accepted_sequence + 1, !is_wrench);
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
      if (sealed) seal(bytes);
      const std::string defect = host_.refuse(bytes);
      ++count;
      if (defect.empty()) return "";
      return "a command with bit " + std::to_string(bit % 8) + " of byte " +
             std::to_string(bit / 8) + " flipped" + (sealed ? ", its check sum put right, " : " ") +
             defect;
    };
    for (std::size_t bit = 0; bit < 8 * hal::kReferenceCommandBytes; ++bit) {
      if (std::string defect = refused(bit, false); !defect.empty()) return {defect, ""};
    }
    // Magic, version, the bits without a meaning and the reserved bytes.
    for (std::size_t bit = 0; bit < 8 * 52; ++bit) {
      const bool meaningless = bit < 24 || (bit > 24 && bit < 32) || bit >= 8 * 36;
      if (!meaningless) continue;
      if (std::string defect = refused(bit, true); !defect.empty()) return {defect, ""};
    }
    return {"", std::to_string(count) + " refused and counted"};
  }

  // 7
  Finding sequence() {
    const auto goes = [&](std::uint32_t next) {
      const ConformHost::Outcome o = host_.exchange(ConformHost::command(next, false), next);
      return o.accepted && o.counted < o.sent;
    };
    if (!host_.accept(false)) return {"a command is not accepted", ""};
    std::uint32_t last = host_.report().accepted_sequence;
    std::string defect = host_.refuse(ConformHost::command(last, false));
    if (!defect.empty()) return {"a command sent twice " + defect, ""};
    constexpr std::uint32_t kFar = 0x7fff'ffff, kBeforeWrap = 0xffff'fffe;
    for (int k = 0; k < 3 && kBeforeWrap - last > kFar; ++k) {
      if (!goes(last + kFar)) return {"a sequence 0x7fffffff ahead is not accepted", ""};
      last += kFar;
    }
    for (const std::uint32_t next : {kBeforeWrap, 0xffff'ffffu, 0u}) {
      if (next == host_.report().accepted_sequence) continue;
      if (!goes(next)) return {"the sequence is not accepted where it wraps", ""};
    }
    for (const std::uint32_t old : {0xffff'ffffu, 0x8000'0000u}) {
      defect = host_.refuse(ConformHost::command(old, false));
      if (!defect.empty()) return {"a sequence behind the last one accepted " + defect, ""};
    }
    return {"", "wraps, and takes nothing twice"};
  }

  // 8
  Finding lengths() {
    for (const std::size_t length : {std::size_t{55}, std::size_t{57}}) {
      Bytes bytes = ConformHost::command(host_.report().accepted_sequence + 1, false);
      bytes.resize(length);
      const std::string defect = host_.refuse(bytes);
      if (!defect.empty())
        return {"a command of " + std::to_string(length) + " bytes " + defect, ""};
    }
    return {"", "55 and 57 bytes refused"};
  }

  // 9
  Finding watchdog() {
    std::string figures;
    for (const bool noise : {false, true}) {
      const std::string with = noise ? "while commands are rejected: " : "";
      if (const std::string trouble = host_.bring_up(); !trouble.empty())
        return {with + trouble, ""};
      std::uint32_t after_us = 0;
      if (const std::string defect = cut(noise, after_us); !defect.empty())
        return {with + defect, ""};
      figures += (noise ? ", " : "off after ") + ms_of(after_us);
      for (int k = 0; k < 3; ++k) {
        if (!host_.accept(true))
          return {"after a cut, a command with bit 0 set is not accepted", ""};
        if (host_.says(hal::kReferenceDrivesOn) || !host_.says(hal::kReferenceWatchdogCut))
          return {"a command with bit 0 set lifts the cut", ""};
      }
    }
    const std::string back = begin_at_zero();
    if (!back.empty()) return {"after a cut: " + back, ""};
    return {"", figures + " of " + ms_of(host_.watchdog_us()) +
                    (host_.speaks_1_1() ? ", and they begin at zero" : "")};
  }

  /// Drives on after a cut. A device of 1.1 says that its force grows from zero, without a push.
  std::string begin_at_zero() {
    for (int k = 0; k < kTries; ++k) {
      if (std::string back = host_.bring_up(); !back.empty()) return back;
      if (!host_.speaks_1_1()) return "";
      // Where reports were missed in between it may be over, and the same where it is that short.
      const std::uint32_t seen_us = host_.time_us() - host_.time_before_us();
      if (host_.slew_us() <= host_.period_us() + host_.period_us() / 4) return "";
      if (seen_us + host_.period_us() > host_.slew_us()) continue;
      if (!host_.says(hal::kReferenceSlewing))
        return "the drives do not begin at zero: status bit 5 is clear in the first report with "
               "them on, and all of the force takes " +
               ms_of(host_.slew_us());
      return ends_slewing();
    }
    return "this machine misses too many reports to see how the drives begin";
  }

  std::string ends_slewing() {
    const std::uint32_t began_us = host_.time_us();
    const std::uint32_t most_us = host_.slew_us() + 4 * host_.period_us();
    while (host_.says(hal::kReferenceSlewing)) {
      if (host_.time_us() - began_us > most_us)
        return "status bit 5 is set " + ms_of(host_.time_us() - began_us) +
               " after the drives went on, and all of the force takes " + ms_of(host_.slew_us());
      host_.feed();
      if (!host_.next()) return host_.trouble();
      if (!host_.says(hal::kReferenceDrivesOn)) return "the drives go off while they are fed";
    }
    return "";
  }

  /// From drives on until they are off without a command. Times are the device's own: between which
  /// reports the last command came in, and at which the drives are off.
  std::string cut(bool noise, std::uint32_t& after_us) {
    const std::uint32_t limit = host_.watchdog_us(), period = host_.period_us();
    const std::uint32_t fed = host_.time_us(), fed_at_least = host_.time_before_us();
    const Bytes replay = ConformHost::command(host_.report().accepted_sequence, true);
    // The device's time may stand still.
    unsigned reports = 0;
    const unsigned most = 10 + 4 * (limit / std::max(period, 1u));
    while (host_.says(hal::kReferenceDrivesOn)) {
      if (++reports > most)
        return "the drives are on " + std::to_string(reports) + " reports after the last command";
      if (host_.time_us() - fed > limit + period + period / 4)
        return "the drives are on " + ms_of(host_.time_us() - fed) +
               " after the last command, and the watchdog is " + ms_of(limit);
      if (noise && !carrier_.send(replay)) return "the device is gone";
      if (!host_.next()) return host_.trouble();
    }
    after_us = host_.time_us() - fed;
    if (host_.time_us() - fed_at_least + period < limit)
      return "the drives are off " + ms_of(after_us) + " after the last command, before the " +
             ms_of(limit) + " of the watchdog are over";
    if (!host_.says(hal::kReferenceWatchdogCut) ||
        (host_.report().faults & kDeviceWatchdogCut) == 0)
      return "a cut is not reported by status bit 3 and fault bit 1";
    return "";
  }

  // 13
  Finding host_lost() {
    if (const std::string trouble = host_.bring_up(); !trouble.empty()) return {trouble, ""};
    carrier_.disconnect();
    carrier_.pass(std::int64_t{1000} * (host_.watchdog_us() + 2 * host_.period_us()));
    const std::string absent = carrier_.connect();
    if (!absent.empty()) return {"it cannot be had again: " + absent, ""};
    if (const std::string block = host_.ask_block(); !block.empty())
      return {"for the next host: " + block, ""};
    if (!host_.next()) return {host_.trouble(), ""};
    if (host_.says(hal::kReferenceDrivesOn))
      return {"the drives are on after the host has gone for longer than the watchdog", ""};
    if (const std::string back = host_.bring_up(); !back.empty())
      return {"for the next host: " + back, ""};
    return {"", "drives off, and on again for the next host"};
  }

  ConformCarrier& carrier_;
  const ConformSettings& settings_;
  ConformHost host_;
  std::vector<ConformCheck> checks_;
  std::string unready_;  ///< why commands cannot be tried; empty: they can
};

}  // namespace

const char* to_text(ConformResult result) noexcept {
  switch (result) {
    case ConformResult::kPassed:
      return "passed";
    case ConformResult::kFailed:
      return "FAILED";
    case ConformResult::kNotDone:
      return "not done";
    case ConformResult::kByHand:
      return "by hand";
    case ConformResult::kNotHere:
      return "-";
  }
  return "?";
}

std::vector<ConformCheck> check_conformance(ConformCarrier& carrier,
                                            const ConformSettings& settings) {
  return Checks(carrier, settings).run();
}

bool conforms(const std::vector<ConformCheck>& checks) noexcept {
  return std::ranges::none_of(checks, [](const ConformCheck& check) {
    return check.result == ConformResult::kFailed || check.result == ConformResult::kNotDone;
  });
}

}  // namespace haptic::tools
