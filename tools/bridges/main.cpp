// SPDX-License-Identifier: Apache-2.0
// device_bridge: devices that are no USB packet devices, each behind a socket.
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/App.hpp>
#include <atomic>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "hal/bridge/bridge_service.hpp"
#include "hal/clock/linux_process.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "tools/bridges/bridge_table.hpp"
#include "tools/bridges/facts_text.hpp"
#include "tools/bridges/record/bridge_recorder.hpp"
#include "tools/bridges/record/recorded_device.hpp"
#include "tools/bridges/record/recording_begin.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"

namespace haptic::tools {
namespace {

using Kind = hal::DriverKey::Kind;

std::atomic<bool> g_stop{false};
extern "C" void stop_bridge(int /*signal*/) { g_stop.store(true); }

struct BridgeOptions {
  std::string listen, replay;
  bool probe = false, json = false;
  int priority = 0, parent = 0;
  std::vector<std::string> texts;   ///< by key of the row
  std::vector<double> numbers;      ///< the same
  std::vector<char> flags;          ///< the same
  std::vector<CLI::Option*> given;  ///< the same
};

hal::DriverOptions driver_options(const hal::DriverRow& row, const BridgeOptions& o) {
  hal::DriverOptions options;
  for (std::size_t k = 0; k < row.keys.size(); ++k) {
    if (o.given[k]->count() == 0) continue;
    const hal::DriverKey& key = row.keys[k];
    if (key.kind == Kind::kFlag)
      options.values.emplace_back(key.name, o.flags[k] != 0);
    else if (key.kind == Kind::kNumber)
      options.values.emplace_back(key.name, o.numbers[k]);
    else
      options.values.emplace_back(key.name, o.texts[k]);
  }
  return options;
}

void say(const std::string& line) { std::fprintf(stderr, "device_bridge: %s\n", line.c_str()); }

/// Opens the device once and tells what it is.
int probe(hal::BridgedDevice& device, const std::string& name, bool json) {
  std::string why;
  const bool found = device.open(why);
  const std::string text = json ? facts_line(name, found ? &device.facts() : nullptr, why)
                                : facts_text(name, found ? &device.facts() : nullptr, why);
  std::printf("%s\n", text.c_str());
  std::fflush(stdout);  // who asked does not wait for the end
  device.close();
  return found ? kExitDone : kExitDeviceOrOs;
}

/// A bridge ends with the process that has started it: the force goes off.
void follow_parent(int parent) {
  (void)prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) g_stop.store(true);
}

int serve(hal::BridgedDevice& device, const BridgeOptions& o) {
  struct sigaction action {};
  action.sa_handler = stop_bridge;
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) (void)sigaction(number, &action, nullptr);
  (void)signal(SIGPIPE, SIG_IGN);
  if (o.parent > 0) follow_parent(o.parent);
  // Refused: the bridge is slower, and its device says so by the reports that are late.
  if (o.priority > 0) (void)hal::set_fifo_priority(o.priority);
  hal::BridgeSettings settings;
  settings.path = o.listen;
  settings.say = say;
  settings.confine = [] { return hal::confine_bridge(); };
  const int error = hal::serve_bridge(device, settings, g_stop);
  if (error == 0) return kExitDone;
  throw OsError("no socket at " + o.listen + ": " + std::generic_category().message(error));
}

/// Compares the poses of today's code with those of the recording.
int replay(const BridgeRow& row, const BridgeOptions& o) {
  note_input(o.replay, "the recording");
  Recording recording(o.replay);
  const hal::DriverRow& driver = *hal::find_driver(row.name);
  const hal::DriverOptions options = recorded_options(recording, driver, driver_options(driver, o));
  hal::DriverDefect defect;
  const std::unique_ptr<hal::BridgedDevice> device = row.make(options, defect);
  if (device == nullptr)
    throw UsageError("--" + std::string(defect.key) + ": " + defect.text +
                     "; a recording does not have this file");
  const ReplayResult result = row.replay(recording, *device);
  const std::string text = o.json ? replay_line(std::string(row.name), result)
                                  : replay_text(std::string(row.name), result);
  std::printf("%s\n", text.c_str());
  return result.poses > 0 && result.first.empty() ? kExitDone : kExitCheckFailed;
}

