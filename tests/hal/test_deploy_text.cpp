// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cerrno>
#include <string>
#include <vector>

#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/polhem_driver.hpp"
#include "hal/drivers/reference_driver.hpp"
#include "hal/drivers/spacemouse_codec.hpp"
#include "hal/realtime/deploy_text.hpp"
#include "hal/usb/usb_text.hpp"
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

  TEST_CASE("60-haptic.rules: every identity of a driver, and no more") {
    const std::string rules(deploy_text("60-haptic.rules"));
    std::vector<UsbName> names;
    const auto add = [&](const UsbProfile& p) {
      names.push_back({p.name, p.vendor_id, p.product_id});
    };
    add(ReferenceDriver().profile());
    add(FalconDriver(FalconSettings{}).profile());
    add(PolhemDriver().profile());
    for (const SpaceMouseModel& m : spacemouse_models())
      names.push_back({"", m.vendor_id, m.product_id});
    for (const UsbName& name : names) {
      CAPTURE(udev_rule(name));
      CHECK(has(rules, "\n" + udev_rule(name) + "\n"));
    }
    std::size_t count = 0;
    for (std::size_t at = rules.find("uaccess\"\n"); at != std::string::npos;
         at = rules.find("uaccess\"\n", at + 1))
      count += 1;
    CHECK(count == names.size());
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
