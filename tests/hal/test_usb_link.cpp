// SPDX-License-Identifier: Apache-2.0
// The link where there is no device: what holds on any machine. Its flow is tested over a device in
// the process (tests/host_sim).
#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <cstring>

#include "hal/clock/servo_clock.hpp"
#include "hal/usb/usb_link.hpp"
#include "hal/usb/usb_text.hpp"
#include "hal/usb/usb_thread.hpp"
#include "tests/support/own_threads.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

// Of an identity that no vendor may use for a product.
class NoDevice final : public Driver {
 public:
  NoDevice() {
    profile_.name = "Nobody's device";
    profile_.vendor_id = 0x1209;
    profile_.product_id = 0x000f;
    profile_.out_endpoint = 0x01;
    profile_.in_bytes = profile_.out_bytes = 8;
  }
  const UsbProfile& profile() const noexcept override {
    ++looks;
    return profile_;
  }
  HalStatus start(UsbPort&) noexcept override {
    ++starts;
    return HalStatus::kOk;
  }
  ReportVerdict read(std::span<const std::uint8_t>, std::int64_t, DeviceState&) noexcept override {
    return ReportVerdict::kNothing;
  }
  std::size_t write(const Wrench&, std::uint64_t, std::span<std::uint8_t>,
                    Wrench&) noexcept override {
    return 0;
  }
  std::size_t zero_report(std::span<std::uint8_t>) const noexcept override { return 0; }
  int starts = 0;
  mutable int looks = 0;  ///< how often the link has asked what to look for
};

struct Clock {
  std::int64_t now_ns = 1'000'000'000;
  static std::int64_t read(void* self) { return static_cast<Clock*>(self)->now_ns; }
};

struct LinkLog final : LinkObserver {
  void on_report(std::int64_t, std::span<const std::uint8_t>, ReportVerdict,
                 std::uint64_t) noexcept override {}
  void on_send(std::int64_t, std::span<const std::uint8_t>,
               const GuardedOutput&) noexcept override {}
  void on_link(std::int64_t, LinkState, HalStatus) noexcept override { ++changes; }
  int changes = 0;
};

}  // namespace