/// The device, and all that it says from now on into `file`.
std::unique_ptr<hal::BridgedDevice> recorded(std::unique_ptr<hal::BridgedDevice> device,
                                             const hal::DriverRow& row,
                                             const hal::DriverOptions& options,
                                             const std::string& file) {
  RecorderSettings settings;
  settings.path = file;
  settings.say = say;
  if (const double* const size = options.value<double>("record_mb"))
    settings.most_bytes = static_cast<std::uint64_t>(*size * 1024 * 1024);
  const auto recorder = std::make_shared<BridgeRecorder>(settings);
  const std::string begin = begin_text(row, options);
  recorder->note(hal::TapKind::kBegin, 0, {}, std::as_bytes(std::span<const char>(begin)));
  return std::make_unique<RecordedDevice>(std::move(device), recorder);
}

int run(const BridgeRow& row, const BridgeOptions& o) {
  const int modes = (o.listen.empty() ? 0 : 1) + (o.replay.empty() ? 0 : 1) + (o.probe ? 1 : 0);
  if (modes != 1)
    throw UsageError("give either --listen PATH, to serve the device, or --probe, or --replay");
  const hal::DriverRow& driver = *hal::find_driver(row.name);
  const hal::DriverOptions options = driver_options(driver, o);
  const auto* const record = options.value<std::string>("record");
  if (!o.replay.empty()) {
    if (record != nullptr)
      throw UsageError("--record keeps what a device says, and --replay has none; leave it out");
    return replay(row, o);
  }
  const hal::KeptCapabilities kept = hal::drop_capabilities({o.priority, false, false});
  if (kept.error != 0)
    throw OsError("capabilities cannot be given up: " +
                  std::generic_category().message(kept.error));
  hal::DriverDefect defect;
  // The bridge is refused for all that a configuration is refused for.
  const bool is_right = driver.make(options, defect) != nullptr;
  std::unique_ptr<hal::BridgedDevice> device = is_right ? row.make(options, defect) : nullptr;
  if (device == nullptr) throw UsageError("--" + std::string(defect.key) + ": " + defect.text);
  if (record != nullptr) device = recorded(std::move(device), driver, options, *record);
  return o.probe ? probe(*device, std::string(row.name), o.json) : serve(*device, o);
}

void add_key(CLI::App& app, const hal::DriverKey& key, std::size_t at, BridgeOptions& o) {
  const std::string name = "--" + std::string(key.name), help(key.help);
  if (key.kind == Kind::kFlag)
    o.given[at] = app.add_flag(name, o.flags[at], help);
  else if (key.kind == Kind::kNumber)
    o.given[at] =
        app.add_option(name, o.numbers[at], help)->check(number_within(key.least, key.most));
  else
    o.given[at] = app.add_option(name, o.texts[at], help);
}

Command add_bridge(CLI::App& program, const BridgeRow& row) {
  const hal::DriverRow& driver = *hal::find_driver(row.name);
  const auto o = std::make_shared<BridgeOptions>();
  const std::size_t keys = driver.keys.size();
  o->texts.resize(keys);
  o->numbers.resize(keys);
  o->flags.resize(keys);
  o->given.resize(keys);
  CLI::App* app = program.add_subcommand(
      std::string(row.name), std::string(driver.product) + ". " + std::string(driver.note));
  app->add_option("--listen", o->listen,
                  "serve the device at this socket, for address = unix:PATH");
  app->add_flag("--probe", o->probe, "open the device once, tell what it is, and end");
  app->add_flag("--json", o->json, "with --probe and --replay: as a line of JSON");
  app->add_option("--replay", o->replay,
                  "no device: make the poses of a recording again, and compare them to the bit");
  app->add_option("--parent", o->parent, "end, force off, when this process ends, which calls")
      ->check(CLI::Range(1, 1 << 22));
  app->add_option("--priority", o->priority, "SCHED_FIFO, 1 to 99; 0: ordinary")
      ->check(CLI::Range(0, 99));
  app->footer("Files: " + std::string(row.files) + ".");
  for (std::size_t k = 0; k < keys; ++k) add_key(*app, driver.keys[k], k, *o);
  return {app, [&row, o] { return run(row, *o); },
          "device_bridge " + std::string(row.name) + " --probe"};
}

}  // namespace
}  // namespace haptic::tools

int main(int argc, char** argv) {
  using namespace haptic::tools;
  static constexpr int kKept[] = {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO};
  (void)haptic::hal::close_inherited_descriptors(kKept);
  CLI::App program("Serves a device that is no USB packet device to run_device, which starts this.",
                   "device_bridge");
  std::vector<Command> commands;
  for (const BridgeRow& row : bridge_rows()) commands.push_back(add_bridge(program, row));
  return run_program(
      program, commands,
      "0 done, 1 a replay has other poses or none, 2 usage, 3 bad recording, 4 the device is not "
      "there or the system refused",
      argc, argv);
}
