// SPDX-License-Identifier: Apache-2.0
#include "tests/bridges/spacenav/spacenav_emulator.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace haptic::test {
namespace {

using Words = std::array<std::int32_t, 8>;

constexpr std::int32_t kDeadZone = 2;  // spacenavd's default
constexpr int kPeriodMs = 8;

void put(int fd, const void* bytes, std::size_t count) {
  (void)!send(fd, bytes, count, MSG_NOSIGNAL | MSG_DONTWAIT);
}

std::int32_t scaled(std::int32_t value, float by) {
  const float product = static_cast<float>(value) * by;
  // As the machine's conversion has it, for what is no 32-bit integer.
  return std::abs(product) < 2147483648.0F ? static_cast<std::int32_t>(product) : INT32_MIN;
}

}  // namespace

SpacenavEmulator::SpacenavEmulator(std::string path, int version)
    : path_(std::move(path)), version_(version) {}

bool SpacenavEmulator::start() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path_.size() >= sizeof address.sun_path || pipe2(wake_, O_CLOEXEC) != 0) return false;
  std::copy(path_.begin(), path_.end(), address.sun_path);
  listening_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  (void)unlink(path_.c_str());
  if (bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listening_, 8) != 0)
    return false;
  stop_ = false;
  thread_ = std::thread([this] { serve(); });
  return true;
}

void SpacenavEmulator::kill() {
  if (!thread_.joinable()) return;
  stop_ = true;
  (void)!write(wake_[1], "", 1);
  thread_.join();
  for (const Client& client : clients_) close(client.fd);
  clients_.clear();
  for (const int fd : {listening_, wake_[0], wake_[1]}) close(fd);
}

void SpacenavEmulator::serve() {
  while (!stop_) {
    std::vector<pollfd> watched = {{listening_, POLLIN, 0}, {wake_[0], POLLIN, 0}};
    {
      const std::lock_guard lock(mutex_);
      for (const Client& client : clients_) watched.push_back({client.fd, POLLIN, 0});
    }
    if (poll(watched.data(), watched.size(), -1) <= 0 || stop_) continue;
    if (watched[0].revents != 0) {
      Client client;
      client.fd = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      const std::lock_guard lock(mutex_);
      if (client.fd >= 0) clients_.push_back(client);
    }
    for (std::size_t k = 2; k < watched.size(); ++k) {
      if (watched[k].revents == 0) continue;
      if (answer_after_ms_ > 0) pause();
      const std::lock_guard lock(mutex_);
      const auto client = std::find_if(clients_.begin(), clients_.end(), [&](const Client& each) {
        return each.fd == watched[k].fd;
      });
      if (client == clients_.end() || hear(*client)) continue;
      close(client->fd);
      clients_.erase(client);
    }
  }
}

void SpacenavEmulator::pause() const {
  std::this_thread::sleep_for(std::chrono::milliseconds(answer_after_ms_));
}

// False: it has gone.
bool SpacenavEmulator::hear(Client& client) {
  if (client.version == 0) {
    std::int32_t word = 0;
    if (recv(client.fd, &word, sizeof word, 0) <= 0) return false;
    if (version_ > 0 && (word & ~0xff) == 0x7faa5500) {
      client.version = std::min(word & 0xff, version_);
      client.mask = 7;
      word = 0x7faa5500 | client.version;
      if (!mute_) put(client.fd, &word, sizeof word);
      return true;
    }
    float sensitivity = 0;
    std::memcpy(&sensitivity, &word, sizeof word);
    if (version_ == 0 || std::isfinite(sensitivity)) client.sensitivity = sensitivity;
    return true;
  }
  const ssize_t got =
      recv(client.fd, client.request.data() + client.held, client.request.size() - client.held, 0);
  if (got <= 0) return false;
  client.held += static_cast<std::size_t>(got);
  if (client.held < client.request.size()) return true;
  client.held = 0;
  Words unit{};
  std::memcpy(unit.data(), client.request.data(), sizeof unit);
  if (!mute_ && !version_alone_) answer(client, unit);
  return true;
}

