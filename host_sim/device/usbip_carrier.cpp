// SPDX-License-Identifier: Apache-2.0
#include "host_sim/device/usbip_carrier.hpp"

#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <deque>
#include <map>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

#include "host_sim/device/usb_descriptors.hpp"
#include "host_sim/device/usbip_codec.hpp"

namespace haptic::sim {
namespace {

std::uint16_t setup_word(std::uint8_t low, std::uint8_t high) {
  return static_cast<std::uint16_t>(low | (high << 8));
}

}  // namespace

/// The transfers of one connection. Its thread reads; whoever ends a transfer writes, under the
/// lock, and never waits: what the socket does not take ends the connection.
class UsbipCarrier::Bus {
 public:
  Bus(UsbFunction& function, unsigned room)
      : function_(function), room_(room), descriptors_(function.descriptors()) {
    for (const auto& each : descriptors_.endpoints()) endpoints_[each.first];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends_.data()) != 0)
      throw std::system_error(errno, std::generic_category(), "socket pair for USB/IP");
  }
  ~Bus() {
    for (const int end : ends_) ::close(end);
  }
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  [[nodiscard]] int host_end() const { return ends_[1]; }

  void serve();
  bool push(std::uint8_t address, std::span<const std::uint8_t> bytes);
  void fail(std::uint8_t address, int negative_errno, unsigned times, bool at_submit);
  void unplug() {
    const std::lock_guard lock(mutex_);
    unplug_locked();
  }
  void unplug_behind_report() {
    const std::lock_guard lock(mutex_);
    unplug_behind_report_ = true;
  }
  [[nodiscard]] bool plugged() const {
    const std::lock_guard lock(mutex_);
    return plugged_;
  }

 private:
  using Lock = std::unique_lock<std::mutex>;
  /// Faults to come: errno and how often.
  using Faults = std::deque<std::pair<int, unsigned>>;
  struct Endpoint {
    std::deque<std::vector<std::uint8_t>> reports;  ///< pushed, no transfer yet
    std::deque<UsbipSubmit> held;                   ///< IN transfers without a report
    Faults failures, refusals;
  };

  bool receive(std::span<std::uint8_t> bytes) const;
  bool visit(const UsbipMessage& message);
  bool submit(const UsbipSubmit& submit);
  void carry(const UsbipSubmit& submit, Lock& lock);
  int control(const UsbipSubmit& submit);
  void unlink(const UsbipUnlink& unlink);
  void serve_in(Endpoint& endpoint);
  void send(const UsbipMessage& message, std::span<const std::uint8_t> bytes);
  void end(const UsbipSubmit& submit, int status, std::span<const std::uint8_t> bytes) {
    send(UsbipSubmitEnd{submit.sequence, status, static_cast<std::uint32_t>(bytes.size())}, bytes);
  }
  void unplug_locked();
  [[nodiscard]] static int take(Faults& faults);

  UsbFunction& function_;
  const unsigned room_;
  const UsbDescriptors descriptors_;
  std::array<int, 2> ends_{-1, -1};  ///< ours, the host's
  std::vector<std::uint8_t> bytes_;  ///< of the transfer at hand; the thread's own

  mutable std::mutex mutex_;  ///< of all below; never held while the function is called
  std::map<std::uint8_t, Endpoint> endpoints_;
  bool plugged_ = true, at_device_ = false, unplug_behind_report_ = false;
};

int UsbipCarrier::Bus::take(Faults& faults) {
  if (faults.empty()) return 0;
  const int result = faults.front().first;
  if (--faults.front().second == 0) faults.pop_front();
  return result;
}

