// SPDX-License-Identifier: Apache-2.0
// guest_board usbip|bridge SCENE PRIORITY [PATH]: a device whose firmware is
// hal/firmware/reference_device.h, with a hand on it that presses the scene's part, until SIGTERM.
//
// usbip   a board of full speed with the short report, in the port of this machine's virtual USB
//         controller
// bridge  the same mechanics behind hal/bridge/bridge_service.hpp, which listens at PATH
//
// At the end it says how many periods passed, what was accepted, refused and cut, the largest force
// that its motors were handed, and what they have now.
#include <sched.h>
#include <sys/prctl.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <string>

#include "hal/bridge/bridge_service.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "host_sim/device/hand_routine.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "host_sim/device/usbip_carrier.hpp"
#include "host_sim/device/vhci_port.hpp"
#include "tests/host_sim/guest/motors_and_hand.hpp"

namespace haptic::sim::test {
namespace {

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr double kRate_hz = 1000, kPressing_s = 6, kRegrip_s = 2;

constinit std::atomic<bool> ended = false;
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

/// As `host_sim usb-device --scene` has it: light fingers press what is nearest, and take the
/// deadman switch once more every two seconds.
MotorsAndHand pressing_hand(const std::string& scene) {
  CoreSession session(scene);
  WorkspaceMap map;
  const double* grip = session.view_of(0).bodies()[0].reference_m;
  for (int k = 0; k < 3; ++k) map.grip_a[k] = static_cast<Real>(grip[k]);
  MotionScript script = pressing_script(session, kRate_hz, kPressing_s);
  script.rate_hz = kRate_hz;
  ReferenceModelSettings settings;
  settings.hand = *hand_named("light");
  return {settings, hand_routine(make_motion(script), kRate_hz, map, kRegrip_s)};
}

struct Account {
  std::uint64_t periods = 0, accepted = 0, refused = 0, cuts = 0;
  double largest_n = 0, now_n = 0;

  void note(double force_n) {
    now_n = force_n;
    largest_n = std::max(largest_n, force_n);
  }
  void tell() const {
    std::printf(
        "board: %llu periods, %llu commands accepted, %llu refused, %llu cuts, largest force %.3f "
        "N, at the end %.3f N\n",
        static_cast<unsigned long long>(periods), static_cast<unsigned long long>(accepted),
        static_cast<unsigned long long>(refused), static_cast<unsigned long long>(cuts), largest_n,
        now_n);
  }
};

/// The board on the bus; the carrier's thread and the period's take turns.
class UsbBoard final : public UsbFunction {
 public:
  explicit UsbBoard(const std::string& scene) : mechanics_(pressing_hand(scene)) {
    const haptic_facts facts = mechanics_.facts(true);
    haptic_device_begin(&firmware_, &facts);
  }

  std::vector<std::uint8_t> descriptors() const override {
    // As at high speed but for the report's packets: section 1 of PROTOCOL.md.
    constexpr std::size_t kPacketBytes = 18 + 9 + 9 + 4;
    std::vector<std::uint8_t> all = reference_descriptors();
    all.at(kPacketBytes) = 64;
    return all;
  }
  int speed() const override { return 2; }
  int control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint16_t,
              std::span<std::uint8_t> bytes) override {
    const std::lock_guard lock(mutex_);
    if ((type & 0x60u) == 0) {
      haptic_device_bus_event(&firmware_);
      return 0;
    }
    const std::int32_t length =
        haptic_device_answer(&firmware_, type, request, value, bytes.data(), bytes.size());
    return length < 0 ? -EPIPE : length;
  }
  int out(std::uint8_t, std::span<const std::uint8_t> bytes) override {
    const std::lock_guard lock(mutex_);
    const bool is_taken =
        haptic_device_command(&firmware_, bytes.data(), bytes.size(), sample_.time_us) != 0;
    ++(is_taken ? account.accepted : account.refused);
    const std::int32_t* f = haptic_device_drive(&firmware_)->force;
    account.note(hal::kReferenceForceUnit_n * std::hypot(double(f[0]), double(f[1]), double(f[2])));
    return static_cast<int>(bytes.size());
  }
  [[nodiscard]] std::vector<std::uint8_t> period() {
    const std::lock_guard lock(mutex_);
    sample_ = mechanics_.pass(*haptic_device_drive(&firmware_));
    std::vector<std::uint8_t> packet(HAPTIC_SHORT_REPORT_BYTES);
    packet.resize(haptic_device_period(&firmware_, &sample_, packet.data(), packet.size()));
    account.cuts += (packet[3] & HAPTIC_WATCHDOG_CUT) != 0 && !was_cut_ ? 1u : 0u;
    was_cut_ = (packet[3] & HAPTIC_WATCHDOG_CUT) != 0;
    ++account.periods;
    return packet;
  }
  void unplugged() {
    const std::lock_guard lock(mutex_);
    haptic_device_bus_event(&firmware_);
    account.note(0);
  }

  Account account;

