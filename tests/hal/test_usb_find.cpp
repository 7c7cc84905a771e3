// SPDX-License-Identifier: Apache-2.0
// Which of several devices a link opens. libusb's functions of this program are the ones below, in
// front of the library's: a bus with any devices on it.
#include <doctest/doctest.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <vector>

#include "hal/drivers/spacenav_socket.hpp"
#include "hal/usb/usb_link.hpp"
#include "tests/support/listening_socket.hpp"

using namespace haptic;
using namespace haptic::hal;
using haptic::test::ListeningSocket;

namespace {

constexpr std::uint16_t kVendor = 0x1209, kProduct = 0x000f;

struct BusDevice {
  std::uint8_t bus = 1;
  std::vector<std::uint8_t> ports;
  std::string serial;
  std::uint16_t product_id = kProduct;
  int open_code = 0, claim_code = 0;
  bool mute = false;  ///< answers no request for its serial number
};

std::vector<BusDevice> on_bus;
int opened = 0;    ///< handles that are open
int opens = 0;     ///< that were opened so far
int claimed = -1;  ///< index of the device whose interface is claimed

BusDevice& device_of(libusb_device* device) { return *reinterpret_cast<BusDevice*>(device); }
libusb_device* as_device(libusb_device_handle* handle) {
  return reinterpret_cast<libusb_device*>(handle);
}
int index_of(libusb_device* device) { return static_cast<int>(&device_of(device) - on_bus.data()); }

constexpr libusb_endpoint_descriptor kIn = {7, LIBUSB_DT_ENDPOINT, 0x81, 3, 16, 1, 0, 0, nullptr,
                                            0};
constexpr libusb_interface_descriptor kSetting = {
    9, LIBUSB_DT_INTERFACE, 0, 0, 1, 0xff, 0, 0, 0, &kIn, nullptr, 0};
constexpr libusb_interface kInterface = {&kSetting, 1};

/// Sees which device it was given, and does not go on.
class LookingDriver final : public Driver {
 public:
  explicit LookingDriver(std::string (*holder)()) {
    profile_.holder = holder;
    profile_.name = "test device";
    profile_.vendor_id = kVendor;
    profile_.product_id = kProduct;
    profile_.in_bytes = 16;
  }
  HalStatus start(UsbPort&) noexcept override {
    got = claimed;
    return HalStatus::kStartFailed;
  }
  ReportVerdict read(std::span<const std::uint8_t>, std::int64_t, DeviceState&) noexcept override {
    return ReportVerdict::kNothing;
  }
  std::size_t write(const Wrench&, std::uint64_t, std::span<std::uint8_t>,
                    Wrench&) noexcept override {
    return 0;
  }
  std::size_t zero_report(std::span<std::uint8_t>) const noexcept override { return 0; }
  int got = -1;
};

struct Found {
  int device = -1;
  HalStatus status = HalStatus::kOk;
  std::string trouble;
};

Found find(const std::vector<BusDevice>& devices, const std::string& address,
           std::string (*holder)() = nullptr) {
  on_bus = devices;
  LookingDriver driver(holder);
  LinkSettings settings;
  if (!address.empty()) REQUIRE(parse_usb_address(address, settings.address));
  MailboxMemory mailbox;
  UsbLink link(driver, mailbox, settings);
  Found found;
  found.status = link.poll(0);
  found.device = driver.got;
  found.trouble = link.trouble();
  link.close();
  CHECK(opened == 0);  // nothing stays open, nor claimed
  CHECK(claimed == -1);
  return found;
}

}  // namespace

