// SPDX-License-Identifier: Apache-2.0
// run_device conform [--device VID:PID[:SERIAL][@1-2.3] | unix:PATH] [--reports N] [--json]

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "hal/usb/usb_link.hpp"
#include "tools/common/command_line.hpp"
#include "tools/common/error.hpp"
#include "tools/run_device/commands.hpp"
#include "tools/run_device/conformance.hpp"

namespace haptic::tools {
namespace {

constexpr std::string_view kSocketAddress = "unix:";

struct ConformOptions {
  std::string device;
  std::uint32_t reports = ConformSettings{}.reports;
  bool json = false;
};

std::string check_address(const std::string& text) {
  hal::UsbAddress ignored;
  const bool socket = text.starts_with(kSocketAddress) && text.size() > kSocketAddress.size();
  return socket || hal::parse_usb_address(text, ignored)
             ? ""
             : text +
                   " is no address; give unix:PATH, VID:PID or VID:PID:SERIAL (hexadecimal, as "
                   "lsusb shows it), a place on the bus (1-2.3), or both, joined by @";
}

std::unique_ptr<ConformCarrier> carrier_to(const std::string& address) {
  if (address.starts_with(kSocketAddress))
    return conform_over_socket(address.substr(kSocketAddress.size()));
  hal::UsbAddress usb;
  if (!address.empty()) (void)hal::parse_usb_address(address, usb);
  return conform_over_usb(usb);
}

std::string table_of(const std::vector<ConformCheck>& checks) {
  std::string text;
  std::size_t counts[5] = {};
  for (const ConformCheck& check : checks) {
    char head[64];
    (void)std::snprintf(head, sizeof head, "%2d  %-8s  %-19s ", check.number, to_text(check.result),
                        check.name.c_str());
    text += head + check.found + "\n";
    ++counts[static_cast<std::size_t>(check.result)];
  }
  text += "\n";
  for (const ConformResult result : {ConformResult::kPassed, ConformResult::kFailed,
                                     ConformResult::kNotDone, ConformResult::kByHand}) {
    text += (text.ends_with("\n") ? "" : ", ") +
            std::to_string(counts[static_cast<std::size_t>(result)]) + " " + to_text(result);
  }
  return text + (conforms(checks) ? "\nconforming, as far as no person is needed\n"
                                  : "\nNOT CONFORMING: hal/drivers/PROTOCOL.md, section 12\n");
}

std::string json_of(const std::vector<ConformCheck>& checks) {
  nlohmann::json found = nlohmann::json::array();
  for (const ConformCheck& check : checks)
    found.push_back({{"number", check.number},
                     {"name", check.name},
                     {"result", to_text(check.result)},
                     {"found", check.found}});
  const nlohmann::json all = {{"conforming", conforms(checks)}, {"checks", std::move(found)}};
  return all.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

int check_device_conforms(const ConformOptions& o) {
  const std::unique_ptr<ConformCarrier> carrier = carrier_to(o.device);
  if (const std::string absent = carrier->connect(); !absent.empty()) throw OsError(absent);
  ConformSettings settings;
  settings.reports = o.reports;
  settings.say = [](const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); };
  const std::vector<ConformCheck> checks = check_conformance(*carrier, settings);
  const std::string text = o.json ? json_of(checks) : table_of(checks);
  std::fwrite(text.data(), 1, text.size(), stdout);
  return conforms(checks) ? kExitDone : kExitCheckFailed;
}

}  // namespace

Command add_conform_command(CLI::App& program) {
  const auto o = std::make_shared<ConformOptions>();
  CLI::App* app = program.add_subcommand(
      "conform",
      "Checks whether a device keeps to the protocol of the reference device "
      "(hal/drivers/PROTOCOL.md). The drives go on without a wrench; no force is asked for.");
  app->footer("Exit codes: 0 conforming, 1 not, 2 usage, 4 the device is not there.");
  app->add_option("--device", o->device,
                  "VID:PID[:SERIAL][@1-2.3] or unix:PATH; default 1209:0001, the test identity")
      ->check(CLI::Validator(check_address, "ADDRESS"));
  app->add_option("--reports", o->reports, "reports read in a row; default 60000")
      ->check(CLI::Range(100, 10'000'000));
  app->add_flag("--json", o->json, "every check as JSON");
  return {app, [o] { return check_device_conforms(*o); },
          "run_device conform --device unix:/run/user/1000/mine.sock"};
}

}  // namespace haptic::tools
