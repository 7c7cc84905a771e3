// SPDX-License-Identifier: Apache-2.0
// The live server under connections that are not those of its clients: noise, damaged requests,
// strangers, frames of every shape and length, messages changed in a byte. All are refused or cut
// off, and a page that watches meanwhile gets every tick.
#include <doctest/doctest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <fstream>

#include "tests/host_sim/view/live_clients.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

constexpr auto kViewer = "foxglove.sdk.v1";
constexpr std::size_t kMostHeader = 8192;
/// A server that keeps something of each connection would need more.
constexpr std::size_t kMostGrowth_bytes = 8u << 20;

std::size_t resident_bytes() {
  std::size_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

class Attacker {
 public:
  explicit Attacker(ServedBoard& served) : served_(served), random_(20) {}

  enum Kind : std::size_t {
    kNoise,
    kDamagedRequest,
    kStranger,
    kNoiseAfterUpgrade,
    kFrames,
    kChangedMessage,
    kOversized,
    kKinds
  };
  /// Connects, sends, and reads until the server has closed. @return what it answered.
  std::string attack(Kind kind) {
    std::string head, frames;
    switch (kind) {
      case kNoise:
        head = noise(1 + below(500));
        break;
      case kDamagedRequest:
        head = upgrade(kPage);
        for (int n = 0; n < 3; ++n) head[below(head.size())] = byte();
        break;
      case kStranger:
        head = stranger();
        break;
      case kNoiseAfterUpgrade:
        head = upgrade(kPage);
        frames = noise(1 + below(200));
        break;
      case kFrames:
        head = upgrade(below(2) == 0 ? kPage : kViewer);
        for (std::size_t n = 0; n <= below(4); ++n)
          frames += frame(byte(), below(3) > 0, noise(below(300)), below(4));
        break;
      case kChangedMessage: {
        const bool is_page = below(2) == 0;
        std::string message = is_page ? page_message() : viewer_message();
        for (std::size_t n = 0; n <= below(2); ++n) message[below(message.size())] = byte();
        if (below(4) == 0) message.resize(below(message.size()));
        head = upgrade(is_page ? kPage : kViewer);
        frames = frame(static_cast<char>(is_page ? 0x82 : 0x81), true, message, 0);
        break;
      }
      case kOversized:
        if (below(2) == 0) {
          head = upgrade(kPage, std::string(kMostHeader + below(100000), 'a'));
        } else {
          head = upgrade(below(2) == 0 ? kPage : kViewer);
          frames = frame('\x82', true, std::string(70000 + below(200000), 'x'), 0);
        }
        break;
      case kKinds:
        break;
    }
    return converse(head, frames);
  }

 private:
  std::size_t below(std::size_t end) {
    return std::min(end - 1, static_cast<std::size_t>(random_.next() * static_cast<double>(end)));
  }
  char byte() { return static_cast<char>(below(256)); }
  std::string noise(std::size_t size) {
    std::string text(size, '\0');
    for (char& c : text) c = byte();
    return text;
  }

  [[nodiscard]] std::string request(const std::string& target, const std::string& host,
                                    const std::string& more) const {
    return "GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n" + more + "\r\n";
  }
  [[nodiscard]] std::string upgrade(const std::string& protocol,
                                    const std::string& filling = "-") const {
    return request(served_.target(), served_.host(),
                   "X-Filling: " + filling + "\r\n" + upgrading(protocol));
  }
  [[nodiscard]] static std::string upgrading(const std::string& protocol) {
    return "Upgrade: websocket\r\nConnection: upgrade\r\n"
           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Protocol: " +
           protocol + "\r\n";
  }

  /// One thing about it at least is wrong.
  std::string stranger() {
    const std::size_t wrong = 1 + below(7);
    std::string token = served_.token;
    if ((wrong & 1u) != 0) {
      char& digit = token[below(token.size())];
      digit = digit == 'a' ? 'b' : 'a';
    }
    const std::string hosts[] = {"evil.example:" + std::to_string(served_.port),
                                 served_.host() + ".evil.example", "127.0.0.1", "",
                                 "10.0.0.1:" + std::to_string(served_.port)};
    const std::string origins[] = {"http://evil.example", "null", "http://" + served_.host() + "0",
                                   "file://", "https://" + served_.host()};
    const std::string host = (wrong & 2u) != 0 ? hosts[below(5)] : served_.host();
    std::string more = (wrong & 4u) != 0 ? "Origin: " + origins[below(5)] + "\r\n" : std::string();
    if (below(2) == 0) more += upgrading(below(2) == 0 ? kPage : kViewer);
    return request("/?token=" + token, host, more);
  }

  std::string page_message() {
    std::string message(72, '\0');
    message[0] = '\2';
    const double values[8] = {0.01, 0.02, 0.03, 0, 0, 0, 1, 7};
    std::memcpy(&message[8], values, sizeof values);
    if (below(3) == 0) message = std::string("\1\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16);
    return message;
  }
  static std::string viewer_message() {
    return R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":3},{"id":2,"channelId":4}]})";
  }

  /// `length`: 0 the true one, else one that is not: larger by a little, of 16 bits, of 64 bits.
  std::string frame(char head, bool masked, const std::string& payload, std::size_t length) {
    std::string out(1, head);
    const char mask_bit = masked ? '\x80' : '\0';
    std::uint64_t said = payload.size();
    if (length == 1) said += below(100);
    if (length == 2) said = below(65536);
    if (length == 3) said = ~std::uint64_t{0} >> below(64);
    const std::size_t width = length == 3 || said > 65535 ? 8 : said > 125 || length == 2 ? 2 : 0;
    out += static_cast<char>((width == 8   ? 127
                              : width == 2 ? 126
                                           : static_cast<int>(said)) |
                             mask_bit);
    for (std::size_t k = 0; k < width; ++k)
      out += static_cast<char>(said >> (8 * (width - 1 - k)) & 255u);
    const std::string mask = masked ? noise(4) : std::string(4, '\0');
    if (masked) out += mask;
    for (std::size_t k = 0; k < payload.size(); ++k)
      out += static_cast<char>(payload[k] ^ mask[k % 4]);
    return out;
  }

  /// `frames`: once the head is answered.
  [[nodiscard]] std::string converse(const std::string& head, const std::string& frames) const {
    boost::asio::io_context context;
    tcp::socket socket = connection(context, served_.port);
    beast::error_code error, ignored;
    std::string answer;
    const auto read = [&] {
      char room[4096];
      const std::size_t count = socket.read_some(boost::asio::buffer(room), error);
      if (answer.size() < 65536) answer.append(room, count);
    };
    boost::asio::write(socket, boost::asio::buffer(head), ignored);
    if (!frames.empty()) {
      while (!error && answer.find("\r\n\r\n") == std::string::npos) read();
      boost::asio::write(socket, boost::asio::buffer(frames), ignored);
    }
    socket.shutdown(tcp::socket::shutdown_send, ignored);
    while (!error) read();
    return answer;
  }

  ServedBoard& served_;
  Random random_;
};

bool is_sane(const PageHand& order) {
  double square = 0;
  for (const double x : order.p_wa_m)
    if (!(std::abs(x) <= 1000)) return false;
  for (const double x : order.q_wa_xyzw) square += x * x;
  return std::abs(square - 1) <= 2e-3 && std::isfinite(order.stamp);
}

/// Attacks of all kinds in turn while `goes_on`; what must hold after each. @return how many.
template <typename GoesOn>
std::size_t attack_while(GoesOn goes_on) {
  ServedBoard served(true);
  NewestReader<PageHand> order(*served.hand);
  TestClient witness(served, kPage);
  Attacker attacker(served);
  PageHand last;
  std::uint64_t next = 0, tokens_told = 0, strangers_served = 0;
  std::size_t rounds = 0, resident = 0;
  for (; goes_on(rounds); ++rounds) {
    CAPTURE(rounds);
    const auto kind = static_cast<Attacker::Kind>(rounds % Attacker::kKinds);
    CAPTURE(static_cast<int>(kind));
    const std::string answer = attacker.attack(kind);
    tokens_told += answer.find(served.token) != std::string::npos ? 1u : 0u;
    if (kind == Attacker::kStranger)
      strangers_served += answer.starts_with("HTTP/1.1 403") ? 0u : 1u;
    // What a page may say moves the hand; nothing else does.
    const PageHand now = order.newest();
    REQUIRE(is_sane(now));
    if (kind != Attacker::kFrames && kind != Attacker::kChangedMessage)
      REQUIRE((now.wanted == last.wanted && now.restarts == last.restarts));
    last = now;
    served.publish(3);
    std::size_t got = 0;
    while (got < 3) {
      witness.ask(next);
      const TestChunk chunk = chunk_of(witness.read());
      REQUIRE(chunk.head.first == next);
      for (std::size_t k = 0; k < chunk.ticks.size(); ++k)
        REQUIRE(chunk.ticks[k].state_hash == next + k);
      next += chunk.ticks.size();
      got += chunk.ticks.size();
    }
    if (rounds == 1000) resident = resident_bytes();
  }
  CHECK(next == served.published);
  CHECK(tokens_told == 0);
  CHECK(strangers_served == 0);
  // Frames got as far as the reader of messages, and were refused there.
  CHECK(served.server->counts().cut > rounds / 50);
  if (resident > 0) CHECK(resident_bytes() < resident + kMostGrowth_bytes);
  CHECK(ask(served.port, {served.target(), served.host(), ""}).status == 200);
  const haptic::tools::LiveCounts& counts = served.server->counts();
  MESSAGE(rounds << " connections: " << counts.refused.load() << " of " << counts.requests.load()
                 << " requests refused, " << counts.cut.load() << " clients cut off, " << next
                 << " ticks of a page that watches, none lost; memory grew by "
                 << (resident > 0
                         ? (static_cast<double>(resident_bytes()) - static_cast<double>(resident)) /
                               1024
                         : 0)
                 << " kB from the 1000th on");
  return rounds;
}

}  // namespace

TEST_SUITE("host_sim.live_fuzz") {
  TEST_CASE("bytes of all kinds, before and after the upgrade: refused, nothing lost") {
    CHECK(attack_while([](std::size_t rounds) { return rounds < 700; }) == 700);
  }

  TEST_CASE("ten minutes of bytes of all kinds [long]") {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(10);
    CHECK(attack_while([&](std::size_t) { return std::chrono::steady_clock::now() < end; }) > 700);
  }
}
