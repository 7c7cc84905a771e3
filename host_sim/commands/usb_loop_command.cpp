// SPDX-License-Identifier: Apache-2.0
// host_sim usb-loop --scene S.rtscene [--ticks N] [--rate HZ] [--device VID:PID[:SERIAL]]
// [--connects N] [--patience S] [--json]
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "host_sim/commands/commands.hpp"
#include "host_sim/device/usb_loop_run.hpp"
#include "rt_core/safety/arming.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

struct Options {
  std::string scene, device;
  UsbLoopSettings loop;
  std::uint64_t connects = 1;
  double rate_hz = 1000;
  bool json = false;
};

constexpr const char* kQuantileNames[] = {"p50", "p99", "p99.9", "max"};
constexpr const char* kLateNames[] = {"in_time", "late_1", "late_2_to_5", "late_more"};

struct Row {
  const char* name;
  const Quantiles* values;
};
std::vector<Row> rows_of(const UsbLoopAccount& a) {
  return {{"wake_up_lateness", &a.lateness},
          {"tick", &a.tick},
          {"report_interval", &a.report_interval},
          {"send_interval", &a.send_interval},
          {"report_to_submitted", &a.answer}};
}

// Each connection was armed, and no tick came a period late.
bool passed(const Options& o, const UsbLoopAccount& a) {
  return a.ticks == o.loop.ticks && a.late[0] == a.ticks && a.link.connects == o.connects &&
         a.armings >= o.connects && a.servo_error == 0;
}

nlohmann::ordered_json account(const Options& o, const UsbLoopAccount& a) {
  nlohmann::ordered_json json;
  json["scene"] = o.scene;
  json["rate_hz"] = o.rate_hz;
  json["preempt_rt"] = a.realtime_kernel;
  json["ticks"] = a.ticks;
  for (std::size_t k = 0; k < a.late.size(); ++k) json[kLateNames[k]] = a.late[k];
  json["armed_ticks"] = a.armed_ticks;
  json["contact_ticks"] = a.contact_ticks;
  json["armings"] = a.armings;
  json["largest_force_n"] = a.largest_force_n;
  for (const Row& row : rows_of(a)) {
    auto& entry = json[std::string(row.name) + "_ns"];
    entry["count"] = row.values->count;
    for (std::size_t k = 0; k < row.values->at_ns.size(); ++k)
      entry[kQuantileNames[k]] = row.values->at_ns[k];
  }
  json["safety_faults"] = a.safety_faults;
  json["device_faults"] = a.device_faults;
  json["connects"] = a.link.connects;
  json["disconnects"] = a.link.disconnects;
  json["reports"] = a.link.reports;
  json["sent"] = a.link.sent;
  json["send_failed"] = a.link.send_failed;
  json["page_faults"] = {{"minor", a.minor_faults}, {"major", a.major_faults}};
  json["refused"] = {{"servo_priority", a.servo_priority_error},
                     {"usb_priority", a.usb_priority_error},
                     {"memory_lock", a.lock_error}};
  json["passed"] = passed(o, a);
  return json;
}

void print_refusal(const char* what, int code) {
  if (code != 0) std::printf("  refused          %s: %s\n", what, std::strerror(code));
}

void print_summary(const Options& o, const UsbLoopAccount& a) {
  std::printf("loop over USB on %s at %g Hz, kernel %s PREEMPT_RT\n", o.scene.c_str(), o.rate_hz,
              a.realtime_kernel ? "with" : "without");
  std::printf("  ticks            %llu, late %llu (1 period %llu, 2 to 5 %llu, more %llu)\n",
              static_cast<unsigned long long>(a.ticks),
              static_cast<unsigned long long>(a.ticks - a.late[0]),
              static_cast<unsigned long long>(a.late[1]),
              static_cast<unsigned long long>(a.late[2]),
              static_cast<unsigned long long>(a.late[3]));
  std::printf("  armed            %llu ticks, %u times; in contact %llu; largest force %.4g N\n",
              static_cast<unsigned long long>(a.armed_ticks), a.armings,
              static_cast<unsigned long long>(a.contact_ticks), a.largest_force_n);
  for (const Row& row : rows_of(a)) {
    std::printf("  %-20s", row.name);
    for (std::size_t k = 0; k < row.values->at_ns.size(); ++k)
      std::printf("  %s %.1f us", kQuantileNames[k],
                  1.0e-3 * static_cast<double>(row.values->at_ns[k]));
    std::printf("  (%llu)\n", static_cast<unsigned long long>(row.values->count));
  }
  std::printf("  link             %llu connects, %llu disconnects, %llu reports, %llu sent\n",
              static_cast<unsigned long long>(a.link.connects),
              static_cast<unsigned long long>(a.link.disconnects),
              static_cast<unsigned long long>(a.link.reports),
              static_cast<unsigned long long>(a.link.sent));
  std::printf("  faults           safety 0x%x, device 0x%x; page faults %llu minor, %llu major\n",
              a.safety_faults, a.device_faults, static_cast<unsigned long long>(a.minor_faults),
              static_cast<unsigned long long>(a.major_faults));
  print_refusal("priority of the servo thread", a.servo_priority_error);
  print_refusal("priority of the USB thread", a.usb_priority_error);
  print_refusal("locking of memory", a.lock_error);
  std::printf("  result           %s\n", passed(o, a) ? "passed" : "FAILED");
}

int run(Options o) {
  if (!o.device.empty() && !hal::parse_usb_address(o.device, o.loop.address))
    throw tools::InputError("--device: '" + o.device + "' is not VID:PID[:SERIAL] in hexadecimal");
  o.loop.period_ns = std::llround(1.0e9 / o.rate_hz);
  CoreSession session(o.scene);
  const UsbLoopAccount result = run_usb_loop(session, o.loop);
  if (o.json) {
    std::printf("%s\n", account(o, result).dump(2).c_str());
  } else {
    print_summary(o, result);
  }
  if (result.ticks == 0) {
    std::fprintf(
        stderr, "host_sim: nothing was armed within %g s; link: %s\n", o.loop.patience_s,
        result.trouble.empty() ? "reports flow, is the deadman pressed?" : result.trouble.c_str());
    return tools::kExitDeviceOrOs;
  }
  return passed(o, result) ? tools::kExitDone : tools::kExitCheckFailed;
}

}  // namespace

Command add_usb_loop_command(CLI::App& program) {
  const auto o = std::make_shared<Options>();
  CLI::App* app = program.add_subcommand(
      "usb-loop", "Closes the loop with a reference device on this machine's USB and times it.");
  app->add_option("--scene", o->scene, "compiled scene (.rtscene)")->required();
  app->add_option("--ticks", o->loop.ticks, "measured, from the first armed one on; default 3000")
      ->check(CLI::Range(1u, 10'000'000u));
  app->add_option("--rate", o->rate_hz, "of the loop, and of the device's reports; default 1000")
      ->check(CLI::Range(100.0, 8000.0));
  app->add_option("--device", o->device, "VID:PID[:SERIAL]; default 1209:0001");
  app->add_option("--connects", o->connects,
                  "connections that the run must see, each of them armed; default 1");
  app->add_option("--patience", o->loop.patience_s, "until the first armed tick [s]; default 20")
      ->check(CLI::Range(0.1, 3600.0));
  app->add_flag("--json", o->json, "account as JSON on stdout");
  return {app, [o] { return run(*o); }};
}

}  // namespace haptic::sim
