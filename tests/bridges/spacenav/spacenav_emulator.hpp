// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A spacenavd without a device: its socket, both versions of its protocol, and what it makes of
/// the kernel's events. Written from the daemon's public description (proto.h, proto_unix.c, dev.c,
/// event.c; facts only); shares no code with the bridge. libspnav judges it in test_libspnav.cpp.

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace haptic::test {

struct EmulatedDevice {
  std::string name = "3Dconnexion SpaceMouse Wireless";
  std::int32_t id = 0, type = 0x20c;
  std::int32_t vendor_id = 0x256f, product_id = 0xc62e;
  /// The kernel calls the axes absolute: it has events for changes alone, and the daemon maps
  /// `minimum` to `maximum` to -500 to 500. Relative: events for what is not zero.
  bool absolute = true;
  std::int32_t minimum = -500, maximum = 500;
  bool swap_yz = true, invert_yz = true;  ///< the daemon's flags of a current model
};

/// Owner: the test's thread, which makes all calls. The daemon has one of its own, which answers.
class SpacenavEmulator {
 public:
  /// @param version  newest that it knows; 0: as spacenavd 0.8, which takes any four bytes for a
  ///                 sensitivity.
  explicit SpacenavEmulator(std::string path, int version = 1);
  ~SpacenavEmulator() { kill(); }
  SpacenavEmulator(const SpacenavEmulator&) = delete;
  SpacenavEmulator& operator=(const SpacenavEmulator&) = delete;

  /// Listens; false: it cannot.
  [[nodiscard]] bool start();
  /// As by SIGKILL: connections end, the socket's file stays.
  void kill();
  void plug(const EmulatedDevice& device);
  void unplug();
  /// Waits for this long before each answer.
  void answer_after(int ms) { answer_after_ms_ = ms; }
  /// Answers nothing from now on, or again.
  void be_mute(bool mute) { mute_ = mute; }
  /// Behind each answer, in one piece with it.
  void say_behind_answers(std::vector<std::int32_t> words) { behind_ = std::move(words); }
  /// Answers no request but that for a version.
  void answer_version_alone(bool alone) { version_alone_ = alone; }

  /// A report of the device, in its own axes.
  void report(const std::array<std::int16_t, 6>& raw);
  void press(std::int32_t button, bool pressed);
  /// To all clients, as they are.
  void say(std::span<const std::int32_t> words);
  void say_bytes(std::span<const std::byte> bytes);

  // What the clients have asked for.
  [[nodiscard]] std::size_t clients();
  [[nodiscard]] std::string client_name();
  [[nodiscard]] float sensitivity();
  [[nodiscard]] std::int32_t mask();
  [[nodiscard]] int client_version();

 private:
  struct Client {
    int fd = -1;
    int version = 0;
    std::int32_t mask = 3;
    float sensitivity = 1;
    std::string name;
    std::array<std::byte, 32> request{};
    std::size_t held = 0;
  };

  void serve();
  [[nodiscard]] bool hear(Client& client);
  void answer(Client& client, std::array<std::int32_t, 8> unit);
  void answer_text(Client& client, std::int32_t type, const std::string& text);
  void pause() const;
  void event(std::int32_t mask, const std::array<std::int32_t, 8>& unit);
  [[nodiscard]] Client last();

  const std::string path_;
  const int version_;
  std::thread thread_;
  std::mutex mutex_;
  std::atomic<bool> stop_{false}, mute_{false}, version_alone_{false};
  std::atomic<int> answer_after_ms_{0};
  int listening_ = -1;
  int wake_[2] = {-1, -1};
  std::vector<Client> clients_;
  std::vector<std::int32_t> behind_;
  bool plugged_ = false;
  EmulatedDevice device_;
  std::array<std::int16_t, 6> raw_{};     ///< by axis of the device, as the kernel has it
  std::array<std::int32_t, 6> motion_{};  ///< by axis of the event; stays between events
};

}  // namespace haptic::test
