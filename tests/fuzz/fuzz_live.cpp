// SPDX-License-Identifier: Apache-2.0
/// What anyone may send to the live view: requests are served only to those who know the token, and
/// messages are what their reader promises, or none.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "tests/fuzz/fuzz_target.hpp"
#include "tools/live/live_protocol.hpp"

namespace {

using namespace haptic::tools;
using haptic::fuzz::require;

/// Lines: target, Host, Origin, subprotocols; a first character each for what they are.
void check_request(std::string_view text) {
  static const AccessRules rules{"0123456789abcdef", "127.0.0.1", 8080, {"https://viewer.example"}};
  std::string_view lines[4];
  for (std::string_view& line : lines) {
    line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
  }
  RequestFacts request;
  request.target = lines[0];
  request.host = lines[1];
  request.origin = lines[2];
  request.origins = lines[2].empty() ? 0 : 1;
  request.protocols = lines[3];
  request.is_upgrade = !lines[3].empty();
  request.is_get = text.empty();
  const Judgement judgement = judge(request, rules);
  if (judgement.kind == RequestKind::kRefused) {
    require(judgement.status >= 400 && judgement.status < 500 && !judgement.why.empty(),
            "a refusal says why");
    require(judgement.why.find(rules.token) == std::string::npos, "no answer tells the token");
    return;
  }
  require(request.host == "127.0.0.1:8080" || request.host == "localhost:8080",
          "served under its own address alone");
  require(request.origins == 0 || request.origin == "http://" + std::string(request.host) ||
              request.origin == rules.origins[0],
          "served to pages that may connect alone");
  require(request.target.find("token=" + rules.token) != std::string_view::npos,
          "served with the token alone");
  require(request.is_get && request.target.starts_with("/?"), "there is one page");
  require((judgement.kind == RequestKind::kPage) == !request.is_upgrade, "a page is no upgrade");
  require(request.protocols.find(judgement.protocol) != std::string_view::npos,
          "a subprotocol that was offered");
}

void check_page_message(std::span<const std::byte> bytes) {
  const auto message = read_page_message(bytes);
  if (!message) return;
  double square = 0;
  for (const double x : message->p_wa_m)
    require(std::isfinite(x) && std::abs(x) <= 1000, "positions are finite and near");
  for (const double x : message->q_wa_xyzw) square += x * x;
  require(std::abs(square - 1) <= 1e-3, "orientations are unit");
  require(std::isfinite(message->stamp), "times are finite");
  require(bytes.size() % 8 == 0 && bytes.size() <= kMostPageMessage_bytes, "of its length");
}

void check_viewer_message(std::string_view text) {
  const auto request = read_foxglove_request(text);
  if (!request) return;
  require(request->subscribe.size() <= 64 && request->unsubscribe.size() <= 64, "bounded lists");
  require(request->unknown.size() <= 64, "a bounded name");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data + 1, size - 1));
  const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
  if (data[0] % 3 == 0) check_request(text);
  if (data[0] % 3 == 1) check_page_message(bytes);
  if (data[0] % 3 == 2) check_viewer_message(text);
  return 0;
}
