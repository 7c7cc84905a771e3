// SPDX-License-Identifier: Apache-2.0
// Transfers of the fake bus: submission, the device's answer, completion, reaping, cancelling,
// unplugging.

// This order: the kernel's header of usbfs needs the types and macros of the first two.
#include "host_sim/device/usbfs_bus.hpp"

#include <fcntl.h>
#include <linux/ioctl.h>
#include <linux/types.h>
#include <linux/usbdevice_fs.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace haptic::sim {

namespace {

constexpr std::size_t kNoFlight = ~std::size_t{0};

bool is_control(const usbdevfs_urb& urb) { return urb.type == USBDEVFS_URB_TYPE_CONTROL; }
bool is_in(const usbdevfs_urb& urb) { return !is_control(urb) && (urb.endpoint & 0x80u) != 0; }
std::uint8_t address_of(const usbdevfs_urb& urb) { return is_control(urb) ? 0 : urb.endpoint; }

std::span<std::uint8_t> bytes_of(const usbdevfs_urb& urb) {
  return {static_cast<std::uint8_t*>(urb.buffer), static_cast<std::size_t>(urb.buffer_length)};
}

std::uint16_t little_endian(std::uint8_t low, std::uint8_t high) {
  return static_cast<std::uint16_t>(low | (high << 8));
}

// An interrupt transfer needs an interrupt endpoint; a bulk transfer may use either, as in usbfs.
bool fits(const usbdevfs_urb& urb, unsigned endpoint_type) {
  switch (urb.type) {
    case USBDEVFS_URB_TYPE_CONTROL:
      return endpoint_type == 0;
    case USBDEVFS_URB_TYPE_INTERRUPT:
      return endpoint_type == 3;
    case USBDEVFS_URB_TYPE_BULK:
      return endpoint_type == 2 || endpoint_type == 3;
    default:
      return false;
  }
}

}  // namespace

ReadinessPipe::ReadinessPipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0)
    throw std::system_error(errno, std::generic_category(), "pipe2");
  read_end_ = ends[0];
  write_end_ = ends[1];
  constexpr int kPageBytes = 4096;
  const int room = fcntl(write_end_, F_SETPIPE_SZ, kPageBytes);
  if (room < 0) {
    const int refusal = errno;
    close(read_end_);
    close(write_end_);
    throw std::system_error(refusal, std::generic_category(), "F_SETPIPE_SZ");
  }
  page_.resize(static_cast<std::size_t>(room));
  show_ready(false);
}

ReadinessPipe::~ReadinessPipe() {
  hang_up();
  close(write_end_);
}

void ReadinessPipe::show_ready(bool ready) {
  if (ready == ready_ || read_end_ < 0) return;
  ready_ = ready;
  // The pipe is either full or empty, so one call moves the whole page; there is no other user.
  const ssize_t moved = ready ? read(read_end_, page_.data(), page_.size())
                              : write(write_end_, page_.data(), page_.size());
  if (moved != static_cast<ssize_t>(page_.size()))
    throw std::system_error(moved < 0 ? errno : EIO, std::generic_category(), "readiness pipe");
}

void ReadinessPipe::hang_up() {
  if (read_end_ >= 0) close(read_end_);
  read_end_ = -1;
}

int UsbfsBus::take(Faults& faults) {
  if (faults.empty()) return 0;
  const int result = faults.front().first;
  if (--faults.front().second == 0) faults.pop_front();
  return result;
}

long UsbfsBus::submit(usbdevfs_urb* urb) {
  Lock lock(mutex_);
  if (armed_ && in_reaped_ && is_in(*urb)) unplug_locked();
  if (!plugged_) return -ENODEV;
  const auto endpoint = endpoints_.find(address_of(*urb));
  if (endpoint == endpoints_.end()) return -ENOENT;
  if (!fits(*urb, endpoint->second.described.type) || urb->buffer_length < 0) return -EINVAL;
  if (is_control(*urb)) {
    if (urb->buffer_length < static_cast<int>(kSetupBytes)) return -EINVAL;
    const std::uint8_t* setup = bytes_of(*urb).data();
    if (little_endian(setup[6], setup[7]) + kSetupBytes > bytes_of(*urb).size()) return -EINVAL;
  }
  if (const int refused = take(endpoint->second.refusals)) return refused;
  urb->status = -EINPROGRESS;
  urb->actual_length = 0;
  flights_.push_back({urb});
  if (is_in(*urb)) {
    serve_in(endpoint->first);
  } else {
    carry_out(lock);
  }
  return 0;
}

