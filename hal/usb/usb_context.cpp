// SPDX-License-Identifier: Apache-2.0
#include "hal/usb/usb_context.hpp"

#include <libusb.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <ctime>

namespace haptic::hal {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

int make_context(libusb_context*& context, bool discovery) noexcept {
#if LIBUSB_API_VERSION >= 0x0100010A
  libusb_init_option option{};
  option.option = LIBUSB_OPTION_NO_DEVICE_DISCOVERY;
  return libusb_init_context(&context, &option, discovery ? 0 : 1);
#else
  if (!discovery) libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
  return libusb_init(&context);
#endif
}

int on_arrival(libusb_context* /*context*/, libusb_device* /*device*/,
               libusb_hotplug_event /*event*/, void* arrived) {
  *static_cast<bool*>(arrived) = true;
  return 0;  // stay registered
}

}  // namespace

UsbContext::UsbContext() noexcept {
  descriptors_[0].fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  descriptors_[0].events = POLLIN;
}

UsbContext::~UsbContext() {
  close();
  if (descriptors_[0].fd >= 0) ::close(descriptors_[0].fd);
}

int UsbContext::open(bool discovery) noexcept {
  if (context_ != nullptr) return 0;
  const int code = make_context(context_, discovery);
  if (code < 0) {
    context_ = nullptr;
    return code;
  }
  libusb_set_pollfd_notifiers(context_, on_added, on_removed, this);
  const libusb_pollfd** given = libusb_get_pollfds(context_);
  for (const libusb_pollfd** each = given; each != nullptr && *each != nullptr; ++each)
    on_added((*each)->fd, (*each)->events, this);
  libusb_free_pollfds(given);
  return 0;
}

void UsbContext::close() noexcept {
  if (context_ == nullptr) return;
  libusb_set_pollfd_notifiers(context_, nullptr, nullptr, nullptr);
  libusb_exit(context_);
  context_ = nullptr;
  count_ = 1;
  overflowed_ = false;
}

void UsbContext::on_added(int descriptor, short events, void* self) {
  auto& context = *static_cast<UsbContext*>(self);
  if (context.count_ == kMostDescriptors) {
    context.overflowed_ = true;
    return;
  }
  context.descriptors_[context.count_++] = {descriptor, events, 0};
}

void UsbContext::on_removed(int descriptor, void* self) {
  auto& context = *static_cast<UsbContext*>(self);
  for (std::size_t i = 1; i < context.count_; ++i) {
    if (context.descriptors_[i].fd != descriptor) continue;
    context.descriptors_[i] = context.descriptors_[--context.count_];
    return;
  }
}

void UsbContext::watch_arrivals(std::uint16_t vendor_id, std::uint16_t product_id) noexcept {
  if (context_ == nullptr || libusb_has_capability(LIBUSB_CAP_HAS_HOTPLUG) == 0) return;
  // Refused, we are left with asking every now and then.
  (void)libusb_hotplug_register_callback(context_, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED,
                                         LIBUSB_HOTPLUG_NO_FLAGS, vendor_id, product_id,
                                         LIBUSB_HOTPLUG_MATCH_ANY, on_arrival, &arrived_, nullptr);
}

bool UsbContext::arrived() noexcept {
  const bool result = arrived_;
  arrived_ = false;
  return result;
}

int UsbContext::handle_events(std::int64_t timeout_ns) noexcept {
  if (timeout_ns < 0) timeout_ns = 0;
  const timespec wait{timeout_ns / kNsPerSecond, timeout_ns % kNsPerSecond};
  const int ready = overflowed_ ? 1 : ppoll(descriptors_.data(), count_, &wait, nullptr);
  if (ready <= 0) return 0;
  if ((descriptors_[0].revents & POLLIN) != 0) {
    std::uint64_t woken = 0;
    (void)!::read(descriptors_[0].fd, &woken, sizeof woken);
  }
  if (context_ == nullptr) return 0;
  timeval at_once{0, 0};
  if (overflowed_) at_once.tv_usec = static_cast<suseconds_t>(timeout_ns / 1000 % 1'000'000);
  return libusb_handle_events_timeout_completed(context_, &at_once, nullptr);
}

void UsbContext::wake() noexcept {
  const std::uint64_t one = 1;
  (void)!::write(descriptors_[0].fd, &one, sizeof one);
}

}  // namespace haptic::hal
