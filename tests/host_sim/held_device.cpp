// SPDX-License-Identifier: Apache-2.0
#include "tests/host_sim/held_device.hpp"

#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <new>
#include <thread>

#include "hal/clock/servo_clock.hpp"
#include "hal/device_limits.hpp"
#include "hal/realtime/servo_loop.hpp"
#include "host_sim/shapes/shapes.hpp"

namespace haptic::test {
namespace {

using sim::Vector;

constexpr double kStiffness_n_per_m = 1000;
// Lifted; and so deep that the hand of 800 N/m and the wall balance at 11 N.
constexpr double kLifted_m = -0.005, kPressed_m = 11.0 / kStiffness_n_per_m + 11.0 / 800;
constexpr double kStep_m = 1.0e-4;  // of the hand's target in a period: 0.1 m/s
constexpr double kTouch_m = 0.06;   // height of the cube's centre at which it lies on the wall
// Of the device: longest wait for something that comes at all, and for a press to become force.
constexpr std::size_t kPatience = 20'000, kPressPeriods = 1500, kRestPeriods = 150;
constexpr unsigned kMostPresses = 25;

std::vector<std::byte> wall_scene() {
  const sim::Solid wall = sim::centred_box("wall", 0.1, 0.1, 0.05);
  return sim::scene_of(sim::centred_box("cube", 0.01, 0.01, 0.01), {&wall, 1}, kStiffness_n_per_m,
                       1e-4);
}

hal::GuardianSettings guardian_settings(unsigned spares) {
  hal::GuardianSettings settings;
  settings.spares = spares;
  settings.recorded_ticks = 8192;
  return settings;
}

}  // namespace

/// Of the servo process: what the loop calls.
struct HeldDevice::Servo {
  static std::int64_t clock(void* self) {
    auto& servo = *static_cast<Servo*>(self);
    if (servo.device->flags().crash.load(std::memory_order_relaxed)) std::raise(SIGSEGV);
    return hal::monotonic_ns();
  }
  static void note(void* self, const ServoInput&, const ServoResult& result) {
    const HashNote note{result.command.tick, result.rendered.state_hash};
    if (note.tick % kHashEvery != 0) return;
    [[maybe_unused]] const auto written =
        write(static_cast<Servo*>(self)->device->notes_[1], &note, sizeof note);
  }
  HeldDevice* device;
};

HeldDevice::HeldDevice(unsigned spares)
    : session_(wall_scene(), "wall"), guardian_(guardian_settings(spares)) {
  const hal::DeviceCapabilities capabilities = hal::reference_capabilities();
  limits_ = hal::limits_of(capabilities, capabilities.report_period_ns);
  REQUIRE(memory_.bytes().size() == sizeof(Flags));
  flags_ = new (memory_.bytes().data()) Flags;
  REQUIRE(pipe2(notes_, O_CLOEXEC | O_NONBLOCK) == 0);
  REQUIRE(guardian_.start([this](const hal::ServoSeat& seat) { return serve(seat); }) == 0);

  sim::ReferenceModelSettings settings;
  settings.hand = *sim::hand_named("firm");
  depth_m_ = kLifted_m;
  model_ =
      std::make_unique<sim::ReferenceModel>(settings, [this](double t_s) { return hand(t_s); });
  usb_ = std::make_unique<sim::ReferenceUsb>(*model_, sim::DevicePace::kRealTime);
  hal::LinkSettings link;
  link.limits = limits_;
  link.deadman = SwitchMap{}.deadman;
  link.address.wrapped_fd = usb_->plug();
  link_ = std::make_unique<hal::UsbLink>(driver_, guardian_.mailbox(), link);
  link_->observe(this);
  usb_->start();
  REQUIRE(guardian_.hold(*link_).create_error == 0);
}

HeldDevice::~HeldDevice() {
  hang_usb(false);
  guardian_.stop();
  usb_->stop();
  for (const int end : notes_) close(end);
}

int HeldDevice::serve(const hal::ServoSeat& seat) {
  FlightRecorder recorder(seat.flights[0]);
  ServoParameters parameters;
  parameters.limits = limits_;
  parameters.switches.deadman = kDeadman;
  ServoTick tick(session_.core(), parameters, session_.view().header().capacity, &recorder);
  Servo servo{this};
  hal::ServoLoopSettings settings;
  settings.clock = &Servo::clock;
  settings.clock_context = &servo;
  hal::ServoLoop loop(tick, seat.mailboxes[0], settings);
  loop.watch(&Servo::note, &servo);
  return loop.run(seat.stop) == 0 ? hal::kGuardianDone : hal::kGuardianOsRefused;
}

/// Called once for each period, before it: what acted in the last one is noted.
sim::HandAction HeldDevice::hand(double /*t_s*/) {
  if (model_ != nullptr) {
    periods_.add(
        {hal::monotonic_ns(), model_->acting().force_w, model_->drives_on(), model_->cuts()});
  }
  const double goal_m = pressing_.load() ? kPressed_m : kLifted_m;
  depth_m_ += std::clamp(goal_m - depth_m_, -kStep_m, kStep_m);
  sim::HandAction action;
  action.target.x0_w = Vector(0, 0, kTouch_m - depth_m_);
  action.switches = deadman_.load() ? kDeadman : 0;
  return action;
}

double HeldDevice::force_n() const {
  return periods().empty() ? 0 : periods().back().force_n.norm();
}

void HeldDevice::hold(bool deadman, bool pressing) {
  deadman_.store(deadman);
  pressing_.store(pressing);
}

bool HeldDevice::pass(std::size_t periods) const {
  const std::size_t end = periods_.size() + periods;
  for (std::size_t k = 0; k < kPatience && periods_.size() < end; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return periods_.size() >= end;
}

bool HeldDevice::reaches(double low_n, double high_n, std::size_t periods) const {
  const std::size_t end = periods_.size() + periods;
  for (std::size_t k = 0; k < kPatience && periods_.size() < end; ++k) {
    if (force_n() >= low_n && force_n() <= high_n) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

bool HeldDevice::lift() {
  hold(false, false);
  // From the deepest to the highest: a tenth more than the way takes.
  return pass(static_cast<std::size_t>(1.1 * (kPressed_m - kLifted_m) / kStep_m)) &&
         reaches(0, 0, kPressPeriods);
}

bool HeldDevice::press() {
  for (unsigned k = 0; k < kMostPresses; ++k) {
    ++presses_;
    if (!lift()) continue;
    hold(true, false);
    if (!pass(kRestPeriods)) return false;
    hold(true, true);
    if (!reaches(kFullForce_n, 12, kPressPeriods) || !pass(kRestPeriods)) continue;
    if (force_n() >= kFullForce_n) return true;
  }
  return false;
}

std::vector<HashNote> HeldDevice::hash_notes() {
  std::vector<HashNote> notes;
  HashNote note;
  while (read(notes_[0], &note, sizeof note) == sizeof note) notes.push_back(note);
  return notes;
}

void HeldDevice::on_report(std::int64_t, std::span<const std::uint8_t>, hal::ReportVerdict,
                           std::uint64_t) noexcept {
  while (hangs_.load()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void HeldDevice::on_send(std::int64_t stamp_ns, std::span<const std::uint8_t> report,
                         const hal::GuardedOutput& output) noexcept {
  hal::ReferenceCommand command;
  if (hal::decode(report, command) != hal::CodecVerdict::kOk) return;
  SentCommand sent;
  sent.stamp_ns = stamp_ns;
  for (unsigned k = 0; k < 3; ++k) {
    sent.force_n[k] = command.force[k] * hal::kReferenceForceUnit_n;
    sent.torque_nm[k] = command.torque[k] * hal::kReferenceTorqueUnit_nm;
  }
  sent.drives_on = command.drives_on;
  sent.tick = output.tick;
  sent.faults = output.faults;
  sent_.add(sent);
}

}  // namespace haptic::test