// The next transfer that the device can take: unless held.
std::size_t UsbfsBus::next_for_device() const {
  for (std::size_t i = 0; i < flights_.size(); ++i) {
    const Flight& flight = flights_[i];
    if (flight.at_device || is_in(*flight.urb)) continue;
    const bool held = is_control(*flight.urb) ? control_held_ : out_held_;
    if (!held) return i;
  }
  return kNoFlight;
}

// Hands control and OUT transfers to the device, one at a time in the order of submission.
void UsbfsBus::carry_out(Lock& lock) {
  if (at_device_) return;  // whoever is in the loop below takes this one too
  for (std::size_t next = next_for_device(); next != kNoFlight; next = next_for_device()) {
    if (const int failure = take(endpoints_[address_of(*flights_[next].urb)].failures)) {
      finish(next, failure, 0);
    } else {
      carry(next, lock);
    }
  }
}

// One of them. The lock is released meanwhile: the device may push a report in answer, and an
// unplug may end the transfer, after which its URB and its bytes are no longer ours.
void UsbfsBus::carry(std::size_t flight, Lock& lock) {
  usbdevfs_urb* const urb = flights_[flight].urb;
  const bool is_setup = is_control(*urb);
  const std::uint8_t address = urb->endpoint;
  carried_.assign(bytes_of(*urb).begin(), bytes_of(*urb).end());
  flights_[flight].at_device = at_device_ = true;
  lock.unlock();
  const std::span<std::uint8_t> bytes(carried_);
  long moved = 0;
  if (is_setup) {
    moved = control(bytes[0], bytes[1], little_endian(bytes[2], bytes[3]),
                    little_endian(bytes[4], bytes[5]),
                    bytes.subspan(kSetupBytes, little_endian(bytes[6], bytes[7])));
  } else {
    moved = function_.out(address, bytes);
  }
  lock.lock();
  at_device_ = false;
  if (const std::size_t done = flight_of(urb); done != kNoFlight) {
    const bool to_host = is_setup && (bytes[0] & 0x80u) != 0;
    if (to_host && moved > 0)
      std::copy_n(bytes.data() + kSetupBytes, moved, bytes_of(*urb).data() + kSetupBytes);
    finish(done, static_cast<int>(std::min(moved, 0L)),
           static_cast<std::size_t>(std::max(moved, 0L)));
  }
  // Reports that the device pushed meanwhile follow the transfer that they answer.
  for (const auto& entry : endpoints_) serve_in(entry.first);
}

// Ends IN transfers with the reports that wait, oldest with oldest.
void UsbfsBus::serve_in(std::uint8_t address) {
  if (!plugged_ || at_device_) return;
  Endpoint& endpoint = endpoints_[address];
  while (!endpoint.reports.empty()) {
    const auto flight = std::find_if(flights_.begin(), flights_.end(), [address](const Flight& f) {
      return is_in(*f.urb) && f.urb->endpoint == address;
    });
    if (flight == flights_.end()) return;
    usbdevfs_urb& urb = *flight->urb;
    const std::vector<std::uint8_t>& report = endpoint.reports.front();
    const std::size_t room = bytes_of(urb).size(), moved = std::min(room, report.size());
    int status = take(endpoint.failures);
    if (status == 0) {
      if (moved > 0) std::memcpy(urb.buffer, report.data(), moved);
      if (report.size() > room) status = -EOVERFLOW;
      if (report.size() < room && (urb.flags & USBDEVFS_URB_SHORT_NOT_OK) != 0) status = -EREMOTEIO;
      finish(static_cast<std::size_t>(flight - flights_.begin()), status, moved);
    } else {
      finish(static_cast<std::size_t>(flight - flights_.begin()), status, 0);
    }
    spare_.push_back(std::move(endpoint.reports.front()));
    endpoint.reports.pop_front();
  }
}

