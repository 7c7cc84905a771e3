// SPDX-License-Identifier: Apache-2.0
// run_device doctor [--json] [--strict] [--device VID:PID[:SERIAL]|DRIVER] [--rate HZ] [--cpu N,M]
//                   [--no-measure] [--seconds S] [--limit-us US] [--culprit] [--histogram FILE]
//                   [--print NAME]

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "hal/drivers/driver_registry.hpp"
#include "hal/realtime/deploy_text.hpp"
#include "hal/realtime/doctor.hpp"
#include "hal/usb/usb_link.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/run_device/bridge_spawn.hpp"
#include "tools/run_device/commands.hpp"

namespace haptic::tools {
namespace {

// Output of the doctor's findings, for people and for programs.

/// Width that prose is wrapped to [columns]. Commands and lines of files are not: they are copied.
inline constexpr std::size_t kReportColumns = 100;

using hal::DoctorLevel;
using hal::DoctorLine;

constexpr std::size_t kLevelColumns = 9;  // the longest level and a blank

std::string padded(std::string text, std::size_t columns) {
  text.resize(std::max(columns, text.size()), ' ');
  return text;
}

// `text` in lines of at most `columns`, broken at blanks; a longer word has a line of its own.
std::vector<std::string> wrapped(const std::string& text, std::size_t columns) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  std::string word, line;
  while (words >> word) {
    if (!line.empty() && line.size() + 1 + word.size() > columns) {
      lines.push_back(line);
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  lines.push_back(line);
  return lines;
}

void append_fix(std::string& text, const std::string& fix, std::size_t indent) {
  std::istringstream parts(fix);
  std::string part;
  const char* lead = "fix: ";
  while (std::getline(parts, part)) {
    if (part.starts_with("    ")) {
      text += part + "\n";
      continue;
    }
    for (const std::string& line : wrapped(lead + part, kReportColumns - indent))
      text += std::string(indent, ' ') + line + "\n";
    lead = "";
  }
}

std::string verdict_text(const std::vector<DoctorLine>& lines, bool strict) {
  std::size_t counts[static_cast<std::size_t>(DoctorLevel::kCount)] = {};
  std::size_t refusing = 0;
  for (const DoctorLine& line : lines) {
    counts[static_cast<std::size_t>(line.level)] += 1;
    refusing += line.level == DoctorLevel::kWarning && line.refuses_in_strict ? 1u : 0u;
  }
  std::string text;
  for (const DoctorLevel level :
       {DoctorLevel::kPass, DoctorLevel::kWarning, DoctorLevel::kFailure, DoctorLevel::kSkipped}) {
    text += (text.empty() ? "" : ", ") + std::to_string(counts[static_cast<std::size_t>(level)]) +
            " " + hal::to_text(level);
  }
  text += "; " + std::to_string(refusing) + " of the warnings refuse with --strict\n";
  text += hal::is_fit(lines, strict) ? "fit" : "NOT FIT";
  return text + (strict ? " (strict)\n" : "\n");
}

/// A table: name, level, what was found; below it the fix where there is something to fix; the
/// verdict last.
std::string doctor_text(const std::vector<DoctorLine>& lines, bool strict) {
  std::size_t name_columns = 0;
  for (const DoctorLine& line : lines) name_columns = std::max(name_columns, line.name.size() + 2);
  const std::size_t indent = name_columns + kLevelColumns;
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const DoctorLine& line = lines[i];
    std::string head =
        padded(line.name, name_columns) + padded(hal::to_text(line.level), kLevelColumns);
    for (const std::string& part : wrapped(line.found, kReportColumns - indent)) {
      text += head + part + "\n";
      head = std::string(indent, ' ');
    }
    // Lines that were skipped for one reason have their fix once, below the last.
    const bool repeated =
        line.level == DoctorLevel::kSkipped && i + 1 < lines.size() && lines[i + 1].fix == line.fix;
    if (line.level != DoctorLevel::kPass && !repeated) append_fix(text, line.fix, indent);
  }
  return text + "\n" + verdict_text(lines, strict);
}

/// {"strict", "fit", "lines": [{"name", "level", "refuses_in_strict", "found", "fix"}],
/// "wakeups": null or what was measured, in nanoseconds}.
nlohmann::json doctor_json(const std::vector<DoctorLine>& lines, bool strict,
                           const hal::WakeupMeasurement* measurement) {
  nlohmann::json found = nlohmann::json::array();
  for (const DoctorLine& line : lines) {
    found.push_back({{"name", line.name},
                     {"level", hal::to_text(line.level)},
                     {"refuses_in_strict", line.refuses_in_strict},
                     {"found", line.found},
                     {"fix", line.fix}});
  }
  nlohmann::json wakeups;
  if (measurement != nullptr && measurement->error == 0) {
    const hal::WakeupHistogram& h = measurement->lateness;
    wakeups = {{"ticks", h.count()},
               {"p50_ns", h.quantile_ns(0.5)},
               {"p99_ns", h.quantile_ns(0.99)},
               {"p99_9_ns", h.quantile_ns(0.999)},
               {"largest_ns", h.largest_ns()},
               {"late_ticks", measurement->late_ticks},
               {"missed_periods", measurement->missed_periods},
               {"fifo_priority", measurement->priority},
               {"minor_faults", measurement->faults.minor},
               {"major_faults", measurement->faults.major}};
  }
  return {{"strict", strict},
          {"fit", hal::is_fit(lines, strict)},
          {"lines", std::move(found)},
          {"wakeups", std::move(wakeups)}};
}

/// The machine, with what its bridges say.
class BridgeProbes final : public hal::LinuxProbes {
 public:
  [[nodiscard]] hal::BridgeReply try_bridge(const std::string& name) override {
    try {
      const BridgeAnswer answer = probe_bridge(bridge_program(), name);
      return {true, answer.found, answer.name, answer.needs, answer.why};
    } catch (const OsError& error) {
      return {true, false, "", "", error.what()};
    }
  }
};

struct Options {
  bool json = false, strict = false, no_measure = false, culprit = false;
  std::string device, print, histogram;
  double rate_hz = 1000.0, seconds = 2.0, limit_us = 0.0;
  std::vector<int> cpus;
};

std::int64_t nanoseconds(double value, double scale) { return std::llround(value * scale); }

void write(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stdout); }

/// A driver whose device a bridge reaches.
bool is_bridge(const std::string& name) {
  const hal::DriverRow* const row = hal::find_driver(name);
  return row != nullptr && row->is_bridged;
}

hal::DoctorQuestions questions_of(const Options& o) {
  hal::DoctorQuestions q;
  hal::UsbAddress address;
  if (is_bridge(o.device)) {
    q.bridge = o.device;
  } else if (!o.device.empty() && hal::parse_usb_address(o.device, address)) {
    q.vendor_id = address.vendor_id;
    q.product_id = address.product_id;
    q.serial = address.serial;
    q.bus_path = address.bus_path;
  }
  q.period_ns = nanoseconds(1.0 / o.rate_hz, 1.0e9);
  q.cpus = o.cpus;
  q.measure = !o.no_measure;
  q.measure_ns = nanoseconds(o.seconds, 1.0e9);
  q.wakeup_limit_ns = nanoseconds(o.limit_us, 1.0e3);
  q.name_culprit = o.culprit;
  return q;
}

int examine_machine(const Options& o) {
  if (!o.print.empty()) {
    write(std::string(hal::deploy_text(o.print)));
    return kExitDone;
  }
  claim_output(o.histogram, "--histogram", text_kind("# Histogram"));
  BridgeProbes probes;
  const auto measurement = std::make_unique<hal::WakeupMeasurement>();
  const hal::DoctorQuestions questions = questions_of(o);
  const std::vector<hal::DoctorLine> lines =
      hal::examine(hal::SystemTree(), probes, questions, measurement.get());
  if (!o.histogram.empty()) {
    const std::string text = hal::cyclictest_text(measurement->lateness);
    write_files({{o.histogram, std::as_bytes(std::span(text))}});
  }
  if (o.json) {
    const auto* measured = questions.measure ? measurement.get() : nullptr;
    write(doctor_json(lines, o.strict, measured)
              .dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
          "\n");
  } else {
    write(doctor_text(lines, o.strict));
  }
  return hal::is_fit(lines, o.strict) ? kExitDone : kExitDeviceOrOs;
}

std::string check_device(const std::string& text) {
  hal::UsbAddress ignored;
  return is_bridge(text) || hal::parse_usb_address(text, ignored)
             ? ""
             : text +
                   " is not VID:PID or VID:PID:SERIAL (hexadecimal, as lsusb shows it), nor a "
                   "place on the bus (1-2.3), nor both, joined by @, nor the driver of a bridge, "
                   "as "
                   "haply";
}

}  // namespace