TEST_SUITE("hal.usb_link") {
  TEST_CASE("parse_usb_address: identity, with a serial number or without") {
    UsbAddress a;
    CHECK(parse_usb_address("1209:000f", a));
    CHECK(a.vendor_id == 0x1209);
    CHECK(a.product_id == 0x000f);
    CHECK(a.serial.empty());
    CHECK(a.wrapped_fd == -1);
    CHECK(parse_usb_address("403:CB48:A1:B2", a));
    CHECK(a.vendor_id == 0x0403);
    CHECK(a.product_id == 0xcb48);
    CHECK(a.serial == "A1:B2");
    CHECK(parse_usb_address("1-2.3", a));
    CHECK(a.vendor_id == 0);
    CHECK(a.serial.empty());
    CHECK(a.bus_path == "1-2.3");
    CHECK(parse_usb_address("1209:000f@12-1", a));
    CHECK(a.product_id == 0x000f);
    CHECK(a.bus_path == "12-1");
    CHECK(parse_usb_address("1209:000f:A@B@3-1.2.3.4.5.6.7", a));
    CHECK(a.serial == "A@B");
    CHECK(a.bus_path == "3-1.2.3.4.5.6.7");
    CHECK(parse_usb_address("1209:000f:A@B", a));
    CHECK(a.serial == "A@B");
    CHECK(a.bus_path.empty());
    for (const char* bad : {"1-",         "-1",          "1-2.",  "1-.2",    "0-1",
                            "1-0",        "01-2",        "1-2-3", "256-1",   "1-2.3.4.5.6.7.1.2",
                            "1209:000f@", "1209:000f@1", "@1-2",  "",        ":",
                            "1209",       "1209:",       ":000f", "12090:1", "1209:0001f",
                            "0:1",        "1:0",         "g:1",   "1209:1:", "-1:1",
                            "0x12:1",     " 1:1",        "1 :1"}) {
      INFO(bad);
      a = UsbAddress{};
      a.vendor_id = 77;
      CHECK_FALSE(parse_usb_address(bad, a));
      CHECK(a.vendor_id == 77);  // left as it was
    }
  }

  TEST_CASE("poll: says what is missing and what to do, and does not try again before its time") {
    NoDevice driver;
    MailboxMemory mailbox;
    Clock clock;
    LinkLog log;
    LinkSettings settings;
    settings.clock = Clock::read;
    settings.clock_context = &clock;
    UsbLink link(driver, mailbox, settings);
    link.observe(&log);
    const HalStatus status = link.poll(0);
    CHECK((status == HalStatus::kDeviceNotFound || status == HalStatus::kUsbUnavailable));
    CHECK(link.state() == LinkState::kAbsent);
    const std::string text = link.trouble();
    INFO(text);
    CHECK(text.find("Nobody's device (1209:000f)") != std::string::npos);
    CHECK(text.find("LIBUSB_ERROR_") != std::string::npos);
    CHECK(text.find("Mend:") != std::string::npos);
    const int once = driver.looks;
    CHECK(once > 0);
    for (int k = 0; k < 10; ++k) {
      clock.now_ns += settings.retry_ns / 20;
      CHECK(link.poll(0) == status);
    }
    CHECK(driver.looks == once);
    clock.now_ns += settings.retry_ns / 2;
    CHECK(link.poll(0) == status);
    CHECK(driver.looks == 2 * once);
    link.cancel();
    clock.now_ns += settings.retry_ns;
    CHECK(link.poll(0) == status);
    CHECK(driver.looks == 2 * once);  // cancelled: opens nothing
    CHECK(driver.starts == 0);
    CHECK(link.counters().connects == 0u);
    CHECK(link.counters().disconnects == 0u);
    bool is_new = true;
    const DeviceState state = ServoSide(mailbox).state(&is_new);
    CHECK_FALSE(is_new);  // never there: no state, and no fault
    CHECK(state.faults == 0u);
    CHECK(log.changes == 0);
    link.close();
    link.close();
  }

  TEST_CASE("poll: where nobody says what is plugged in, devices are listed afresh each second") {
    NoDevice driver;
    MailboxMemory mailbox;
    Clock clock;
    LinkSettings settings;
    settings.clock = Clock::read;
    settings.clock_context = &clock;
    UsbLink link(driver, mailbox, settings);
    // Each list comes with a thread of libusb's own; 0: none.
    const auto listed_by = [] {
      int id = 0;
      for (const auto& each : haptic::test::own_threads()) {
        if (each.id != getpid()) id = each.id;
      }
      return id;
    };
    REQUIRE(listed_by() == 0);
    const HalStatus status = link.poll(0);
    if (status == HalStatus::kUsbUnavailable || listed_by() == 0) {
      MESSAGE("skipped: libusb does not start here, or cannot be told of devices");
      return;
    }
    const int first = listed_by();
    for (int k = 0; k < 4; ++k) {
      clock.now_ns += settings.retry_ns;
      CHECK(link.poll(0) == status);
      CHECK(listed_by() == first);
    }
    clock.now_ns += 1'000'000'000;
    CHECK(link.poll(0) == status);
    CHECK(listed_by() == 0);
    clock.now_ns += settings.retry_ns;
    CHECK(link.poll(0) == status);
    CHECK(listed_by() != 0);
    CHECK(listed_by() != first);
  }

  TEST_CASE("poll: a descriptor that is no device is refused with libusb's own word") {
    const int fd = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    REQUIRE(fd >= 0);
    {
      NoDevice driver;
      MailboxMemory mailbox;
      LinkSettings settings;
      settings.address.wrapped_fd = fd;
      UsbLink link(driver, mailbox, settings);
      const HalStatus status = link.poll(0);
      CHECK(status != HalStatus::kOk);
      CHECK(link.trouble().find("wrap the descriptor") != std::string::npos);
      link.set_wrapped_fd(-1);
      CHECK(link.state() == LinkState::kAbsent);
      CHECK(driver.starts == 0);
    }
    CHECK(::fcntl(fd, F_GETFD) >= 0);  // it is its owner's to close
    ::close(fd);
  }

  TEST_CASE("trouble: an access refused comes with the udev rule of that device") {
    const UsbName falcon{"Novint Falcon", 0x0403, 0xcb48};
    constexpr int kAccess = -3, kBusy = -6, kNoDevice = -4;  // of libusb's stable interface
    CHECK(status_of_libusb(kAccess, UsbAction::kOpen) == HalStatus::kDeviceDenied);
    const std::string text =
        usb_trouble(falcon, UsbAction::kOpen, kAccess, HalStatus::kDeviceDenied);
    CHECK(text.find("LIBUSB_ERROR_ACCESS") != std::string::npos);
    CHECK(text.find(udev_rule(falcon)) != std::string::npos);
    CHECK(udev_rule(falcon) ==
          "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"0403\", ATTR{idProduct}==\"cb48\", MODE=\"0660\", "
          "TAG+=\"uaccess\"");
    CHECK(status_of_libusb(kBusy, UsbAction::kClaim) == HalStatus::kDeviceBusy);
    CHECK(status_of_libusb(kNoDevice, UsbAction::kTransfer) == HalStatus::kDeviceGone);
    CHECK(status_of_libusb(-99, UsbAction::kInitialise) == HalStatus::kUsbUnavailable);
    CHECK(status_of_libusb(0, UsbAction::kOpen) == HalStatus::kOk);
  }

  TEST_CASE("thread: starts once asked, reports what it was granted, and stops in order") {
    NoDevice driver;
    MailboxMemory mailbox;
    UsbLink link(driver, mailbox, LinkSettings{});
    UsbThreadSettings settings;
    settings.priority = 1;
    UsbThread thread(link, settings);
    CHECK_FALSE(thread.running());
    thread.stop();
    for (int round = 0; round < 2; ++round) {
      const UsbThreadGrant grant = thread.start();
      REQUIRE(grant.create_error == 0);
      CHECK(thread.running());
      CHECK((grant.priority_error == 0) == (grant.priority == 1));
      CHECK(grant.cpu == -1);
      CHECK(thread.start().create_error == 0);  // again: nothing
      thread.stop();
      CHECK_FALSE(thread.running());
      CHECK(thread.status() != HalStatus::kOk);
    }
  }

  TEST_CASE("thread: while there is no device, it and libusb's own thread are ordinary ones") {
    NoDevice driver;
    MailboxMemory mailbox;
    UsbLink link(driver, mailbox, LinkSettings{});
    UsbThreadSettings settings;
    settings.priority = 7;
    settings.cpu = 0;
    UsbThread thread(link, settings);
    const UsbThreadGrant grant = thread.start();
    REQUIRE(grant.create_error == 0);
    if (grant.priority == 0) {
      MESSAGE("skipped: no right to SCHED_FIFO here, so no thread could have it");
      return;
    }
    const std::int64_t end_ns = monotonic_ns() + 20'000'000'000;
    while (driver.looks == 0 && monotonic_ns() < end_ns) usleep(200);
    if (thread.status() == HalStatus::kUsbUnavailable)
      MESSAGE("libusb does not start here: its own thread is not seen");
    for (int look = 0; look < 100; ++look) {
      const auto threads = haptic::test::own_threads();
      REQUIRE(threads.size() >= 2);
      REQUIRE(haptic::test::all_ordinary(threads));
      usleep(500);
    }
    const int all = haptic::test::own_threads().front().cpus;
    for (const auto& each : haptic::test::own_threads()) CHECK(each.cpus == all);
  }

  TEST_CASE("thread: a core that does not exist is refused, and said so") {
    NoDevice driver;
    MailboxMemory mailbox;
    UsbLink link(driver, mailbox, LinkSettings{});
    UsbThreadSettings settings;
    settings.cpu = 1'000'000;
    UsbThread thread(link, settings);
    const UsbThreadGrant grant = thread.start();
    CHECK(grant.create_error == 0);
    CHECK(grant.affinity_error != 0);
    CHECK(grant.cpu == -1);
  }
}
