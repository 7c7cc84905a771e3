// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Haply Inverse3, Inverse3x and Minverse, with a VerseGrip or without, through Haply's Inverse
/// service: a bridged device (README.md). The service's own axes are those of D, its origin is the
/// device's base; the handle point is the cursor, the handle's axes are those of the grip.

#include <memory>
#include <string>

#include "hal/bridge/bridged_device.hpp"
#include "hal/drivers/driver_registry.hpp"
#include "tools/bridges/haply/haply_messages.hpp"
#include "tools/bridges/haply/haply_session.hpp"

namespace haptic::tools {

struct HaplySettings {
  std::string service = "127.0.0.1";  ///< a name or an address, no URL
  std::uint16_t http_port = 10000, websocket_port = 10001;
  std::string device;  ///< name of the device; empty: the only one
  std::string grip;    ///< name of the grip, "none"; empty: the only one, if there is one
  Real max_force_n = 2.0_r;
  bool accepts_other_forces = false;
  HaplyTimes times;  ///< no key: a machine that is too slow for the period is refused elsewhere
};

/// Owner: the bridge's thread. `open` takes 3 s at most, beside looking up a name; `close` 0.3 s;
/// the others copy a record.
class HaplyDevice final : public hal::BridgedDevice {
 public:
  explicit HaplyDevice(HaplySettings settings);
  ~HaplyDevice() override;

  [[nodiscard]] bool open(std::string& why) override;
  [[nodiscard]] const hal::BridgeFacts& facts() const override { return facts_; }
  [[nodiscard]] hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override;
  [[nodiscard]] bool write(std::int64_t now_ns, const Wrench& wrench_d) override;
  [[nodiscard]] bool release(std::int64_t now_ns) override;
  void close() noexcept override;
  [[nodiscard]] pollfd watched() const noexcept override;

  /// Why the connection before this one ended; empty: it did not, or was closed here.
  [[nodiscard]] const std::string& last_end() const noexcept { return last_end_; }

 private:
  [[nodiscard]] bool ask(std::uint16_t port, const char* target, HttpAnswer& answer,
                         std::string& why) const;
  [[nodiscard]] bool find_version(HaplyVersion& version, std::uint16_t& http_port,
                                  std::string& why) const;
  [[nodiscard]] bool choose(const HaplyInventory& inventory, HaplyListed& device, HaplyListed& grip,
                            std::string& why) const;
  void state_facts(const HaplyVersion& version, const HaplyListed& device, const HaplyListed& grip,
                   std::uint16_t http_port);
  void remember_end();

  HaplySettings settings_;
  hal::BridgeFacts facts_;
  std::unique_ptr<HaplySession> session_;
  bool has_grip_ = false, was_on_ = false;
  std::uint64_t releases_ = 0;
  std::string last_end_, last_cut_;
};

/// The device as a configuration describes it. Null, with `defect` filled: a service that is no
/// plain host, a name that is none.
[[nodiscard]] std::unique_ptr<hal::BridgedDevice> make_haply(const hal::DriverOptions& options,
                                                             hal::DriverDefect& defect);

}  // namespace haptic::tools
