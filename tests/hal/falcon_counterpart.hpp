// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A Falcon as the bus sees it: the FTDI bridge with its line settings, the boot loader that echoes
/// an image, the firmware that answers packets. Written from the facts in the drivers' headers, for
/// tests; usable as the port of a driver's start, or byte by byte behind a simulated bus.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "hal/drivers/falcon_codec.hpp"
#include "hal/drivers/falcon_kinematics.hpp"
#include "tests/support/device_counterpart.hpp"

namespace haptic::test {

/// Faults; the default is a good device.
struct FalconFaults {
  bool silent = false;          ///< the bridge works, nothing behind it answers
  int deaf_greetings = 0;       ///< first messages that get no answer
  bool wrong_greeting = false;  ///< answered with other bytes
  bool leading_zero = false;    ///< a zero before the answer, as some hosts see it
  long wrong_echo_at = -1;      ///< byte of the image that comes back changed
  long silent_echo_at = -1;     ///< byte of the image from which on nothing comes back
  int bad_loads = 1 << 30;      ///< how many loads the two above spoil
  bool firmware_dead = false;   ///< loads well and then does not run
  int gone_after_calls = -1;    ///< port calls until it is unplugged
  int cancelled_after_calls = -1;
};

class FalconCounterpart : public DeviceCounterpart {
 public:
  /// `image_bytes`: what its loader takes before it starts the firmware.
  explicit FalconCounterpart(std::size_t image_bytes) : image_bytes_(image_bytes) {}

  FalconFaults faults;
  int home_after = 0;  ///< packets in homing mode until all three encoders are homed
  std::size_t in_payload = hal::kFtdiPacketBytes - hal::kFtdiStatusBytes;  ///< per IN packet
  std::array<std::int16_t, 3> counts{};
  std::uint8_t buttons = 0;

  // World side.
  /// Forgets the firmware and the homing.
  void power_cycle();
  /// As after an earlier load.
  void power_up_loaded();
  /// False where the arm does not reach the position.
  bool move_to(const hal::Column3& position_f);
  void lose_homing() { homing_packets_ = 0; }
  [[nodiscard]] bool runs() const { return running_; }
  [[nodiscard]] const std::vector<std::uint8_t>& image() const { return image_; }
  [[nodiscard]] const hal::FalconCommand& last_command() const { return last_command_; }
  [[nodiscard]] int packets() const { return packets_; }
  [[nodiscard]] int loads() const { return loads_; }

  // Bytes.
  bool on_control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                  std::size_t& moved) override;
  bool on_out(std::span<const std::uint8_t> bytes) override;
  /// One IN packet into `bytes`; at least the two status bytes.
  std::size_t on_in(std::span<std::uint8_t> bytes) override;

  [[nodiscard]] bool cancelled() const noexcept override;

 private:
  enum class Boot : std::uint8_t { kDeaf, kGreeting, kGreeted, kLoading };
  void reset_boot();
  void on_modem(std::uint16_t value);
  void boot_byte(std::uint8_t byte);
  void load_byte(std::uint8_t byte);
  void run_byte(std::uint8_t byte);
  bool is_gone() override;

  std::size_t image_bytes_;
  std::uint16_t baud_ = 0, latency_ms_ = 16;
  bool dtr_ = false, rts_ = true;
  Boot boot_ = Boot::kDeaf;
  int greetings_ = 0;
  std::vector<std::uint8_t> heard_, image_;
  std::deque<std::uint8_t> to_host_;
  bool running_ = false;
  hal::FalconStream stream_;
  hal::FalconCommand last_command_;
  int packets_ = 0, homing_packets_ = 0, loads_ = 0, calls_ = 0;
  hal::FalconKinematics arm_;
};

}  // namespace haptic::test