Command add_doctor_command(CLI::App& program) {
  const auto o = std::make_shared<Options>();
  CLI::App* app = program.add_subcommand("doctor",
                                         "Checks whether this machine can run a servo loop, and "
                                         "says how to fix what fails. Changes nothing.");
  app->footer("Exit codes: 0 it can, 2 usage, 4 it cannot.");
  app->add_flag("--json", o->json, "every line as JSON");
  app->add_flag("--strict", o->strict,
                "some warnings refuse too: no PREEMPT_RT, limited memory lock, page faults, late "
                "wake-ups");
  app->add_option("--device", o->device,
                  "VID:PID[:SERIAL] of the device to look for, or the driver of a bridge, as haply")
      ->check(CLI::Validator(check_device, "VID:PID[:SERIAL]|DRIVER"));
  app->add_option("--rate", o->rate_hz, "of the loop [Hz]; default 1000")
      ->check(number_within(1.0, 20000.0));
  app->add_option("--cpu", o->cpus, "cores of the servo thread and of the USB thread")
      ->delimiter(',')
      ->expected(1, 2)
      ->check(CLI::Range(0, 65535));
  auto* no_measure = app->add_flag("--no-measure", o->no_measure, "do not measure wake-ups");
  app->add_option("--seconds", o->seconds, "to measure wake-ups for; default 2")
      ->check(number_within(0.01, 86400.0))
      ->excludes(no_measure);
  app->add_option("--limit-us", o->limit_us,
                  "latest wake-up that passes [us]; default a quarter of the period")
      ->check(number_within(1.0, 1.0e6));
  app->add_flag("--culprit", o->culprit,
                "where wake-ups fail, let rtla name who is late (root, half a minute)")
      ->excludes(no_measure);
  app->add_option("--histogram", o->histogram, "file for the wake-ups, as cyclictest writes them")
      ->excludes(no_measure);
  std::vector<std::string> names;
  for (const hal::DeployFile& file : hal::deploy_files()) names.emplace_back(file.name);
  app->add_option("--print", o->print, "print a file to be installed, and do nothing else")
      ->check(CLI::IsMember(names));
  return {app, [o] { return examine_machine(*o); }, "run_device doctor --seconds 10"};
}

}  // namespace haptic::tools
