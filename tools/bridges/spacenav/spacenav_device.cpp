// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/spacenav/spacenav_device.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>
#include <vector>

#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/spacenav_socket.hpp"
#include "tools/bridges/spacenav/spacenav_scale.hpp"

namespace haptic::tools {
namespace {

constexpr const char* kClientName = "haptic device_bridge";
constexpr std::int64_t kVersionWait_ns = 300'000'000, kAnswerWait_ns = 400'000'000;
constexpr unsigned kMostUnknownInRow = 256;
constexpr std::int32_t kButtons = 32;
constexpr int kMostPassedOver = 16;  ///< times that the socket is looked at
/// The pose goes on between two events.
constexpr std::int64_t kPeriod_ns = 1'000'000;

std::string system_text(int error) { return std::generic_category().message(error); }

std::string identity(std::uint16_t vendor_id, std::uint16_t product_id) {
  char text[16];
  (void)std::snprintf(text, sizeof text, "%04x:%04x", vendor_id, product_id);
  return text;
}

/// The result of a system call, or its negative errno.
std::int64_t or_error(std::int64_t result) { return result < 0 ? -errno : result; }

bool is_axis(std::int32_t value) { return value >= -kSpnavMostAxis && value <= kSpnavMostAxis; }

}  // namespace

SpacenavDevice::SpacenavDevice(SpacenavSettings settings)
    : settings_(std::move(settings)), pose_(settings_.motion) {}

bool SpacenavDevice::open(std::string& why) {
  close();
  pose_.reset();
  stream_.reset();
  buttons_ = 0;
  unknown_in_a_row_ = 0;
  told_ = lost_ = false;
  if (connect(why) && agree_on_version(why) && introduce(why)) {
    end_ = nullptr;
    pass_over_motions();
    return true;
  }
  close();
  return false;
}

/// Passes over all that came behind the last answer, while it was being opened: motions are over,
/// buttons stay pressed, and a device that came or went makes it lost.
void SpacenavDevice::pass_over_motions() {
  for (int k = 0; k < kMostPassedOver && !lost_; ++k) {
    SpnavUnit unit;
    for (auto item = stream_.next(unit); item != SpnavStream::Item::kNone && !lost_;
         item = stream_.next(unit)) {
      if (item == SpnavStream::Item::kUnit && unit.type != kSpnavMotion) take(unit, 0);
    }
    if (receive() <= 0) return;  // its end is seen by the first `read`
  }
}

bool SpacenavDevice::connect(std::string& why) {
  std::string tried;
  is_connected_ = hal::through(tap().get(), hal::TapKind::kConnect, {}, {},
                               [&] { return fd_ = connect_first(tried); }) >= 0;
  if (is_connected_) return true;
  why = "no spacenavd listens at " + tried +
        "; install and start it (sudo apt-get install spacenavd; sudo systemctl start spacenavd), "
        "or name its socket: socket = \"PATH\"";
  return false;
}

/// @return a descriptor, or -1: `tried` has each path and why it was none.
int SpacenavDevice::connect_first(std::string& tried) {
  const std::vector<std::string> paths =
      settings_.socket.empty() ? hal::spacenav_paths() : std::vector{settings_.socket};
  for (const std::string& path : paths) {
    const int fd = hal::connect_spacenav(path);
    path_ = path;
    if (fd >= 0) return fd;
    tried += (tried.empty() ? "" : ", ") + path + " (" + system_text(-fd) + ")";
  }
  return -1;
}

// A daemon of version 0 takes the question for a sensitivity, and then gets one that is a number.
bool SpacenavDevice::agree_on_version(std::string& why) {
  const std::int32_t question = kSpnavChangeProtocol | kSpnavVersion;
  if (!send(&question, sizeof question, why)) return false;
  const std::int64_t end_ns = now_ns() + kVersionWait_ns;
  for (bool came = true; came;) {
    if (!wait_for_bytes(end_ns, came, why)) return false;
    SpnavUnit unit;
    for (auto item = stream_.next(unit); item != SpnavStream::Item::kNone;
         item = stream_.next(unit)) {
      if (item == SpnavStream::Item::kUnit) continue;
      version_ = std::min(unit.data[0], kSpnavVersion);
      return true;
    }
  }
  version_ = 0;
  const float sensitivity = 1;
  return send(&sensitivity, sizeof sensitivity, why);
}

bool SpacenavDevice::introduce(std::string& why) {
  if (version_ == 0) {
    describe("a device that spacenavd does not name", 0, 0);
    return true;
  }
  const SpnavUnit named = spnav_request(kSpnavSetName, kClientName);
  if (!send(&named, sizeof named, why)) return false;
  SpnavUnit answer;
  const auto sensitivity = std::bit_cast<std::int32_t>(1.0F);
  constexpr std::int32_t kMask = kSpnavMaskMotion | kSpnavMaskButton | kSpnavMaskDevice;
  if (!ask(kSpnavSetSensitivity, spnav_request(kSpnavSetSensitivity, sensitivity), answer, why) ||
      !ask(kSpnavSetEventMask, spnav_request(kSpnavSetEventMask, kMask), answer, why))
    return false;

  const std::int64_t end_ns = now_ns() + kAnswerWait_ns;
  if (!ask(kSpnavDeviceName, spnav_request(kSpnavDeviceName), answer, why)) return false;
  SpnavText name;
  SpnavText::State state = name.add(answer);
  while (state == SpnavText::State::kMore) {
    if (!next_answer(kSpnavDeviceName, end_ns, answer, why)) return false;
    state = name.add(answer);
  }
  if (state == SpnavText::State::kRefused) {
    why = "spacenavd at " + path_ +
          " has no device; plug one in (its log, /var/log/spnavd.log, says what it has found)";
    return false;
  }
  if (!ask(kSpnavDeviceUsb, spnav_request(kSpnavDeviceUsb), answer, why)) return false;
  const bool on_usb = !is_refused(answer);
  describe(name.text(), on_usb ? static_cast<std::uint16_t>(answer.data[0]) : 0,
           on_usb ? static_cast<std::uint16_t>(answer.data[1]) : 0);
  return true;
}

bool SpacenavDevice::ask(SpnavRequest kind, const SpnavUnit& request, SpnavUnit& answer,
                         std::string& why) {
  return send(&request, sizeof request, why) &&
         next_answer(kind, now_ns() + kAnswerWait_ns, answer, why);
}

// Motions of the meantime are over when it is open; buttons stay pressed.
bool SpacenavDevice::next_answer(SpnavRequest kind, std::int64_t end_ns, SpnavUnit& answer,
                                 std::string& why) {
  for (bool came = true; came;) {
    for (auto item = stream_.next(answer); item != SpnavStream::Item::kNone;
         item = stream_.next(answer)) {
      if (item == SpnavStream::Item::kVersion) continue;
      if (is_answer(answer, kind)) return true;
      if (answer.type == kSpnavPress || answer.type == kSpnavRelease) take_button(answer);
    }
    if (!wait_for_bytes(end_ns, came, why)) return false;
  }
  why = "spacenavd at " + path_ +
        " accepts version 1 of its protocol and does not answer; restart it: sudo systemctl "
        "restart spacenavd";
  return false;
}

bool SpacenavDevice::send(const void* bytes, std::size_t count, std::string& why) {
  const std::int64_t sent = hal::through(
      tap().get(), hal::TapKind::kSent, {static_cast<const std::byte*>(bytes), count}, {},
      [&] { return or_error(::send(fd_, bytes, count, MSG_NOSIGNAL | MSG_DONTWAIT)); });
  if (sent == static_cast<std::int64_t>(count)) return true;
  why = "spacenavd at " + path_ + " takes no requests (" +
        (sent < 0 ? system_text(static_cast<int>(-sent)) : "a part of one alone") +
        "); restart it: sudo systemctl restart spacenavd";
  return false;
}

std::int64_t SpacenavDevice::now_ns() const {
  return hal::through(tap().get(), hal::TapKind::kClock, {}, {}, hal::monotonic_ns);
}

/// Adds what has come to the stream. @return its bytes; 0: the daemon has ended; a negative errno.
std::int64_t SpacenavDevice::receive() {
  const std::span<std::byte> room = stream_.room();
  const std::int64_t got = hal::through(tap().get(), hal::TapKind::kReceived, {}, room, [&] {
    return or_error(recv(fd_, room.data(), room.size(), MSG_DONTWAIT));
  });
  if (got > 0) stream_.added(static_cast<std::size_t>(got));
  return got;
}

/// @param came  false: the time was over.
bool SpacenavDevice::wait_for_bytes(std::int64_t end_ns, bool& came, std::string& why) {
  came = false;
  for (;;) {
    const std::int64_t left_ns = end_ns - now_ns();
    if (left_ns <= 0) return true;
    const timespec left{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
    pollfd watched{fd_, POLLIN, 0};
    const std::int64_t ready = hal::through(tap().get(), hal::TapKind::kReady, {}, {}, [&] {
      return or_error(ppoll(&watched, 1, &left, nullptr));
    });
    if (ready < 0 && ready != -EINTR) break;
    if (ready <= 0) continue;
    const std::int64_t got = receive();
    if (got > 0) {
      came = true;
      return true;
    }
    if (got == 0 || (got != -EAGAIN && got != -EINTR)) break;
  }
  why = "spacenavd at " + path_ +
        " ended the connection; see its log, /var/log/spnavd.log, and start it again: sudo "
        "systemctl restart spacenavd";
  return false;
}

void SpacenavDevice::describe(const std::string& name, std::uint16_t vendor_id,
                              std::uint16_t product_id) {
  full_scale_ =
      settings_.full_scale > 0 ? settings_.full_scale : spacenav_full_scale(vendor_id, product_id);
  facts_ = hal::BridgeFacts{};
  facts_.capabilities.sensed_dof = hal::kDofAll;
  facts_.capabilities.workspace_radius_m = pose_.reach_m();
  facts_.capabilities.report_period_ns = kPeriod_ns;
  facts_.capabilities.is_displacement = true;
  facts_.capabilities.name = hal::device_text(name);
  facts_.rests_in_silence = true;
  facts_.name = name;
  if (vendor_id != 0) facts_.name += " (" + identity(vendor_id, product_id) + ")";
  facts_.name += ", spacenavd at " + path_ + ", protocol " + std::to_string(version_);
  if (version_ == 0) {
    facts_.words =
        "this spacenavd is older than 1.0 and does not say when the device is unplugged: it is at "
        "rest then";
  }
  if (end_ != nullptr) {
    facts_.words += facts_.words.empty() ? "" : "; ";
    facts_.words += std::string("the connection before was given up: ") + end_;
  }
}

hal::BridgeRead SpacenavDevice::read(std::int64_t now_ns, hal::BridgeSample& sample) {
  if (!is_connected_ || lost_) return hal::BridgeRead::kLost;
  const std::uint64_t events = counts_.events;
  const Twist& velocity_d = pose_.velocity_d();
  const bool moved = !velocity_d.linear_w.isZero(0) || !velocity_d.angular_w.isZero(0);
  take_in(now_ns);
  if (lost_) return hal::BridgeRead::kLost;
  pose_.advance(now_ns);
  if (told_ && !moved && counts_.events == events) return hal::BridgeRead::kSame;
  told_ = true;
  sample = hal::BridgeSample{};
  sample.sampled_ns = now_ns;
  sample.pose_dh = record_of(pose_.pose_dh());
  sample.twist_d = record_of(velocity_d);
  sample.twist_valid = true;
  sample.calibrated = true;
  sample.switches = buttons_;
  return hal::BridgeRead::kNew;
}

void SpacenavDevice::take_in(std::int64_t now_ns) {
  const std::int64_t got = receive();
  // A daemon that ends with something of ours unread resets the connection.
  if (got == 0 || (got < 0 && got != -EAGAIN && got != -EINTR)) return lose("the daemon ended it");
  if (got < 0) return;
  SpnavUnit unit;
  for (auto item = stream_.next(unit); item != SpnavStream::Item::kNone && !lost_;
       item = stream_.next(unit)) {
    // A version that comes this late changes nothing: events are the same ones.
    if (item == SpnavStream::Item::kUnit) take(unit, now_ns);
  }
}

void SpacenavDevice::take(const SpnavUnit& unit, std::int64_t now_ns) {
  bool known = true;
  switch (unit.type) {
    case kSpnavMotion:
      take_motion(unit, now_ns);
      break;
    case kSpnavPress:
    case kSpnavRelease:
      take_button(unit);
      break;
    case kSpnavDevice:
      if (unit.data[0] == kSpnavRemoved) return lose("a device was removed");
      if (unit.data[0] == kSpnavAdded) return lose("a device was added");
      known = false;
      break;
    case kSpnavConfiguration:
    case kSpnavRawAxis:
    case kSpnavRawButton:
      break;
    default:
      known = is_answer(unit);
  }
  unknown_in_a_row_ = known ? 0 : unknown_in_a_row_ + 1;
  if (known) return;
  ++counts_.unknown;
  if (unknown_in_a_row_ >= kMostUnknownInRow)
    lose("256 messages in a row were of types that spacenavd does not have");
}

void SpacenavDevice::take_motion(const SpnavUnit& unit, std::int64_t now_ns) {
  const auto& v = unit.data;
  if (!std::all_of(v.begin(), v.begin() + 6, is_axis)) {
    ++counts_.impossible;
    return;
  }
  const auto share = [&](std::size_t axis) { return pose_.share_of(v[axis], full_scale_); };
  // From right, up, away.
  pose_.take(Vec3(share(0), share(2), share(1)), Vec3(share(3), share(5), share(4)), now_ns);
  ++counts_.events;
}

// Says nothing of the axes: the velocity so far goes on for its time.
void SpacenavDevice::take_button(const SpnavUnit& unit) {
  const std::int32_t number = unit.data[0];
  if (number < 0 || number >= kButtons) {
    ++counts_.impossible;
    return;
  }
  const std::uint32_t bit = 1U << static_cast<unsigned>(number);
  buttons_ = unit.type == kSpnavPress ? buttons_ | bit : buttons_ & ~bit;
  ++counts_.events;
}

void SpacenavDevice::lose(const char* why) {
  lost_ = true;
  end_ = why;
}

void SpacenavDevice::close() noexcept {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  is_connected_ = false;
}

pollfd SpacenavDevice::watched() const noexcept { return {fd_, POLLIN, 0}; }

std::unique_ptr<hal::BridgedDevice> make_spacenav(const hal::DriverOptions& options,
                                                  hal::DriverDefect& defect) {
  SpacenavSettings settings;
  if (const auto* const path = options.value<std::string>("socket")) settings.socket = *path;
  if (const auto* const scale = options.value<double>("full_scale")) settings.full_scale = *scale;
  if (settings.socket.size() >= sizeof(sockaddr_un::sun_path)) {
    defect = {"socket", "is longer than the " + std::to_string(sizeof(sockaddr_un::sun_path) - 1) +
                            " bytes that a socket's path can have; give a shorter one"};
    return nullptr;
  }
  return std::make_unique<SpacenavDevice>(std::move(settings));
}

}  // namespace haptic::tools
