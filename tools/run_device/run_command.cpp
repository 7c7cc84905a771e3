// SPDX-License-Identifier: Apache-2.0
// run_device run CONFIG.toml [--seconds N] [--ticks N] [--device NAME] [--status-every S] [--json]
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "hal/realtime/flight_report.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"
#include "tools/run_device/commands.hpp"
#include "tools/run_device/device_run.hpp"
#include "tools/run_device/run_report.hpp"

namespace haptic::tools {
namespace {

struct RunOptions {
  std::string config, device;
  RunLength length;
  double status_every_s = 1.0;
  bool json = false;
};

constexpr std::size_t kTicksShown = 20;

void write_line(std::FILE* stream, const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stream);
  std::fputc('\n', stream);
  std::fflush(stream);
}

void write_json(const nlohmann::ordered_json& json) {
  write_line(stdout, json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

// The force is already on its way to zero.
void tell_crash(const RunCrash& crash, const std::filesystem::path& file) {
  const std::string head = "run_device: servo process " + std::to_string(crash.number) + " (pid " +
                           std::to_string(crash.pid) + "): " + crash.end;
  write_line(stderr, head + "; its last ticks:\n" + hal::flight_text(crash.records, kTicksShown));
  if (file.empty()) return;
  const std::string text = "# " + head + "\n" + hal::flight_csv(crash.records);
  // A file that cannot be written must not end the hold of the device.
  try {
    write_files({{file, std::as_bytes(std::span(text))}});
  } catch (const OsError& error) {
    write_line(stderr, std::string("run_device: ") + error.what());
  }
}

int run(const RunOptions& o) {
  const DeviceConfig config = read_device_config(o.config, o.device);
  const SceneBytes scene = read_usable_scene(config);
  const bool told = o.json || isatty(STDERR_FILENO) == 1;
  RunWatch watch;
  watch.status_every_s = told ? o.status_every_s : 0.0;
  watch.status = [&o](const RunStatus& status) {
    o.json ? write_json(status_json(status)) : write_line(stderr, status_text(status));
  };
  watch.refusals = [&config](const std::vector<Refusal>& refusals) {
    const std::string text = refusals_text(refusals, config.loop.strict);
    std::fwrite(text.data(), 1, text.size(), stderr);
  };
  watch.crash = [&config](const RunCrash& crash) { tell_crash(crash, config.crash_file); };
  const RunAccount account = run_device_of(config, scene, o.length, watch);
  if (o.json) {
    write_json(summary_json(account));
  } else {
    const std::string text = summary_text(account);
    std::fwrite(text.data(), 1, text.size(), stdout);
  }
  return account.exit_code;
}

std::string check_driver(const std::string& name) {
  return is_driver_name(name) ? "" : "no device '" + name + "'; see [device] driver";
}

}  // namespace

Command add_run_command(CLI::App& program) {
  const auto o = std::make_shared<RunOptions>();
  CLI::App* app = program.add_subcommand(
      "run",
      "Runs the servo loop on a device until SIGINT or SIGTERM, which ramp the force down and "
      "close it.");
  app->add_option("config", o->config, "TOML: scene, device, loop, workspace, limits")->required();
  app->add_option("--seconds", o->length.seconds, "end after this long; default: never")
      ->check(CLI::Range(0.01, 1.0e9));
  app->add_option("--ticks", o->length.ticks,
                  "end after so many from the first armed one on, and count and time these alone; "
                  "default: all are counted")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  app->add_option("--device", o->device,
                  "instead of the file's driver. sim: a handle in this process with a scripted "
                  "hand, for trying out the loop; not a model of any device")
      ->check(CLI::Validator(check_driver, "DRIVER"));
  app->add_option("--status-every", o->status_every_s,
                  "seconds between two status lines, on a terminal or with --json; default 1")
      ->check(CLI::Range(0.01, 3600.0));
  app->add_flag("--json", o->json, "status and summary as JSON, a line each, on stdout");
  app->footer(
      "Exit codes: 0 ended in order, 1 the servo process crashed or --seconds were over before\n"
      "--ticks, 2 usage, 3 bad configuration or scene, 4 the machine refused (with strict: "
      "anything\n"
      "asked for), or the device was not there within --seconds.");
  return {app, [o] { return run(*o); }, "run_device run device.toml"};
}

}  // namespace haptic::tools
