// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The reference device on a bus: ReferenceModel behind the descriptors and requests of
/// PROTOCOL.md, with faults at chosen periods, in virtual or in real time, on any carrier.
///
/// Lock-step: a period passes when the command that answers the last report has arrived, so a run
/// is as fast as the host and has the same bits each time. A period whose report does not reach the
/// host (lost, late, stalled, unplugged with a replug to come) passes by itself. If the host cannot
/// answer (its own submit failed), it may call `step`.
/// Paced: a thread of its own steps at the report rate of the wall clock.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "host_sim/device/device_fault.hpp"
#include "host_sim/device/reference_model.hpp"
#include "host_sim/device/usbfs_carrier.hpp"

namespace haptic::sim {

enum class DevicePace : std::uint8_t { kLockStep = 0, kRealTime };

/// hal/drivers/PROTOCOL.md section 1: device, configuration, interface, the two endpoints.
[[nodiscard]] std::vector<std::uint8_t> reference_descriptors();

/// Makes the bus for a plug, which holds `room` reports; called with the device's lock held.
using CarrierMaker =
    std::function<std::unique_ptr<BusCarrier>(UsbFunction& function, unsigned room)>;
/// UsbfsCarrier: inside this process.
[[nodiscard]] std::unique_ptr<BusCarrier> make_usbfs_carrier(UsbFunction& function, unsigned room);

/// All members may be called from any thread. Must outlive the libusb handles on it.
class ReferenceUsb final : public UsbFunction {
 public:
  static constexpr std::uint8_t kInEndpoint = 0x81, kOutEndpoint = 0x01;
  /// Unplugged buses that are kept, since their hosts may still have them open.
  static constexpr std::size_t kKeptCarriers = 8;

  /// `model` is this object's from now on; see `with_model`.
  ReferenceUsb(ReferenceModel& model, DevicePace pace, CarrierMaker maker = make_usbfs_carrier);
  ~ReferenceUsb() override;
  ReferenceUsb(const ReferenceUsb&) = delete;
  ReferenceUsb& operator=(const ReferenceUsb&) = delete;

  /// Onto the bus, with a new descriptor, unplugged before where it was on it; returns the
  /// descriptor for libusb. In lock-step the first report is offered at once. @throws as the
  /// maker of carriers.
  int plug();
  void unplug();
  /// Descriptor of the newest plug; -1 before the first.
  [[nodiscard]] int descriptor() const;
  /// Called with the descriptor after a replug by an event; on the thread whose call let the period
  /// pass, without a lock. Set before the first period.
  void on_replug(std::function<void(int descriptor)> told);
  /// Called with the lock held, after each period and after each command that was accepted. Set
  /// before the first period.
  void on_period(std::function<void(const ReferenceModel&)> seen);
  void on_command(std::function<void(const ReferenceModel&)> seen);
  /// The bus of the newest plug. Lives until kKeptCarriers plugs later.
  [[nodiscard]] BusCarrier& carrier();

  /// Real time: periods pass from `start` on until `stop`, which waits for the thread.
  void start();
  void stop();
  /// The same on the calling thread, until `run` is false; also lets out what a replug throws.
  void run_paced(const std::atomic<bool>& run);

  /// One period: events, motion, report.
  void step();
  [[nodiscard]] std::uint64_t periods() const;

  /// Something fails at event.report, or at the next period where that is 0 or over.
  void add(const DeviceFaultEvent& event);

  /// Calls `work(model)` while nothing else touches the model.
  template <typename Work>
  auto with_model(Work work) const {
    const std::lock_guard lock(mutex_);
    return work(model_);
  }

  // UsbFunction.
  [[nodiscard]] std::vector<std::uint8_t> descriptors() const override;
  [[nodiscard]] int speed() const override { return 3; }
  int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
              std::uint16_t index, std::span<std::uint8_t> bytes) override;
  int out(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) override;

 private:
  void plug_locked();
  void drop_retired();
  void settle(int descriptor_before);
  bool step_locked();
  void step_to_next_report();
  void begin(const DeviceFaultEvent& event);
  [[nodiscard]] bool replug_to_come() const;

  ReferenceModel& model_;
  const DevicePace pace_;
  const CarrierMaker maker_;
  std::function<void(int)> told_;
  std::function<void(const ReferenceModel&)> period_seen_, command_seen_;

  mutable std::mutex mutex_;                           ///< of all below; taken before the carrier's
  std::vector<std::unique_ptr<BusCarrier>> carriers_;  ///< old ones may still be open in the host
  std::vector<std::unique_ptr<BusCarrier>> retired_;   ///< to be destroyed without the lock
  std::vector<DeviceFaultEvent> events_;               ///< to come
  ReportFaultFilter filter_;
  std::uint64_t period_ = 0, deaf_until_ = 0, stopped_until_ = 0;
  unsigned failing_ = 0;  ///< reports that the next transfers will not deliver
  std::thread thread_;
  std::atomic<bool> run_ = false;
};

}  // namespace haptic::sim
