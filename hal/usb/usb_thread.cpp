// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_thread.hpp"

#include <sched.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace haptic::hal {
namespace {

// Beyond what is touched: libusb, libc, and the thread-local state of a sanitizer, which lies
// there.
constexpr std::size_t kStackReserve = 1024 * 1024;
constexpr std::size_t kPageBytes = 4096;

// Touches `bytes` of the stack below, page by page, in frames of a bounded size.
[[gnu::noinline]] void prefault_stack(std::size_t bytes) noexcept {
  volatile unsigned char page[kPageBytes];
  page[0] = 1;
  if (bytes > kPageBytes) prefault_stack(bytes - kPageBytes);
  page[kPageBytes - 1] = page[0];  // after the call: the frame stays
}

// The first allocation of a thread sets up and faults in its own arena; not while reports flow.
void touch_heap() noexcept {
  void* volatile block = std::malloc(kPageBytes);
  std::free(block);
}

}  // namespace

UsbThread::UsbThread(UsbLink& link, const UsbThreadSettings& settings) noexcept
    : link_(link), settings_(settings) {}

UsbThreadGrant UsbThread::start() noexcept {
  if (started_) return grant_;
  grant_ = UsbThreadGrant{};
  stopping_.store(false);
  ready_.store(false);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  (void)pthread_attr_setstacksize(&attributes, settings_.prefault_bytes + kStackReserve);
  grant_.create_error = pthread_create(&thread_, &attributes, entry, this);
  pthread_attr_destroy(&attributes);
  if (grant_.create_error != 0) return grant_;
  started_ = true;
  ready_.wait(false);
  return grant_;
}

void UsbThread::stop() noexcept {
  if (!started_) return;
  stopping_.store(true, std::memory_order_release);
  link_.cancel();
  pthread_join(thread_, nullptr);
  started_ = false;
}

void* UsbThread::entry(void* self) {
  static_cast<UsbThread*>(self)->run();
  return nullptr;
}

void UsbThread::run() noexcept {
  char name[16] = {};
  std::strncpy(name, settings_.name, sizeof name - 1);
  (void)pthread_setname_np(pthread_self(), name);
  if (settings_.cpu >= 0) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    if (settings_.cpu < CPU_SETSIZE) CPU_SET(static_cast<unsigned>(settings_.cpu), &cpus);
    grant_.affinity_error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus);
    if (grant_.affinity_error == 0) grant_.cpu = settings_.cpu;
  }
  if (settings_.priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = settings_.priority;
    grant_.priority_error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (grant_.priority_error == 0) grant_.priority = settings_.priority;
  }
  prefault_stack(settings_.prefault_bytes);
  touch_heap();
  running_.store(true, std::memory_order_release);
  ready_.store(true, std::memory_order_release);
  ready_.notify_all();

  const std::int64_t wait_ns = std::max<std::int64_t>(settings_.period_ns / 2, 1);
  while (!stopping_.load(std::memory_order_acquire))
    status_.store(link_.poll(wait_ns), std::memory_order_release);
  link_.close();
  running_.store(false, std::memory_order_release);
}

}  // namespace haptic::hal
