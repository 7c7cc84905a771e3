// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/dynamixel/dynamixel_bus.hpp"

#include <algorithm>
#include <array>

#include "tools/bridges/dynamixel/dynamixel_servo.hpp"

namespace haptic::tools {
namespace {

/// Unit of current, torque per current, firmware: X330 from 46 on, X430 and X540 from 45 on.
constexpr std::array kModels = {DynamixelModel{1190, "XL330-M077", 46, 0.001, 0.146},
                                DynamixelModel{1200, "XL330-M288", 46, 0.001, 0.354},
                                DynamixelModel{1220, "XC330-T288", 46, 0.001, 1.15},
                                DynamixelModel{1230, "XC330-M181", 46, 0.001, 0.333},
                                DynamixelModel{1240, "XC330-M288", 46, 0.001, 0.517},
                                DynamixelModel{1020, "XM430-W350", 45, 0.00269, 1.783},
                                DynamixelModel{1030, "XM430-W210", 45, 0.00269, 1.304},
                                DynamixelModel{1120, "XM540-W270", 45, 0.00269, 2.409},
                                DynamixelModel{1130, "XM540-W150", 45, 0.00269, 1.659},
                                DynamixelModel{1060, "XL430-W250", 45, 0, 0},
                                DynamixelModel{1070, "XC430-W150", 45, 0, 0},
                                DynamixelModel{1080, "XC430-W240", 45, 0, 0},
                                DynamixelModel{1090, "2XL430-W250", 45, 0, 0},
                                DynamixelModel{1160, "2XC430-W250", 45, 0, 0}};

}  // namespace

std::span<const DynamixelModel> dynamixel_models() noexcept { return kModels; }

const DynamixelModel* find_model(std::uint16_t number) noexcept {
  const auto* const at = std::ranges::find(kModels, number, &DynamixelModel::number);
  return at == kModels.end() ? nullptr : at;
}

DynamixelReply DynamixelBus::ask(std::uint8_t id, DynamixelInstruction instruction,
                                 std::span<const std::uint8_t> parameters,
                                 std::span<std::uint8_t> answer) {
  DynamixelOutput output;
  if (!output.add(id, instruction, parameters)) return DynamixelReply::kSilent;
  for (int attempt = 0; attempt < kAttempts && !port_.is_lost(); ++attempt) {
    port_.drop_input();
    input_.clear();
    if (!port_.write(output.bytes())) continue;
    for (const std::int64_t end = port_.now_ns() + kAnswer_ns; port_.now_ns() < end;) {
      DynamixelStatus status;
      const DynamixelRead got = input_.next(status);
      if (got == DynamixelRead::kNothing) {
        port_.wait(end - port_.now_ns());
        input_.added(port_.read(input_.room()));
      }
      if (got == DynamixelRead::kWrongCheck || port_.is_lost()) break;
      if (got == DynamixelRead::kNothing || status.id != id) continue;
      if ((status.error & ~kAlertBit) != 0) return DynamixelReply::kRefused;
      if (status.parameters.size() != answer.size()) break;
      std::ranges::copy(status.parameters, answer.begin());
      return DynamixelReply::kDone;
    }
  }
  return DynamixelReply::kSilent;
}

DynamixelReply DynamixelBus::ping(std::uint8_t id, DynamixelIdentity& identity) {
  std::array<std::uint8_t, 3> answer{};
  const DynamixelReply reply = ask(id, DynamixelInstruction::kPing, {}, answer);
  if (reply == DynamixelReply::kDone) {
    identity = {static_cast<std::uint16_t>(int16_at(answer)), answer[2]};
  }
  return reply;
}

DynamixelReply DynamixelBus::read(std::uint8_t id, std::uint16_t address,
                                  std::span<std::uint8_t> data) {
  const std::array<std::uint8_t, 4> parameters = {low_byte(address), high_byte(address),
                                                  static_cast<std::uint8_t>(data.size()), 0};
  return ask(id, DynamixelInstruction::kRead, parameters, data);
}

DynamixelReply DynamixelBus::set(std::uint8_t id, std::uint16_t address, std::uint8_t value) {
  const std::array<std::uint8_t, 3> parameters = {low_byte(address), high_byte(address), value};
  // A servo may be set to answer reads alone; the value says what happened.
  const DynamixelReply written = ask(id, DynamixelInstruction::kWrite, parameters, {});
  if (written == DynamixelReply::kRefused) return written;
  std::array<std::uint8_t, 1> back{};
  const DynamixelReply reply = read(id, address, back);
  if (reply != DynamixelReply::kDone) return reply;
  return back[0] == value ? DynamixelReply::kDone : DynamixelReply::kOther;
}

}  // namespace haptic::tools
