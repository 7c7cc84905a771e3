// SPDX-License-Identifier: Apache-2.0
// The files to be installed, as systemd's own tools judge them.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "hal/realtime/deploy_text.hpp"
#include "tests/support/program_run.hpp"

using namespace haptic::hal;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;

namespace {

constexpr double kMostExposure = 2.0;
constexpr int kOfflineSince = 250;  ///< of systemd: security --offline, sysusers --root

struct Answer {
  int exit_code = -1;
  std::string text;
};

Answer answer_of(const std::string& command) {
  Answer answer;
  std::FILE* const pipe = popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return answer;
  char part[4096];
  for (std::size_t count = 0; (count = fread(part, 1, sizeof part, pipe)) > 0;)
    answer.text.append(part, count);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) answer.exit_code = WEXITSTATUS(status);
  return answer;
}

bool has_tool(const std::string& tool) {
  const Answer answer = answer_of(tool + " --version");
  int version = 0;
  if (answer.exit_code == 0 && std::sscanf(answer.text.c_str(), "systemd %d", &version) == 1 &&
      version >= kOfflineSince)
    return true;
  MESSAGE("skipped: no ", tool, " of systemd ", kOfflineSince, " or newer");
  return false;
}

std::vector<std::string> units() {
  std::vector<std::string> names;
  for (const DeployFile& file : deploy_files()) {
    if (file.name.ends_with(".service")) names.emplace_back(file.name);
  }
  return names;
}

void write_text(const std::string& path, const std::string& text) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

// 10 of 10 where the tool does not say.
double exposure_of(const std::string& path) {
  const Answer answer =
      answer_of("SYSTEMD_COLORS=0 systemd-analyze security --offline=true --no-pager " + path);
  const std::string key = "Overall exposure level for ";
  const std::size_t at = answer.text.find(key);
  const std::size_t colon = answer.text.find(": ", at);
  if (at == std::string::npos || colon == std::string::npos) return 10.0;
  return std::strtod(answer.text.c_str() + colon + 2, nullptr);
}

// The text without the lines that begin so.
std::string without(const std::string& text, const std::string& begin) {
  std::istringstream lines(text);
  std::string line, rest;
  while (std::getline(lines, line)) {
    if (!line.starts_with(begin)) rest += line + "\n";
  }
  return rest;
}

bool has_line(const std::string& text, const std::string& line) {
  return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

}  // namespace

