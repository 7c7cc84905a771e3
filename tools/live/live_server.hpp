// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The live view over HTTP and WebSocket, in one thread: it hands out the page, and to each client
/// the newest state. Nothing is queued: a client has one write under way at most, and what it gets
/// next is made when that one is over. A page asks for each message, so that one that is slow only
/// gets less; it can ask for the inputs of the last minute.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tools/live/live_board.hpp"
#include "tools/live/live_protocol.hpp"

namespace haptic::tools {

/// Bound and listening. Made before the server's process is, so that a refusal is said at once.
class ListeningSocket {
 public:
  /// `address` as digits; port 0: one that is free. @throws UsageError  no such address;
  /// OsError  it is taken, or not allowed.
  ListeningSocket(const std::string& address, std::uint16_t port);
  ~ListeningSocket() { close(); }
  ListeningSocket(const ListeningSocket&) = delete;
  ListeningSocket& operator=(const ListeningSocket&) = delete;

  [[nodiscard]] const std::string& address() const { return address_; }
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] bool is_v6() const { return v6_; }
  [[nodiscard]] int descriptor() const { return descriptor_; }
  /// The caller has the descriptor from now on.
  [[nodiscard]] int release();
  /// In a process that does not serve.
  void close();

 private:
  std::string address_;
  std::uint16_t port_ = 0;
  bool v6_ = false;
  int descriptor_ = -1;
};

/// What is served. Everything outlives the server.
struct LiveOffer {
  const SceneView* scene = nullptr;
  const LiveBoard* board = nullptr;
  HandBoard* hand =
      nullptr;  ///< nullptr: the session takes no hand, and a client that sends one is cut off
  bool knows_felt = true;
  std::string page;     ///< filled_page of a live session; empty: `no_page` is said
  std::string no_page;  ///< why there is no page
  /// Before each look at the board, about a hundred times a second; may be empty.
  std::function<void()> before_look;
};

struct LiveCounts {
  std::atomic<std::uint64_t> requests{0}, refused{0};  ///< HTTP, upgrades included
  std::atomic<std::uint64_t> clients{0};               ///< that have connected
  std::atomic<std::uint64_t> cut{0};                   ///< clients that said what is no message
  std::atomic<std::uint64_t> turned_away{0};           ///< beyond the most connections
};

class LiveServer {
 public:
  /// Most connections at a time. One more takes the place of the oldest that has not shown the
  /// token; where all have, it is closed at once.
  static constexpr std::size_t kMostConnections = 64;

  /// Takes the descriptor of `socket`.
  LiveServer(ListeningSocket& socket, AccessRules rules, LiveOffer offer);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  void run();   ///< until `stop`
  void stop();  ///< from any thread
  [[nodiscard]] const LiveCounts& counts() const;

 private:
  struct Core;
  std::unique_ptr<Core> core_;
};

}  // namespace haptic::tools
