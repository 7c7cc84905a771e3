// SPDX-License-Identifier: Apache-2.0
#include "tools/live/live_protocol.hpp"

#include <arpa/inet.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFarthest_m = 1.0e3, kUnitTolerance = 1.0e-3;
constexpr std::size_t kMostSubscriptions = 64;

Judgement refused(unsigned status, std::string why) {
  return {RequestKind::kRefused, status, std::move(why), {}};
}

/// Takes the same time wherever the first difference is.
bool same_secret(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned char differs = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    differs = static_cast<unsigned char>(differs | (a[k] ^ b[k]));
  return differs == 0;
}

/// Value of `name` in the query of a target.
std::string_view query_value(std::string_view target, std::string_view name) {
  const std::size_t mark = target.find('?');
  if (mark == std::string_view::npos) return {};
  std::string_view query = target.substr(mark + 1);
  query = query.substr(0, query.find('#'));
  while (!query.empty()) {
    const std::string_view part = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), part.size() + 1));
    const std::size_t equal = part.find('=');
    if (equal != std::string_view::npos && part.substr(0, equal) == name)
      return part.substr(equal + 1);
  }
  return {};
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// The first of the names that are offered which this server speaks.
std::string_view chosen_protocol(std::string_view offered) {
  while (!offered.empty()) {
    const std::string_view part = offered.substr(0, offered.find(','));
    offered.remove_prefix(std::min(offered.size(), part.size() + 1));
    const std::string_view name = trimmed(part);
    if (name == kPageProtocol) return kPageProtocol;
    for (const std::string_view known : kFoxgloveProtocols)
      if (name == known) return known;
  }
  return {};
}

/// An address of the Internet protocol in its binary form; empty: `text` is none.
std::string packed(const std::string& text) {
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET, text.c_str(), bytes.data()) == 1)
    return {reinterpret_cast<const char*>(bytes.data()), 4};
  if (inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1)
    return {reinterpret_cast<const char*>(bytes.data()), 16};
  return {};
}

