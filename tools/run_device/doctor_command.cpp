// SPDX-License-Identifier: Apache-2.0
// run_device doctor [--json] [--strict] [--device VID:PID[:SERIAL]] [--rate HZ] [--cpu N,M]
//                   [--no-measure] [--seconds S] [--limit-us US] [--histogram FILE] [--print NAME]
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "hal/realtime/deploy_text.hpp"
#include "hal/realtime/doctor.hpp"
#include "hal/usb/usb_link.hpp"
#include "tools/common/error.hpp"
#include "tools/common/file_roles.hpp"
#include "tools/common/files.hpp"
#include "tools/run_device/commands.hpp"
#include "tools/run_device/doctor_report.hpp"

namespace haptic::tools {
namespace {

struct Options {
  bool json = false, strict = false, no_measure = false;
  std::string device, print, histogram;
  double rate_hz = 1000.0, seconds = 2.0, limit_us = 0.0;
  std::vector<int> cpus;
};

std::int64_t nanoseconds(double value, double scale) { return std::llround(value * scale); }

void write(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stdout); }

hal::DoctorQuestions questions_of(const Options& o) {
  hal::DoctorQuestions q;
  hal::UsbAddress address;
  if (!o.device.empty() && hal::parse_usb_address(o.device, address)) {
    q.vendor_id = address.vendor_id;
    q.product_id = address.product_id;
    q.serial = address.serial;
  }
  q.period_ns = nanoseconds(1.0 / o.rate_hz, 1.0e9);
  q.cpus = o.cpus;
  q.measure = !o.no_measure;
  q.measure_ns = nanoseconds(o.seconds, 1.0e9);
  q.wakeup_limit_ns = nanoseconds(o.limit_us, 1.0e3);
  return q;
}

int examine_machine(const Options& o) {
  if (!o.print.empty()) {
    write(std::string(hal::deploy_text(o.print)));
    return kExitDone;
  }
  claim_output(o.histogram, "--histogram");
  hal::LinuxProbes probes;
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
  return hal::parse_usb_address(text, ignored)
             ? ""
             : text + " is not VID:PID or VID:PID:SERIAL (hexadecimal, as lsusb shows it)";
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
  app->add_option("--device", o->device, "VID:PID[:SERIAL] of the device to look for")
      ->check(CLI::Validator(check_device, "VID:PID[:SERIAL]"));
  app->add_option("--rate", o->rate_hz, "of the loop [Hz]; default 1000")
      ->check(CLI::Range(1.0, 20000.0));
  app->add_option("--cpu", o->cpus, "cores of the servo thread and of the USB thread")
      ->delimiter(',')
      ->expected(1, 2)
      ->check(CLI::Range(0, 65535));
  auto* no_measure = app->add_flag("--no-measure", o->no_measure, "do not measure wake-ups");
  app->add_option("--seconds", o->seconds, "to measure wake-ups for; default 2")
      ->check(CLI::Range(0.01, 86400.0))
      ->excludes(no_measure);
  app->add_option("--limit-us", o->limit_us,
                  "latest wake-up that passes [us]; default a quarter of the period")
      ->check(CLI::Range(1.0, 1.0e6));
  app->add_option("--histogram", o->histogram, "file for the wake-ups, as cyclictest writes them")
      ->excludes(no_measure);
  std::vector<std::string> names;
  for (const hal::DeployFile& file : hal::deploy_files()) names.emplace_back(file.name);
  app->add_option("--print", o->print, "print a file to be installed, and do nothing else")
      ->check(CLI::IsMember(names));
  return {app, [o] { return examine_machine(*o); }, "run_device doctor --seconds 10"};
}

}  // namespace haptic::tools
