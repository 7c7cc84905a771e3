// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_live: what is served, and messages of each kind.
#include <cstring>

#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

std::string hand(std::initializer_list<double> values) {
  std::string bytes("\1\2\0\0\0\0\0\0\0", 9);
  for (const double value : values)
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes;
}

}  // namespace

std::vector<Seed> seeds() {
  const std::string target = std::string(1, '\0') + "/?token=0123456789abcdef\n";
  return {{"page", target + "127.0.0.1:8080\n"},
          {"local", target + "localhost:8080\nhttp://localhost:8080\n"},
          {"live", target + "127.0.0.1:8080\nhttp://127.0.0.1:8080\nhaptic.live.v1\n"},
          {"viewer", target + "127.0.0.1:8080\nhttps://viewer.example\nx, foxglove.sdk.v1\n"},
          {"foreign_host", target + "evil.example:8080\n"},
          {"foreign_origin", target + "127.0.0.1:8080\nhttp://evil.example\n"},
          {"more", std::string(1, '\0') + "/?a=b&token=0123456789abcdef&c\n[::1]:8080\n\n\nx"},
          {"ask", std::string("\1\1\0\0\0\0\0\0\0\7\0\0\0\0\0\0\0", 17)},
          {"restart", std::string("\1\3\0\0\0\0\0\0\0", 9)},
          {"hand", hand({0.1, -0.2, 3e-3, 0, 0.6, 0, 0.8, 1234.5})},
          {"far", hand({1e300, 0, 0, 0, 0, 0, 1, 0})},
          {"subscribe", "\2{\"op\":\"subscribe\",\"subscriptions\":[{\"id\":1,\"channelId\":2}]}"},
          {"unsubscribe", "\2{\"op\":\"unsubscribe\",\"subscriptionIds\":[1,2]}"},
          {"other", "\2{\"op\":\"getParameters\"}"}};
}

}  // namespace haptic::fuzz
