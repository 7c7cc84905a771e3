// SPDX-License-Identifier: Apache-2.0
// host_sim usb-device [--seconds N] [--rate HZ] [--faults SCRIPT] [--hand H] [--scene S]
// [--second] [--script MOTION] [--regrip S] [--priority P] [--wire FILE]
#include <sched.h>
#include <sys/prctl.h>
#include <sys/time.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "host_sim/commands/commands.hpp"
#include "host_sim/device/hand_routine.hpp"
#include "host_sim/device/pressing_script.hpp"
#include "host_sim/device/reference_usb.hpp"
#include "host_sim/device/usbip_carrier.hpp"
#include "host_sim/device/vhci_port.hpp"
#include "host_sim/report/part_report.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"

namespace haptic::sim {
namespace {

constexpr double kPressing_s = 6.0;  // one round of the motion without a script

struct UsbDeviceArguments {
  std::string faults, hand = "light", scene, script, wire;
  std::optional<double> seconds;
  double rate_hz = 1000, regrip_s = 2;
  int priority = 0;
  bool second = false;
};

constinit std::atomic<bool> running = true;
constinit std::atomic<unsigned> marks = 0;
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");
static_assert(std::atomic<unsigned>::is_always_lock_free, "counted by a signal handler");

void stop_at_signals(const std::optional<double>& seconds) {
  struct sigaction action {};
  action.sa_handler = [](int) { running = false; };
  for (const int each : {SIGINT, SIGTERM, SIGALRM}) sigaction(each, &action, nullptr);
  if (!seconds) return;
  itimerval end{};
  end.it_value.tv_sec = static_cast<time_t>(*seconds);
  end.it_value.tv_usec = static_cast<suseconds_t>(std::fmod(*seconds, 1.0) * 1.0e6);
  setitimer(ITIMER_REAL, &end, nullptr);
}

/// The commands that the device received and the wrench that acted, per period, as CSV.
class WireLog {
 public:
  explicit WireLog(const std::string& path) : path_(path) {
    tools::claim_output(path, "--wire", tools::csv_kind(kHeader));
    struct sigaction action {};
    action.sa_handler = [](int) { marks.fetch_add(1, std::memory_order_relaxed); };
    action.sa_flags = SA_RESTART;
    sigaction(SIGUSR1, &action, nullptr);
    rows_.reserve(kRowsAtFirst);
  }

  void note_command(const ReferenceModel& m) {
    ++commands_;
    step_n_ = std::max(step_n_, (m.handed().force_w - handed_n_).norm());
    handed_n_ = m.handed().force_w;
  }

  void note_period(const ReferenceModel& m) {
    handed_n_ = m.handed().force_w;
    rows_.push_back({m.time_s(), handed_n_, m.acting().force_w.norm(), step_n_, m.cuts(),
                     marks.load(std::memory_order_relaxed), commands_, m.drives_on()});
    step_n_ = 0;
    commands_ = 0;
  }

  void write() const {
    std::string text = kHeader + std::string("\n");
    for (const Row& r : rows_) {
      for (const double value : {r.t_s, r.handed_n.x(), r.handed_n.y(), r.handed_n.z()})
        text += fixed(value, 4) + ',';
      text += (r.drives_on ? "1," : "0,") + fixed(r.acting_n, 4) + ',' + std::to_string(r.cuts) +
              ',' + std::to_string(r.marks) + ',' + std::to_string(r.commands) + ',' +
              fixed(r.step_n, 4) + '\n';
    }
    tools::write_files({{path_, std::as_bytes(std::span(text))}});
  }

 private:
  struct Row {
    double t_s = 0;
    Vector handed_n;
    double acting_n = 0, step_n = 0;
    std::uint32_t cuts = 0;
    unsigned marks = 0, commands = 0;
    bool drives_on = false;
  };
  static constexpr const char* kHeader =
      "t_s,handed_x_n,handed_y_n,handed_z_n,drives_on,acting_n,cuts,marks,commands,step_n";
  // A minute at the usual rate, before the first copy.
  static constexpr std::size_t kRowsAtFirst = 60'000;

  std::string path_;
  std::vector<Row> rows_;
  // Since the last period.
  Vector handed_n_ = Vector::Zero();
  double step_n_ = 0;
  unsigned commands_ = 0;
};

/// Sets the priority of this thread, and of those that it makes.
void take_priority(int priority) {
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);  // reports on time, also without a priority
  if (priority == 0) return;
  sched_param parameters{};
  parameters.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO, &parameters) != 0)
    throw std::system_error(errno, std::generic_category(), "--priority; run this with sudo");
}

