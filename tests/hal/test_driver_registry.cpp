// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <bit>
#include <set>
#include <string>

#include "hal/drivers/driver_registry.hpp"
#include "hal/drivers/falcon_driver.hpp"
#include "hal/realtime/deploy_text.hpp"
#include "hal/usb/usb_text.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"

using namespace haptic::hal;
using haptic::test::has;
using haptic::test::times;

namespace {

std::string matching_rule(const UsbIdentity& identity, const std::string& rest) {
  const std::string rule = udev_rule({"", identity.vendor_id, identity.product_id});
  return rule.substr(0, rule.find(", MODE")) + rest;
}

/// The lines of 60-haptic.rules for a driver: a comment, and the rules of each identity.
std::string rules_of(const DriverRow& row) {
  std::string text = "\n# " + std::string(row.product) + "." + (row.note.empty() ? "" : " ") +
                     std::string(row.note) + "\n";
  const bool motors = standard_driver(row)->capabilities().driven_dof != 0;
  for (const UsbIdentity& id : identities_of(row)) {
    text += udev_rule({"", id.vendor_id, id.product_id}) + "\n";
    if (!motors) continue;
    text += matching_rule(id, ", GROUP=\"realtime\"\n");
    text += "ACTION==\"add\", " +
            matching_rule(id, ", TEST==\"power/control\", ATTR{power/control}=\"on\"\n");
  }
  return text + "\n";
}

/// Its row in the table of README.md.
std::string readme_row_of(const DriverRow& row) {
  const std::unique_ptr<Driver> driver = standard_driver(row);
  const DeviceCapabilities& c = driver->capabilities();
  const int driven = std::popcount(c.driven_dof);
  std::string drives = driven == 0 ? "none" : std::to_string(driven) + ": ";
  if ((c.driven_dof & kDofTranslation) != 0) drives += "force";
  if (std::popcount(c.driven_dof & kDofAll) == 6) drives += " and ";
  if ((c.driven_dof & kDofRotation) != 0) drives += "torque";
  return "\n| `" + std::string(row.name) + "` | " + std::string(row.product) + " | " +
         std::to_string(std::popcount(c.sensed_dof)) + " | " + drives + " | " +
         std::string(row.tested) + " |\n";
}

}  // namespace

TEST_SUITE("hal.driver_registry") {
  TEST_CASE("driver_rows: names are found, and no two drivers have one name or one identity") {
    CHECK(driver_rows().front().name == "reference");  // the simulated device speaks its protocol
    std::set<std::string_view> names;
    std::set<std::pair<unsigned, unsigned>> identities;
    for (const DriverRow& row : driver_rows()) {
      CAPTURE(std::string(row.name));
      CHECK(names.insert(row.name).second);
      CHECK(find_driver(row.name) == &row);
      CHECK_FALSE(row.product.empty());
      CHECK_FALSE(row.tested.empty());
      for (const UsbIdentity& id : identities_of(row))
        CHECK(identities.emplace(id.vendor_id, id.product_id).second);
      const std::unique_ptr<Driver> driver = standard_driver(row);
      REQUIRE(driver != nullptr);
      CHECK(check_capabilities(driver->capabilities()) == HalStatus::kOk);
      CHECK(driver->profile().in_bytes <= kMaxReportBytes);
    }
    CHECK(find_driver("sim") == nullptr);
    CHECK(find_driver("") == nullptr);
  }

  TEST_CASE("60-haptic.rules: the lines of every driver, and no more") {
    const std::string rules(deploy_text("60-haptic.rules"));
    std::size_t identities = 0;
    for (const DriverRow& row : driver_rows()) {
      if (row.is_bridged) continue;
      // In hal/realtime/deploy/60-haptic.rules these lines are missing:
      CAPTURE(rules_of(row));
      CHECK(has(rules, rules_of(row)));
      identities += identities_of(row).size();
    }
    CHECK(times(rules, "uaccess\"\n") == identities);
  }

  TEST_CASE("README.md: a row for every driver, and no more") {
    const std::string readme =
        haptic::sim::test::text_of_file(std::string(HAPTIC_TEST_DIR) + "/../README.md");
    for (const DriverRow& row : driver_rows()) {
      // In the table of README.md this row is missing:
      CAPTURE(readme_row_of(row));
      CHECK(has(readme, readme_row_of(row)));
    }
    const std::size_t table =
        readme.find("\n| `driver =` | device | senses | drives | tested against |\n");
    REQUIRE(table != std::string::npos);
    const std::string rows = readme.substr(table, readme.find("\n\n", table) - table);
    CHECK(times(rows, "\n| ") == driver_rows().size() + 1);
  }

  TEST_CASE("make: the keys of the falcon, and what no driver can be made of") {
    const DriverRow& falcon = *find_driver("falcon");
    const std::string hash(64, '7');
    const auto defect_of = [&](const DriverOptions& options) {
      DriverDefect defect;
      const bool made = falcon.make(options, defect) != nullptr;
      CHECK(made == defect.key.empty());
      return std::string(defect.key) + ": " + defect.text;
    };
    DriverOptions options;
    CHECK(defect_of(options) == ": ");
    options.values = {{"firmware_accept_unknown", true}};
    CHECK(has(defect_of(options), "firmware_accept_unknown: says how to check the firmware"));
    options.values = {{"firmware_sha256", hash}};
    CHECK(has(defect_of(options), "firmware_sha256: says how to check the firmware"));
    options.values.emplace_back("firmware", std::string("falcon.bin"));
    CHECK(defect_of(options) == ": ");
    options.values = {{"firmware", std::string("falcon.bin")}, {"firmware_sha256", hash + " 12"}};
    CHECK(has(defect_of(options), "firmware_sha256: '12' is no SHA-256; give the 64 digits"));
  }

  TEST_CASE("make: a model of 3Dconnexion by its identity, a Polhem driven with a deadman switch") {
    DriverOptions options;
    DriverDefect defect;
    options.vendor_id = 0x046d;
    options.product_id = 0xc626;
    const auto mouse = find_driver("spacemouse")->make(options, defect);
    CHECK(mouse->profile().vendor_id == 0x046d);
    CHECK(mouse->profile().product_id == 0xc626);
    const DriverRow& polhem = *find_driver("polhem");
    CHECK(polhem.make({}, defect)->capabilities().driven_dof == 0);
    CHECK(standard_driver(polhem)->capabilities().driven_dof == kDofTranslation);
  }
}
