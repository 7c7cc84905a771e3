// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The reference device with a hand on it, in real time in a process of its own for all that its
/// host knows (hal/local/device_port.hpp), so that the process which holds it can be killed,
/// stopped and spoiled while the device goes on. What came over the wire and what acted on the hand
/// are written down here, and nowhere else.

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hal/local/device_port.hpp"
#include "host_sim/device/reference_model.hpp"

namespace haptic::sim {

/// A command that the device accepted.
struct WireCommand {
  std::int64_t stamp_ns = 0;  ///< when it came
  Load wrench;
  bool drives_on = false;
  unsigned host = 0;       ///< 1: the first that connected
  std::uint32_t tick = 0;  ///< that it was made in
};

/// A period of the device.
struct WirePeriod {
  std::int64_t stamp_ns = 0;  ///< when it was over
  std::int64_t late_ns = 0;   ///< of this process: what it saw may be late by as much
  double acting_n = 0;
  bool drives_on = false;
  std::uint32_t cuts = 0;  ///< by the watchdog, so far
};

/// Everything so far, or since an index of it.
struct WireRecord {
  std::vector<WireCommand> commands;
  std::vector<WirePeriod> periods;
};

/// Owner: one thread, which is not the one that it makes for the device.
class ServedDevice final : private hal::PortDevice {
 public:
  /// Listens at `path`, which is replaced. @throws std::system_error  it cannot.
  ServedDevice(const std::string& path, const ReferenceModelSettings& settings);
  ~ServedDevice() override;
  ServedDevice(const ServedDevice&) = delete;
  ServedDevice& operator=(const ServedDevice&) = delete;

  /// The hand moves its target towards `height_m` at 0.2 m/s and holds these switches.
  void hold(double height_m, std::uint32_t switches);
  void press_emergency_stop(bool pressed);
  /// It goes on reporting and looks at no command until this is taken back: its host is deaf to it.
  void be_deaf(bool deaf);
  /// Probe: a carrier with a queue in it. A command is passed on so much later than it came.
  void pass_on_after(std::int64_t late_ns);
  /// The cable is pulled; in its place another device is plugged in, at rest where this one was.
  void replace(const ReferenceModelSettings& settings);

  [[nodiscard]] WireRecord record() const;
  /// Of the last command accepted from the host that is connected; 0: none.
  [[nodiscard]] double handed_n() const;
  [[nodiscard]] bool is_asked_for_drives() const;  ///< by the last command
  [[nodiscard]] unsigned hosts() const;            ///< that connected and were served
  [[nodiscard]] unsigned refused() const;          ///< that came while another was served

 private:
  void serve();
  void begin() override {}
  [[nodiscard]] std::ptrdiff_t control(const hal::ControlRequest& request,
                                       std::span<const std::uint8_t> data,
                                       std::span<std::uint8_t> room) override;
  void command(std::span<const std::uint8_t> bytes) override;
  void take(std::span<const std::uint8_t> bytes);
  void end() override { handed_n_ = 0; }
  void pass_period(std::int64_t due_ns);
  [[nodiscard]] HandAction hand();

  mutable std::mutex mutex_;  ///< of all below
  std::unique_ptr<ReferenceModel> model_;
  WireRecord record_;
  double height_m_ = 0, wanted_m_ = 0;
  std::uint32_t switches_ = 0;
  double handed_n_ = 0;
  hal::DevicePort port_;
  bool deaf_ = false;
  std::int64_t late_ns_ = 0;
  std::deque<std::pair<std::int64_t, std::vector<std::uint8_t>>> queue_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace haptic::sim