/// Without a scene the handle itself follows the script, or rests at the origin; with one, the
/// scene's part does, or it presses on what is nearest.
std::function<HandAction(double)> hand_of(const UsbDeviceArguments& o) {
  WorkspaceMap map;
  MotionScript script;
  if (!o.script.empty()) script = read_motion_script(o.script);
  std::vector<MotionSample> motion;
  if (!o.scene.empty()) {
    CoreSession session(o.scene);
    const std::uint32_t number = o.second ? 1 : 0;
    if (o.second && (session.hands() == nullptr || session.hands()->count() < 2))
      throw tools::InputError(o.scene +
                              ": --second is of a scene with two hands, and this one has one; "
                              "leave it out");
    if (o.second && o.script.empty())
      throw tools::UsageError("--second: needs the motion of its part; give --script MOTION.toml");
    const double* grip = session.view_of(number).bodies()[0].reference_m;
    for (int k = 0; k < 3; ++k) map.grip_a[k] = static_cast<Real>(grip[k]);
    if (o.script.empty()) script = pressing_script(session, o.rate_hz, kPressing_s);
  }
  script.rate_hz = o.rate_hz;
  if (script.waypoints.empty()) {
    motion.emplace_back();
  } else {
    motion = make_motion(script);
  }
  return hand_routine(std::move(motion), o.rate_hz, map, o.regrip_s);
}

int do_usb_device(const UsbDeviceArguments& o) {
  if (o.second && o.scene.empty())
    throw tools::UsageError("--second: is the second hand of a scene; give --scene SCENE.rtscene");
  const std::optional<HandModel> hand = hand_named(o.hand);
  if (!hand) throw tools::InputError("no hand is called '" + o.hand + "'");
  ReferenceModelSettings settings;
  settings.hand = *hand;
  settings.report_rate_hz = o.rate_hz;
  ReferenceModel model(settings, hand_of(o));
  const auto plug_in = [&model, &o](UsbFunction& function, unsigned room) {
    auto carrier = std::make_unique<UsbipCarrier>(function, room);
    const unsigned port = attach_to_vhci(carrier->descriptor(), function.speed());
    if (o.priority > 0) raise_vhci_threads(o.priority);
    std::printf("at %.3f s: 1209:0001 plugged into port %u of the virtual controller\n",
                model.time_s(), port);
    std::fflush(stdout);
    return carrier;
  };
  ReferenceUsb device(model, DevicePace::kRealTime, plug_in);
  if (!o.faults.empty())
    for (const DeviceFaultEvent& event : read_fault_script(o.faults, o.rate_hz)) device.add(event);
  std::optional<WireLog> wire;
  if (!o.wire.empty()) {
    wire.emplace(o.wire);
    device.on_period([&wire](const ReferenceModel& m) { wire->note_period(m); });
    device.on_command([&wire](const ReferenceModel& m) { wire->note_command(m); });
  }
  stop_at_signals(o.seconds);
  take_priority(o.priority);
  device.plug();
  device.run_paced(running);
  device.unplug();
  device.with_model([&](const ReferenceModel& m) {
    std::printf(
        "unplugged after %.3f s: %llu reports made, %u commands rejected, %u watchdog cuts\n",
        m.time_s(), static_cast<unsigned long long>(std::llround(m.time_s() * o.rate_hz)),
        m.rejected(), m.cuts());
  });
  if (wire) wire->write();
  return tools::kExitDone;
}

}  // namespace

Command add_usb_device_command(CLI::App& program) {
  const auto o = std::make_shared<UsbDeviceArguments>();
  CLI::App* app = program.add_subcommand(
      "usb-device",
      "Plugs the reference device, with a hand on it, into this machine's virtual USB controller.");
  app->add_option("--seconds", o->seconds, "then unplug it; default: when this is stopped (^C)")
      ->check(tools::number_within(0.01, 1.0e6));
  app->add_option("--rate", o->rate_hz,
                  "reports per second, at most what high-speed USB carries, 8000; default 1000")
      ->check(tools::number_within(10.0, 8000.0));
  app->add_option("--faults", o->faults, "script of faults (TOML)");
  app->add_option("--hand", o->hand, "none, loose, light (default) or firm")
      ->check(CLI::IsMember(hand_names()));
  app->add_option("--scene", o->scene,
                  "compiled scene; the motion is that of its part, by default a press on the "
                  "nearest fixed one");
  app->add_flag("--second", o->second,
                "the device of the second hand of the scene; its motion is that of --script");
  app->add_option("--script", o->script,
                  "motion script (TOML), of the handle, or of the part where a scene is given");
  app->add_option("--regrip", o->regrip_s,
                  "the deadman switch is released for 0.1 s every so many seconds; default 2")
      ->check(tools::number_within(0.2, 1.0e6));
  app->add_option(
         "--priority", o->priority,
         "SCHED_FIFO priority of the device and of the kernel's threads for it, below those "
         "of the loop; default 0: ordinary")
      ->check(CLI::Range(0, 98));
  app->add_option("--wire", o->wire,
                  "CSV, written at the end: the force that the device was handed and the one that "
                  "acted, per period; SIGUSR1 counts in column marks");
  return {app,
          [o] { return do_usb_device(*o); },
          "host_sim usb-device --scene peg.rtscene",
          {{"--motion", "a hand follows way points: --script MOTION.toml"}}};
}

}  // namespace haptic::sim
