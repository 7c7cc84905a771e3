// SPDX-License-Identifier: Apache-2.0
// The live server with clients of all kinds: pages, viewers, strangers, and those that stand still.
#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/host_sim/view/live_clients.hpp"
#include "tools/common/error.hpp"
#include "tools/live/topics.hpp"

using namespace haptic;
using namespace haptic::sim;
using namespace haptic::tools;
using namespace haptic::sim::test;

namespace {

/// Waits, long enough on any machine, until something holds.
template <typename Holds>
bool comes_true(Holds holds) {
  for (int k = 0; k < 2000 && !holds(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return holds();
}

/// Still serves pages and answers requests.
void check_alive(ServedBoard& served) {
  CHECK(ask(served.port, {served.target(), served.host(), ""}).status == 200);
  TestClient client(served, kPage);
  REQUIRE(client.status == 101);
  served.publish(1);
  client.ask(0);
  CHECK(chunk_of(client.read()).head.written >= 1);
}

}  // namespace

TEST_SUITE("host_sim.live_server") {
  TEST_CASE("a page: with the token, under its own address; it may connect there alone") {
    ServedBoard served(true);
    const Answer page = ask(served.port, {served.target(), served.host(), ""});
    CHECK(page.status == 200);
    CHECK(page.body == "<meta connect-src 'self' ws://" + served.host() + ">");
    CHECK(page.policy == "DENY");
    const std::string local = "localhost:" + std::to_string(served.port);
    CHECK(ask(served.port, {served.target(), local, ""}).status == 200);
    CHECK(ask(served.port, {"/other?token=" + served.token, served.host(), ""}).status == 404);
    CHECK(ask(served.port, {served.target(), served.host(), "", http::verb::post}).status == 405);
    CHECK(TestClient(served, "").status == 400);
    CHECK(TestClient(served, "chat, soap").status == 400);
  }

  TEST_CASE("403: foreign Host, foreign Origin, no token, wrong token; page and WebSocket alike") {
    ServedBoard served(true, {"https://viewer.example"});
    const std::string port = std::to_string(served.port);
    std::string wrong = served.token;
    wrong.back() = wrong.back() == '0' ? '1' : '0';
    const std::string own = "http://" + served.host();
    const struct {
      std::string target, host, origin;
    } strangers[] = {{served.target(), "evil.example:" + port, ""},
                     {served.target(), "127.0.0.1.evil.example:" + port, ""},
                     {served.target(), "127.0.0.1:1", ""},
                     {served.target(), "127.0.0.1", ""},
                     {served.target(), "10.0.0.1:" + port, ""},
                     {served.target(), served.host(), "http://evil.example"},
                     {served.target(), served.host(), "null"},
                     {served.target(), served.host(), "http://localhost:" + port},
                     {served.target(), served.host(), own + ".evil.example"},
                     {served.target(), served.host(), "https://viewer.example.evil.example"},
                     {"/", served.host(), ""},
                     {"/?token=", served.host(), ""},
                     {"/?token=" + wrong, served.host(), ""},
                     {"/?token=" + served.token + "0", served.host(), ""},
                     {"/?other=" + served.token, served.host(), ""},
                     {"/secret?token=" + wrong, served.host(), own}};
    for (const auto& stranger : strangers) {
      CAPTURE(stranger.target);
      CAPTURE(stranger.host);
      CAPTURE(stranger.origin);
      const Answer answer = ask(served.port, {stranger.target, stranger.host, stranger.origin});
      CHECK(answer.status == 403);
      CHECK(answer.body.find(served.token) == std::string::npos);
      CHECK(TestClient(served, kPage, stranger.origin, stranger.target, stranger.host).status ==
            403);
    }
    CHECK(served.server->counts().refused == 3 * std::size(strangers));
    CHECK(served.server->counts().clients == 0);
    CHECK(TestClient(served, kPage, own).status == 101);
    CHECK(TestClient(served, "foxglove.websocket.v1", "https://viewer.example").status == 101);
  }

  TEST_CASE("judge: a server that listens everywhere takes addresses as digits, and no names") {
    const AccessRules rules{"5ec7e7", "0.0.0.0", 8080, {}};
    CHECK(is_own_host("192.168.1.7:8080", rules));
    CHECK(is_own_host("localhost:8080", rules));
    CHECK_FALSE(is_own_host("evil.example:8080", rules));
    CHECK_FALSE(is_own_host("192.168.1.7.evil.example:8080", rules));
    CHECK_FALSE(is_own_host("192.168.1.7:8081", rules));
    const AccessRules six{"5ec7e7", "::1", 80, {}};
    CHECK(is_own_host("[::1]", six));
    CHECK(is_own_host("[::1]:80", six));
    CHECK_FALSE(is_own_host("::1:80", six));
    CHECK_FALSE(is_own_host("[::2]:80", six));
    CHECK_FALSE(is_own_host("", six));
    RequestFacts twice;
    twice.is_get = true;
    twice.target = "/?token=5ec7e7";
    twice.host = "localhost:8080";
    CHECK(judge(twice, rules).kind == RequestKind::kPage);
    twice.hosts = 2;
    CHECK(judge(twice, rules).status == 403);
    const AccessRules without{"", "127.0.0.1", 8080, {}};
    twice.hosts = 1;
    twice.target = "/?token=";
    CHECK(judge(twice, without).status == 403);
    CHECK(new_token().size() == 32);
    CHECK(new_token() != new_token());
  }

  TEST_CASE("a page gets every tick from the first one on, and the newest state") {
    ServedBoard served(false);
    served.publish(3000);
    TestClient page(served, kPage);
    REQUIRE(page.status == 101);
    CHECK(page.chosen == kPage);
    std::uint64_t next = 0;
    for (int k = 0; k < 40 && next < 4000; ++k) {
      if (next == 3000) served.publish(1000);
      page.ask(next);
      const TestChunk chunk = chunk_of(page.read());
      REQUIRE(chunk.head.magic == ChunkHead{}.magic);
      REQUIRE(chunk.head.first == next);
      REQUIRE_FALSE(chunk.ticks.empty());
      CHECK(chunk.state.record.tick + 1 == chunk.head.written);
      CHECK(chunk.state.record.force_n[2] == static_cast<double>(chunk.state.record.tick));
      for (std::size_t i = 0; i < chunk.ticks.size(); ++i)
        REQUIRE(chunk.ticks[i].state_hash == next + i);
      CHECK(((chunk.ticks[0].marks & kMarkReset) != 0) == (next == 0));
      next += chunk.ticks.size();
    }
    CHECK(next == 4000);
    // The end is said once, without a tick.
    page.ask(next);
    served.writer.finish();
    const TestChunk end = chunk_of(page.read());
    CHECK(end.state.is_over == 1);
    CHECK(end.ticks.empty());
  }

  TEST_CASE("a page that comes late gets the last minute, and sees that the begin is missing") {
    ServedBoard served(false);
    served.publish(LiveBoard::kTicks + 5000);
    TestClient page(served, kPage);
    page.ask(0);
    const TestChunk chunk = chunk_of(page.read());
    CHECK(chunk.head.first > 5000);
    CHECK(chunk.head.first < 7000);
    REQUIRE(chunk.ticks.size() == 1024);
    CHECK(chunk.ticks[0].state_hash == chunk.head.first);
  }

  TEST_CASE("board: any bytes in it are read without harm, and each tick is whole or left out") {
    auto board = std::make_unique<LiveBoard>();
    Random random(5);
    auto* bytes = reinterpret_cast<unsigned char*>(board.get());
    for (std::size_t k = 0; k < sizeof(LiveBoard); ++k)
      bytes[k] = static_cast<unsigned char>(256 * random.next());
    LiveReader reader(*board);
    std::vector<LiveTick> out(100);
    for (std::uint64_t first : {std::uint64_t{0}, std::uint64_t{1} << 40, ~std::uint64_t{0}}) {
      std::uint64_t from = first;
      CHECK(reader.copy(from, out) <= out.size());
    }
    for (const Topic topic : kTickTopics)
      static_cast<void>(tick_message(topic, reader.newest().record, GuideLegs()));
  }

  TEST_CASE("the hand of a page: taken where the session takes one") {
    ServedBoard served(true);
    served.publish(1);
    NewestReader<PageHand> order(*served.hand);
    TestClient page(served, kPage);
    page.move({0.01, 0.02, 0.03, 0, 0, 0.6, 0.8, 123.5});
    REQUIRE(comes_true([&] { return order.newest().wanted == 1; }));
    CHECK(order.newest().p_wa_m[2] == 0.03);
    CHECK(order.newest().q_wa_xyzw[3] == 0.8);
    CHECK(order.newest().stamp == 123.5);
    page.send(std::string("\3\0\0\0\0\0\0\0", 8));
    REQUIRE(comes_true([&] { return order.newest().restarts == 1; }));
    CHECK(order.newest().p_wa_m[2] == 0.03);
  }

  TEST_CASE("a session that is only watched: who sends a hand is cut off, the others go on") {
    ServedBoard served(false);
    served.publish(1);
    TestClient watcher(served, kPage);
    TestClient mover(served, kPage);
    mover.move({0, 0, 0, 0, 0, 0, 1, 0});
    CHECK(mover.read().empty());
    CHECK(mover.closed == websocket::close_code::policy_error);
    TestClient restarter(served, kPage);
    restarter.send(std::string("\3\0\0\0\0\0\0\0", 8));
    CHECK(restarter.read().empty());
    watcher.ask(0);
    CHECK(chunk_of(watcher.read()).ticks.size() == 1);
    CHECK(served.server->counts().cut == 2);
  }

  TEST_CASE("a page that says what is no message is cut off; nothing of it is done") {
    ServedBoard served(true);
    served.publish(1);
    NewestReader<PageHand> order(*served.hand);
    const double nan = std::nan("");
    const std::vector<std::vector<double>> poses = {{nan, 0, 0, 0, 0, 0, 1, 0},
                                                    {0, 0, 0, 0, 0, 0, nan, 0},
                                                    {0, 0, 0, 0, 0, 0, 2, 0},
                                                    {1e9, 0, 0, 0, 0, 0, 1, 0},
                                                    {0, 0, 0, 0, 0, 0, 1, INFINITY},
                                                    {0, 0, 0, 0, 0, 0, 1},
                                                    {0, 0, 0}};
    for (const std::vector<double>& pose : poses) {
      TestClient page(served, kPage);
      page.move(pose);
      CHECK(page.read().empty());
      CHECK(page.closed == websocket::close_code::policy_error);
    }
    for (const std::string& message :
         {std::string(1, '\1'), std::string("\1\0\0\0\0\0\0\0", 8), std::string(16, '\0'),
          std::string("\1\0\0\0\1\0\0\0\0\0\0\0\0\0\0\0", 16), std::string(16, '\xff')}) {
      TestClient page(served, kPage);
      page.send(message);
      CHECK(page.read().empty());
    }
    TestClient talker(served, kPage);
    talker.send(std::string("\1\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16), true);
    CHECK(talker.read().empty());
    // Too long: refused by its length.
    TestClient flood(served, kPage);
    flood.send(std::string(100000, 'x'));
    CHECK(flood.read().empty());
    // What was not read of it may take the reason along: the connection is reset.
    CHECK((flood.closed == websocket::close_code::too_big || flood.closed == 0));
    CHECK(order.newest().wanted == 0);
    check_alive(served);
  }

  TEST_CASE("viewers of others: both names of the protocol, the topics of the MCAP file") {
    ServedBoard served(true);
    served.publish(600);
    for (const std::string protocol : {"foxglove.websocket.v1", "foxglove.sdk.v1"}) {
      CAPTURE(protocol);
      TestClient viewer(served, "other.v9, " + protocol);
      REQUIRE(viewer.status == 101);
      CHECK(viewer.chosen == protocol);
      const auto greeting = nlohmann::json::parse(viewer.read());
      CHECK(greeting["op"] == "serverInfo");
      CHECK(served.token.find(greeting["sessionId"].get<std::string>()) == std::string::npos);
      const auto advertised = nlohmann::json::parse(viewer.read());
      REQUIRE(advertised["channels"].size() == kTopics);
      for (std::size_t k = 0; k < kTopics; ++k) {
        const auto& channel = advertised["channels"][k];
        CHECK(channel["id"] == k + 1);
        CHECK(channel["topic"] == topics()[k].name);
        CHECK(channel["schemaName"] == topics()[k].schema_name);
        CHECK(channel["schema"] == topics()[k].schema);
        CHECK(channel["encoding"] == "json");
      }
      viewer.send(
          R"({"op":"subscribe","subscriptions":[{"id":7,"channelId":1},{"id":8,"channelId":5},
        {"id":9,"channelId":9},{"id":10,"channelId":7}]})",
          true);
      std::set<std::uint32_t> seen;
      while (seen.size() < 4) {
        const std::string frame = viewer.read();
        REQUIRE(frame.size() > 13);
        CHECK(frame[0] == 1);
        std::uint32_t id = 0;
        std::uint64_t ns = 0;
        std::memcpy(&id, &frame[1], 4);
        std::memcpy(&ns, &frame[5], 8);
        CHECK(ns == 599'000'000u);
        const auto message = nlohmann::json::parse(frame.substr(13));
        if (id == 7) CHECK(message["entities"].size() == 2);
        if (id == 8) CHECK(message["force_n"]["z"] == 599);
        if (id == 9) CHECK(message["message"] == "face_face");
        if (id == 10) CHECK(message["tick"] == 599);
        CHECK(seen.insert(id).second);
      }
      // The same state is not sent again; the next is.
      viewer.send(R"({"op":"unsubscribe","subscriptionIds":[7,9,10]})", true);
      viewer.send(R"({"op":"advertise","channels":[]})", true);
      const auto status = nlohmann::json::parse(viewer.read());
      CHECK(status["op"] == "status");
      CHECK(status["message"].get<std::string>().find("advertise") != std::string::npos);
    }
  }

  TEST_CASE("a viewer that sends no JSON, a binary frame or numbers that are none is cut off") {
    ServedBoard served(true);
    served.publish(1);
    for (const char* text :
         {"", "{", "[]", "7", R"({"op":7})", R"({"op":"subscribe"})",
          R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
          R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
          R"({"op":"subscribe","subscriptions":[1]})",
          R"({"op":"unsubscribe","subscriptionIds":["a"]})"}) {
      CAPTURE(text);
      TestClient viewer(served, "foxglove.sdk.v1");
      viewer.send(text, true);
      std::string last;
      for (int k = 0; k < 3; ++k) last = viewer.read();
      CHECK(last.empty());
      CHECK(viewer.closed == websocket::close_code::policy_error);
    }
    TestClient deep(served, "foxglove.sdk.v1");
    deep.send(std::string(60000, '['), true);
    for (int k = 0; k < 3; ++k) (void)deep.read();
    CHECK(deep.closed == websocket::close_code::policy_error);
    CHECK(read_foxglove_request(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})"));
    check_alive(served);
  }

  TEST_CASE("eight clients, two of which stand still: the other six miss nothing") {
    ServedBoard served(false);
    // One page never asks; one viewer asks for everything and reads nothing.
    TestClient asleep(served, kPage);
    TestClient full(served, "foxglove.websocket.v1");
    std::string all = R"({"op":"subscribe","subscriptions":[)";
    for (int k = 0; k < 60; ++k)
      all += std::string(k == 0 ? "" : ",") + R"({"id":)" + std::to_string(k) + R"(,"channelId":)" +
             std::to_string(1 + k % 8) + "}";
    full.send(all + "]}", true);
    std::vector<std::unique_ptr<TestClient>> pages;
    std::vector<std::uint64_t> next(6, 0);
    for (std::size_t k = 0; k < next.size(); ++k)
      pages.push_back(std::make_unique<TestClient>(served, kPage));
    constexpr std::uint64_t kRounds = 200, kTicksOfRound = 100;
    for (std::uint64_t round = 0; round < kRounds; ++round) {
      served.publish(kTicksOfRound);
      for (std::size_t k = 0; k < pages.size(); ++k) {
        pages[k]->ask(next[k]);
        const TestChunk chunk = chunk_of(pages[k]->read());
        REQUIRE(chunk.head.first == next[k]);
        for (std::size_t i = 0; i < chunk.ticks.size(); ++i)
          REQUIRE(chunk.ticks[i].state_hash == next[k] + i);
        next[k] += chunk.ticks.size();
      }
    }
    for (const std::uint64_t ticks : next) CHECK(ticks == kRounds * kTicksOfRound);
    CHECK(served.server->counts().clients == 8);
    CHECK(served.server->counts().cut == 0);
    // Who wakes up gets the newest, not what he has missed.
    asleep.ask(~std::uint64_t{0} >> 1);
    served.publish(1);
    asleep.send(std::string("\1\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16));
    CHECK(chunk_of(asleep.read()).head.written == served.published);
  }

  TEST_CASE("a message that does not come is said to be lost, and the test goes on") {
    ServedBoard served(false);
    served.publish(1);
    {
      TestClient page(served, kPage);
      page.patience = std::chrono::milliseconds(50);
      CHECK_THROWS_WITH_AS(static_cast<void>(page.read()),
                           "no message of the server within 50 ms: one is lost",
                           std::runtime_error);
    }
    check_alive(served);
  }

  TEST_CASE("idle connections without the token keep nobody out, and those with it are kept") {
    ServedBoard served(false);
    served.publish(1);
    boost::asio::io_context context;
    std::vector<tcp::socket> idle;
    const auto flood = [&](std::size_t count) {
      for (std::size_t k = 0; k < count; ++k) idle.push_back(connection(context, served.port));
    };
    flood(LiveServer::kMostConnections);
    TestClient viewer(served, kPage);
    REQUIRE(viewer.status == 101);
    CHECK(served.server->counts().turned_away >= 1);
    for (int k = 0; k < 3; ++k) {
      flood(LiveServer::kMostConnections);
      CHECK(comes_true([&] {
        return ask(served.port, {served.target(), served.host(), ""}).status == 200;
      }));
    }
    viewer.ask(0);
    CHECK_FALSE(viewer.read().empty());
  }

  TEST_CASE("more with the token than there are seats: closed at once, and a free seat is given") {
    ServedBoard served(false);
    served.publish(1);
    {
      std::vector<std::unique_ptr<TestClient>> viewers;
      for (std::size_t k = 0; k < LiveServer::kMostConnections; ++k)
        viewers.push_back(std::make_unique<TestClient>(served, kPage));
      CHECK(ask(served.port, {served.target(), served.host(), ""}).status == 0);
      CHECK(served.server->counts().turned_away == 1);
    }
    CHECK(comes_true([&] {
      return ask(served.port, {served.target(), served.host(), ""}).status == 200;
    }));
  }

  TEST_CASE(
      "listening: a port that is taken and an address that is none are refused with the fix") {
    const ListeningSocket first("127.0.0.1", 0);
    CHECK_THROWS_WITH_AS(ListeningSocket("127.0.0.1", first.port()),
                         doctest::Contains("give another --port"), tools::OsError);
    CHECK_THROWS_AS(ListeningSocket("localhost", 0), tools::UsageError);
    CHECK_THROWS_AS(ListeningSocket("", 0), tools::UsageError);
    CHECK(ListeningSocket("::1", 0).is_v6());
  }
}
