// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_thread.hpp"

#include <algorithm>
#include <cstring>

#include "hal/clock/linux_process.hpp"

namespace haptic::hal {
namespace {

// Beyond what is touched: libusb, libc, and the thread-local state of a sanitizer, which lies
// there.
constexpr std::size_t kStackReserve = 1024 * 1024;

}  // namespace

UsbThread::UsbThread(DeviceLink& link, const UsbThreadSettings& settings) noexcept
    : link_(link), settings_(settings) {
  link_.watch_flow(on_flow, this);
}

UsbThreadGrant UsbThread::start() noexcept {
  if (started_) return grant_;
  grant_ = UsbThreadGrant{};
  stopping_.store(false);
  ready_.store(false);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  (void)pthread_attr_setstacksize(&attributes, settings_.prefault_bytes + kStackReserve);
  {
    const SignalsHeld held;
    grant_.create_error = pthread_create(&thread_, &attributes, entry, this);
  }
  pthread_attr_destroy(&attributes);
  if (grant_.create_error != 0) return grant_;
  started_ = true;
  ready_.wait(false);
  return grant_;
}

void UsbThread::begin_stop() noexcept {
  if (!started_) return;
  stopping_.store(true, std::memory_order_release);
  link_.cancel();
}

void UsbThread::stop() noexcept {
  if (!started_) return;
  begin_stop();
  pthread_join(thread_, nullptr);
  started_ = false;
}

void* UsbThread::entry(void* self) {
  static_cast<UsbThread*>(self)->run();
  return nullptr;
}

void UsbThread::try_rights() noexcept {
  (void)pthread_getaffinity_np(pthread_self(), sizeof cpus_before_, &cpus_before_);
  if (settings_.cpu >= 0) {
    grant_.affinity_error = tie_to_cpu(settings_.cpu);
    if (grant_.affinity_error == 0) grant_.cpu = settings_.cpu;
  }
  if (settings_.priority > 0) {
    grant_.priority_error = set_fifo_priority(settings_.priority);
    if (grant_.priority_error == 0) grant_.priority = settings_.priority;
  }
  give_rights_back();
}

void UsbThread::take_rights() const noexcept {
  if (grant_.cpu >= 0) (void)tie_to_cpu(grant_.cpu);
  if (grant_.priority > 0) (void)set_fifo_priority(grant_.priority);
}

void UsbThread::give_rights_back() const noexcept {
  const sched_param ordinary{};
  if (grant_.priority > 0) (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
  if (grant_.cpu >= 0)
    (void)pthread_setaffinity_np(pthread_self(), sizeof cpus_before_, &cpus_before_);
}

void UsbThread::on_flow(void* self, bool flows) noexcept {
  const auto& thread = *static_cast<const UsbThread*>(self);
  if (flows) {
    thread.take_rights();
  } else {
    thread.give_rights_back();
  }
}

void UsbThread::run() noexcept {
  char name[16] = {};
  std::strncpy(name, settings_.name, sizeof name - 1);
  (void)pthread_setname_np(pthread_self(), name);
  try_rights();
  prefault_stack(settings_.prefault_bytes);
  touch_heap();
  running_.store(true, std::memory_order_release);
  ready_.store(true, std::memory_order_release);
  ready_.notify_all();

  const std::int64_t wait_ns = std::max<std::int64_t>(settings_.period_ns / 2, 1);
  while (!stopping_.load(std::memory_order_acquire)) {
    status_.store(link_.poll(wait_ns), std::memory_order_release);
    // One writer: the count need not be read back from memory that others have as well.
    if (settings_.turns != nullptr) settings_.turns->store(++turns_, std::memory_order_relaxed);
  }
  link_.close();
  running_.store(false, std::memory_order_release);
}

}  // namespace haptic::hal
