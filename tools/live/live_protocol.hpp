// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a request to the live server may be, and what its clients may say: pure functions over
/// bytes from anyone, apart from all sockets.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tools/live/live_board.hpp"

namespace haptic::tools {

/// Subprotocol of the page, and the two names of one protocol of Foxglove.
inline constexpr std::string_view kPageProtocol = "haptic.live.v1";
inline constexpr std::string_view kFoxgloveProtocols[] = {"foxglove.sdk.v1",
                                                          "foxglove.websocket.v1"};

// Who may ask.

struct AccessRules {
  std::string token;    ///< of the URL that was printed; hexadecimal digits
  std::string address;  ///< that the server listens on, as digits
  std::uint16_t port = 0;
  std::vector<std::string> origins;  ///< of pages of others that may connect
};

/// What a request says of itself; empty: it does not say.
struct RequestFacts {
  bool is_get = false;
  bool is_upgrade = false;  ///< to a WebSocket
  std::string_view target, host, origin, protocols;
  std::size_t hosts = 1, origins = 0;  ///< how many such fields there are
};

enum class RequestKind : std::uint8_t {
  kRefused = 0,  ///< Judgement::status says how
  kPage,         ///< the page itself
  kLive,         ///< the page's connection
  kFoxglove
};
struct Judgement {
  RequestKind kind = RequestKind::kRefused;
  unsigned status = 403;  ///< of HTTP, where refused
  std::string why;        ///< for the person who sees it
  std::string protocol;   ///< that was chosen
};

/// A foreign Host (another name than localhost or the address, which a page of another site may
/// lead here), a foreign Origin or a wrong token: 403, before anything else is looked at.
[[nodiscard]] Judgement judge(const RequestFacts& request, const AccessRules& rules);

/// Whether a Host field names this server by its address or as localhost.
[[nodiscard]] bool is_own_host(std::string_view host, const AccessRules& rules);

/// 128 bits of the system, as hexadecimal digits. @throws OsError.
[[nodiscard]] std::string new_token();

// What a page says, binary, little-endian: a kind, zero, then the values.

enum class PageMessageKind : std::uint32_t {
  kAsk = 1,     ///< u64: send the ticks from this number on, and the newest state; once
  kHand = 2,    ///< 7 doubles: pose (position, quaternion x y z w); a double: the page's time
  kRestart = 3  ///< the session begins again
};
struct PageMessage {
  PageMessageKind kind = PageMessageKind::kAsk;
  std::uint64_t first = 0;
  double p_wa_m[3] = {}, q_wa_xyzw[4] = {0, 0, 0, 1};  ///< finite, near, unit
  double stamp = 0;                                    ///< finite
};
inline constexpr std::size_t kMostPageMessage_bytes = 72;

/// Nothing: it is no such message.
[[nodiscard]] std::optional<PageMessage> read_page_message(std::span<const std::byte> bytes);

/// A page is sent: head, newest state, ticks, poses of driven parts in the order of the ticks.
struct ChunkHead {
  std::uint32_t magic = 0x33564C48;  // "HLV3"
  std::uint32_t ticks = 0;
  std::uint64_t first = 0;    ///< number of the first tick
  std::uint64_t written = 0;  ///< ticks of the session so far
  std::uint64_t given = 0;    ///< poses of driven parts
};
static_assert(sizeof(ChunkHead) == 32);
[[nodiscard]] std::string chunk_message(const LiveState& state, std::uint64_t first,
                                        std::uint64_t written, std::span<const LiveTick> ticks,
                                        std::span<const GivenPose> given = {});

// What a viewer of others says: text, JSON.

struct Subscription {
  std::uint32_t id = 0, channel = 0;
};
struct FoxgloveRequest {
  std::vector<Subscription> subscribe;
  std::vector<std::uint32_t> unsubscribe;
  std::string unknown;  ///< an operation that this server does not have
};
inline constexpr std::size_t kMostFoxgloveMessage_bytes = 65536;
/// Nothing: it is no such message.
[[nodiscard]] std::optional<FoxgloveRequest> read_foxglove_request(std::string_view text);

}  // namespace haptic::tools
