// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A client of a service by HTTP and WebSocket in which every wait has an end. Each object is used
/// by one thread at a time. Times are of CLOCK_MONOTONIC.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "hal/bridge/device_tap.hpp"

namespace haptic::tools {

struct HttpAnswer {
  unsigned status = 0;
  std::string body;  ///< at most `most_bytes`
};

/// One GET. False, with `why` in a few words for people: no answer by `until_ns`, refused, too
/// long.
/// @param host  a name or an address; a name is looked up, which is the system's to bound
[[nodiscard]] bool http_get(const std::string& host, std::uint16_t port, const std::string& target,
                            std::size_t most_bytes, std::int64_t until_ns, HttpAnswer& answer,
                            std::string& why);

/// One WebSocket. Texts come and go whole.
class ServiceSocket {
 public:
  enum class Got : std::uint8_t {
    kText = 0,
    kNothing,  ///< until then
    kClosed,   ///< by the other side, or by what it sent; no text will come
    kTooLong   ///< as kClosed
  };

  /// @param tap  hears each text, whole; may be null
  explicit ServiceSocket(std::size_t most_bytes, std::shared_ptr<hal::DeviceTap> tap = nullptr);
  ServiceSocket(const ServiceSocket&) = delete;
  ServiceSocket& operator=(const ServiceSocket&) = delete;
  ~ServiceSocket();

  [[nodiscard]] bool connect(const std::string& host, std::uint16_t port, std::int64_t until_ns,
                             std::string& why);
  /// The next text; waits until `until_ns` at most.
  [[nodiscard]] Got receive(std::string& text, std::int64_t until_ns);
  /// False: it could not be handed to the system, because the one before it could not or the other
  /// side is gone.
  [[nodiscard]] bool send(std::string_view text, std::int64_t until_ns);
  /// Says goodbye, until `until_ns` at most.
  void close(std::int64_t until_ns);

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace haptic::tools
