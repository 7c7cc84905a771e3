// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The inside of UsbfsCarrier: the answers of the kernel's usbfs to libusb, and the transfers that
/// are in flight. A URB ends in three steps, as in the kernel: it completes (bytes and status are
/// written), it waits, it is reaped in the order of completion.

struct usbdevfs_urb;

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

#include "host_sim/device/descriptor_answer.hpp"
#include "host_sim/device/usb_descriptors.hpp"
#include "host_sim/device/usbfs_carrier.hpp"

namespace haptic::sim {

// A descriptor whose poll events this process decides: the write end of a pipe of one page. Full:
// no event; drained: POLLOUT; read end closed: POLLERR. poll itself stays the kernel's own, and a
// usbfs descriptor says the same with the same events: a URB can be reaped, the device is gone.

/// Not thread-safe.
class ReadinessPipe {
 public:
  /// Without an event. @throws std::system_error when the kernel refuses.
  ReadinessPipe();
  ~ReadinessPipe();
  ReadinessPipe(const ReadinessPipe&) = delete;
  ReadinessPipe& operator=(const ReadinessPipe&) = delete;

  /// Descriptor to poll; closed by the destructor.
  [[nodiscard]] int descriptor() const { return write_end_; }
  /// POLLOUT or not. Cost: one system call when it changes.
  void show_ready(bool ready);
  /// POLLERR from now on.
  void hang_up();

 private:
  int read_end_ = -1, write_end_ = -1;
  bool ready_ = true;
  std::vector<std::byte> page_;
};

class UsbfsBus final : public DescriptorAnswer {
 public:
  UsbfsBus(UsbFunction& function, unsigned room);
  UsbfsBus(const UsbfsBus&) = delete;
  UsbfsBus& operator=(const UsbfsBus&) = delete;

  // For libusb.
  long on_ioctl(unsigned long request, void* argument) override;
  long on_read(std::span<std::byte> bytes) override;
  long on_seek(long offset, int whence) override;

  // For the device.
  [[nodiscard]] int descriptor() const { return pipe_.descriptor(); }
  bool push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes);
  void fail_next(std::uint8_t endpoint, int negative_errno, unsigned times);
  void refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times);
  void hold_out(bool held);
  void hold_control(bool held);
  void unplug();
  void unplug_at_next_resubmit();
  [[nodiscard]] bool plugged() const;
  [[nodiscard]] unsigned waiting(std::uint8_t endpoint) const;

 private:
  using Lock = std::unique_lock<std::mutex>;
  /// Faults to come: errno and how often.
  using Faults = std::deque<std::pair<int, unsigned>>;
  struct Endpoint {
    UsbDescriptors::Endpoint described;
    std::deque<std::vector<std::uint8_t>> reports;  ///< pushed, no transfer yet
    Faults failures, refusals;
  };
  struct Flight {
    usbdevfs_urb* urb = nullptr;
    bool at_device = false;  ///< the function works on it, without the lock
  };

  // Transfers (usbfs_bus.cpp).
  long submit(usbdevfs_urb* urb);
  long reap(void** urb);
  long discard(const usbdevfs_urb* urb);
  void finish(std::size_t flight, int status, std::size_t moved);
  [[nodiscard]] std::size_t flight_of(const usbdevfs_urb* urb) const;
  void serve_in(std::uint8_t address);
  void carry_out(Lock& lock);
  void carry(std::size_t flight, Lock& lock);
  [[nodiscard]] std::size_t next_for_device() const;
  void unplug_locked();
  [[nodiscard]] static int take(Faults& faults);

  // Requests (usbfs_requests.cpp).
  long on_rare_ioctl(unsigned long request, void* argument);
  long claim(unsigned interface);
  long release(unsigned interface);
  long control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
               std::uint16_t index, std::span<std::uint8_t> bytes);
  long clear_halt(unsigned endpoint);

  UsbFunction& function_;
  const unsigned room_;
  const UsbDescriptors descriptors_;

  mutable std::mutex mutex_;  ///< of all below; never held while the function is called
  ReadinessPipe pipe_;
  std::map<std::uint8_t, Endpoint> endpoints_;
  std::set<unsigned> claimed_;
  std::vector<Flight> flights_;        ///< in order of submission
  std::vector<usbdevfs_urb*> ended_;   ///< in order of completion
  std::size_t position_ = 0;           ///< of read
  bool at_device_ = false;             ///< the function works on a flight
  std::vector<std::uint8_t> carried_;  ///< its bytes: the host's may go when the device does
  std::vector<std::vector<std::uint8_t>> spare_;  ///< memory of reports
  bool plugged_ = true, out_held_ = false, control_held_ = false;
  bool armed_ = false, in_reaped_ = false;  ///< of unplug_at_next_resubmit
};

}  // namespace haptic::sim
