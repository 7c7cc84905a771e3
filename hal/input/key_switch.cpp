// SPDX-License-Identifier: Apache-2.0
#include "hal/input/key_switch.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <ctime>

namespace haptic::hal {
namespace {

constexpr timespec kLook{0, 100'000'000};
constexpr int kMostReads = 8;
constexpr std::size_t kEvents = 16;

}  // namespace

KeySwitch::KeySwitch(const KeySwitchSettings& settings) : settings_(settings) {
  look();
  has_thread_ = pthread_create(&thread_, nullptr, entry, this) == 0;
}

KeySwitch::~KeySwitch() {
  stop_.store(true);
  if (has_thread_) pthread_join(thread_, nullptr);
  for (const int fd : {fd_.load(), gone_.load()}) {
    if (fd >= 0) ::close(fd);
  }
}

void* KeySwitch::entry(void* self) {
  auto& key = *static_cast<KeySwitch*>(self);
  while (!key.stop_.load()) {
    key.look();
    (void)nanosleep(&kLook, nullptr);
  }
  return nullptr;
}

void KeySwitch::look() noexcept {
  if (const int gone = gone_.exchange(-1); gone >= 0) ::close(gone);
  if (fd_.load(std::memory_order_acquire) >= 0) return;
  fd_.store(::open(settings_.path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC),
            std::memory_order_release);
}

void KeySwitch::take(const input_event& event) noexcept {
  // Events were lost: a release may be among them.
  if (event.type == EV_SYN && event.code == SYN_DROPPED) down_ = false;
  if (event.type != EV_KEY || event.code != settings_.key) return;
  if (event.value == 0) down_ = false;
  if (event.value == 1) down_ = true;  // 2 repeats what is known
}

bool KeySwitch::take_events(int fd) noexcept {
  std::array<input_event, kEvents> events{};
  for (int k = 0; k < kMostReads; ++k) {
    const ssize_t size = ::read(fd, events.data(), sizeof events);
    if (size < 0) return errno == EAGAIN || errno == EINTR;
    if (size == 0 || static_cast<std::size_t>(size) % sizeof(input_event) != 0) return false;
    const std::size_t count = static_cast<std::size_t>(size) / sizeof(input_event);
    for (std::size_t i = 0; i < count; ++i) take(events[i]);
    if (count < kEvents) return true;
  }
  down_ = false;  // more than any hand does: not understood
  return true;
}

std::uint32_t KeySwitch::pressed() noexcept {
  const int fd = fd_.load(std::memory_order_acquire);
  if (fd < 0) {
    down_ = false;
    return 0;
  }
  if (!take_events(fd)) {
    down_ = false;
    gone_.store(fd);
    fd_.store(-1, std::memory_order_release);
  }
  return down_ ? settings_.mask : 0;
}

}  // namespace haptic::hal