TEST_SUITE("hal.deploy_units") {
  TEST_CASE("units: exposure by systemd's own judgement is at most 2.0") {
    if (!has_tool("systemd-analyze")) return;
    const ScratchFolder folder("deploy_units");
    REQUIRE(units().size() == 2);
    for (const std::string& name : units()) {
      CAPTURE(name);
      const std::string path = folder.file(name);
      const std::string text(deploy_text(name));
      write_text(path, text);
      const double exposure = exposure_of(path);
      MESSAGE(name, ": ", exposure);
      CHECK(exposure <= kMostExposure);
      write_text(path, without(without(text, "CapabilityBoundingSet="), "SystemCallFilter="));
      CHECK(exposure_of(path) > kMostExposure);  // the judge is awake
    }
  }

  TEST_CASE("60-haptic.rules: udevadm takes every line, and not a spoiled one") {
    if (answer_of("udevadm verify --help").exit_code != 0) {
      MESSAGE("skipped: no udevadm verify, which is of systemd 254 or newer");
      return;
    }
    const ScratchFolder folder("deploy_rules");
    const std::string path = folder.file("60-haptic.rules");
    const std::string text(deploy_text("60-haptic.rules"));
    const auto verdict = [&](const std::string& rules) {
      write_text(path, rules);
      return answer_of("udevadm verify --resolve-names=never " + path);
    };
    const Answer whole = verdict(text);
    CAPTURE(whole.text);
    CHECK(whole.exit_code == 0);
    CHECK(verdict(text + "SUBSYSTEM==\"tty\", ATTR{idVendor=\"0403\"\n").exit_code != 0);
    CHECK(verdict(text + "SUBSYSTEM==\"tty\", MODES=\"0660\"\n").exit_code != 0);
  }

  TEST_CASE("units: every key is known to systemd") {
    if (!has_tool("systemd-analyze")) return;
    const ScratchFolder folder("deploy_verify");
    for (const std::string& name : units()) {
      std::string text(deploy_text(name));
      for (const std::string program : {"/usr/local/bin/run_device", "/usr/bin/systemd-inhibit"}) {
        for (std::size_t at = 0; (at = text.find("=" + program, at)) != std::string::npos;)
          text.replace(at + 1, program.size(), "/bin/sh");
      }
      write_text(folder.file(name), text);
    }
    const std::string verify =
        "cd " + folder.file("") + " && SYSTEMD_COLORS=0 systemd-analyze verify";
    for (const std::string& name : units()) {
      const Answer answer = answer_of(verify + " ./" + name);
      CAPTURE(answer.text);
      CHECK(answer.exit_code == 0);
      CHECK(answer.text.find(name) == std::string::npos);
      write_text(folder.file(name), text_of_file(folder.file(name)) + "[Service]\nNoSuchKey=1\n");
      CHECK(answer_of(verify + " ./" + name).text.find("NoSuchKey") != std::string::npos);
    }
  }

  TEST_CASE("haptic-run.service: what the loop needs is not refused, and an end is one of order") {
    const std::string unit(deploy_text("haptic-run.service"));
    for (const char* line :
         {"KillMode=mixed", "User=haptic", "SupplementaryGroups=realtime", "StateDirectory=haptic",
          "LimitMEMLOCK=infinity", "CapabilityBoundingSet=", "DevicePolicy=closed",
          "DeviceAllow=char-usb_device rw", "DeviceAllow=/dev/cpu_dma_latency rw",
          "PrivateNetwork=yes", "MemoryDenyWriteExecute=yes", "LockPersonality=yes",
          "ProtectSystem=strict", "Conflicts=sleep.target", "Before=sleep.target",
          "Wants=haptic-awake.service"})
      CHECK_MESSAGE(has_line(unit, line), std::string(line));
    // Each of these takes away a right that the loop or the doctor has need of.
    for (const char* key : {"RestrictRealtime=", "PrivateDevices=", "PrivateUsers=", "ProcSubset=",
                            "ProtectProc=", "RootDirectory=", "DynamicUser="})
      CHECK_MESSAGE(without(unit, key) == unit, std::string(key));
    CHECK(has_line(unit, "LimitRTPRIO=95"));
    CHECK(std::string(deploy_text("haptic-limits.conf")).find("@realtime - rtprio 95\n") !=
          std::string::npos);
  }

  TEST_CASE("users and folders: made as the unit and the rules name them") {
    if (!has_tool("systemd-sysusers") || !has_tool("systemd-tmpfiles")) return;
    if (getuid() != 0) {
      MESSAGE("skipped: not root, so no folder can be given to another user");
      return;
    }
    const ScratchFolder folder("deploy_users");
    const std::string root = folder.file("root");
    std::filesystem::create_directories(root + "/etc");
    for (const char* name : {"haptic-sysusers.conf", "haptic-tmpfiles.conf"})
      write_text(folder.file(name), std::string(deploy_text(name)));
    const Answer users =
        answer_of("systemd-sysusers --root=" + root + " " + folder.file("haptic-sysusers.conf"));
    CAPTURE(users.text);
    REQUIRE(users.exit_code == 0);
    const std::string passwd = text_of_file(root + "/etc/passwd");
    CHECK(passwd.starts_with("haptic:"));
    CHECK(passwd.find("/nologin\n") != std::string::npos);
    const std::string group = text_of_file(root + "/etc/group");
    CHECK(group.find("realtime:") != std::string::npos);
    CHECK(group.find(":haptic\n") != std::string::npos);
    const Answer folders = answer_of("systemd-tmpfiles --create --root=" + root + " " +
                                     folder.file("haptic-tmpfiles.conf"));
    CAPTURE(folders.text);
    REQUIRE(folders.exit_code == 0);
    namespace fs = std::filesystem;
    CHECK(fs::status(root + "/var/lib/haptic").permissions() == fs::perms{0750});
    CHECK(fs::status(root + "/etc/haptic").permissions() == fs::perms{0755});
  }
}
