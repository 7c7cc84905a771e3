// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Facts that only a try can find: each probe does the thing, puts it back, and tells the
/// errno. Tests answer in the system's place.

#include <string>
#include <vector>

#include "hal/realtime/wakeup_measurement.hpp"

namespace haptic::hal {

/// libusb as it starts on this machine.
struct UsbLibrary {
  int code = 0;           ///< of libusb_init
  std::string code_name;  ///< "LIBUSB_ERROR_OTHER"
  std::string version;    ///< "1.0.26"
};

/// Answer of a bridge (tools/bridges) that has looked for its device once.
struct BridgeReply {
  bool is_asked = false;  ///< false: this program has no bridges
  bool found = false;
  std::string name, needs;  ///< of a device that was found; needs: what its owner has to do
  std::string why;          ///< else
};

/// Not for a loop: probes start threads, allocate and block. Each int is 0 or an errno.
class SystemProbes {
 public:
  virtual ~SystemProbes() = default;
  [[nodiscard]] virtual int try_fifo(int priority) = 0;
  [[nodiscard]] virtual int try_cpu(int cpu) = 0;
  [[nodiscard]] virtual int try_memory_lock() = 0;
  [[nodiscard]] virtual int try_idle_hold() = 0;
  /// Tries to open a device node for reading and writing as this user; 0 or an errno.
  [[nodiscard]] virtual int try_node(const std::string& path) = 0;
  /// Tries to connect to a local stream socket; 0 or an errno.
  [[nodiscard]] virtual int try_socket(const std::string& path) = 0;
  [[nodiscard]] virtual BridgeReply try_bridge(const std::string& name) = 0;
  /// A variable of the environment; empty: it is not set.
  [[nodiscard]] virtual std::string variable(const std::string& name) = 0;
  [[nodiscard]] virtual UsbLibrary try_usb_library() = 0;
  virtual void measure(const WakeupQuestion& question, WakeupMeasurement& measurement) = 0;
  /// True if a program of this name can be found.
  [[nodiscard]] virtual bool has_program(const std::string& name) = 0;
  /// Output of a program, standard error included; it ends by itself.
  [[nodiscard]] virtual std::string run_program(const std::vector<std::string>& command) = 0;
};

/// The machine that this runs on.
class LinuxProbes : public SystemProbes {
 public:
  [[nodiscard]] int try_fifo(int priority) override;
  [[nodiscard]] int try_cpu(int cpu) override;
  [[nodiscard]] int try_memory_lock() override;
  [[nodiscard]] int try_idle_hold() override;
  [[nodiscard]] int try_node(const std::string& path) override;
  [[nodiscard]] int try_socket(const std::string& path) override;
  /// Bridges are a program of their own: who knows where it lies asks it.
  [[nodiscard]] BridgeReply try_bridge(const std::string& /*name*/) override { return {}; }
  [[nodiscard]] std::string variable(const std::string& name) override;
  [[nodiscard]] UsbLibrary try_usb_library() override;
  void measure(const WakeupQuestion& question, WakeupMeasurement& measurement) override {
    measure_wakeups(question, measurement);
  }
  [[nodiscard]] bool has_program(const std::string& name) override;
  [[nodiscard]] std::string run_program(const std::vector<std::string>& command) override;
};

}  // namespace haptic::hal