void SpacenavEmulator::answer(Client& client, Words unit) {
  unit[7] = 0;
  switch (unit[0] & 0xffff) {
    case 0x1000: {  // the client's name: no answer
      const char* const text = reinterpret_cast<const char*>(client.request.data() + 4);
      client.name.assign(text, strnlen(text, 24));
      return;
    }
    case 0x1001: {
      float sensitivity = 0;
      std::memcpy(&sensitivity, &unit[1], sizeof sensitivity);
      if (std::isfinite(sensitivity)) {
        client.sensitivity = sensitivity;
      } else {
        unit[7] = -1;
      }
      break;
    }
    case 0x1003:
      client.mask = unit[1];
      break;
    case 0x2000:
      if (plugged_) return answer_text(client, unit[0], device_.name);
      unit[7] = -1;
      break;
    case 0x2002:
      unit[1] = 6;
      unit[7] = plugged_ ? 0 : -1;
      break;
    case 0x2003:
      unit[1] = 2;
      unit[7] = plugged_ ? 0 : -1;
      break;
    case 0x2004:
      unit[1] = device_.vendor_id;
      unit[2] = device_.product_id;
      unit[7] = plugged_ && device_.vendor_id != 0 ? 0 : -1;
      break;
    case 0x2005:
      unit[1] = device_.type;
      unit[7] = plugged_ ? 0 : -1;
      break;
    default:
      unit[7] = -1;
  }
  std::vector<std::int32_t> words(unit.begin(), unit.end());
  words.insert(words.end(), behind_.begin(), behind_.end());
  put(client.fd, words.data(), words.size() * sizeof words[0]);
}

void SpacenavEmulator::answer_text(Client& client, std::int32_t type, const std::string& text) {
  std::size_t at = 0;
  do {
    Words unit{};
    unit[0] = type;
    const std::size_t left = text.size() - at;
    const std::size_t length = std::min<std::size_t>(left, 24);
    std::memcpy(&unit[1], text.data() + at, length);
    unit[7] = static_cast<std::int32_t>(left) | (at == 0 ? 0 : 0x10000);
    put(client.fd, unit.data(), sizeof unit);
    at += length;
  } while (at < text.size());
}

void SpacenavEmulator::event(std::int32_t mask, const Words& unit) {
  for (const Client& client : clients_) {
    if ((client.mask & mask) != 0) put(client.fd, unit.data(), sizeof unit);
  }
}

void SpacenavEmulator::plug(const EmulatedDevice& device) {
  const std::lock_guard lock(mutex_);
  device_ = device;
  plugged_ = true;
  raw_ = {};
  motion_ = {};
  event(4, {3, 0, device.id, device.type, device.vendor_id, device.product_id, 0, 0});
}

void SpacenavEmulator::unplug() {
  const std::lock_guard lock(mutex_);
  plugged_ = false;
  event(4, {3, 1, device_.id, device_.type, device_.vendor_id, device_.product_id, 0, 0});
}

// The kernel's events of it, then the daemon's.
void SpacenavEmulator::report(const std::array<std::int16_t, 6>& raw) {
  constexpr std::array<std::size_t, 6> kSwapped{0, 2, 1, 3, 5, 4};
  const std::lock_guard lock(mutex_);
  bool pending = false;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    std::int32_t value = raw[axis];
    if (device_.absolute ? raw[axis] == raw_[axis] : value == 0) continue;
    pending = true;
    if (device_.absolute)
      value = (value - device_.minimum) * 1000 / (device_.maximum - device_.minimum) - 500;
    const std::size_t to = device_.swap_yz ? kSwapped[axis] : axis;
    if (device_.invert_yz && to != 0 && to != 3) value = -value;
    motion_[to] = std::abs(value) < kDeadZone ? 0 : value;
  }
  raw_ = raw;
  if (!pending) return;
  for (const Client& client : clients_) {
    if ((client.mask & 1) == 0) continue;
    Words unit{};
    for (std::size_t axis = 0; axis < 6; ++axis)
      unit[1 + axis] = scaled(motion_[axis], client.sensitivity);
    unit[7] = kPeriodMs;
    put(client.fd, unit.data(), sizeof unit);
  }
}

void SpacenavEmulator::press(std::int32_t button, bool pressed) {
  const std::lock_guard lock(mutex_);
  event(2, {pressed ? 1 : 2, button, pressed ? 1 : 0, 0, 0, 0, 0, 0});
}

void SpacenavEmulator::say(std::span<const std::int32_t> words) { say_bytes(std::as_bytes(words)); }

void SpacenavEmulator::say_bytes(std::span<const std::byte> bytes) {
  const std::lock_guard lock(mutex_);
  for (const Client& client : clients_) put(client.fd, bytes.data(), bytes.size());
}

std::size_t SpacenavEmulator::clients() {
  const std::lock_guard lock(mutex_);
  return clients_.size();
}

SpacenavEmulator::Client SpacenavEmulator::last() {
  const std::lock_guard lock(mutex_);
  return clients_.empty() ? Client{} : clients_.back();
}

std::string SpacenavEmulator::client_name() { return last().name; }
float SpacenavEmulator::sensitivity() { return last().sensitivity; }
std::int32_t SpacenavEmulator::mask() { return last().mask; }
int SpacenavEmulator::client_version() { return last().version; }

}  // namespace haptic::test
