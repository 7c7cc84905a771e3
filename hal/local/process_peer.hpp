// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A device in another process: it is found, asked and missed by a Unix socket
/// (socket_message.hpp), and its reports and our commands are in memory that both share
/// (carrier_memory.hpp), the newest of each.

#include <cstdint>
#include <string>
#include <utility>

#include "hal/local/carrier_memory.hpp"
#include "hal/local/local_peer.hpp"
#include "hal/socket_message.hpp"

namespace haptic::hal {

/// Owner: the link's thread. Nothing blocks but `plug`, `control` and `read`, for at most their
/// time; nothing that the other process does makes it longer.
class ProcessPeer final : public LocalPeer {
 public:
  explicit ProcessPeer(std::string path) : path_(std::move(path)), name_("unix:" + path_) {}
  ~ProcessPeer() override { unplug(); }
  ProcessPeer(const ProcessPeer&) = delete;
  ProcessPeer& operator=(const ProcessPeer&) = delete;

  /// @retval kDeviceNotFound  nobody listens
  /// @retval kDeviceDenied    this user may not connect
  /// @retval kDeviceBusy      it serves another host
  /// @retval kDeviceUnfit     it speaks another version of socket_message.hpp
  HalStatus plug(std::int64_t now_ns) noexcept override;
  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved) noexcept override;
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override;
  std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                     std::int64_t& sampled_ns) noexcept override;
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
  [[nodiscard]] HalStatus open_socket() noexcept;
  [[nodiscard]] HalStatus share_memory() noexcept;
  bool say(SocketMessage kind, std::span<const std::uint8_t> bytes) noexcept;
  void wait_for_message(std::int64_t until_ns) noexcept;
  [[nodiscard]] std::size_t receive(SocketMessage wanted, std::span<std::uint8_t> bytes,
                                    std::int64_t until_ns) noexcept;

  std::string path_, name_;
  int socket_ = -1;
  bool gone_ = false;
  std::int64_t woken_ns_ = 0;  ///< when a report woke us last
  CarrierMemory memory_;
};

}  // namespace haptic::hal