extern "C" {

int libusb_init(libusb_context** context) {
  static int one = 0;
  *context = reinterpret_cast<libusb_context*>(&one);
  return 0;
}
#if LIBUSB_API_VERSION >= 0x0100010A
int libusb_init_context(libusb_context** context, const libusb_init_option*, int) {
  return libusb_init(context);
}
#endif
void libusb_exit(libusb_context*) {}
int libusb_set_option(libusb_context*, libusb_option, ...) { return 0; }
void libusb_set_pollfd_notifiers(libusb_context*, libusb_pollfd_added_cb, libusb_pollfd_removed_cb,
                                 void*) {}
const libusb_pollfd** libusb_get_pollfds(libusb_context*) { return nullptr; }
void libusb_free_pollfds(const libusb_pollfd**) {}
int libusb_has_capability(std::uint32_t) { return 0; }
ssize_t libusb_get_device_list(libusb_context*, libusb_device*** list) {
  static std::vector<libusb_device*> devices;
  devices.clear();
  for (BusDevice& device : on_bus) devices.push_back(reinterpret_cast<libusb_device*>(&device));
  devices.push_back(nullptr);
  *list = devices.data();
  return static_cast<ssize_t>(on_bus.size());
}
void libusb_free_device_list(libusb_device**, int) {}
int libusb_get_device_descriptor(libusb_device* device, libusb_device_descriptor* descriptor) {
  *descriptor = {};
  descriptor->idVendor = kVendor;
  descriptor->idProduct = device_of(device).product_id;
  descriptor->iSerialNumber = device_of(device).serial.empty() ? 0 : 3;
  return 0;
}
std::uint8_t libusb_get_bus_number(libusb_device* device) { return device_of(device).bus; }
int libusb_get_port_numbers(libusb_device* device, std::uint8_t* ports, int room) {
  const std::vector<std::uint8_t>& of = device_of(device).ports;
  if (of.size() > static_cast<std::size_t>(room)) return LIBUSB_ERROR_OVERFLOW;
  std::copy(of.begin(), of.end(), ports);
  return static_cast<int>(of.size());
}
std::uint8_t libusb_get_device_address(libusb_device*) { return 1; }
int libusb_open(libusb_device* device, libusb_device_handle** handle) {
  if (device_of(device).open_code < 0) return device_of(device).open_code;
  *handle = reinterpret_cast<libusb_device_handle*>(device);
  ++opened;
  ++opens;
  return 0;
}
void libusb_close(libusb_device_handle*) { --opened; }
libusb_device* libusb_get_device(libusb_device_handle* handle) { return as_device(handle); }
int libusb_claim_interface(libusb_device_handle* handle, int) {
  BusDevice& device = device_of(as_device(handle));
  if (device.claim_code < 0) return device.claim_code;
  claimed = index_of(as_device(handle));
  return 0;
}
int libusb_release_interface(libusb_device_handle*, int) {
  claimed = -1;
  return 0;
}
int libusb_get_active_config_descriptor(libusb_device*, libusb_config_descriptor** config) {
  static libusb_config_descriptor one{};
  one.bNumInterfaces = 1;
  one.interface = &kInterface;
  *config = &one;
  return 0;
}
void libusb_free_config_descriptor(libusb_config_descriptor*) {}
libusb_transfer* libusb_alloc_transfer(int) {
  return static_cast<libusb_transfer*>(std::calloc(1, sizeof(libusb_transfer)));
}
void libusb_free_transfer(libusb_transfer* transfer) { std::free(transfer); }
// String descriptors: the languages, and the serial number.
int libusb_submit_transfer(libusb_transfer* transfer) {
  const BusDevice& device = device_of(as_device(transfer->dev_handle));
  if (device.mute) return 0;
  const libusb_control_setup* setup = libusb_control_transfer_get_setup(transfer);
  unsigned char* bytes = libusb_control_transfer_get_data(transfer);
  const std::string text = (libusb_le16_to_cpu(setup->wValue) & 0xff) == 0 ? "\x09" : device.serial;
  transfer->actual_length = static_cast<int>(2 + 2 * text.size());
  bytes[0] = static_cast<unsigned char>(transfer->actual_length);
  bytes[1] = LIBUSB_DT_STRING;
  for (std::size_t k = 0; k < text.size(); ++k) {
    bytes[2 + 2 * k] = static_cast<unsigned char>(text[k]);
    bytes[3 + 2 * k] = text == "\x09" ? 4 : 0;
  }
  transfer->status = LIBUSB_TRANSFER_COMPLETED;
  transfer->callback(transfer);
  return 0;
}
int libusb_cancel_transfer(libusb_transfer* transfer) {
  transfer->status = LIBUSB_TRANSFER_CANCELLED;
  transfer->callback(transfer);
  return 0;
}
int libusb_handle_events_timeout_completed(libusb_context*, timeval*, int*) { return 0; }

}  // extern "C"