template <typename Number>
Number number_at(std::span<const std::byte> bytes, std::size_t at) {
  Number value{};
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

template <typename Plain>
void append(std::string& out, const Plain& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
static_assert(std::endian::native == std::endian::little, "the messages are");

std::optional<std::uint32_t> number_in(const Json& json) {
  if (!json.is_number_unsigned()) return std::nullopt;
  const auto value = json.get<std::uint64_t>();
  if (value > 0xFFFFFFFFu) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

const Json* member(const Json& json, const char* name) {
  if (!json.is_object()) return nullptr;
  const auto found = json.find(name);
  return found == json.end() ? nullptr : &*found;
}

}  // namespace

bool is_own_host(std::string_view host, const AccessRules& rules) {
  std::string_view name = host, port;
  const std::size_t colon = host.rfind(':');
  if (!host.empty() && host.back() != ']' && colon != std::string_view::npos) {
    name = host.substr(0, colon);
    port = host.substr(colon + 1);
  }
  if (port != std::to_string(rules.port) && !(port.empty() && rules.port == 80)) return false;
  const bool bracketed = name.size() > 2 && name.front() == '[' && name.back() == ']';
  const std::string own = packed(rules.address);
  const bool everywhere = std::ranges::all_of(own, [](char c) { return c == 0; });
  const bool loopback = own == packed("127.0.0.1") || own == packed("::1");
  if (name == "localhost") return loopback || everywhere;
  const std::string asked = packed(std::string(bracketed ? name.substr(1, name.size() - 2) : name));
  if (asked.empty() || bracketed != (asked.size() == 16)) return false;
  // Listening everywhere: any address as digits. A name could be one that another site controls.
  return everywhere || asked == own;
}

Judgement judge(const RequestFacts& request, const AccessRules& rules) {
  if (request.hosts != 1 || !is_own_host(request.host, rules))
    return refused(403, "this server answers only under its own address");
  if (request.origins > 1) return refused(403, "a request comes from one page");
  if (request.origins == 1) {
    const bool own = request.origin == "http://" + std::string(request.host);
    const bool allowed = std::ranges::find(rules.origins, request.origin) != rules.origins.end();
    if (!own && !allowed)
      return refused(403,
                     "pages of this origin may not connect; --allow-origin names those that may");
  }
  if (rules.token.empty() || !same_secret(query_value(request.target, "token"), rules.token))
    return refused(403, "open the address with the token that the program has printed");
  if (!request.is_get) return refused(405, "only GET is answered");
  if (request.target.substr(0, request.target.find('?')) != "/")
    return refused(404, "there is one page here, /");
  if (!request.is_upgrade) return {RequestKind::kPage, 200, {}, {}};
  const std::string_view protocol = chosen_protocol(request.protocols);
  if (protocol.empty())
    return refused(400,
                   "a connection names one of the subprotocols haptic.live.v1, foxglove.sdk.v1 and "
                   "foxglove.websocket.v1");
  return {protocol == kPageProtocol ? RequestKind::kLive : RequestKind::kFoxglove,
          101,
          {},
          std::string(protocol)};
}

std::string new_token() {
  std::array<unsigned char, 16> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw OsError("the system gives no random bytes for the token of the URL");
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::optional<PageMessage> read_page_message(std::span<const std::byte> bytes) {
  if (bytes.size() < 8 || bytes.size() > kMostPageMessage_bytes) return std::nullopt;
  if (number_at<std::uint32_t>(bytes, 4) != 0) return std::nullopt;
  PageMessage message;
  message.kind = static_cast<PageMessageKind>(number_at<std::uint32_t>(bytes, 0));
  switch (message.kind) {
    case PageMessageKind::kAsk:
      if (bytes.size() != 16) return std::nullopt;
      message.first = number_at<std::uint64_t>(bytes, 8);
      return message;
    case PageMessageKind::kRestart:
      if (bytes.size() != 8) return std::nullopt;
      return message;
    case PageMessageKind::kHand:
      break;
    default:
      return std::nullopt;
  }
  if (bytes.size() != kMostPageMessage_bytes) return std::nullopt;
  double square = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    message.p_wa_m[k] = number_at<double>(bytes, 8 + 8 * k);
    // Comparisons with NaN are false.
    if (!(std::abs(message.p_wa_m[k]) <= kFarthest_m)) return std::nullopt;
  }
  for (std::size_t k = 0; k < 4; ++k) {
    message.q_wa_xyzw[k] = number_at<double>(bytes, 32 + 8 * k);
    square += message.q_wa_xyzw[k] * message.q_wa_xyzw[k];
  }
  if (!(std::abs(square - 1) <= kUnitTolerance)) return std::nullopt;
  message.stamp = number_at<double>(bytes, 64);
  if (!std::isfinite(message.stamp)) return std::nullopt;
  return message;
}

std::string chunk_message(const LiveState& state, std::uint64_t first, std::uint64_t written,
                          std::span<const LiveTick> ticks, std::span<const GivenPose> given) {
  ChunkHead head;
  head.ticks = static_cast<std::uint32_t>(ticks.size());
  head.first = first;
  head.written = written;
  head.given = given.size();
  std::string out;
  out.reserve(sizeof head + sizeof state + ticks.size_bytes() + given.size_bytes());
  append(out, head);
  append(out, state);
  out.append(reinterpret_cast<const char*>(ticks.data()), ticks.size_bytes());
  out.append(reinterpret_cast<const char*>(given.data()), given.size_bytes());
  return out;
}

std::optional<FoxgloveRequest> read_foxglove_request(std::string_view text) {
  if (text.size() > kMostFoxgloveMessage_bytes) return std::nullopt;
  const Json json = Json::parse(text, nullptr, false);
  const Json* op = member(json, "op");
  if (op == nullptr || !op->is_string()) return std::nullopt;
  FoxgloveRequest request;
  const auto name = op->get<std::string>();
  if (name == "subscribe") {
    const Json* list = member(json, "subscriptions");
    if (list == nullptr || !list->is_array() || list->size() > kMostSubscriptions)
      return std::nullopt;
    for (const Json& entry : *list) {
      const Json* id = member(entry, "id");
      const Json* channel = member(entry, "channelId");
      if (id == nullptr || channel == nullptr) return std::nullopt;
      const auto id_number = number_in(*id), channel_number = number_in(*channel);
      if (!id_number || !channel_number) return std::nullopt;
      request.subscribe.push_back({*id_number, *channel_number});
    }
  } else if (name == "unsubscribe") {
    const Json* list = member(json, "subscriptionIds");
    if (list == nullptr || !list->is_array() || list->size() > kMostSubscriptions)
      return std::nullopt;
    for (const Json& entry : *list) {
      const auto number = number_in(entry);
      if (!number) return std::nullopt;
      request.unsubscribe.push_back(*number);
    }
  } else {
    request.unknown = name.substr(0, 64);
  }
  return request;
}

}  // namespace haptic::tools
