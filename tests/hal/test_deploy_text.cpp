// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cerrno>
#include <string>

#include "hal/realtime/deploy_text.hpp"
#include "tests/support/fake_machine.hpp"
#include "tests/support/text_search.hpp"

using namespace haptic::hal;
using haptic::test::FakeMachine;
using haptic::test::has;

TEST_SUITE("hal.deploy_text") {
  TEST_CASE("deploy_text: byte for byte the files of the source tree") {
    const std::string folder = std::string(HAPTIC_TEST_DIR) + "/../hal/realtime/deploy/";
    CHECK(deploy_files().size() == 6);
    for (const DeployFile& file : deploy_files()) {
      CAPTURE(std::string(file.name));
      const std::string text = haptic::sim::test::text_of_file(folder + std::string(file.name));
      CHECK_FALSE(text.empty());
      CHECK(std::string(file.text) == text);
      CHECK(deploy_text(file.name) == file.text);
    }
    CHECK(deploy_text("60-haptic").empty());
  }

  TEST_CASE("haptic-limits.conf: the lines that the doctor names") {
    FakeMachine machine;
    machine.probes.memory_error = ENOMEM;
    const std::string limits(deploy_text("haptic-limits.conf"));
    const std::string fix = machine.line("memory lock").fix;
    for (const char* line : {"@realtime - rtprio 95", "@realtime - memlock unlimited"}) {
      CHECK(has(limits, std::string("\n") + line + "\n"));
      CHECK(has(fix, std::string("    ") + line));
    }
  }
}
