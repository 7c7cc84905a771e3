// SPDX-License-Identifier: Apache-2.0
#include "tests/bridges/haply/inverse_service.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

namespace haptic::test {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = boost::asio::ip::tcp;
using nlohmann::json;

std::int64_t clock_ns() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1'000'000'000LL + t.tv_nsec;
}

int listen_at(std::uint16_t& port) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_port = htons(port);
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof place;
  if (::bind(descriptor, reinterpret_cast<sockaddr*>(&place), length) != 0 ||
      ::listen(descriptor, 16) != 0 ||
      ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&place), &length) != 0)
    throw std::runtime_error("port " + std::to_string(port) + " cannot be listened at");
  port = ntohs(place.sin_port);
  return descriptor;
}

json xyz(const std::array<double, 3>& v) { return {{"x", v[0]}, {"y", v[1]}, {"z", v[2]}}; }

}  // namespace

/// A connection, HTTP or WebSocket, with a thread of its own.
struct InverseService::Session {
  explicit Session(int accepted) : descriptor(accepted), socket(context) {
    const int on = 1;
    ::setsockopt(accepted, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    socket.assign(tcp::v4(), accepted);
  }
  int descriptor;
  boost::asio::io_context context{1};
  tcp::socket socket;
  std::thread thread;
  unsigned number = 0;
  std::atomic<bool> is_done{false};
};

InverseService::InverseService(InverseKind kind, std::string version, std::uint16_t http_port,
                               std::uint16_t websocket_port)
    : kind_(kind),
      version_(std::move(version)),
      http_port_(http_port),
      websocket_port_(websocket_port) {
  start();
}

InverseService::~InverseService() { stop(); }

void InverseService::start() {
  is_over_ = false;
  if (kind_ != InverseKind::k35) listeners_.push_back(listen_at(http_port_));
  listeners_.push_back(listen_at(websocket_port_));
  if (kind_ == InverseKind::k35 && http_port_ == 0) http_port_ = websocket_port_;
  for (const int listener : listeners_)
    acceptors_.emplace_back([this, listener] { accept(listener); });
}

void InverseService::stop() {
  is_over_ = true;
  for (const int listener : listeners_) ::shutdown(listener, SHUT_RDWR);
  for (std::thread& acceptor : acceptors_) acceptor.join();
  for (const int listener : listeners_) ::close(listener);
  listeners_.clear();
  acceptors_.clear();
  std::list<std::shared_ptr<Session>> all;
  {
    const std::lock_guard lock(mutex_);
    all.swap(all_);
  }
  for (const auto& session : all)
    if (!session->is_done) ::shutdown(session->descriptor, SHUT_RDWR);
  for (const auto& session : all) session->thread.join();
}

void InverseService::accept(int listener) {
  while (!is_over_) {
    const int accepted = ::accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
    if (accepted < 0) continue;
    auto session = std::make_shared<Session>(accepted);
    const std::lock_guard lock(mutex_);
    all_.remove_if([](const std::shared_ptr<Session>& old) {
      if (old->is_done) old->thread.join();
      return old->is_done.load();
    });
    all_.push_back(session);
    session->thread = std::thread([this, session] {
      try {
        serve(session);
      } catch (const std::exception&) {
        // The other side is gone, or speaks something else: a connection has ended.
      }
      session->is_done = true;
    });
  }
}

void InverseService::serve(const std::shared_ptr<Session>& session) {
  beast::flat_buffer buffer;
  http::request<http::string_body> request;
  http::read(session->socket, buffer, request);
  if (!websocket::is_upgrade(request)) {
    const std::string target(request.target());
    const std::string prefix = kind_ == InverseKind::k30 ? "/3.0" : "";
    http::response<http::string_body> response{http::status::ok, 11};
    response.set(http::field::content_type, "application/json");
    if (target == prefix + "/version") {
      response.body() = json{
          {"build_time", "2024-08-07T16:01:53Z"},
          {"git_branch", "main"},
          {"project_name", "haply-inverse-service"},
          {"project_version",
           version_}}.dump();
    } else if (target == prefix + "/devices") {
      response.body() = devices_text(true, 0);
    } else if (target == "/sessions" && kind_ == InverseKind::k35) {
      json list = json::array();
      for (unsigned k = 0; k < open_sessions_; ++k) list.push_back({{"session_id", k + 1}});
      response.body() = json{{"ok", true}, {"data", list}}.dump();
    } else {
      response.result(http::status::not_found);
    }
    response.keep_alive(false);
    response.prepare_payload();
    http::write(session->socket, response);
    session->socket.shutdown(tcp::socket::shutdown_send);
    return;
  }

  websocket::stream<tcp::socket&> stream(session->socket);
  stream.accept(request);
  stream.text(true);
  stream.auto_fragment(false);
  {
    const std::lock_guard lock(mutex_);
    forces_.push_back({0, 0, 0});
    session->number = static_cast<unsigned>(forces_.size());
    first_message_.clear();
  }
  ++open_sessions_;
  try {
    stream.write(boost::asio::buffer(devices_text(true, session->number)));
    while (!is_over_) {
      const std::int64_t stall_ns = stall_ns_.exchange(0);
      for (std::int64_t end_ns = clock_ns() + stall_ns; clock_ns() < end_ns && !is_over_;)
        std::this_thread::sleep_for(std::chrono::nanoseconds(
            std::min<std::int64_t>(std::max<std::int64_t>(end_ns - clock_ns(), 0), 5'000'000)));
      beast::flat_buffer in;
      stream.read(in);
      hear(*session, beast::buffers_to_string(in.data()));
      const std::string said = answer(session->number);
      stream.write(boost::asio::buffer(said));
      if (twice_left_ == 0) continue;
      --twice_left_;
      stream.write(boost::asio::buffer(said));
    }
  } catch (const std::exception&) {
  }
  --open_sessions_;
  const std::lock_guard lock(mutex_);
  forces_[session->number - 1] = {0, 0, 0};
  log_.push_back({clock_ns(), session->number, {0, 0, 0}, false, true});
}

void InverseService::hear(Session& session, const std::string& text) {
  const std::int64_t at_ns = clock_ns();
  ++messages_;
  std::array<double, 3> force{0, 0, 0};
  bool was_understood = false;
  const json message = json::parse(text, nullptr, false);
  const std::lock_guard lock(mutex_);
  if (first_message_.empty()) first_message_ = text;
  if (message.is_object() && message.contains("inverse3") && message["inverse3"].is_array()) {
    for (const json& entry : message["inverse3"]) {
      if (entry.value("device_id", "") != device_.id) continue;
      const json none = json::object();
      const json command = entry.value("commands", none).value("set_cursor_force", none);
      const json vector = command.value(kind_ == InverseKind::k35 ? "vector" : "values", none);
      if (!vector.contains("x")) continue;
      was_understood = true;
      force = {vector.value("x", 0.0), vector.value("y", 0.0), vector.value("z", 0.0)};
    }
  }
  forces_[session.number - 1] = force;
  log_.push_back({at_ns, session.number, force, was_understood, false});
}

std::string InverseService::devices_text(bool with_config, unsigned session) const {
  const std::lock_guard lock(mutex_);
  const TableDevice& d = device_;
  std::array<double, 3> sum = other_n_;
  bool in_use = false;
  for (const auto& force : forces_)
    for (std::size_t k = 0; k < 3; ++k) {
      sum[k] += force[k];
      in_use = in_use || force[k] != 0;
    }
  json entry = {{"device_id", d.id},
                {"state",
                 {{"cursor_position", xyz(d.position_m)},
                  {"cursor_velocity", xyz(d.velocity_m_per_s)},
                  {"angular_position", {{"a0", -69.3}, {"a1", 137.6}, {"a2", 19.8}}},
                  {"body_orientation", {{"w", 1.0}, {"x", 0.0}, {"y", 0.0}, {"z", 0.0}}}}},
                {"status",
                 {{"calibrated", d.calibrated},
                  {"in_use", in_use},
                  {"power_supply", d.powered},
                  {"ready", true},
                  {"started", true}}}};
  json& state = entry["state"];
  if (kind_ == InverseKind::k35) {
    state["current_cursor_force"] = xyz(sum);
    state["control_mode"] = "force";
    if (d.workspace_m != std::array<double, 3>{0, 0, 0})
      state["transform"] = {{"position", xyz(d.workspace_m)}};
  } else {
    state["mode"] = "idle";
  }
  if (with_config) entry["config"] = {{"type", d.kind}, {"port", "COM12"}, {"handedness", "right"}};
  json message = json::object();
  if (kind_ == InverseKind::k35 && session != 0) message["session_id"] = session;
  if (kind_ == InverseKind::k30) {
    entry.erase("device_id");
    message["inverse3"] = json{{d.id, entry}};
    return message.dump();
  }
  message["inverse3"] = json::array();
  if (d.is_there) message["inverse3"].push_back(entry);
  if (!d.second_id.empty()) {
    entry["device_id"] = d.second_id;
    message["inverse3"].push_back(entry);
  }
  const json q = {{"w", d.q_wxyz[0]}, {"x", d.q_wxyz[1]}, {"y", d.q_wxyz[2]}, {"z", d.q_wxyz[3]}};
  message["verse_grip"] = json::array();
  message["wireless_verse_grip"] = json::array();
  if (!d.wired_grip.empty())
    message["verse_grip"].push_back(
        {{"device_id", d.wired_grip},
         {"state", {{"button", d.wired_button}, {"hall", 0}, {"orientation", q}}},
         {"status", {{"error", 0}, {"ready", true}}}});
  if (!d.wireless_grip.empty())
    message["wireless_verse_grip"].push_back(
        {{"device_id", d.wireless_grip},
         {"state",
          {{"buttons", {{"a", d.a}, {"b", d.b}, {"c", d.c}}},
           {"battery_level", 0.8},
           {"orientation", q}}},
         {"status", {{"awake", d.awake}, {"connected", true}}}});
  return message.dump();
}

std::string InverseService::answer(unsigned session) {
  const std::string right = devices_text(false, session);
  WrongAnswer how = WrongAnswer::kCount;
  {
    const std::lock_guard lock(mutex_);
    if (wrong_left_ > 0) {
      --wrong_left_;
      how = wrong_;
    }
  }
  const auto with_x = [&](const char* text) {
    std::string changed = right;
    const std::size_t at = changed.find("\"x\":", changed.find("\"cursor_position\""));
    const std::size_t end = changed.find_first_of(",}", at);
    return changed.replace(at + 4, end - at - 4, text);
  };
  switch (how) {
    case WrongAnswer::kTruncated:
      return right.substr(0, right.size() / 2);
    case WrongAnswer::kNan:
      return with_x("NaN");
    case WrongAnswer::kText:
      return with_x("\"0.1\"");
    case WrongAnswer::kOverflow:
      return with_x("1e999");
    case WrongAnswer::kFar:
      return with_x("1e30");
    case WrongAnswer::kDeep:
      return std::string(30'000, '[') + std::string(30'000, ']');
    case WrongAnswer::kLong:
      return right + std::string(80'000, ' ');
    case WrongAnswer::kEmpty:
      return "";
    case WrongAnswer::kOtherShape:
      return "[" + right + "]";
    case WrongAnswer::kNoPosition: {
      std::string changed = right;
      return changed.replace(changed.find("cursor_position"), 15, "cursor_Position");
    }
    case WrongAnswer::kQuaternion: {
      std::string changed = right;
      const std::size_t at = changed.find("\"orientation\":{");
      return changed.replace(at, changed.find('}', at) + 1 - at,
                             R"("orientation":{"w":0,"x":0,"y":0,"z":0})");
    }
    case WrongAnswer::kCount:
      break;
  }
  return right;
}

void InverseService::set(const TableDevice& device) {
  const std::lock_guard lock(mutex_);
  device_ = device;
}

TableDevice InverseService::device() const {
  const std::lock_guard lock(mutex_);
  return device_;
}

void InverseService::answer_wrongly(WrongAnswer how, unsigned count) {
  const std::lock_guard lock(mutex_);
  wrong_ = how;
  wrong_left_ = count;
}

void InverseService::exert(const std::array<double, 3>& other_n) {
  const std::lock_guard lock(mutex_);
  other_n_ = other_n;
}

std::vector<Exerted> InverseService::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

std::string InverseService::first_message() const {
  const std::lock_guard lock(mutex_);
  return first_message_;
}

}  // namespace haptic::test
