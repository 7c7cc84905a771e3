// SPDX-License-Identifier: Apache-2.0
// Two devices behind USB/IP, one holds the peg and one the socket: driver, link and guard of each,
// both hands in one tick. The host's end of each connection is what vhci-hcd does in the kernel.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/device_limits.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/local/local_link.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "host_sim/device/stack_run.hpp"
#include "host_sim/device/usbip_carrier.hpp"
#include "host_sim/session/core_session.hpp"
#include "host_sim/session/motion_script.hpp"
#include "rt_core/two_hand_tick.hpp"
#include "tests/host_sim/usbip_client.hpp"
#include "tools/graph_compiler/program/compile_scene.hpp"

namespace haptic::sim {
namespace {

constexpr double kHostRate_hz = 1000;
constexpr std::int64_t kHostPeriod_ns = 1'000'000;
constexpr double kMostLeft_n = HAPTIC_REAL_IS_FLOAT != 0 ? 1e-4 : 1e-9;

/// The host's end of a connection, as a link takes it: a report is a transfer that the device has
/// answered, and so a period of it.
class UsbipHost final : public hal::LocalPeer {
 public:
  explicit UsbipHost(std::function<int()> plugged) : plugged_(std::move(plugged)) {}

  /// The next period may pass.
  void let_pass() { due_ = true; }

  hal::HalStatus plug(std::int64_t /*now_ns*/) noexcept override {
    client_ = std::make_unique<UsbipClient>(plugged_());
    return hal::HalStatus::kOk;
  }
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved) noexcept override {
    const auto length = static_cast<std::uint16_t>(bytes.size());
    client_->control(request.request_type, request.request, request.value, request.index, length);
    const std::optional<UsbipAnswer> answer = client_->receive();
    moved = answer ? answer->bytes.size() : 0;
    if (!answer || answer->end().status != 0 || moved > bytes.size())
      return hal::HalStatus::kTransferFailed;
    std::copy(answer->bytes.begin(), answer->bytes.end(), bytes.begin());
    return hal::HalStatus::kOk;
  }
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override {
    return due_ ? 0 : std::numeric_limits<std::int64_t>::max();
  }
  std::size_t report(std::int64_t /*now_ns*/, std::span<std::uint8_t> bytes,
                     std::int64_t& /*sampled_ns*/) noexcept override {
    if (!std::exchange(due_, false)) return 0;
    client_->submit_in(kInNumber, static_cast<std::uint32_t>(bytes.size()));
    const std::optional<UsbipAnswer> answer = client_->receive();
    if (!answer || answer->end().status != 0 || answer->bytes.size() > bytes.size()) return 0;
    std::copy(answer->bytes.begin(), answer->bytes.end(), bytes.begin());
    return answer->bytes.size();
  }
  void command(std::int64_t /*now_ns*/, std::span<const std::uint8_t> bytes) noexcept override {
    client_->submit_out(kOutNumber, bytes);
    const std::optional<UsbipAnswer> answer = client_->receive();
    taken_ += answer && answer->end().status == 0 ? 1u : 0u;
  }
  [[nodiscard]] std::uint64_t taken() const { return taken_; }

 private:
  std::function<int()> plugged_;
  std::unique_ptr<UsbipClient> client_;
  bool due_ = false;
  std::uint64_t taken_ = 0;
};

/// One of the devices, and all that the host has for it.
class UsbipDevice {
 public:
  UsbipDevice(CoreSession& session, std::uint32_t hand, const std::vector<MotionSample>& motion,
              const std::int64_t& now_ns)
      : settings_(stack_over(StackCarrier::kUsb, {}, {}, *hand_named("light"), kHostRate_hz)),
        model_(settings_.model, scripted_hand(session, motion, kHostRate_hz, hand)),
        device_(model_, DevicePace::kLockStep,
                [](UsbFunction& function, unsigned room) -> std::unique_ptr<BusCarrier> {
                  return std::make_unique<UsbipCarrier>(function, room);
                }),
        host_([this] { return device_.plug(); }),
        link_(driver_, mailbox_, host_, link_settings(now_ns)) {
    parameters.limits = settings_.limits;
    const double* grip = session.view_of(hand).bodies()[0].reference_m;
    for (int k = 0; k < 3; ++k) parameters.map.grip_a[k] = static_cast<Real>(grip[k]);
  }

  /// A period of the device: its report comes, and the command of the tick before goes out.
  void pass() {
    host_.let_pass();
    REQUIRE(link_.poll(0) == hal::HalStatus::kOk);
  }
  [[nodiscard]] const hal::DeviceMailbox& mailbox() const { return mailbox_; }
  [[nodiscard]] hal::LinkCounters counters() const { return link_.counters(); }
  [[nodiscard]] std::uint64_t taken() const { return host_.taken(); }
  [[nodiscard]] std::uint32_t cuts() const { return model_.cuts(); }
  [[nodiscard]] double acting_n() const { return model_.acting().force_w.norm(); }

