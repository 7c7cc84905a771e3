// SPDX-License-Identifier: Apache-2.0
#include "tools/live/live_session.hpp"

#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <new>
#include <system_error>
#include <utility>

#include "hal/realtime/process_hardening.hpp"
#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address == "::1";
}

/// A board over shared memory, which is zeroed.
LiveBoard& board_in(hal::SharedMemory& memory) {
  if (memory.bytes().size() < sizeof(LiveBoard))
    throw OsError("the system has no memory left for the live session");
  return *new (memory.bytes().data()) LiveBoard;  // placement, no heap
}

}  // namespace

void add_serve_options(CLI::App& app, ServeOptions& options) {
  app.add_option("--port", options.port, "port of the live view; default: one that is free")
      ->check(CLI::Range(0, 65535));
  app.add_option("--bind", options.address,
                 "address that the live view listens on, as digits; default 127.0.0.1: this "
                 "machine alone");
  app.add_option("--allow-origin", options.origins,
                 "origin of a page of others that may connect, for instance "
                 "https://app.foxglove.dev; may be given again");
}

LiveDoor::LiveDoor(const ServeOptions& options) : socket_(options.address, options.port) {
  rules_.token = new_token();
  rules_.address = socket_.address();
  rules_.port = socket_.port();
  rules_.origins = options.origins;
}

std::string LiveDoor::url() const {
  const std::string host = socket_.is_v6() ? "[" + rules_.address + "]" : rules_.address;
  return "http://" + host + ":" + std::to_string(rules_.port) + "/?token=" + rules_.token;
}

std::vector<std::string> LiveDoor::words() const {
  const std::string address = url();
  std::vector<std::string> lines = {"live view: " + address,
                                    "Foxglove, Lichtblick: ws" + address.substr(4)};
  if (!is_loopback(rules_.address))
    lines.push_back(
        "it listens on " + rules_.address +
        ": whoever reaches this machine and has the token sees the session; nothing is encrypted");
  try {
    (void)read_page();
  } catch (const OsError& error) {
    lines.push_back(std::string("without the page, for other viewers alone: ") + error.what());
  }
  return lines;
}

void LiveDoor::serve(LiveOffer offer, const LivePage& page) {
  try {
    offer.page = live_page(read_page(), *offer.scene, page);
  } catch (const std::exception& error) {
    offer.no_page = error.what();
  }
  LiveServer(socket_, rules_, std::move(offer)).run();
}

LiveSession::LiveSession(const ServeOptions& options, const SceneView& scene, bool takes_hand)
    : scene_(scene),
      down_(sizeof(LiveBoard)),
      up_(takes_hand ? sizeof(HandBoard) : 0),
      door_(options),
      writer_(board_in(down_)) {
  if (!takes_hand) return;
  if (up_.bytes().empty()) throw OsError("the system has no memory left for the live session");
  hand_ = std::make_unique<NewestReader<PageHand>>(*new (up_.bytes().data()) HandBoard);
}

void LiveSession::begin() {
  for (const std::string& line : door_.words()) std::printf("%s\n", line.c_str());
  std::fflush(stdout);
  int error = signals_.take();
  if (error == 0)
    error = server_.start([this] {
      hal::leave_signals_to_holder();
      prctl(PR_SET_NAME, "haptic-live");
      const int kept[] = {STDERR_FILENO, door_.descriptor()};
      if (hal::close_inherited_descriptors(kept) != 0 || hal::drop_capabilities({}).error != 0)
        return 4;
      if (down_.protect() != 0) return 4;
      LiveOffer offer;
      offer.scene = &scene_;
      offer.board = std::launder(reinterpret_cast<const LiveBoard*>(down_.bytes().data()));
      if (hand_) offer.hand = std::launder(reinterpret_cast<HandBoard*>(up_.bytes().data()));
      door_.serve(std::move(offer), {hand_ != nullptr, {}});
      return 0;
    });
  if (error != 0)
    throw OsError("the live view's process cannot be started: " +
                  std::generic_category().message(error));
  door_.leave();
}

void LiveSession::publish(const RecordedTick& tick, const LiveState& state,
                          std::span<const GivenPose> given) {
  writer_.publish(live_tick(tick, state.record.tick), state, given);
}

PageHand LiveSession::order() { return hand_ ? hand_->newest() : PageHand{}; }

bool LiveSession::is_stopped() {
  stopped_ = stopped_ || signals_.asked() != 0;
  return stopped_;
}

void LiveSession::wait_for_stop() {
  while (!is_stopped()) {
    pollfd watched{signals_.descriptor(), POLLIN, 0};
    (void)::poll(&watched, 1, -1);
  }
}

}  // namespace haptic::tools
