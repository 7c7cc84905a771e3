// SPDX-License-Identifier: Apache-2.0
#include "tests/bridges/arms/dynamixel_emulator.hpp"

#include <algorithm>
#include <span>
#include <utility>

namespace haptic::test {
namespace {

/// Bit by bit, as the polynomial says.
unsigned crc_of(const std::vector<std::uint8_t>& bytes) {
  unsigned crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= unsigned{byte} << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1) ^ ((crc & 0x8000u) != 0 ? 0x8005u : 0u);
    crc &= 0xffffu;
  }
  return crc;
}

void append_crc(std::vector<std::uint8_t>& bytes) {
  const unsigned crc = crc_of(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xff));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
}

void set_length(std::vector<std::uint8_t>& bytes, std::size_t length) {
  bytes[5] = static_cast<std::uint8_t>(length & 0xff);
  bytes[6] = static_cast<std::uint8_t>(length >> 8);
}

std::size_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return bytes[at] + std::size_t{bytes[at + 1]} * 256;
}

}  // namespace

void DynamixelEmulator::serve(std::int64_t now_ns) {
  for (auto& [id, servo] : servos_) {
    const int set_to = static_cast<std::int8_t>(servo.table[98]);
    if (servo.table[64] == 1 && set_to > 0 && now_ns - servo.heard_ns > set_to * watchdog_unit_ns) {
      servo.table[98] = 0xff;
      set(servo, 102, 2, 0);
      ++servo.cuts;
    }
  }
  while (heard_.size() >= 10) {
    if (heard_[0] != 0xff || heard_[1] != 0xff || heard_[2] != 0xfd || heard_[3] != 0) {
      heard_.erase(heard_.begin());
      continue;
    }
    const std::size_t whole = 7 + word(heard_, 5);
    if (heard_.size() < whole) return;
    std::vector<std::uint8_t> packet(heard_.begin(), heard_.begin() + static_cast<long>(whole));
    heard_.erase(heard_.begin(), heard_.begin() + static_cast<long>(whole));
    const std::size_t crc = word(packet, whole - 2);
    packet.resize(whole - 2);
    if (crc_of(packet) != crc) continue;
    // ff ff fd fd was ff ff fd.
    for (std::size_t k = 11; k < packet.size(); ++k) {
      if (packet[k] == 0xfd && packet[k - 1] == 0xfd && packet[k - 2] == 0xff &&
          packet[k - 3] == 0xff) {
        packet.erase(packet.begin() + static_cast<long>(k));
      }
    }
    ++instructions;
    for (auto& [id, servo] : servos_) servo.heard_ns = now_ns;
    obey(packet, now_ns);
  }
}

void DynamixelEmulator::obey(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  const int id = packet[4], instruction = packet[7];
  const auto parameters = packet.subspan(8);
  if (instruction == 0x8a || instruction == 0x82) {
    const std::size_t address = word(parameters, 0), size = word(parameters, 2);
    const auto ids = parameters.subspan(4);
    if (instruction == 0x8a) return answer_together(address, size, ids);
    for (const int each : ids) {
      if (!servos_.contains(each) || servos_[each].silent) continue;
      const auto begin = servos_[each].table.begin() + static_cast<long>(address);
      answer(each, alert(servos_[each]), {begin, begin + static_cast<long>(size)});
    }
    return;
  }
  if (instruction == 0x83) return write_all(parameters, now_ns);
  if (!servos_.contains(id) || servos_[id].silent) return;
  Servo& servo = servos_[id];
  if (instruction == 0x01) {
    answer(id, alert(servo), {servo.table[0], servo.table[1], servo.table[6]});
  } else if (instruction == 0x02 && servo.table[68] >= 1) {
    const auto begin = servo.table.begin() + static_cast<long>(word(parameters, 0));
    answer(id, alert(servo), {begin, begin + static_cast<long>(word(parameters, 2))});
  } else if (instruction == 0x03) {
    const int error = write(servo, word(parameters, 0), parameters.subspan(2));
    if (servo.table[68] == 2) answer(id, error | alert(servo), {});
  } else if (instruction != 0x02) {
    answer(id, 2 | alert(servo), {});
  }
}