  ServoParameters parameters;

 private:
  [[nodiscard]] hal::LinkSettings link_settings(const std::int64_t& now_ns) const {
    hal::LinkSettings link;
    link.limits = settings_.limits;
    link.deadman = SwitchMap{}.deadman;
    link.clock = [](void* now) { return *static_cast<const std::int64_t*>(now); };
    link.clock_context = const_cast<std::int64_t*>(&now_ns);
    return link;
  }

  StackSettings settings_;
  ReferenceModel model_;
  ReferenceUsb device_;
  hal::ReferenceDriver driver_;
  hal::MailboxMemory mailbox_;
  UsbipHost host_;
  hal::LocalLink link_;
};

std::vector<MotionSample> hand_motion_of(const std::string& script) {
  MotionScript read = read_motion_script(std::string(HAPTIC_SCENES_DIR) + "/two_hands/" + script);
  read.rate_hz = kHostRate_hz;
  return make_motion(read);
}

}  // namespace

TEST_SUITE("host_sim.two_usbip") {
  TEST_CASE("two devices over USB/IP: the peg goes to the bottom, and the forces are one") {
    const tools::SceneFile file =
        tools::read_scene_file(std::string(HAPTIC_SCENES_DIR) + "/two_hands/scene.toml");
    CoreSession session(tools::compile_scene(file, {}).bytes, "two_hands");
    REQUIRE(session.hands() != nullptr);
    REQUIRE(session.hands()->count() == 2);
    const std::array<std::vector<MotionSample>, 2> motions{hand_motion_of("motion.toml"),
                                                           hand_motion_of("socket.toml")};
    std::int64_t now_ns = 1'000'000'000;
    UsbipDevice first(session, 0, motions[0], now_ns), second(session, 1, motions[1], now_ns);
    TwoHandTick tick(*session.hands(), {first.parameters, second.parameters}, {});
    hal::ServoLoopSettings settings;
    settings.period_ns = kHostPeriod_ns;
    hal::ServoLoop loop(tick, {&first.mailbox(), &second.mailbox()}, settings);

    const std::size_t ticks = std::max(motions[0].size(), motions[1].size());
    double left_n = 0, largest_n = 0, deepest_m = 1, acting_n = 0;
    std::size_t touching = 0, armed = 0;
    for (std::size_t k = 0; k < ticks; ++k) {
      first.pass();
      second.pass();
      now_ns += kHostPeriod_ns / 2;
      loop.tick(now_ns, 0);
      now_ns += kHostPeriod_ns / 2;
      const StepResult& peg = loop.result(0).rendered;
      const StepResult& socket = loop.result(1).rendered;
      REQUIRE(loop.result(0).faults == 0);
      REQUIRE(loop.result(1).faults == 0);
      // Nothing but the other part touches either.
      const Vec3 sum_n =
          session.hands()->contact_w(0).force_w + session.hands()->contact_w(1).force_w;
      left_n = std::max(left_n, static_cast<double>(sum_n.norm()));
      largest_n =
          std::max(largest_n, static_cast<double>(session.hands()->contact_w(0).force_w.norm()));
      touching += peg.situation != ContactSituation::kNone ? 1u : 0u;
      const bool both = loop.result(0).arming == ArmingState::kArmed &&
                        loop.result(1).arming == ArmingState::kArmed;
      armed += both ? 1u : 0u;
      acting_n = std::max(acting_n, std::min(first.acting_n(), second.acting_n()));
      const double tip_m = static_cast<double>(peg.proxy_pose_wa.p_wa.z()) - 0.025;
      const double bottom_m = static_cast<double>(socket.proxy_pose_wa.p_wa.z()) - 0.03;
      deepest_m = std::min(deepest_m, tip_m - bottom_m);
    }
    MESSAGE(ticks, " ticks, ", armed, " armed, ", touching, " touching, largest ", largest_n,
            " N, left ", left_n, " N, from the bottom ", deepest_m, " m");
    CHECK(left_n <= kMostLeft_n);
    CHECK(largest_n > 1);
    CHECK(acting_n > 0.5);  // on both handles at once
    CHECK(touching > 1000);
    CHECK(armed > 4000);
    CHECK(std::abs(deepest_m) < 1e-4);
    for (const UsbipDevice* device : {&first, &second}) {
      CHECK(device->counters().states >= ticks - 1);
      CHECK(device->counters().sent == device->taken());
      CHECK(device->counters().sent > ticks - 10);
      CHECK(device->cuts() == 0);
    }
  }
}

}  // namespace haptic::sim
