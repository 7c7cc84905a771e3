// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The driver of the reference device over the model of one, without a bus.

#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hal/drivers/reference_driver.hpp"
#include "host_sim/device/reference_model.hpp"
#include "rt_core/exchange/device_exchange.hpp"

namespace haptic::sim::test {

using Bytes = std::vector<std::uint8_t>;

inline HandAction still(double) { return {}; }

/// Control pipe of the model, for the driver's start.
class ModelPort final : public hal::UsbPort {
 public:
  explicit ModelPort(const ReferenceModel& model) : model_(model) {}
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved, unsigned) noexcept override {
    CHECK(request.request_type == hal::kReferenceBlockRequestType);
    REQUIRE(bytes.size() == hal::kReferenceBlockBytes);
    hal::encode(model_.block(), bytes.first<hal::kReferenceBlockBytes>());
    moved = bytes.size();
    return hal::HalStatus::kOk;
  }
  hal::HalStatus write(std::span<const std::uint8_t>, unsigned) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  hal::HalStatus read(std::span<std::uint8_t>, std::size_t&, unsigned) noexcept override {
    return hal::HalStatus::kTransferFailed;
  }
  [[nodiscard]] bool cancelled() const noexcept override { return false; }

 private:
  const ReferenceModel& model_;
};

/// The driver of hal over the model: one period, in which the renderer asks for `force_n` along x.
struct DrivenModel {
  DrivenModel() : model({}, still), port(model) {
    REQUIRE(driver.start(port) == hal::HalStatus::kOk);
  }
  void turn(double force_n) {
    model.advance();
    REQUIRE(driver.read(model.report(), 0, state) == hal::ReportVerdict::kState);
    Bytes bytes(hal::kReferenceCommandBytes);
    Wrench wrench;
    wrench.force_w.x() = static_cast<Real>(force_n);
    Wrench handed;
    const std::size_t length = driver.write(wrench, ++tick, bytes, handed);
    REQUIRE(length == bytes.size());
    delivered_n = static_cast<double>(handed.force_w.x());
    if (reached) REQUIRE(model.command(bytes));
  }

  ReferenceModel model;
  ModelPort port;
  hal::ReferenceDriver driver;
  haptic::DeviceState state;
  std::uint64_t tick = 0;
  double delivered_n = 0;
  bool reached = true;
};

}  // namespace haptic::sim::test