// False at the end of the connection.
bool UsbipCarrier::Bus::receive(std::span<std::uint8_t> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = recv(ends_[0], bytes.data(), bytes.size(), MSG_WAITALL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

// Until the host hangs up, or sends what is no USB/IP.
void UsbipCarrier::Bus::serve() {
  std::array<std::uint8_t, kUsbipHeaderBytes> header{};
  UsbipMessage message;
  while (receive(header) && decode(header, message) == UsbipVerdict::kOk && visit(message)) {
  }
  unplug();
}

bool UsbipCarrier::Bus::visit(const UsbipMessage& message) {
  if (const auto* const begun = std::get_if<UsbipSubmit>(&message)) return submit(*begun);
  const auto* const taken_back = std::get_if<UsbipUnlink>(&message);
  if (taken_back == nullptr) return false;  // a host ends no transfers
  unlink(*taken_back);
  return true;
}

bool UsbipCarrier::Bus::submit(const UsbipSubmit& submit) {
  bytes_.assign(submit.byte_count, 0);
  if (!submit.to_host && !receive(bytes_)) return false;
  Lock lock(mutex_);
  if (!plugged_) return false;
  const auto found = endpoints_.find(submit.address());
  if (found == endpoints_.end()) {
    end(submit, -EPIPE, {});
    return true;
  }
  Endpoint& endpoint = found->second;
  if (const int refused = take(endpoint.refusals)) {
    end(submit, refused, {});
  } else if (submit.address() >= 0x80) {
    endpoint.held.push_back(submit);
    serve_in(endpoint);
  } else if (const int failure = take(endpoint.failures)) {
    end(submit, failure, {});
  } else {
    carry(submit, lock);
  }
  return true;
}

// Control and OUT. Reports that the device pushes meanwhile follow the transfer that they answer.
void UsbipCarrier::Bus::carry(const UsbipSubmit& submit, Lock& lock) {
  at_device_ = true;
  lock.unlock();
  const int moved = submit.endpoint == 0 ? control(submit) : function_.out(submit.endpoint, bytes_);
  lock.lock();
  at_device_ = false;
  const std::size_t count = std::min(bytes_.size(), static_cast<std::size_t>(std::max(moved, 0)));
  if (submit.to_host) {
    end(submit, std::min(moved, 0), std::span(bytes_).first(count));
  } else {
    send(UsbipSubmitEnd{submit.sequence, std::min(moved, 0), static_cast<std::uint32_t>(count)},
         {});
  }
  for (auto& each : endpoints_) serve_in(each.second);
}

int UsbipCarrier::Bus::control(const UsbipSubmit& submit) {
  const auto& setup = submit.setup;
  const std::uint16_t value = setup_word(setup[2], setup[3]);
  const std::uint16_t index = setup_word(setup[4], setup[5]);
  const std::size_t length = std::min<std::size_t>(bytes_.size(), setup_word(setup[6], setup[7]));
  const std::span<std::uint8_t> bytes = std::span(bytes_).first(length);
  const long said = descriptors_.answer(setup[0], setup[1], value, index, bytes);
  if (said >= 0) return static_cast<int>(said);
  return std::min(function_.control(setup[0], setup[1], value, index, bytes),
                  static_cast<int>(length));
}

void UsbipCarrier::Bus::unlink(const UsbipUnlink& unlink) {
  const std::lock_guard lock(mutex_);
  for (auto& each : endpoints_) {
    std::deque<UsbipSubmit>& held = each.second.held;
    const auto found = std::find_if(held.begin(), held.end(), [&](const UsbipSubmit& submit) {
      return submit.sequence == unlink.target;
    });
    if (found == held.end()) continue;
    held.erase(found);
    send(UsbipUnlinkEnd{unlink.sequence, -ECONNRESET}, {});
    return;
  }
  send(UsbipUnlinkEnd{unlink.sequence, 0}, {});
}

// Ends IN transfers with the reports that wait, oldest with oldest.
void UsbipCarrier::Bus::serve_in(Endpoint& endpoint) {
  while (plugged_ && !at_device_ && !endpoint.reports.empty() && !endpoint.held.empty()) {
    const UsbipSubmit submit = endpoint.held.front();
    const std::vector<std::uint8_t> report = std::move(endpoint.reports.front());
    endpoint.held.pop_front();
    endpoint.reports.pop_front();
    int status = take(endpoint.failures);
    if (status != 0) {
      end(submit, status, {});
      continue;
    }
    const std::size_t moved = std::min<std::size_t>(report.size(), submit.byte_count);
    if (report.size() > submit.byte_count) status = -EOVERFLOW;
    if (report.size() < submit.byte_count && (submit.flags & kUsbipShortNotOk) != 0)
      status = -EREMOTEIO;
    end(submit, status, std::span(report).first(moved));
    if (unplug_behind_report_) unplug_locked();
  }
}

void UsbipCarrier::Bus::send(const UsbipMessage& message, std::span<const std::uint8_t> bytes) {
  if (!plugged_) return;
  std::array<std::uint8_t, kUsbipHeaderBytes> header{};
  encode(message, header);
  // sendmsg only reads what iov_base points at.
  std::array<iovec, 2> parts{iovec{header.data(), header.size()},
                             iovec{const_cast<std::uint8_t*>(bytes.data()), bytes.size()}};
  msghdr whole{};
  whole.msg_iov = parts.data();
  whole.msg_iovlen = parts.size();
  const ssize_t sent = sendmsg(ends_[0], &whole, MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent != static_cast<ssize_t>(header.size() + bytes.size())) unplug_locked();
}

bool UsbipCarrier::Bus::push(std::uint8_t address, std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  const auto found = endpoints_.find(address);
  if (found == endpoints_.end() || address < 0x80 || !plugged_) return false;
  Endpoint& endpoint = found->second;
  endpoint.reports.emplace_back(bytes.begin(), bytes.end());
  serve_in(endpoint);
  if (endpoint.reports.size() <= room_) return true;
  endpoint.reports.pop_front();
  return false;
}

void UsbipCarrier::Bus::fail(std::uint8_t address, int negative_errno, unsigned times,
                             bool at_submit) {
  const std::lock_guard lock(mutex_);
  const auto found = endpoints_.find(address);
  if (found == endpoints_.end() || negative_errno >= 0 || times == 0) return;
  Faults& faults = at_submit ? found->second.refusals : found->second.failures;
  faults.emplace_back(negative_errno, times);
}

// The host finds its end hung up and ends what is in flight; ours wakes the thread.
void UsbipCarrier::Bus::unplug_locked() {
  if (!plugged_) return;
  plugged_ = false;
  shutdown(ends_[0], SHUT_RDWR);
}

UsbipCarrier::UsbipCarrier(UsbFunction& function, unsigned room)
    : bus_(std::make_shared<Bus>(function, room)) {
  thread_ = std::thread([bus = bus_] { bus->serve(); });
}

UsbipCarrier::~UsbipCarrier() { close(); }

int UsbipCarrier::descriptor() const { return bus_->host_end(); }

bool UsbipCarrier::push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  return bus_->push(endpoint, bytes);
}

void UsbipCarrier::fail_next(std::uint8_t endpoint, int negative_errno, unsigned times) {
  bus_->fail(endpoint, negative_errno, times, false);
}

void UsbipCarrier::refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times) {
  bus_->fail(endpoint, negative_errno, times, true);
}

void UsbipCarrier::unplug() { bus_->unplug(); }

void UsbipCarrier::unplug_at_next_resubmit() { bus_->unplug_behind_report(); }

bool UsbipCarrier::plugged() const { return bus_->plugged(); }

void UsbipCarrier::close() {
  bus_->unplug();
  if (!thread_.joinable()) return;
  // A function that drops its carrier from within a call of it: the thread ends with that call.
  if (thread_.get_id() == std::this_thread::get_id()) return thread_.detach();
  thread_.join();
}

}  // namespace haptic::sim