/// The error number; what is refused is not written.
int DynamixelEmulator::write(Servo& servo, std::size_t address,
                             std::span<const std::uint8_t> data) {
  constexpr int kRange = 4, kLimit = 6, kAccess = 7;
  if (address < 64 && servo.table[64] != 0) return kAccess;
  if (address == 102) {
    const int goal = static_cast<std::int16_t>(word(data, 0));
    if (servo.table[98] == 0xff) return ++rejected_goals, kRange;
    if (std::abs(goal) > get(servo, 38, 2)) return ++rejected_goals, kLimit;
  }
  if (address == 98 && data[0] > 127) return kRange;
  if (address >= 120 && address < 147) return kAccess;
  if (address == 64 && data[0] == 1 && (servo.table[70] & servo.table[63]) != 0) return kAccess;
  std::ranges::copy(data, servo.table.begin() + static_cast<long>(address));
  return 0;
}

void DynamixelEmulator::write_all(std::span<const std::uint8_t> parameters, std::int64_t now_ns) {
  const std::size_t address = word(parameters, 0), size = word(parameters, 2);
  for (std::size_t at = 4; at + size < parameters.size(); at += size + 1) {
    const int id = parameters[at];
    if (!servos_.contains(id) || servos_[id].silent) continue;
    static_cast<void>(write(servos_[id], address, parameters.subspan(at + 1, size)));
  }
  if (address != 102) return;
  Goals now{now_ns, {}};
  for (const auto& [id, servo] : servos_) now.current[id] = current(id);
  goals.push_back(std::move(now));
}

void DynamixelEmulator::answer(int id, int error, std::vector<std::uint8_t> data) {
  std::vector<std::uint8_t> bytes = {0xff,
                                     0xff,
                                     0xfd,
                                     0,
                                     static_cast<std::uint8_t>(id),
                                     0,
                                     0,
                                     0x55,
                                     static_cast<std::uint8_t>(error)};
  for (const std::uint8_t byte : data) {
    bytes.push_back(byte);
    const std::size_t n = bytes.size();
    if (byte == 0xfd && bytes[n - 2] == 0xff && bytes[n - 3] == 0xff) bytes.push_back(0xfd);
  }
  set_length(bytes, bytes.size() + 2 - 7);
  append_crc(bytes);
  send(std::move(bytes));
}

/// One packet, to which each servo adds its part once the one before has: behind one that is not
/// there nothing comes.
void DynamixelEmulator::answer_together(std::size_t address, std::size_t size,
                                        std::span<const std::uint8_t> ids) {
  if (address <= 132 && address + size > 132) {
    asked_ns.push_back(steady_ns());
    set(servos_[1], 132, 4, get(servos_[1], 132, 4) + counts_a_question);
  }
  std::vector<std::uint8_t> bytes = {0xff, 0xff, 0xfd, 0, 0xfe, 0, 0, 0x55};
  set_length(bytes, 1 + ids.size() * (size + 4));
  for (const int id : ids) {
    if (!servos_.contains(id) || servos_[id].silent) break;
    const Servo& servo = servos_[id];
    bytes.push_back(static_cast<std::uint8_t>(alert(servo)));
    bytes.push_back(static_cast<std::uint8_t>(id));
    bytes.insert(bytes.end(), servo.table.begin() + static_cast<long>(address),
                 servo.table.begin() + static_cast<long>(address + size));
    append_crc(bytes);
  }
  send(std::move(bytes));
}

void DynamixelEmulator::send(std::vector<std::uint8_t> bytes) {
  const int wait_ms = delay_ms + std::exchange(late_once_ms, 0);
  if (wait_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
  if (damage > 0) {
    --damage;
    bytes[bytes.size() / 2] ^= 0x10;
  }
  say(bytes);
}

}  // namespace haptic::test
