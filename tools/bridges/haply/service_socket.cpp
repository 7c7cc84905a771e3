// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/haply/service_socket.hpp"

#include <boost/asio/connect.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>

#include "hal/clock/servo_clock.hpp"

namespace haptic::tools {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using Error = beast::error_code;

/// A context that is run by who waits, and by nobody else.
struct Waiting {
  net::io_context context{1};
  net::executor_work_guard<net::io_context::executor_type> work{context.get_executor()};

  /// True: `is_done` holds.
  template <typename Done>
  bool wait(std::int64_t until_ns, const Done& is_done) {
    while (!is_done()) {
      const std::int64_t left_ns = until_ns - hal::monotonic_ns();
      if (left_ns <= 0) {
        context.poll();
        return is_done();
      }
      context.run_one_for(std::chrono::nanoseconds(left_ns));
    }
    return true;
  }
};

bool connect_to(Waiting& waiting, tcp::socket& socket, const std::string& host, std::uint16_t port,
                std::int64_t until_ns, std::string& why) {
  Error error;
  tcp::resolver resolver(waiting.context);
  const auto places = resolver.resolve(host, std::to_string(port), error);
  if (error) {
    why = "the name cannot be looked up: " + error.message();
    return false;
  }
  bool is_done = false;
  net::async_connect(socket, places, [&](Error e, const tcp::endpoint&) {
    error = e;
    is_done = true;
  });
  if (!waiting.wait(until_ns, [&] { return is_done; })) {
    Error ignored;
    socket.close(ignored);
    waiting.wait(until_ns + 1'000'000'000, [&] { return is_done; });  // it refers to this frame
    why = "no answer";
    return false;
  }
  if (error) {
    why = error.message();
    return false;
  }
  socket.set_option(tcp::no_delay(true), error);
  return true;
}

}  // namespace

bool http_get(const std::string& host, std::uint16_t port, const std::string& target,
              std::size_t most_bytes, std::int64_t until_ns, HttpAnswer& answer, std::string& why) {
  struct Exchange {
    http::request<http::empty_body> request;
    http::response_parser<http::string_body> parser;
    beast::flat_buffer buffer;
    Error error;
    bool is_done = false;
  };
  // Declared before the context and its socket: their handlers refer to it.
  Exchange exchange;
  Waiting waiting;
  tcp::socket socket(waiting.context);
  if (!connect_to(waiting, socket, host, port, until_ns, why)) return false;
  exchange.request.method(http::verb::get);
  exchange.request.target(target);
  exchange.request.version(11);
  exchange.request.set(http::field::host, host + ":" + std::to_string(port));
  exchange.request.keep_alive(false);
  exchange.parser.body_limit(most_bytes);
  exchange.parser.header_limit(8192);
  http::async_write(socket, exchange.request, [&](Error error, std::size_t) {
    exchange.error = error;
    exchange.is_done = static_cast<bool>(error);
    if (error) return;
    http::async_read(socket, exchange.buffer, exchange.parser, [&](Error read, std::size_t) {
      exchange.error = read;
      exchange.is_done = true;
    });
  });
  if (!waiting.wait(until_ns, [&] { return exchange.is_done; })) {
    why = "connected, and no answer";
    return false;
  }
  if (exchange.error) {
    why = exchange.error.message();
    return false;
  }
  answer.status = exchange.parser.get().result_int();
  answer.body = std::move(exchange.parser.get().body());
  return true;
}

struct ServiceSocket::Core {
  Core(std::size_t most, std::shared_ptr<hal::DeviceTap> t)
      : tap(std::move(t)), stream(waiting.context), most_bytes(most) {}

  std::shared_ptr<hal::DeviceTap> tap;
  std::string out;
  beast::flat_buffer in;
  Error read_error, write_error;
  bool is_reading = false, is_writing = false;
  Waiting waiting;
  websocket::stream<tcp::socket> stream;
  std::size_t most_bytes;
};

ServiceSocket::ServiceSocket(std::size_t most_bytes, std::shared_ptr<hal::DeviceTap> tap)
    : core_(std::make_unique<Core>(most_bytes, std::move(tap))) {}

ServiceSocket::~ServiceSocket() = default;

bool ServiceSocket::connect(const std::string& host, std::uint16_t port, std::int64_t until_ns,
                            std::string& why) {
  Core& c = *core_;
  if (!connect_to(c.waiting, c.stream.next_layer(), host, port, until_ns, why)) return false;
  c.stream.set_option(websocket::stream_base::timeout{websocket::stream_base::none(),
                                                      websocket::stream_base::none(), false});
  c.stream.read_message_max(c.most_bytes);
  c.stream.text(true);
  c.stream.auto_fragment(false);
  Error& error = c.write_error;
  c.is_writing = true;
  c.stream.async_handshake(host + ":" + std::to_string(port), "/", [&c](Error e) {
    c.write_error = e;
    c.is_writing = false;
  });
  if (!c.waiting.wait(until_ns, [&c] { return !c.is_writing; })) {
    why = "connected, and it does not speak WebSocket in time";
    return false;
  }
  if (error) why = "it does not speak WebSocket: " + error.message();
  return !error;
}

ServiceSocket::Got ServiceSocket::receive(std::string& text, std::int64_t until_ns) {
  Core& c = *core_;
  if (c.read_error) return Got::kClosed;
  if (!c.is_reading) {
    c.in.clear();
    c.is_reading = true;
    c.stream.async_read(c.in, [&c](Error error, std::size_t) {
      c.read_error = error;
      c.is_reading = false;
    });
  }
  if (!c.waiting.wait(until_ns, [&c] { return !c.is_reading; })) return Got::kNothing;
  if (c.read_error == websocket::error::message_too_big) return Got::kTooLong;
  if (c.read_error) return Got::kClosed;
  const auto bytes = c.in.data();
  text.assign(static_cast<const char*>(bytes.data()), bytes.size());
  if (c.tap != nullptr)
    c.tap->note(hal::TapKind::kMessage, 0, {}, std::as_bytes(std::span<const char>(text)));
  return Got::kText;
}

bool ServiceSocket::send(std::string_view text, std::int64_t until_ns) {
  Core& c = *core_;
  if (c.is_writing || c.write_error || c.read_error) return false;
  c.out = text;
  c.is_writing = true;
  if (c.tap != nullptr)
    c.tap->note(hal::TapKind::kMessage, 0, std::as_bytes(std::span<const char>(c.out)), {});
  c.stream.async_write(net::buffer(c.out), [&c](Error error, std::size_t) {
    c.write_error = error;
    c.is_writing = false;
  });
  return c.waiting.wait(until_ns, [&c] { return !c.is_writing; }) && !c.write_error;
}

void ServiceSocket::close(std::int64_t until_ns) {
  Core& c = *core_;
  if (c.is_writing || c.write_error || c.read_error || !c.stream.is_open()) return;
  c.is_writing = true;
  c.stream.async_close(websocket::close_code::normal, [&c](Error error) {
    c.write_error = error;
    c.is_writing = false;
  });
  c.waiting.wait(until_ns, [&c] { return !c.is_writing; });
}

}  // namespace haptic::tools