 private:
  std::mutex mutex_;
  MotorsAndHand mechanics_;
  haptic_device firmware_{};
  haptic_sample sample_{};
  bool was_cut_ = false;
};

int plug_in(const std::string& scene, int priority) {
  UsbBoard board(scene);
  {
    UsbipCarrier carrier(board);
    const unsigned port = attach_to_vhci(carrier.descriptor(), board.speed());
    if (priority > 0) (void)raise_vhci_threads(priority);
    std::printf("board: plugged into port %u\n", port);
    std::fflush(stdout);
    std::int64_t due_ns = hal::monotonic_ns();
    while (!ended) {
      due_ns += kPeriod_ns;
      (void)hal::sleep_until(due_ns);
      carrier.push(ReferenceUsb::kInEndpoint, board.period());
    }
  }
  board.account.tell();
  return 0;
}

/// The mechanics as a bridge has a device: it has something new at each period of a timer.
class BridgedHand final : public hal::BridgedDevice {
 public:
  explicit BridgedHand(const std::string& scene) : mechanics_(pressing_hand(scene)) {
    facts_.capabilities = hal::capabilities_of(mechanics_.model().block());
    facts_.name = "hand behind a bridge";
  }
  ~BridgedHand() override { close(); }
  BridgedHand(const BridgedHand&) = delete;
  BridgedHand& operator=(const BridgedHand&) = delete;

  bool open(std::string& why) override {
    timer_ = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
    itimerspec every{};
    every.it_value.tv_nsec = every.it_interval.tv_nsec = kPeriod_ns;
    if (timer_ >= 0 && timerfd_settime(timer_, 0, &every, nullptr) == 0) return true;
    why = "no timer";
    return false;
  }
  const hal::BridgeFacts& facts() const override { return facts_; }
  hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override {
    std::uint64_t expired = 0;
    if (::read(timer_, &expired, sizeof expired) != ssize_t{sizeof expired})
      return hal::BridgeRead::kSame;
    const haptic_sample s = mechanics_.pass(drive_);
    ++account.periods;
    sample = {};
    sample.sampled_ns = now_ns;
    for (std::size_t k = 0; k < 3; ++k)
      sample.pose_dh.p_m[k] = static_cast<Real>(s.position_nm[k] * 1e-9);
    for (std::size_t k = 0; k < 4; ++k)
      sample.pose_dh.q_xyzw[k] =
          static_cast<Real>(s.orientation[k] * hal::kReferenceOrientationUnit);
    sample.calibrated = true;
    sample.switches = s.switches;
    return hal::BridgeRead::kNew;
  }
  bool write(std::int64_t, const Wrench& wrench_d) override {
    drive_.is_on = 1;
    for (int k = 0; k < 3; ++k) {
      drive_.force[k] = units(wrench_d.force_w[k], hal::kReferenceForceUnit_n);
      drive_.torque[k] = units(wrench_d.torque_w[k], hal::kReferenceTorqueUnit_nm);
    }
    ++account.accepted;
    account.note(static_cast<double>(wrench_d.force_w.norm()));
    return true;
  }
  bool release(std::int64_t) override {
    drive_ = {};
    account.note(0);
    return true;
  }
  void close() noexcept override {
    if (timer_ >= 0) ::close(timer_);
    timer_ = -1;
  }
  pollfd watched() const noexcept override { return {timer_, POLLIN, 0}; }

  Account account;

 private:
  static std::int32_t units(Real value, double unit) {
    return static_cast<std::int32_t>(std::lround(static_cast<double>(value) / unit));
  }
  MotorsAndHand mechanics_;
  hal::BridgeFacts facts_;
  haptic_drive drive_{};
  int timer_ = -1;
};

int serve(const std::string& scene, const std::string& path) {
  BridgedHand device(scene);
  hal::BridgeSettings settings;
  settings.path = path;
  settings.say = [](const std::string& line) {
    std::printf("board: %s\n", line.c_str());
    std::fflush(stdout);
  };
  const int error = hal::serve_bridge(device, settings, ended);
  device.account.tell();
  return error == 0 ? 0 : 1;
}

int run(int count, char** words) {
  const std::string kind = count > 1 ? words[1] : "";
  const bool bridges = kind == "bridge" && count == 5;
  if (!bridges && !(kind == "usbip" && count == 4)) {
    std::fprintf(stderr,
                 "usage: guest_board usbip SCENE PRIORITY\n"
                 "       guest_board bridge SCENE PRIORITY PATH\n");
    return 2;
  }
  struct sigaction action {};
  action.sa_handler = [](int) { ended = true; };
  for (const int each : {SIGINT, SIGTERM}) sigaction(each, &action, nullptr);
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  sched_param parameters{};
  parameters.sched_priority = std::atoi(words[3]);
  if (parameters.sched_priority > 0 && sched_setscheduler(0, SCHED_FIFO, &parameters) != 0) {
    std::perror("guest_board: priority");
    return 4;
  }
  if (bridges) return serve(words[2], words[4]);
  return plug_in(words[2], parameters.sched_priority);
}

}  // namespace
}  // namespace haptic::sim::test

int main(int count, char** words) {
  try {
    return haptic::sim::test::run(count, words);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "guest_board: %s\n", error.what());
    return 4;
  }
}