std::size_t UsbfsBus::flight_of(const usbdevfs_urb* urb) const {
  for (std::size_t i = 0; i < flights_.size(); ++i) {
    if (flights_[i].urb == urb) return i;
  }
  return kNoFlight;
}

void UsbfsBus::finish(std::size_t flight, int status, std::size_t moved) {
  usbdevfs_urb* urb = flights_[flight].urb;
  flights_.erase(flights_.begin() + static_cast<std::ptrdiff_t>(flight));
  urb->status = status;
  urb->actual_length = static_cast<int>(moved);
  ended_.push_back(urb);
  pipe_.show_ready(true);
}

long UsbfsBus::reap(void** urb) {
  const Lock lock(mutex_);
  if (ended_.empty()) return plugged_ ? -EAGAIN : -ENODEV;
  usbdevfs_urb* first = ended_.front();
  ended_.erase(ended_.begin());
  if (ended_.empty()) pipe_.show_ready(false);
  if (is_in(*first) && first->status == 0) in_reaped_ = true;
  *urb = first;
  return 0;
}

long UsbfsBus::discard(const usbdevfs_urb* urb) {
  const Lock lock(mutex_);
  if (!plugged_) return -ENODEV;
  const std::size_t flight = flight_of(urb);
  if (flight == kNoFlight || flights_[flight].at_device) return -EINVAL;  // ends by itself
  finish(flight, -ENOENT, 0);
  return 0;
}

bool UsbfsBus::push(std::uint8_t endpoint, std::span<const std::uint8_t> bytes) {
  const Lock lock(mutex_);
  const auto found = endpoints_.find(endpoint);
  if (found == endpoints_.end() || (endpoint & 0x80u) == 0 || !plugged_) return false;
  std::deque<std::vector<std::uint8_t>>& reports = found->second.reports;
  std::vector<std::uint8_t> report;
  if (!spare_.empty()) {
    report = std::move(spare_.back());
    spare_.pop_back();
  }
  report.assign(bytes.begin(), bytes.end());
  reports.push_back(std::move(report));
  serve_in(endpoint);
  if (reports.size() <= room_) return true;
  spare_.push_back(std::move(reports.front()));
  reports.pop_front();
  return false;
}

void UsbfsBus::fail_next(std::uint8_t endpoint, int negative_errno, unsigned times) {
  const Lock lock(mutex_);
  const auto found = endpoints_.find(endpoint);
  if (found != endpoints_.end() && negative_errno < 0 && times > 0)
    found->second.failures.emplace_back(negative_errno, times);
}

void UsbfsBus::refuse_submit(std::uint8_t endpoint, int negative_errno, unsigned times) {
  const Lock lock(mutex_);
  const auto found = endpoints_.find(endpoint);
  if (found != endpoints_.end() && negative_errno < 0 && times > 0)
    found->second.refusals.emplace_back(negative_errno, times);
}

void UsbfsBus::hold_out(bool held) {
  Lock lock(mutex_);
  out_held_ = held;
  if (!held) carry_out(lock);
}

void UsbfsBus::hold_control(bool held) {
  Lock lock(mutex_);
  control_held_ = held;
  if (!held) carry_out(lock);
}

void UsbfsBus::unplug() {
  const Lock lock(mutex_);
  unplug_locked();
}

// Also what the device works on at the moment: the host gets it back now.
void UsbfsBus::unplug_locked() {
  if (!plugged_) return;
  plugged_ = false;
  while (!flights_.empty()) finish(0, -ESHUTDOWN, 0);
  pipe_.hang_up();
}

void UsbfsBus::unplug_at_next_resubmit() {
  const Lock lock(mutex_);
  armed_ = true;
  in_reaped_ = false;
}

bool UsbfsBus::plugged() const {
  const Lock lock(mutex_);
  return plugged_;
}

unsigned UsbfsBus::waiting(std::uint8_t endpoint) const {
  const Lock lock(mutex_);
  return static_cast<unsigned>(std::count_if(
      flights_.begin(), flights_.end(),
      [endpoint](const Flight& flight) { return address_of(*flight.urb) == endpoint; }));
}

}  // namespace haptic::sim
