// SPDX-License-Identifier: Apache-2.0
#include "tools/run_device/run_line.hpp"

#include <algorithm>
#include <vector>

#include "hal/local/local_link.hpp"
#include "hal/usb/usb_link.hpp"
#include "tools/common/formatted.hpp"
#include "tools/run_device/arming_words.hpp"

namespace haptic::tools {
namespace {

void add_counts(const TickCounts& from, TickCounts& to) {
  to.ticks += from.ticks;
  to.armed_ticks += from.armed_ticks;
  to.contact_ticks += from.contact_ticks;
  for (std::size_t k = 0; k < kLateDegrees; ++k) to.late[k] += from.late[k];
  for (std::size_t k = 0; k < hal::kLateCauses; ++k) to.causes[k] += from.causes[k];
  to.armings += from.armings;
  to.safety_faults |= from.safety_faults;
  to.device_faults |= from.device_faults;
  to.largest_force_n = std::max(to.largest_force_n, from.largest_force_n);
  to.largest_torque_nm = std::max(to.largest_torque_nm, from.largest_torque_nm);
}

}  // namespace

RunLine::RunLine(const DeviceConfig& config, std::size_t device,
                 const std::array<double, 3>& stroke_m, const RunWatch& watch)
    : config_(config),
      device_(config.devices[device]),
      number_(device),
      words_(device_words(config, device)),
      watch_(watch),
      bus_(device_.servo.limits, config.loop.period_ns),
      events_(watch.event, config.has_two() ? static_cast<unsigned>(device) + 1 : 0),
      hand_(stroke_m),
      limits_(device_.servo.limits) {
  account_.driver = device_.driver_name;
}

hal::LinkSettings RunLine::link_settings(const SceneBytes& scene) {
  hal::LinkSettings settings;
  settings.address = device_.address;
  settings.deadman = device_.servo.switches.deadman;
  settings.wake_servo = clocks_loop(config_, number_);
  settings.answer_wait_ns = settings.wake_servo ? config_.loop.period_ns / 2 : 0;
  settings.limits = limits_;
  settings.force_share = static_cast<Real>(share_);
  gate_.emplace(fit_question(config_, scene, number_), limits_, settings.force_share);
  settings.accept = [this](const hal::DeviceCapabilities& c) { return admit(c); };
  settings.gripper = device_.gripper;
  if (!device_.deadman_input.path.empty()) {
    deadman_ = std::make_unique<hal::KeySwitch>(device_.deadman_input);
    settings.switches = deadman_.get();
  }
  return settings;
}

/// On the link's thread, before reports flow.
std::string RunLine::admit(const hal::DeviceCapabilities& device) {
  std::string unfit;
  if (device_.gripper.is_used() && !(device.largest_gap_m > device_.gripper.opens_m))
    unfit =
        device.largest_gap_m > 0
            ? "its gripper opens to " + short_number(static_cast<double>(device.largest_gap_m), 3) +
                  " m at most, so that it would never be open; lower [switches] "
                  "gripper_opens_m"
            : "it measures no gripper, and [switches] gripper makes it a switch; remove the key";
  {
    const std::lock_guard lock(stated_mutex_);
    stated_ = {std::string(hal::text_of(device.name)), std::string(hal::text_of(device.serial)),
               1e-9 * static_cast<double>(device.latency_ns), device.is_displacement,
               device.driven_dof != 0};
    unfit_ = unfit;
  }
  if (!device_.has_motors) return unfit;
  bus_.expect_reports_every(hal::report_interval_ns(device));
  const std::string refusal = gate_->admit(device);
  return refusal.empty() ? unfit : refusal;
}

StatedDevice RunLine::stated() const {
  const std::lock_guard lock(stated_mutex_);
  return stated_;
}

std::string RunLine::refusal() const {
  if (was_there()) return "";
  const std::lock_guard lock(stated_mutex_);
  return unfit_.empty() ? gate_->refusal() : unfit_;
}

void RunLine::make_link(const hal::DeviceMailbox& mailbox, hal::ZeroHolder& keeper,
                        const SceneBytes& scene) {
  hal::LinkSettings settings = link_settings(scene);
  settings.zero_holder = &keeper;
  hal::Driver& driver = *device_.driver;
  if (device_.simulated) {
    peer_ = std::make_unique<SimulatedPeer>(
        SimulatedPeerSettings{config_.loop.period_ns, device_.servo.switches.deadman}, hand_);
    link_ = std::make_unique<hal::LocalLink>(driver, mailbox, *peer_, settings);
  } else if (bridge_ != nullptr || !device_.socket_path.empty()) {
    socket_ = std::make_unique<hal::ProcessPeer>(bridge_ != nullptr ? bridge_->socket_path()
                                                                    : device_.socket_path);
    link_ = std::make_unique<hal::LocalLink>(driver, mailbox, *socket_, settings);
  } else {
    link_ = std::make_unique<hal::UsbLink>(driver, mailbox, settings);
  }
  link_->observe(&bus_);
  is_held_.store(true, std::memory_order_release);
}

void RunLine::start_bridge() {
  if (!device_.bridge.is_used()) return;
  bridge_ = std::make_unique<BridgeProcess>(device_.bridge, config_.loop.usb_priority);
  bridge_->start();
}

void RunLine::look_at_bridge(double t_s) {
  if (bridge_ == nullptr) return;
  for (const std::string& line : bridge_->look())
    events_.tell(t_s, "bridge", line, LineLevel::kNotice);
}

RunStatus RunLine::status(double t_s, std::int64_t silence_ns, const ServoBoard& board) const {
  RunStatus s;
  s.device = config_.has_two() ? static_cast<unsigned>(number_) + 1 : 0;
  s.t_s = t_s;
  // Never less than the device has, where it is behind what it was handed.
  const hal::HeldWrench held = link_->held();
  s.force_n = std::max(bus_.force_n(), held.force_n);
  s.torque_nm = std::max(bus_.torque_nm(), held.torque_nm);
  s.link_faults = bus_.faults();
  s.silence_ns = silence_ns;
  s.servo = status_of(board, number_);
  s.link = link_->state();
  s.counters = link_->counters();
  s.trouble = link_->trouble();
  s.stated = stated();
  s.gap_m = link_->gap_m();
  return s;
}

void RunLine::tell_notes() {
  std::vector<std::string> notes = gate_->take_notes();
  for (std::string& note : notes) note = words_ + note;
  if (!notes.empty()) watch_.notes(notes);
}

bool RunLine::needs_keeper() const {
  const hal::DeviceCapabilities& device = device_.driver->capabilities();
  return device.watchdog_ns <= 0 && device.driven_dof != 0;
}

void RunLine::add(const ServoBoard& board) {
  const ServoStatus last_word = status_of(board, number_);
  add_counts(last_word.counts, account_.counts);
  tools::add(last_word.verdict, account_.verdict);
}

void RunLine::note_last(const ServoBoard& board) {
  if (link_ != nullptr) account_.trouble = link_->trouble();
  account_.waits_for = wait_text(status_of(board, number_).arming_news);
}

void RunLine::finish() {
  account_.stated = stated();
  if (peer_ != nullptr) account_.peer = peer_->counters();
  account_.link_times = bus_.times();
  account_.ending = bus_.ending();
  if (link_ != nullptr) account_.link = link_->counters();
}

}  // namespace haptic::tools
