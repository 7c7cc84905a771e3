// SPDX-License-Identifier: Apache-2.0
#pragma once
/// All drivers, one row each. A configuration's `[device] driver`, the help of run_device, the udev
/// rules and the table of README.md follow from it; tests compare the last two with it.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "hal/drivers/driver.hpp"

namespace haptic::hal {

/// A key of `[device]` that one driver has beyond `driver` and `address`.
struct DriverKey {
  enum class Kind : std::uint8_t {
    kText,
    kPath,  ///< of a file; given to the driver relative to the working directory
    kFlag,
    kNumber  ///< from `least` to `most`
  };
  std::string_view name;
  Kind kind = Kind::kText;
  std::string_view help;  ///< one line
  double least = 0, most = 0;
};

/// The device as a configuration describes it.
struct DriverOptions {
  std::uint16_t vendor_id = 0, product_id = 0;  ///< 0: the driver's own
  bool has_deadman = false;                     ///< a deadman switch beside the device
  std::vector<std::pair<std::string_view, std::variant<std::string, bool, double>>> values;

  /// The value of a key of the driver; null where the configuration does not have it.
  template <typename Value>
  [[nodiscard]] const Value* value(std::string_view key) const {
    for (const auto& [name, value] : values) {
      if (name == key) return std::get_if<Value>(&value);
    }
    return nullptr;
  }
};

/// Why no driver was made.
struct DriverDefect {
  std::string_view key;  ///< of `[device]`
  std::string text;      ///< defect and fix
};

struct UsbIdentity {
  std::uint16_t vendor_id = 0, product_id = 0;
};

struct DriverRow {
  std::string_view name;     ///< as `[device] driver` has it
  std::string_view product;  ///< for people
  std::string_view note;     ///< for who plugs it in: whole sentences; may be empty
  std::string_view tested;   ///< against which hardware, or models of it by whom
  std::span<const DriverKey> keys;
  /// Null, with `defect` filled, for values of keys that no driver can be made of.
  std::unique_ptr<Driver> (*make)(const DriverOptions& options, DriverDefect& defect);
  /// Identities of all models, where there are others than that of the profile; else null.
  std::vector<UsbIdentity> (*identities)() = nullptr;
  /// A program of its own (tools/bridges) speaks to the device, and to us as the reference device.
  bool is_bridged = false;
};

/// The reference device first.
[[nodiscard]] std::span<const DriverRow> driver_rows() noexcept;

/// Null for a name that no driver has.
[[nodiscard]] const DriverRow* find_driver(std::string_view name) noexcept;

/// Identities by which the row's devices are found on a bus; none of a bridge.
[[nodiscard]] std::vector<UsbIdentity> identities_of(const DriverRow& row);

/// The driver as it is without a configuration, with a deadman switch beside the device.
[[nodiscard]] std::unique_ptr<Driver> standard_driver(const DriverRow& row);

}  // namespace haptic::hal
