// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A live server in this process, and what connects to it: requests, WebSockets, bare bytes.

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/host_sim/sample_scenes.hpp"
#include "tools/common/scene_bytes.hpp"
#include "tools/live/live_server.hpp"

namespace haptic::sim::test {

using namespace haptic::tools;

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = boost::asio::ip::tcp;

constexpr auto kPage = "haptic.live.v1";  // the protocol that the page speaks

/// Serves a board that the test fills.
class ServedBoard {
 public:
  /// `look`: before each look of the server at the board, in its thread.
  explicit ServedBoard(bool takes_hand, std::vector<std::string> origins = {},
                       const std::function<void(LiveBoard&)>& look = {})
      : board(std::make_unique<LiveBoard>()),
        hand(takes_hand ? std::make_unique<HandBoard>() : nullptr),
        writer(*board),
        bytes_(scene_of(tetrahedron(), box(0.1, 0.06, 0.05))) {
    if (SceneView::open(bytes_.span(), scene) != RtStatus::kOk) std::abort();
    ListeningSocket socket("127.0.0.1", 0);
    port = socket.port();
    LiveOffer offer;
    offer.scene = &scene;
    offer.board = board.get();
    offer.hand = hand.get();
    if (look) offer.before_look = [this, look] { look(*board); };
    offer.page = "<meta connect-src @CONNECT@>";
    server = std::make_unique<LiveServer>(
        socket, AccessRules{token, "127.0.0.1", port, std::move(origins)}, std::move(offer));
    thread_ = std::thread([this] { server->run(); });
  }
  ~ServedBoard() {
    server->stop();
    thread_.join();
  }

  /// Ticks whose numbers are their hashes.
  void publish(std::uint64_t count) {
    for (std::uint64_t k = 0; k < count; ++k) {
      LiveTick tick;
      tick.state_hash = tick.sequence = published;
      tick.marks = published == 0 ? std::uint64_t{kMarkReset} : 0;
      LiveState state;
      state.record.t_s = 1e-3 * static_cast<double>(published);
      state.record.force_n[2] = static_cast<double>(published);
      state.record.situation =
          published % 1000 < 500 ? ContactSituation::kNone : ContactSituation::kFaceFace;
      writer.publish(tick, state);
      ++published;
    }
  }

  [[nodiscard]] std::string host() const { return "127.0.0.1:" + std::to_string(port); }
  [[nodiscard]] std::string target() const { return "/?token=" + token; }

  const std::string token = new_token();
  std::unique_ptr<LiveBoard> board;
  std::unique_ptr<HandBoard> hand;
  LiveWriter writer;
  SceneView scene;
  std::uint64_t published = 0;
  std::uint16_t port = 0;
  std::unique_ptr<LiveServer> server;

