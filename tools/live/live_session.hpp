// SPDX-License-Identifier: Apache-2.0
#pragma once
/// What a program needs to let its session be watched while it runs: options, the address with its
/// token, and the server in a process of its own.

#include <CLI/App.hpp>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/realtime/servo_process.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "hal/realtime/stop_signals.hpp"
#include "tools/live/live_server.hpp"
#include "tools/live/page_file.hpp"

namespace haptic::tools {

struct ServeOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;
  std::vector<std::string> origins;
};

/// --port, --bind, --allow-origin.
void add_serve_options(CLI::App& app, ServeOptions& options);

/// The address under which a session is watched. Made before the process that serves it is forked.
class LiveDoor {
 public:
  /// @throws as ListeningSocket.
  explicit LiveDoor(const ServeOptions& options);

  /// Lines for the person who started the program: addresses, and what to know about them.
  [[nodiscard]] std::vector<std::string> words() const;
  [[nodiscard]] std::string url() const;  ///< of the page, with the token

  /// In the process that serves: until it is killed. `offer` without a page: it is made here.
  void serve(LiveOffer offer, const LivePage& page);
  [[nodiscard]] int descriptor() const { return socket_.descriptor(); }
  /// In the others.
  void leave() { socket_.close(); }

 private:
  ListeningSocket socket_;
  AccessRules rules_;
};

/// A session that this process runs by itself, in real time: no device, no motors.
class LiveSession {
 public:
  /// `takes_hand`: pages may move the simulated hand. @throws as ListeningSocket, OsError.
  LiveSession(const ServeOptions& options, const SceneView& scene, bool takes_hand);

  /// Forks the server and prints where it is. Before any thread. @throws OsError.
  void begin();
  /// `tick`: what the core was given; `state`: what it made of it; `given`: poses that driven parts
  /// were given before it.
  void publish(const RecordedTick& tick, const LiveState& state,
               std::span<const GivenPose> given = {});
  /// No further tick comes.
  void finish() { writer_.finish(); }
  [[nodiscard]] PageHand order();  ///< the newest of a page; wanted 0: none yet

  /// Whether a signal has asked to stop.
  [[nodiscard]] bool is_stopped();
  void wait_for_stop();

 private:
  const SceneView& scene_;
  hal::SharedMemory down_, up_;  ///< to the server; from it, where pages may move the hand
  LiveDoor door_;
  LiveWriter writer_;
  std::unique_ptr<NewestReader<PageHand>> hand_;
  hal::StopSignals signals_;
  bool stopped_ = false;
  hal::ServoProcess server_;  ///< goes first
};

}  // namespace haptic::tools
