// SPDX-License-Identifier: Apache-2.0
#include "hal/local/local_link.hpp"

#include <algorithm>

#include "hal/clock/servo_clock.hpp"

namespace haptic::hal {
namespace {

// Longest ramp to zero of an orderly end, as over USB.
constexpr std::int64_t kLongestRest_ns = 300'000'000, kRestWait_ns = 10'000'000;

}  // namespace

/// The port through which a driver starts its device.
class LocalLink::Port final : public UsbPort {
 public:
  explicit Port(LocalLink& link) noexcept : link_(link) {}
  HalStatus control(const ControlRequest& request, std::span<std::uint8_t> bytes,
                    std::size_t& moved, unsigned /*timeout_ms*/) noexcept override {
    return link_.peer_.control(request, bytes, moved);
  }
  HalStatus write(std::span<const std::uint8_t> bytes, unsigned /*timeout_ms*/) noexcept override {
    return link_.peer_.write(bytes);
  }
  HalStatus read(std::span<std::uint8_t> bytes, std::size_t& moved,
                 unsigned timeout_ms) noexcept override {
    return link_.peer_.read(bytes, moved, timeout_ms);
  }
  [[nodiscard]] bool cancelled() const noexcept override { return link_.cancelled_.load(); }

 private:
  LocalLink& link_;
};

LocalLink::LocalLink(Driver& driver, const DeviceMailbox& mailbox, LocalPeer& peer,
                     const LinkSettings& settings)
    : driver_(driver), peer_(peer), settings_(settings), flow_(driver, mailbox, settings_) {
  flow_.attach(*this);
}

LocalLink::~LocalLink() { close(); }

std::string LocalLink::trouble() const {
  const HalStatus status = status_.load();
  return status == HalStatus::kOk ? "" : std::string(peer_.name()) + ": " + to_text(status);
}

std::span<std::uint8_t> LocalLink::out_bytes() noexcept {
  return std::span(out_).first(std::min<std::size_t>(driver_.profile().out_bytes, out_.size()));
}

SendOutcome LocalLink::send(std::size_t bytes) noexcept {
  if (busy_) return SendOutcome::kBusy;
  busy_ = true;
  peer_.command(monotonic_ns(), std::span(out_).first(bytes));
  return SendOutcome::kSent;
}

HalStatus LocalLink::connect() noexcept {
  if (const HalStatus plugged = peer_.plug(monotonic_ns()); plugged != HalStatus::kOk)
    return plugged;
  flow_.begin_start();
  Port port(*this);
  const HalStatus started = driver_.start(port);
  if (started != HalStatus::kOk) {
    peer_.unplug();
    flow_.end(false, started);
    return started;
  }
  busy_ = false;
  connected_ = true;
  flow_watch_.tell(true);
  flow_.begin_reports();
  return HalStatus::kOk;
}

HalStatus LocalLink::poll(std::int64_t timeout_ns) noexcept {
  if (connected_) {
    serve(cancelled_.load() ? 0 : timeout_ns);
    if (peer_.gone()) lose();
  } else if (!cancelled_.load()) {
    const std::int64_t now = monotonic_ns();
    if (now >= next_try_ns_) {
      status_.store(connect());
      next_try_ns_ = now + settings_.retry_ns;
    }
    if (!connected_) (void)sleep_until(monotonic_ns() + timeout_ns);
  }
  return status_.load();
}

void LocalLink::lose() noexcept {
  connected_ = false;
  status_.store(HalStatus::kDeviceGone);
  flow_.end(true, HalStatus::kDeviceGone);
  flow_watch_.tell(false);
  peer_.unplug();
  next_try_ns_ = monotonic_ns() + settings_.retry_ns;
}

void LocalLink::serve(std::int64_t timeout_ns) noexcept {
  const std::int64_t now = monotonic_ns();
  const std::int64_t wait_ns = busy_ ? 0 : std::min(timeout_ns, flow_.until_turn_ns());
  const std::int64_t until_ns = std::min(now + wait_ns, peer_.next_report_ns());
  if (until_ns > now) peer_.wait(until_ns);
  if (busy_) {
    busy_ = false;
    flow_.on_out_end(true);
  }
  const std::size_t size = peer_.report(monotonic_ns(), in_);
  if (size > 0) {
    flow_.on_report(std::span(in_).first(size));
    flow_.on_report_done();
  }
  flow_.turn();
}

ZeroCommand LocalLink::zero_target() const noexcept {
  ZeroCommand target;
  target.descriptor = peer_.descriptor();
  return target;
}

void LocalLink::close() noexcept {
  if (connected_) {
    flow_.begin_rest();
    const std::int64_t end_ns = monotonic_ns() + kLongestRest_ns;
    while (!flow_.is_at_rest() && !peer_.gone() && monotonic_ns() < end_ns) serve(kRestWait_ns);
    connected_ = false;
    flow_watch_.tell(false);
    flow_.end(false, HalStatus::kOk);
    peer_.unplug();
  }
  cancelled_.store(false);
}

}  // namespace haptic::hal
