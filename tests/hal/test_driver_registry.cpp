// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <bit>
#include <cstdio>
#include <map>
#include <set>
#include <string>

#include "hal/drivers/driver_registry.hpp"
#include "hal/drivers/falcon_driver.hpp"
#include "hal/drivers/serial_adapters.hpp"
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

std::string hex4(std::uint16_t number) {
  char text[8];
  (void)std::snprintf(text, sizeof text, "%04x", number);
  return text;
}

/// Lines that give a page in a browser the devices of a driver: one a vendor.
std::string hidraw_rules_of(const DriverRow& row) {
  std::map<std::uint16_t, std::string> products;
  for (const UsbIdentity& id : identities_of(row)) {
    std::string& list = products[id.vendor_id];
    list += (list.empty() ? "" : "|") + hex4(id.product_id);
  }
  std::string text;
  for (const auto& [vendor, list] : products)
    text += "SUBSYSTEM==\"hidraw\", ATTRS{idVendor}==\"" + hex4(vendor) +
            "\", ATTRS{idProduct}==\"" + list + "\", MODE=\"0660\", TAG+=\"uaccess\"\n";
  return text;
}

/// The lines of an adapter: its port, ModemManager, the time that it holds bytes back.
std::string rules_of(const SerialAdapter& adapter) {
  const auto match = [&](const char* key) {
    return std::string(key) + "{idVendor}==\"" + hex4(adapter.vendor_id) + "\", " + key +
           "{idProduct}==\"" + hex4(adapter.product_id) + "\", ";
  };
  std::string text = "\n# Serial port: " + std::string(adapter.name) +
                     ". Its group stays dialout; ModemManager leaves it alone.\n"
                     "SUBSYSTEM==\"tty\", " +
                     match("ATTRS") +
                     "MODE=\"0660\", TAG+=\"uaccess\"\n"
                     "SUBSYSTEM==\"usb\", ENV{DEVTYPE}==\"usb_device\", " +
                     match("ATTR") + "ENV{ID_MM_DEVICE_IGNORE}=\"1\"\n";
  if (adapter.has_latency_timer)
    text += "ACTION==\"add\", SUBSYSTEM==\"usb-serial\", DRIVERS==\"ftdi_sio\", " + match("ATTRS") +
            "ATTR{latency_timer}=\"1\"\n";
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
    // Those of WebHID, of Force Dimension and of the serial ports are checked below.
    CHECK(times(rules, "uaccess\"\n") == identities + 3 + serial_adapters().size());
  }

  TEST_CASE("60-haptic.rules: what bridges and a page in a browser open") {
    const std::string rules(deploy_text("60-haptic.rules"));
    CAPTURE(hidraw_rules_of(*find_driver("spacemouse")));
    CHECK(has(rules, hidraw_rules_of(*find_driver("spacemouse"))));
    CHECK(times(rules, "\"hidraw\"") == 2);
    const std::string vendor = "ATTR{idVendor}==\"" + hex4(kForceDimensionVendor) + "\", ";
    CHECK(has(rules, "SUBSYSTEM==\"usb\", " + vendor + "MODE=\"0660\", TAG+=\"uaccess\"\n"));
    CHECK(has(rules, "SUBSYSTEM==\"usb\", " + vendor + "GROUP=\"realtime\"\n"));
    CHECK(has(rules, vendor + "TEST==\"power/control\", ATTR{power/control}=\"on\"\n"));
    for (const SerialAdapter& adapter : serial_adapters()) {
      // In hal/realtime/deploy/60-haptic.rules these lines are missing:
      CAPTURE(rules_of(adapter));
      CHECK(has(rules, rules_of(adapter)));
      CHECK(find_serial_adapter(adapter.vendor_id, adapter.product_id) == &adapter);
      const DriverRow* const row = find_driver(adapter.bridge);
      REQUIRE(row != nullptr);
      CHECK(row->is_bridged);
    }
    CHECK(times(rules, "ID_MM_DEVICE_IGNORE") == serial_adapters().size());
    CHECK(find_serial_adapter(0x1209, 0x0001) == nullptr);
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
