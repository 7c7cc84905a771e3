// SPDX-License-Identifier: Apache-2.0
#include "hal/local/local_link.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "hal/clock/servo_clock.hpp"
#include "hal/usb/usb_text.hpp"

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
  const std::lock_guard lock(trouble_mutex_);
  return trouble_;
}

void LocalLink::tell(HalStatus why, std::string text) {
  status_ = why;
  const std::lock_guard lock(trouble_mutex_);
  trouble_ = std::move(text);
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

HalStatus LocalLink::connect() {
  const HalStatus plugged = peer_.plug(monotonic_ns());
  if (plugged == HalStatus::kOk) return start_reports();
  tell(plugged, named(plugged));
  return plugged;
}

HalStatus LocalLink::start_reports() {
  flow_.begin_start();
  Port port(*this);
  HalStatus started = driver_.start(port);
  std::string text = named(started);
  if (started == HalStatus::kOk) {
    text = flow_.defect(0);
    if (!text.empty()) started = HalStatus::kNotAccepted;
  }
  if (started != HalStatus::kOk) {
    peer_.unplug();
    flow_.end(false, started);
    tell(started, std::move(text));
    return started;
  }
  busy_ = false;
  connected_ = true;
  flow_watch_.tell(true);
  flow_.begin_reports();
  tell(HalStatus::kOk, flow_.is_other_device() ? other_device_text(flow_.stated()) : "");
  return HalStatus::kOk;
}

HalStatus LocalLink::poll(std::int64_t timeout_ns) noexcept {
  if (connected_) {
    serve(cancelled_.load() ? 0 : timeout_ns);
    if (peer_.gone()) lose();
  } else if (!cancelled_.load()) {
    look_for_peer(timeout_ns);
  }
  return status_;
}

void LocalLink::look_for_peer(std::int64_t timeout_ns) noexcept {
  const std::int64_t now = monotonic_ns();
  try {
    if (now >= next_try_ns_) {
      next_try_ns_ = now + settings_.retry_ns;
      (void)connect();
    }
  } catch (const std::exception&) {  // texts made while connecting
    connected_ = false;
    flow_watch_.tell(false);
    peer_.unplug();
    flow_.end(false, HalStatus::kNoMemory);
    status_ = HalStatus::kNoMemory;
  }
  if (!connected_) (void)sleep_until(monotonic_ns() + timeout_ns);
}

std::string LocalLink::named(HalStatus status) const {
  return status == HalStatus::kOk ? "" : std::string(peer_.name()) + ": " + to_text(status);
}

void LocalLink::lose() noexcept {
  connected_ = false;
  status_ = HalStatus::kDeviceGone;
  flow_.end(true, HalStatus::kDeviceGone);  // first of all: the servo thread waits for it
  flow_watch_.tell(false);
  peer_.unplug();
  next_try_ns_ = monotonic_ns() + settings_.retry_ns;
  try {
    tell(HalStatus::kDeviceGone, named(HalStatus::kDeviceGone));
  } catch (const std::exception&) {  // no memory for a text
  }
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
  std::int64_t sampled_ns = monotonic_ns();
  const std::size_t size = peer_.report(sampled_ns, in_, sampled_ns);
  if (size > 0) {
    flow_.on_report(std::span(in_).first(size), sampled_ns);
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
