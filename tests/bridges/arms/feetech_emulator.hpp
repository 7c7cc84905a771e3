// SPDX-License-Identifier: Apache-2.0
#pragma once
/// STS servos on a bus, from the published protocol alone: it shares no code with the bridge, and
/// the official SDK reads and writes it (feetech_sdk_check.py).

#include <chrono>
#include <map>
#include <thread>
#include <utility>

#include "tests/bridges/arms/pty_bus.hpp"

namespace haptic::test {

class FeetechEmulator final : public PtyBus {
 public:
  struct Servo {
    std::array<std::uint8_t, 128> table{};
    bool silent = false;
    std::uint8_t error = 0;
  };
  /// STS3215 with ids 1 to `count`, torque off, in the middle.
  explicit FeetechEmulator(int count) {
    for (int id = 1; id <= count; ++id) {
      Servo& servo = servos_[id];
      servo.table[3] = 777 & 0xff;
      servo.table[4] = 777 >> 8;
      servo.table[5] = static_cast<std::uint8_t>(id);
      turn(servo, 2048);
    }
    run();
  }
  ~FeetechEmulator() override { stop(); }

  template <typename Change>
  auto with(Change change) {
    const std::lock_guard guard(lock_);
    return change(*this);
  }
  Servo& servo(int id) { return servos_.at(id); }
  /// Sign in bit 15.
  static void turn(Servo& servo, int counts) {
    const int size = counts < 0 ? -counts : counts;
    servo.table[56] = static_cast<std::uint8_t>(size & 0xff);
    servo.table[57] = static_cast<std::uint8_t>((size >> 8 & 0x7f) | (counts < 0 ? 0x80 : 0));
  }

  int damage = 0;                      ///< so many answers get a wrong bit
  int writes = 0;                      ///< of any register
  int late_once_ms = 0;                ///< before the next answer
  int counts_a_question = 0;           ///< servo 1 has gone on by so many at each
  std::vector<std::int64_t> asked_ns;  ///< when positions of all were asked for

 private:
  void serve(std::int64_t /*now_ns*/) override {
    while (heard_.size() >= 6) {
      const std::size_t whole = std::size_t{4} + heard_[3];
      if (heard_[0] != 0xff || heard_[1] != 0xff || heard_[2] == 0xff) {
        heard_.erase(heard_.begin());
        continue;
      }
      if (heard_.size() < whole) return;
      const std::vector<std::uint8_t> packet(heard_.begin(),
                                             heard_.begin() + static_cast<long>(whole));
      heard_.erase(heard_.begin(), heard_.begin() + static_cast<long>(whole));
      if (inverted_sum(packet) == packet.back()) obey(packet);
    }
  }
  /// Of all but the header and the last byte.
  static std::uint8_t inverted_sum(const std::vector<std::uint8_t>& packet) {
    unsigned sum = 0;
    for (std::size_t k = 2; k + 1 < packet.size(); ++k) sum += packet[k];
    return static_cast<std::uint8_t>(255 - sum % 256);
  }
  void obey(const std::vector<std::uint8_t>& packet) {
    const int id = packet[2], instruction = packet[4];
    if (instruction == 0x82) {
      asked_ns.push_back(steady_ns());
      turn(servos_[1],
           (servos_[1].table[56] + 256 * servos_[1].table[57] + counts_a_question) % 4096);
      for (std::size_t k = 7; k + 1 < packet.size(); ++k) read(packet[k], packet[5], packet[6]);
    } else if (instruction == 0x02) {
      read(id, packet[5], packet[6]);
    } else if (servos_.contains(id) && !servos_[id].silent) {
      if (instruction == 0x03) {
        ++writes;
        for (std::size_t k = 6; k + 1 < packet.size(); ++k)
          servos_[id].table[packet[5] + k - 6] = packet[k];
      }
      answer(id, {});
    }
  }
  void read(int id, std::size_t address, std::size_t size) {
    if (!servos_.contains(id) || servos_[id].silent || address + size > 128) return;
    const auto begin = servos_[id].table.begin() + static_cast<long>(address);
    answer(id, {begin, begin + static_cast<long>(size)});
  }
  void answer(int id, const std::vector<std::uint8_t>& data) {
    std::vector<std::uint8_t> bytes = {0xff, 0xff, static_cast<std::uint8_t>(id),
                                       static_cast<std::uint8_t>(data.size() + 2),
                                       servos_[id].error};
    bytes.insert(bytes.end(), data.begin(), data.end());
    bytes.push_back(0);
    bytes.back() = inverted_sum(bytes);
    if (damage > 0) {
      --damage;
      bytes[bytes.size() / 2] ^= 0x10;
    }
    if (late_once_ms > 0)
      std::this_thread::sleep_for(std::chrono::milliseconds(std::exchange(late_once_ms, 0)));
    say(bytes);
  }

  std::map<int, Servo> servos_;
};

}  // namespace haptic::test
