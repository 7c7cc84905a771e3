// SPDX-License-Identifier: Apache-2.0
#pragma once
/// X-series servos on a bus, from the published protocol 2.0 and control table alone: it shares no
/// code with the bridge, and the official SDK reads and writes it (dynamixel_sdk_check.py).

#include <map>

#include "tests/bridges/arms/pty_bus.hpp"

namespace haptic::test {

class DynamixelEmulator final : public PtyBus {
 public:
  struct Servo {
    std::array<std::uint8_t, 256> table{};
    bool silent = false;
    std::int64_t heard_ns = 0;
    int cuts = 0;
  };
  /// Goal currents as they were accepted, by id, with their time.
  struct Goals {
    std::int64_t at_ns = 0;
    std::map<int, int> current;
  };

  /// Servos 1 to `count` of a model, torque off, in position mode as they come from the factory.
  DynamixelEmulator(int count, int model, int firmware = 47) {
    for (int id = 1; id <= count; ++id) {
      Servo& servo = servos_[id];
      set(servo, 0, 2, model);
      servo.table[6] = static_cast<std::uint8_t>(firmware);
      servo.table[7] = static_cast<std::uint8_t>(id);
      servo.table[11] = 3;
      set(servo, 38, 2, model == 1220 ? 910 : 1193);
      servo.table[63] = 52;
      servo.table[68] = 2;
      set(servo, 132, 4, 2048);
    }
    run();
  }
  ~DynamixelEmulator() override { stop(); }

  /// Applies `change` between two instructions.
  template <typename Change>
  auto with(Change change) {
    const std::lock_guard guard(lock_);
    return change(*this);
  }
  Servo& servo(int id) { return servos_.at(id); }
  static void set(Servo& servo, std::size_t address, std::size_t size, int value) {
    for (std::size_t k = 0; k < size; ++k)
      servo.table[address + k] = static_cast<std::uint8_t>(value >> (8 * k) & 0xff);
  }
  static int get(const Servo& servo, std::size_t address, std::size_t size) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < size; ++k)
      value |= static_cast<std::uint32_t>(servo.table[address + k]) << (8 * k);
    return size == 2 ? static_cast<std::int16_t>(value) : static_cast<std::int32_t>(value);
  }
  /// Current that a servo has now.
  [[nodiscard]] int current(int id) const {
    const Servo& s = servos_.at(id);
    return s.table[64] == 1 && s.table[11] == 0 && s.table[98] != 0xff ? get(s, 102, 2) : 0;
  }

  std::int64_t watchdog_unit_ns = 1'000'000'000;  ///< 20 ms where a test is about it
  int damage = 0;                                 ///< so many answers get a wrong bit
  int delay_ms = 0;                               ///< before each answer
  int late_once_ms = 0;                           ///< before the next one
  int counts_a_question = 0;                      ///< servo 1 has gone on by so many at each
  std::vector<std::int64_t> asked_ns;             ///< when positions were asked for
  int rejected_goals = 0, instructions = 0;
  std::vector<Goals> goals;

 private:
  void serve(std::int64_t now_ns) override;
  void obey(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  int write(Servo& servo, std::size_t address, std::span<const std::uint8_t> data);
  void write_all(std::span<const std::uint8_t> parameters, std::int64_t now_ns);
  void answer(int id, int error, std::vector<std::uint8_t> data);
  void answer_together(std::size_t address, std::size_t size, std::span<const std::uint8_t> ids);
  void send(std::vector<std::uint8_t> bytes);
  static int alert(const Servo& servo) { return servo.table[70] != 0 ? 0x80 : 0; }

  std::map<int, Servo> servos_;
};

}  // namespace haptic::test
