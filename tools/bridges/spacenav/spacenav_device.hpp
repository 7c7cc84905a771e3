// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A six-axis device by way of spacenavd: no root, and no other program loses it. Poses follow the
/// law of hal/drivers/displacement_pose.hpp, as those of driver `spacemouse` do.

#include <cstdint>
#include <memory>
#include <string>

#include "hal/bridge/bridged_device.hpp"
#include "hal/drivers/displacement_pose.hpp"
#include "hal/drivers/driver_registry.hpp"
#include "tools/bridges/spacenav/spacenav_protocol.hpp"

namespace haptic::tools {

struct SpacenavSettings {
  std::string socket;     ///< empty: where libspnav looks (hal/drivers/spacenav_socket.hpp)
  double full_scale = 0;  ///< an axis at full push, as the daemon sends it; 0: by the device, as
                          ///< spacenav_scale.hpp has it
  hal::DisplacementSettings motion;
};

/// Since the device was made.
struct SpacenavCounts {
  std::uint64_t events = 0;      ///< motions and buttons that were taken
  std::uint64_t unknown = 0;     ///< units of a type that no daemon sends
  std::uint64_t impossible = 0;  ///< motions and buttons beyond what any device has
};

/// The daemon sends one motion for each report of the device, and none at rest, nor, of a device
/// with absolute axes, while the cap is held quite still: the pose stands then. A motion is dated
/// when it is read. Sensitivity, dead zone, axes and signs that its owner has set in the daemon
/// hold here too.
///
/// Lost, to be opened again: the daemon has ended, or any device was added or removed, since the
/// daemon's choice may be another from then on (version 1; version 0 says nothing of devices), or
/// 256 units in a row are of unknown types. Ignored and counted: fewer of these, and numbers that
/// no device reports.
class SpacenavDevice final : public hal::BridgedDevice {
 public:
  explicit SpacenavDevice(SpacenavSettings settings);
  ~SpacenavDevice() override { close(); }
  SpacenavDevice(const SpacenavDevice&) = delete;
  SpacenavDevice& operator=(const SpacenavDevice&) = delete;

  /// Takes 0.3 s with a daemon of version 0, and 2 s at most. The pose begins at the origin.
  [[nodiscard]] bool open(std::string& why) override;
  [[nodiscard]] const hal::BridgeFacts& facts() const override { return facts_; }
  /// Reads at most 64 units; what is left waits for the next turn. No heap while nothing is lost.
  [[nodiscard]] hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override;
  /// Nothing is driven.
  [[nodiscard]] bool write(std::int64_t, const Wrench&) override { return true; }
  [[nodiscard]] bool release(std::int64_t) override { return true; }
  void close() noexcept override;
  [[nodiscard]] pollfd watched() const noexcept override;

  [[nodiscard]] const SpacenavCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] int version() const noexcept { return version_; }

 private:
  [[nodiscard]] bool connect(std::string& why);
  [[nodiscard]] bool agree_on_version(std::string& why);
  [[nodiscard]] bool introduce(std::string& why);
  [[nodiscard]] bool ask(SpnavRequest kind, const SpnavUnit& request, SpnavUnit& answer,
                         std::string& why);
  [[nodiscard]] bool send(const void* bytes, std::size_t count, std::string& why);
  [[nodiscard]] bool wait_for_bytes(std::int64_t end_ns, bool& came, std::string& why);
  [[nodiscard]] bool next_answer(SpnavRequest kind, std::int64_t end_ns, SpnavUnit& answer,
                                 std::string& why);
  void describe(const std::string& name, std::uint16_t vendor_id, std::uint16_t product_id);
  [[nodiscard]] int connect_first(std::string& tried);
  [[nodiscard]] std::int64_t now_ns() const;
  [[nodiscard]] std::int64_t receive();
  void pass_over_motions();
  void take_in(std::int64_t now_ns);
  void take(const SpnavUnit& unit, std::int64_t now_ns);
  void take_motion(const SpnavUnit& unit, std::int64_t now_ns);
  void take_button(const SpnavUnit& unit);
  void lose(const char* why);

  SpacenavSettings settings_;
  hal::DisplacementPose pose_;
  SpnavStream stream_;
  SpacenavCounts counts_;
  hal::BridgeFacts facts_;
  std::string path_;  ///< of the socket
  int fd_ = -1;
  bool is_connected_ = false;  ///< also in a replay, which has no descriptor
  int version_ = 0;
  double full_scale_ = hal::kDisplacementFullScale;
  std::uint32_t buttons_ = 0;
  unsigned unknown_in_a_row_ = 0;
  bool told_ = false;  ///< a sample has been given since `open`
  bool lost_ = false;
  const char* end_ = nullptr;  ///< why the connection before has ended
};

/// The bridge `spacenav` of a configuration or a command line. Null, with `defect` filled, for a
/// path that no socket can have.
[[nodiscard]] std::unique_ptr<hal::BridgedDevice> make_spacenav(const hal::DriverOptions& options,
                                                                hal::DriverDefect& defect);

}  // namespace haptic::tools