 private:
  tools::SceneBytes bytes_;
  std::thread thread_;
};

inline tcp::socket connection(boost::asio::io_context& context, std::uint16_t port) {
  tcp::socket socket(context);
  socket.connect({boost::asio::ip::address_v4::loopback(), port});
  return socket;
}

struct Answer {
  unsigned status = 0;  ///< 0: the connection was closed without one
  std::string body, policy;
};
struct Asked {
  std::string target, host, origin;
  http::verb verb = http::verb::get;
  bool upgrades = false;  ///< to a WebSocket of subprotocol `protocol`
  std::string protocol = {};
};
inline Answer ask(std::uint16_t port, const Asked& asked) {
  boost::asio::io_context context;
  tcp::socket socket = connection(context, port);
  http::request<http::string_body> request(asked.verb, asked.target, 11);
  request.set(http::field::host, asked.host);
  if (!asked.origin.empty()) request.set(http::field::origin, asked.origin);
  if (asked.upgrades) {
    request.set(http::field::connection, "Upgrade");
    request.set(http::field::upgrade, "websocket");
    request.set(http::field::sec_websocket_version, "13");
    request.set(http::field::sec_websocket_key, "dGhlIHNhbXBsZSBub25jZQ==");
    if (!asked.protocol.empty()) request.set(http::field::sec_websocket_protocol, asked.protocol);
  }
  beast::error_code error;
  http::write(socket, request, error);
  beast::flat_buffer buffer;
  http::response<http::string_body> response;
  http::read(socket, buffer, response, error);
  if (error) return {};
  return {response.result_int(), response.body(),
          std::string(response[http::field::x_frame_options])};
}

/// A WebSocket client that waits for what it reads.
class TestClient {
 public:
  /// `status`: 101 where it is connected.
  TestClient(const ServedBoard& served, const std::string& protocol, const std::string& origin = {})
      : TestClient(served, protocol, origin, served.target(), served.host()) {}
  TestClient(const ServedBoard& served, const std::string& protocol, const std::string& origin,
             const std::string& target, const std::string& host)
      : socket(connection(context, served.port)) {
    socket.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
      if (!protocol.empty()) request.set(http::field::sec_websocket_protocol, protocol);
      if (!origin.empty()) request.set(http::field::origin, origin);
    }));
    beast::error_code error;
    websocket::response_type response;
    socket.handshake(response, host, target, error);
    // Where it is declined this client says no more than that.
    status =
        error ? sim::test::ask(served.port, {target, host, origin, http::verb::get, true, protocol})
                    .status
              : response.result_int();
    chosen = std::string(response[http::field::sec_websocket_protocol]);
  }

  void send(std::string_view bytes, bool is_text = false) {
    socket.text(is_text);
    beast::error_code error;
    socket.write(boost::asio::buffer(bytes.data(), bytes.size()), error);
  }
  /// Empty: the server has closed; `closed` says how.
  /// @throws std::runtime_error where nothing comes within `patience`: a message is lost.
  std::string read() {
    beast::flat_buffer buffer;
    beast::error_code error;
    bool is_over = false;
    socket.async_read(buffer, [&](beast::error_code ended, std::size_t) {
      error = ended;
      is_over = true;
    });
    context.restart();
    context.run_for(patience);
    if (!is_over) {
      // The read refers to this frame: it ends before the frame does.
      beast::get_lowest_layer(socket).close(error);
      context.run();
      throw std::runtime_error("no message of the server within " +
                               std::to_string(patience.count()) + " ms: one is lost");
    }
    if (error) {
      closed = socket.reason().code;
      return {};
    }
    return beast::buffers_to_string(buffer.data());
  }

  void ask(std::uint64_t first) {
    std::string message(16, '\0');
    message[0] = 1;
    std::memcpy(&message[8], &first, 8);
    send(message);
  }
  /// x, y, z, q x, y, z, w, stamp.
  void move(const std::vector<double>& values) {
    std::string message(8, '\0');
    message[0] = 2;
    message.append(reinterpret_cast<const char*>(values.data()), 8 * values.size());
    send(message);
  }

  /// Longer than any answer takes on a machine under load.
  std::chrono::milliseconds patience{10'000};

  boost::asio::io_context context;
  websocket::stream<tcp::socket> socket;
  unsigned status = 0;
  std::string chosen;
  std::uint16_t closed = 0;
};

/// What a page is sent.
struct TestChunk {
  ChunkHead head;
  LiveState state;
  std::vector<LiveTick> ticks;
  std::vector<GivenPose> given;
};
inline TestChunk chunk_of(const std::string& message) {
  TestChunk chunk;
  if (message.size() < sizeof chunk.head + sizeof chunk.state) return chunk;
  std::memcpy(&chunk.head, message.data(), sizeof chunk.head);
  std::memcpy(&chunk.state, message.data() + sizeof chunk.head, sizeof chunk.state);
  chunk.ticks.resize(chunk.head.ticks);
  const std::size_t at = sizeof chunk.head + sizeof chunk.state;
  chunk.given.resize(chunk.head.given);
  const std::size_t of_ticks = chunk.ticks.size() * sizeof(LiveTick);
  const std::size_t of_given = chunk.given.size() * sizeof(GivenPose);
  if (message.size() != at + of_ticks + of_given) return {};
  if (of_ticks > 0) std::memcpy(chunk.ticks.data(), message.data() + at, of_ticks);
  if (of_given > 0) std::memcpy(chunk.given.data(), message.data() + at + of_ticks, of_given);
  return chunk;
}

}  // namespace haptic::sim::test
