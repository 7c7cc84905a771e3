// SPDX-License-Identifier: Apache-2.0
// run_device run CONFIG.toml [--seconds N] [--ticks N] [--device NAME] [--status-every S]
// [--serve [--port N] [--bind ADDRESS] [--allow-origin ORIGIN]] [--json]

#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "hal/realtime/flight_report.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/common/formatted.hpp"
#include "tools/live/live_trace.hpp"
#include "tools/run_device/commands.hpp"
#include "tools/run_device/device_run.hpp"
#include "tools/run_device/run_account.hpp"
#include "tools/run_device/run_events.hpp"
#include "tools/run_device/run_session.hpp"
#include "tools/run_device/teller.hpp"

namespace haptic::tools {
namespace {

using nlohmann::ordered_json;

struct RunOptions {
  std::string config, device, device2;
  RunLength length;
  double status_every_s = 1.0;
  int session = -1;
  bool json = false, allow_degraded = false, accept_unbudgeted = false, serve = false;
  ServeOptions live;
};

constexpr std::size_t kTicksShown = 20;

std::string line_of(const ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// {"kind": "event", ...}
ordered_json event_json(const RunEvent& e) {
  ordered_json json = line_json("event", e.device);
  json.update(ordered_json{{"t_s", e.t_s}, {"event", e.event}, {"text", e.text}});
  return json;
}

/// The first crash of a run has the name given, the next ones a number before its ending.
std::filesystem::path crash_path(const std::filesystem::path& file, unsigned number) {
  if (number == 0 || file.empty()) return file;
  std::filesystem::path numbered = file;
  numbered.replace_filename(file.stem().string() + "-" + std::to_string(number) +
                            file.extension().string());
  return numbered;
}

/// A run that is watched. The watcher has the scene, the address and the flight recorders, and no
/// way to the device.
struct LiveView {
  LiveView(const ServeOptions& options, const SceneBytes& scene) : door(options) {
    // It was opened before: read_usable_scene.
    if (SceneView::open(scene.span(), view) != RtStatus::kOk) view = {};
  }

  /// In the watching process.
  int serve(const DeviceConfig& config, std::span<const std::span<const std::byte>> flights) {
    const int kept[] = {STDERR_FILENO, door.descriptor()};
    const rlimit none{0, 0};
    if (hal::close_inherited_descriptors(kept) != 0 || hal::drop_capabilities({}).error != 0 ||
        setrlimit(RLIMIT_RTPRIO, &none) != 0 || setrlimit(RLIMIT_MEMLOCK, &none) != 0) {
      return kExitDeviceOrOs;
    }
    serve_trace(door, view, config.devices[0].servo, {flights.begin(), flights.end()});
    return kExitDone;
  }

  LiveDoor door;
  SceneView view;
};

/// Prints the events of a run on threads of their own, which begin once the processes are forked.
class RunTeller {
 public:
  /// `view`: of a run that is watched, or nullptr.
  /// `session`: of a run that a program with one has started, or nullptr; then what is said on
  /// standard error is read until the run has begun, and the rest are events of the session.
  RunTeller(const RunOptions& options, const DeviceConfig& config, LiveView* view,
            RunSession* session)
      : options_(options), config_(config), view_(view), session_(session) {}

  [[nodiscard]] RunWatch watch() {
    RunWatch watch;
    watch.session = session_;
    const bool told = options_.json || isatty(STDERR_FILENO) == 1;
    watch.status_every_s = told ? options_.status_every_s : 0.0;
    watch.forked = [this] {
      teller_ = std::make_unique<Teller>();
      if (view_ == nullptr) return;
      view_->door.leave();
      for (const std::string& line : view_->door.words()) {
        if (options_.json) say(line_of({{"kind", "note"}, {"text", line}}));
        complain("run_device: " + line, LineLevel::kNotice);
      }
    };
    if (view_ != nullptr)
      watch.watcher = [this](std::span<const std::span<const std::byte>> flights) {
        return view_->serve(config_, flights);
      };
    watch.status = [this](const RunStatus& s) {
      options_.json ? say(line_of(status_json(s))) : complain(status_text(s), LineLevel::kPlain);
    };
    watch.refusals = [this](const std::vector<Refusal>& refusals) {
      complain(refusals_text(refusals, config_.loop.strict), LineLevel::kWarning);
    };
    watch.event = [this](const RunEvent& e) {
      if (options_.json) say(line_of(event_json(e)));
      if (session_ != nullptr) session_->tell(e);
      complain("run_device: " + formatted("%.3f s: ", e.t_s) + e.text, e.level);
    };
    watch.notes = [this](const std::vector<std::string>& notes) {
      for (const std::string& note : notes) {
        if (options_.json) say(line_of({{"kind", "note"}, {"text", note}}));
        if (session_ != nullptr) session_->tell({0, 0, "note", note, LineLevel::kNotice});
        complain("run_device: " + note, LineLevel::kNotice);
      }
    };
    watch.crash = [this](const RunCrash& crash) { tell_crash(crash); };
    return watch;
  }

  /// @return the exit code: that of the account, or that its summary could not be written.
  [[nodiscard]] int finish(const RunAccount& account) {
    say(options_.json ? line_of(summary_json(account)) : summary_text(account));
    if (session_ != nullptr && account.exit_code != kExitDone)
      complain("run_device: " + account.why, LineLevel::kError);
    const bool whole = teller_ == nullptr || teller_->finish();
    return whole || account.exit_code != kExitDone ? account.exit_code : kExitDeviceOrOs;
  }

 private:
  void say(const std::string& text) const {
    if (teller_ != nullptr) teller_->say(Stream::kOut, text);
  }
  void complain(const std::string& text, LineLevel level) const {
    const bool is_read = session_ == nullptr || !session_->has_begun();
    if (teller_ != nullptr && is_read) teller_->say(Stream::kError, text, level);
  }

  // The force is already on its way to zero.
  void tell_crash(const RunCrash& crash) {
    const std::string head = "run_device: servo process " + std::to_string(crash.number) +
                             " (pid " + std::to_string(crash.pid) + "): " + crash.end;
    const unsigned number = crashes_++;
    for (std::size_t k = 0; k < config_.devices.size(); ++k) {
      const std::string device = device_words(config_, k);
      complain(head + "; " + device + "its last ticks:\n" +
                   hal::flight_text(crash.records[k], kTicksShown),
               LineLevel::kError);
      const std::filesystem::path file = crash_path(crash_file_of(config_.crash_file, k), number);
      if (!file.empty() && teller_ != nullptr)
        teller_->write_file(file, "# " + head + "\n" + hal::flight_csv(crash.records[k]));
    }
  }

  const RunOptions& options_;
  const DeviceConfig& config_;
  LiveView* view_;
  RunSession* session_;
  std::unique_ptr<Teller> teller_;
  unsigned crashes_ = 0;
};

// All memory will be locked, and a locked stack is there in full: 8 MiB for each thread by default.
// Its pages are what the end of a killed process takes longest for, and only after them does the
// zero-keeper hear of it.
void bound_thread_stacks() noexcept {
  constexpr std::size_t kThreadStackBytes = 512 * 1024;
  pthread_attr_t attributes;
  if (pthread_getattr_default_np(&attributes) != 0) return;
  (void)pthread_attr_setstacksize(&attributes, kThreadStackBytes);
  (void)pthread_setattr_default_np(&attributes);
  (void)pthread_attr_destroy(&attributes);
}

int run(const RunOptions& o) {
  bound_thread_stacks();
  DeviceConfig config = read_device_config(o.config, o.device, o.device2);
  if (o.allow_degraded) config.loop.strict = false;
  config.accept_unbudgeted = o.accept_unbudgeted;
  std::unique_ptr<RunSession> session;
  if (o.session >= 0) {
    session = std::make_unique<RunSession>(o.session);
    session->fit(config);
  }
  if (o.serve && config.has_two())
    throw UsageError(
        "--serve: shows one device, and this run has two; leave it out, or 'host_sim run --serve' "
        "shows two hands");
  const SceneBytes scene = read_usable_scene(config);
  std::unique_ptr<LiveView> view;
  if (o.serve) view = std::make_unique<LiveView>(o.live, scene);
  RunTeller teller(o, config, view.get(), session.get());
  const RunAccount account = run_device_of(config, scene, o.length, teller.watch());
  return teller.finish(account);
}

std::string check_driver(const std::string& name) {
  return is_driver_name(name) ? "" : "no device '" + name + "'; " + driver_list();
}

}  // namespace

Command add_run_command(CLI::App& program) {
  const auto o = std::make_shared<RunOptions>();
  CLI::App* app = program.add_subcommand(
      "run",
      "Runs the servo loop on a device until a signal such as SIGINT or SIGTERM, which ramps the "
      "force down and closes it.");
  app->add_option("config", o->config, "TOML: scene, device or two, loop, workspace, limits")
      ->required();
  app->add_option("--seconds", o->length.seconds, "end after this long; default: never")
      ->check(number_within(0.01, 1.0e9));
  app->add_option("--ticks", o->length.ticks,
                  "end after so many from the first armed one on, and count and time these alone; "
                  "default: all are counted")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  app->add_option("--device", o->device,
                  "instead of the file's driver. sim: a handle in this process with a scripted "
                  "hand, for trying out the loop; not a model of any device")
      ->check(CLI::Validator(check_driver, "DRIVER"));
  app->add_option("--device2", o->device2,
                  "the same of the second device, of a scene with two hands; the file need not "
                  "have [device2] then")
      ->check(CLI::Validator(check_driver, "DRIVER"));
  app->add_option("--status-every", o->status_every_s,
                  "seconds between two status lines, on a terminal or with --json; default 1")
      ->check(number_within(0.01, 3600.0));
  app->add_flag("--allow-degraded", o->allow_degraded,
                "run without what the machine does not grant, or although it wakes the loop too "
                "late; a device with motors then gets half of its force and torque or less");
  app->add_flag("--accept-unbudgeted", o->accept_unbudgeted,
                "run a scene whose gains are beyond the device's passivity budget, or for which "
                "none can be computed");
  app->add_flag("--serve", o->serve,
                "let the session be watched in a browser or viewer; nobody there moves anything");
  add_serve_options(*app, o->live);
  // Not for people: the library starts a run with it.
  app->add_option("--session", o->session, "")->check(CLI::Range(3, 1 << 20))->group("");
  app->add_flag("--json", o->json, "status and summary as JSON, a line each, on stdout");
  app->footer(
      driver_help() +
      "\nExit codes: 0 ended in order, 1 the part did not follow the hand as it should (the last "
      "line\n"
      "says so), the servo process crashed or --seconds were over before --ticks, 2 usage, 3 bad\n"
      "configuration or scene, 4 the machine refused (with strict: anything asked for), or the "
      "device\n"
      "was not there within --seconds.");
  return {app, [o] { return run(*o); }, "run_device run device.toml"};
}

}  // namespace haptic::tools
