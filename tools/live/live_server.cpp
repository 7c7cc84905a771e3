// SPDX-License-Identifier: Apache-2.0
#include "tools/live/live_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <map>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "tools/common/error.hpp"
#include "tools/live/page_file.hpp"
#include "tools/live/topics.hpp"
#include "tools/live/viewer_messages.hpp"

namespace haptic::tools {
namespace {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using Error = beast::error_code;

/// Of looks at the board.
constexpr std::chrono::milliseconds kLook{8};
/// Viewers of others get a message of each topic at most so often.
constexpr std::uint64_t kLooksPerViewerTick = 2;
constexpr std::chrono::seconds kPatience{10};
constexpr std::uint32_t kMostHeader_bytes = 8192;
/// Of one message to a page.
constexpr std::size_t kTicksAtOnce = 1024;
/// Poses of driven parts in a message, at most.
constexpr std::size_t kGivenAtOnce = 4096;
/// A page that is so far behind is answered at once and not at the next look.
constexpr std::uint64_t kFarBehind = 64;
constexpr std::size_t kMostSubscriptions = 64;

std::span<const std::byte> bytes_of(const beast::flat_buffer& buffer) {
  return {static_cast<const std::byte*>(buffer.data().data()), buffer.size()};
}

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

}  // namespace

ListeningSocket::ListeningSocket(const std::string& address, std::uint16_t port)
    : address_(address) {
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  v4.sin_family = AF_INET;
  v4.sin_port = htons(port);
  v6.sin6_family = AF_INET6;
  v6.sin6_port = htons(port);
  v6_ = inet_pton(AF_INET6, address.c_str(), &v6.sin6_addr) == 1;
  if (!v6_ && inet_pton(AF_INET, address.c_str(), &v4.sin_addr) != 1)
    throw UsageError("--bind: '" + address +
                     "' is no address; give digits, for instance 127.0.0.1");
  descriptor_ = ::socket(v6_ ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const auto refuse = [&](const std::string& fix) {
    const std::string reason = std::generic_category().message(errno);
    close();
    throw OsError("cannot listen on " + address + " port " + std::to_string(port) + ": " + reason +
                  fix);
  };
  if (descriptor_ < 0) refuse("");
  const int yes = 1;
  (void)::setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  const int bound = v6_ ? ::bind(descriptor_, reinterpret_cast<const sockaddr*>(&v6), sizeof v6)
                        : ::bind(descriptor_, reinterpret_cast<const sockaddr*>(&v4), sizeof v4);
  if (bound != 0)
    refuse(errno == EADDRINUSE ? "; give another --port, or none for one that is free" : "");
  if (::listen(descriptor_, SOMAXCONN) != 0) refuse("");
  socklen_t length = v6_ ? sizeof v6 : sizeof v4;
  sockaddr* const own = v6_ ? reinterpret_cast<sockaddr*>(&v6) : reinterpret_cast<sockaddr*>(&v4);
  if (::getsockname(descriptor_, own, &length) != 0) refuse("");
  port_ = ntohs(v6_ ? v6.sin6_port : v4.sin_port);
}

int ListeningSocket::release() { return std::exchange(descriptor_, -1); }

void ListeningSocket::close() {
  if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
}

namespace {

class Client;
class Visitor;

/// What all connections share. One thread.
struct Shared {
  Shared(AccessRules the_rules, LiveOffer the_offer)
      : rules(std::move(the_rules)), offer(std::move(the_offer)), reader(*offer.board) {
    if (offer.hand != nullptr) hand.emplace(*offer.hand);
    if (offer.scene == nullptr) return;
    legs = GuideLegs(*offer.scene);
    frames = DrivenFrames(*offer.scene);
  }

  AccessRules rules;
  LiveOffer offer;
  LiveReader reader;
  GuideLegs legs;       ///< of the scene's guide
  DrivenFrames frames;  ///< of its driven parts
  std::optional<NewestWriter<PageHand>> hand;
  PageHand order;
  LiveCounts counts;
  std::string session = new_token();  ///< names the session to viewers; not the token
  std::uint64_t looks = 0;
  std::size_t connections = 0;
  std::vector<std::weak_ptr<Client>> clients;
  std::deque<std::weak_ptr<Visitor>> visitors;  ///< the oldest first
  std::vector<LiveTick> room = std::vector<LiveTick>(kTicksAtOnce);
  std::vector<GivenPose> given;
};

/// Counts one connection for as long as it lives.
class Seat {
 public:
  explicit Seat(Shared& shared) : shared_(&shared) { shared_->connections += 1; }
  ~Seat() {
    if (shared_ != nullptr) shared_->connections -= 1;
  }
  Seat(Seat&& other) noexcept : shared_(std::exchange(other.shared_, nullptr)) {}
  Seat& operator=(Seat&&) = delete;
  Seat(const Seat&) = delete;
  Seat& operator=(const Seat&) = delete;

 private:
  Shared* shared_;
};

/// A WebSocket. One read and at most one write are under way.
class Client : public std::enable_shared_from_this<Client> {
 public:
  using Upgrade = http::request<http::empty_body>;

  Client(beast::tcp_stream&& stream, Shared& shared, Seat&& seat, std::size_t most_bytes)
      : shared_(shared), socket_(std::move(stream)), seat_(std::move(seat)) {
    socket_.read_message_max(most_bytes);
  }
  virtual ~Client() = default;
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void accept(const Upgrade& request, const std::string& protocol) {
    socket_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
    socket_.set_option(
        websocket::stream_base::decorator([protocol](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, protocol);
        }));
    socket_.async_accept(request, [self = shared_from_this()](Error error) {
      if (error) return;
      self->open_ = true;
      self->shared_.counts.clients += 1;
      self->read();
      self->look();
    });
  }

  /// Says what there is to say, unless a write is under way.
  void look() {
    if (!open_ || writing_) return;
    out_.clear();
    bool is_text = false;
    if (!next(out_, is_text)) return;
    writing_ = true;
    socket_.text(is_text);
    socket_.async_write(net::buffer(out_), [self = shared_from_this()](Error error, std::size_t) {
      self->writing_ = false;
      if (error) {
        self->open_ = false;
        return;
      }
      if (self->closing_) {
        self->close(*self->closing_);
      } else if (self->has_more()) {
        self->look();
      }
    });
  }

 protected:
  /// Composes the next message. False: there is none now.
  virtual bool next(std::string& out, bool& is_text) = 0;
  /// Whether the next one may follow at once.
  [[nodiscard]] virtual bool has_more() const = 0;
  /// False: it is no message of this protocol.
  virtual bool take(std::span<const std::byte> message, bool is_text) = 0;

  Shared& shared_;

 private:
  void read() {
    in_.clear();
    socket_.async_read(in_, [self = shared_from_this()](Error error, std::size_t) {
      if (error) {
        if (error == websocket::error::message_too_big) self->shared_.counts.cut += 1;
        self->open_ = false;
        return;
      }
      if (!self->take(bytes_of(self->in_), self->socket_.got_text())) {
        self->shared_.counts.cut += 1;
        self->close(websocket::close_code::policy_error);
        return;
      }
      self->read();
      self->look();
    });
  }

  void close(websocket::close_code code) {
    open_ = false;
    if (writing_) {
      closing_ = code;
      return;
    }
    socket_.async_close(code, [self = shared_from_this()](Error) {});
  }

  websocket::stream<beast::tcp_stream> socket_;
  Seat seat_;
  beast::flat_buffer in_;
  std::string out_;
  std::optional<websocket::close_code> closing_;
  bool open_ = false, writing_ = false;
};

/// The page. It asks for each message.
class PageClient final : public Client {
 public:
  PageClient(beast::tcp_stream&& stream, Shared& shared, Seat&& seat)
      : Client(std::move(stream), shared, std::move(seat), kMostPageMessage_bytes) {}

 private:
  bool next(std::string& out, bool& is_text) override {
    if (!asked_) return false;
    const LiveState state = shared_.reader.newest();
    const std::uint64_t written = shared_.reader.written();
    const bool ended = state.is_over != 0 && !said_end_;
    if (written <= *asked_ && !ended) return false;
    if (looked_ == shared_.looks && written - *asked_ < kFarBehind && !ended) return false;
    looked_ = shared_.looks;
    std::uint64_t first = *asked_;
    std::span<const LiveTick> ticks =
        std::span(shared_.room).first(shared_.reader.copy(first, shared_.room));
    // Poses that have been overwritten take the ticks before them along.
    std::size_t whole = 0;
    shared_.given.clear();
    while (!ticks.empty()) {
      whole = shared_.reader.copy_given(ticks, kGivenAtOnce, shared_.given);
      if (whole > 0) break;
      ticks = ticks.subspan(1);
      first += 1;
    }
    ticks = ticks.first(whole);
    said_end_ = state.is_over != 0 && first + ticks.size() >= written;
    out = chunk_message(state, first, written, ticks, shared_.given);
    is_text = false;
    asked_.reset();
    return true;
  }
  [[nodiscard]] bool has_more() const override { return asked_.has_value(); }

  bool take(std::span<const std::byte> bytes, bool is_text) override {
    const std::optional<PageMessage> message = read_page_message(bytes);
    if (is_text || !message) return false;
    if (message->kind == PageMessageKind::kAsk) {
      asked_ = message->first;
      return true;
    }
    if (!shared_.hand) return false;  // this session takes no hand
    PageHand& order = shared_.order;
    if (message->kind == PageMessageKind::kHand) {
      std::copy_n(message->p_wa_m, 3, order.p_wa_m);
      std::copy_n(message->q_wa_xyzw, 4, order.q_wa_xyzw);
      order.stamp = message->stamp;
      order.wanted += 1;
    } else {
      order.restarts += 1;
    }
    shared_.hand->publish(order);
    return true;
  }

  std::optional<std::uint64_t> asked_;
  std::uint64_t looked_ = ~std::uint64_t{0};
  bool said_end_ = false;
};

/// A viewer that speaks Foxglove's protocol.
class ViewerClient final : public Client {
 public:
  ViewerClient(beast::tcp_stream&& stream, Shared& shared, Seat&& seat)
      : Client(std::move(stream), shared, std::move(seat), kMostFoxgloveMessage_bytes) {}

 private:
  struct Subscribed {
    std::uint32_t id = 0;
    Topic topic = Topic::kScene;
    std::uint64_t sent = 0;  ///< ticks at the newest message
    bool sent_scene = false;
  };

  bool next(std::string& out, bool& is_text) override {
    is_text = true;
    if (greeted_ < 2) {
      out = greeted_ == 0 ? foxglove_greeting(shared_.session)
                          : foxglove_channels(shared_.offer.knows_felt);
      greeted_ += 1;
      return true;
    }
    if (!complaint_.empty()) {
      out = foxglove_complaint(std::exchange(complaint_, {}));
      return true;
    }
    is_text = false;
    if (take_waiting(out)) return true;
    begin_round();
    while (at_ < subscribed_.size()) {
      if (compose(subscribed_[at_++], out)) return true;
    }
    return false;
  }
  [[nodiscard]] bool has_more() const override {
    return greeted_ < 2 || !complaint_.empty() || !waiting_.empty() || at_ < subscribed_.size();
  }

  /// The newest state, for one message of each subscription.
  void begin_round() {
    if (at_ < subscribed_.size() || shared_.looks < round_ + kLooksPerViewerTick) return;
    round_ = shared_.looks;
    at_ = 0;
    ticks_ = shared_.reader.written();
    state_ = shared_.reader.newest();
  }

  bool compose(Subscribed& s, std::string& out) {
    if (s.topic == Topic::kScene) {
      if (s.sent_scene) return false;
      s.sent_scene = true;
      out = foxglove_frame(s.id, topic_time_ns(state_.record), scene_message(*shared_.offer.scene));
      return true;
    }
    if (ticks_ <= s.sent) return false;
    s.sent = ticks_;
    if (s.topic == Topic::kLog) {
      waiting_ = log_.messages(state_.record);
    } else {
      if (s.topic == Topic::kFrames) {
        const std::uint64_t count = std::min<std::uint64_t>(state_.driven_count, kMostDriven);
        waiting_ = shared_.frames.messages(state_.record, std::span(state_.driven).first(count));
      }
      std::string message = tick_message(s.topic, state_.record, shared_.legs);
      if (!message.empty()) waiting_.insert(waiting_.begin(), std::move(message));
    }
    std::ranges::reverse(waiting_);
    for (std::string& text : waiting_)
      text = foxglove_frame(s.id, topic_time_ns(state_.record), text);
    return take_waiting(out);
  }

  bool take_waiting(std::string& out) {
    if (waiting_.empty()) return false;
    out = std::move(waiting_.back());
    waiting_.pop_back();
    return true;
  }

  bool take(std::span<const std::byte> bytes, bool is_text) override {
    if (!is_text) return false;
    const auto request =
        read_foxglove_request({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (!request) return false;
    if (!request->unknown.empty())
      complaint_ = "this server has no operation '" + request->unknown + "'";
    for (const std::uint32_t id : request->unsubscribe) {
      std::erase_if(subscribed_, [id](const Subscribed& s) { return s.id == id; });
      at_ = subscribed_.size();
    }
    for (const Subscription& asked : request->subscribe) {
      const bool known =
          asked.channel >= 1 && asked.channel <= kTopics &&
          (shared_.offer.knows_felt || static_cast<Topic>(asked.channel - 1) != Topic::kFeltPose);
      const bool taken =
          std::ranges::any_of(subscribed_, [&](const Subscribed& s) { return s.id == asked.id; });
      if (!known || taken || subscribed_.size() >= kMostSubscriptions) {
        complaint_ = "subscription " + std::to_string(asked.id) + " to channel " +
                     std::to_string(asked.channel) + " is refused";
        continue;
      }
      subscribed_.push_back({asked.id, static_cast<Topic>(asked.channel - 1)});
      at_ = subscribed_.size();
      round_ = 0;
    }
    return true;
  }

  unsigned greeted_ = 0;
  std::string complaint_;
  std::vector<Subscribed> subscribed_;
  std::vector<std::string> waiting_;  ///< of the topic at hand, the first one last
  std::size_t at_ = 0;
  std::uint64_t round_ = 0, ticks_ = 0;
  LiveState state_;
  LogTopic log_;
};

/// One HTTP request and its answer.
class Visitor : public std::enable_shared_from_this<Visitor> {
 public:
  Visitor(tcp::socket&& socket, Shared& shared)
      : shared_(shared), stream_(std::move(socket)), seat_(std::in_place, shared) {}

  void begin() {
    parser_.header_limit(kMostHeader_bytes);
    parser_.body_limit(0);
    stream_.expires_after(kPatience);
    http::async_read(stream_, in_, parser_,
                     [self = shared_from_this()](Error error, std::size_t) { self->take(error); });
  }
  /// It has a connection, and has not shown the token.
  [[nodiscard]] bool is_waiting() const { return seat_.has_value() && !is_served_; }
  void drop() {
    seat_.reset();
    Error ignored;
    stream_.socket().close(ignored);
  }

 private:
  void take(Error error) {
    if (!seat_ || error == http::error::end_of_stream) return;
    shared_.counts.requests += 1;
    if (error) {
      if (error.category() == http::make_error_code(http::error::bad_method).category())
        answer(400, "this is no request for a page", "text/plain; charset=utf-8");
      return;
    }
    const auto& request = parser_.get();
    const auto field = [&request](http::field name) { return view_of(request[name]); };
    RequestFacts facts;
    facts.is_get = request.method() == http::verb::get;
    facts.is_upgrade = websocket::is_upgrade(request);
    facts.target = view_of(request.target());
    facts.host = field(http::field::host);
    facts.origin = field(http::field::origin);
    facts.protocols = field(http::field::sec_websocket_protocol);
    facts.hosts = request.count(http::field::host);
    facts.origins = request.count(http::field::origin);
    const Judgement judgement = judge(facts, shared_.rules);
    switch (judgement.kind) {
      case RequestKind::kRefused:
        answer(judgement.status, judgement.why, "text/plain; charset=utf-8");
        return;
      case RequestKind::kPage:
        if (shared_.offer.page.empty()) {
          answer(503, shared_.offer.no_page, "text/plain; charset=utf-8");
        } else {
          answer(200, connected_page(shared_.offer.page, std::string(facts.host)),
                 "text/html; charset=utf-8");
        }
        return;
      case RequestKind::kLive:
        become<PageClient>(judgement.protocol);
        return;
      case RequestKind::kFoxglove:
        become<ViewerClient>(judgement.protocol);
        return;
    }
  }

  template <typename Kind>
  void become(const std::string& protocol) {
    stream_.expires_never();
    const auto client = std::make_shared<Kind>(std::move(stream_), shared_, std::move(*seat_));
    seat_.reset();
    shared_.clients.push_back(client);
    client->accept(parser_.get(), protocol);
  }

  void answer(unsigned status, const std::string& text, const char* type) {
    if (status != 200) shared_.counts.refused += 1;
    is_served_ = status == 200;
    response_.result(status);
    response_.version(11);
    response_.set(http::field::content_type, type);
    response_.set(http::field::cache_control, "no-store");
    response_.set(http::field::x_frame_options, "DENY");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("Cross-Origin-Resource-Policy", "same-origin");
    response_.keep_alive(false);
    response_.body() = status == 200 ? text : std::to_string(status) + ": " + text + "\n";
    response_.prepare_payload();
    stream_.expires_after(kPatience);
    http::async_write(stream_, response_, [self = shared_from_this()](Error, std::size_t) {
      Error ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  Shared& shared_;
  beast::tcp_stream stream_;
  std::optional<Seat> seat_;
  bool is_served_ = false;  ///< it has shown the token, and is being sent the page
  beast::flat_buffer in_{2 * kMostHeader_bytes};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

/// Makes room where all connections are taken: the oldest that has not shown the token goes. False:
/// all have.
bool drop_oldest(Shared& shared) {
  while (!shared.visitors.empty()) {
    const std::shared_ptr<Visitor> oldest = shared.visitors.front().lock();
    shared.visitors.pop_front();
    if (!oldest || !oldest->is_waiting()) continue;
    oldest->drop();
    return true;
  }
  return false;
}

}  // namespace

struct LiveServer::Core {
  Core(ListeningSocket& socket, AccessRules rules, LiveOffer offer)
      : shared(std::move(rules), std::move(offer)), acceptor(context), timer(context) {
    acceptor.assign(socket.is_v6() ? tcp::v6() : tcp::v4(), socket.release());
  }

  void admit(tcp::socket socket) {
    Error ignored;
    socket.set_option(tcp::no_delay(true), ignored);
    const auto visitor = std::make_shared<Visitor>(std::move(socket), shared);
    std::erase_if(shared.visitors, [](const auto& there) { return there.expired(); });
    shared.visitors.push_back(visitor);
    visitor->begin();
  }

  void accept() {
    acceptor.async_accept([this](Error error, tcp::socket socket) {
      if (error == net::error::operation_aborted) return;
      if (!error) {
        const bool is_full = shared.connections >= LiveServer::kMostConnections;
        if (is_full) shared.counts.turned_away += 1;
        if (!is_full || drop_oldest(shared)) admit(std::move(socket));
      }
      accept();
    });
  }

  void look() {
    timer.expires_after(kLook);
    timer.async_wait([this](Error error) {
      if (error) return;
      shared.looks += 1;
      if (shared.offer.before_look) shared.offer.before_look();
      std::erase_if(shared.clients, [](const std::weak_ptr<Client>& client) {
        const std::shared_ptr<Client> there = client.lock();
        if (there) there->look();
        return !there;
      });
      look();
    });
  }

  Shared shared;  ///< goes last: what the context still holds refers to it
  net::io_context context{1};
  tcp::acceptor acceptor;
  net::steady_timer timer;
};

LiveServer::LiveServer(ListeningSocket& socket, AccessRules rules, LiveOffer offer)
    : core_(std::make_unique<Core>(socket, std::move(rules), std::move(offer))) {}

LiveServer::~LiveServer() = default;

void LiveServer::run() {
  core_->accept();
  core_->look();
  core_->context.run();
}

void LiveServer::stop() { core_->context.stop(); }

const LiveCounts& LiveServer::counts() const { return core_->shared.counts; }

}  // namespace haptic::tools
