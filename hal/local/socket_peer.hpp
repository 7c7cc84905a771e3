// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device in another process, behind a Unix socket (socket_message.hpp): its bytes travel as they
/// would on a bus, and who dies there or here is noticed as on a bus.

#include <cstdint>
#include <string>
#include <utility>

#include "hal/local/local_peer.hpp"
#include "hal/socket_message.hpp"

namespace haptic::hal {

/// Owner: the link's thread. Nothing blocks but `control` and `read`, for at most their time.
class SocketPeer final : public LocalPeer {
 public:
  explicit SocketPeer(std::string path) : path_(std::move(path)), name_("unix:" + path_) {}
  ~SocketPeer() override { unplug(); }
  SocketPeer(const SocketPeer&) = delete;
  SocketPeer& operator=(const SocketPeer&) = delete;

  /// @retval kDeviceNotFound  nobody listens
  /// @retval kDeviceDenied    this user may not connect
  HalStatus plug(std::int64_t now_ns) noexcept override;
  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved) noexcept override;
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override;
  std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes) noexcept override;
  void command(std::int64_t now_ns, std::span<const std::uint8_t> bytes) noexcept override;

  void wait(std::int64_t until_ns) noexcept override;
  HalStatus write(std::span<const std::uint8_t> bytes) noexcept override;
  HalStatus read(std::span<std::uint8_t> bytes, std::size_t& moved,
                 unsigned timeout_ms) noexcept override;
  [[nodiscard]] bool gone() const noexcept override { return gone_; }
  void unplug() noexcept override;
  [[nodiscard]] int descriptor() const noexcept override { return socket_; }
  [[nodiscard]] const char* name() const noexcept override { return name_.c_str(); }

 private:
  /// Receives the next message of the kind wanted and drops all others; its length, 0: none within
  /// the time.
  [[nodiscard]] std::size_t receive(SocketMessage wanted, std::span<std::uint8_t> bytes,
                                    std::int64_t until_ns) noexcept;
  [[nodiscard]] bool say(SocketMessage kind, std::span<const std::uint8_t> bytes) noexcept;

  std::string path_, name_;
  int socket_ = -1;
  bool gone_ = false;
};

}  // namespace haptic::hal