TEST_SUITE("hal.usb_find") {
  const BusDevice kBusy{1, {1}, "A", kProduct, 0, LIBUSB_ERROR_BUSY};
  const BusDevice kDenied{1, {2}, "B", kProduct, LIBUSB_ERROR_ACCESS};
  const BusDevice kOther{1, {3}, "C", 0x0001};
  const BusDevice kFree{1, {4}, "D"}, kDeep{2, {1, 4, 2}, "E"};

  TEST_CASE("of equal devices the first that is free is taken, no matter why others are not") {
    CHECK(find({kFree, kDeep}, "").device == 0);
    CHECK(find({kBusy, kFree, kDeep}, "").device == 1);
    CHECK(find({kDenied, kOther, kBusy, kDeep}, "").device == 3);
    CHECK(find({kFree, kBusy}, "1209:000f").device == 0);
  }

  TEST_CASE("none is free: what is said is about one that is there") {
    CHECK(find({}, "").status == HalStatus::kDeviceNotFound);
    CHECK(find({kOther}, "").status == HalStatus::kDeviceNotFound);
    const Found busy = find({kOther, kBusy}, "");
    CHECK(busy.device == -1);
    CHECK(busy.status == HalStatus::kDeviceBusy);
    CHECK(busy.trouble.find("close the other program") != std::string::npos);
    CHECK(find({kDenied}, "").status == HalStatus::kDeviceDenied);
  }

  TEST_CASE("a place on the bus chooses among equal devices") {
    CHECK(find({kFree, kDeep}, "2-1.4.2").device == 1);
    CHECK(find({kFree, kDeep}, "1-4").device == 0);
    CHECK(find({kFree, kDeep}, "1209:000f@2-1.4.2").device == 1);
    CHECK(find({kFree, kDeep}, "1209:000f:E@2-1.4.2").device == 1);
    CHECK(find({kFree, kDeep}, "1209:000f:D@2-1.4.2").status == HalStatus::kDeviceNotFound);
    CHECK(find({kFree, kDeep}, "2-1.4").status == HalStatus::kDeviceNotFound);
    CHECK(find({kFree, kDeep, kBusy}, "1-1").status == HalStatus::kDeviceBusy);
  }

  TEST_CASE("a serial number chooses, and a device that does not say its own is passed over") {
    BusDevice mute = kFree;
    mute.mute = true;
    CHECK(find({kFree, kDeep}, "1209:000f:E").device == 1);
    CHECK(find({mute, kDeep}, "1209:000f:E").device == 1);
    CHECK(find({mute}, "1209:000f:D").status == HalStatus::kDeviceNotFound);
    CHECK(find({kFree}, "1209:000f:DD").status == HalStatus::kDeviceNotFound);
    CHECK(find({kFree}, "1209:000f:d").status == HalStatus::kDeviceNotFound);
  }

  TEST_CASE("a device that a daemon holds is not opened, and who holds it is said") {
    ListeningSocket daemon;
    unsetenv("SPNAV_SOCKET");
    if (!spacenav_holder().empty()) {
      MESSAGE("skipped: a spacenavd runs on this machine");
      return;
    }
    CHECK(find({kFree}, "", spacenav_holder).device == 0);
    setenv("SPNAV_SOCKET", daemon.path().c_str(), 1);
    opens = 0;
    const Found held = find({kFree}, "", spacenav_holder);
    CHECK(held.device == -1);
    CHECK(held.status == HalStatus::kDeviceBusy);
    CHECK(held.trouble.find("test device (1209:000f): spacenavd holds") == 0);
    CHECK(held.trouble.find("Give driver = \"spacenav\"") != std::string::npos);
    CHECK(opens == 0);  // not even for a moment
    daemon.stop();
    CHECK(find({kFree}, "", spacenav_holder).device == 0);
    unsetenv("SPNAV_SOCKET");
  }
}
