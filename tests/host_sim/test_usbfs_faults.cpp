// SPDX-License-Identifier: Apache-2.0
// Faults of the bus as libusb sees them: failed and refused transfers, unplugging.
#include <doctest/doctest.h>

#include <cerrno>
#include <thread>
#include <utility>
#include <vector>

#include "tests/host_sim/usbfs_gadget.hpp"

namespace haptic::sim {

TEST_SUITE("host_sim.usbfs_faults") {
  TEST_CASE("faults: stall, babble, bus error and over-long reports, then all is well again") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    const std::pair<int, libusb_transfer_status> cases[] = {{-EPIPE, LIBUSB_TRANSFER_STALL},
                                                            {-EOVERFLOW, LIBUSB_TRANSFER_OVERFLOW},
                                                            {-EPROTO, LIBUSB_TRANSFER_ERROR}};
    Async in(host, kIn, 96), out(host, kOut, 56);
    for (const auto& [fault, status] : cases) {
      const int made = fault;
      CAPTURE(made);
      carrier.fail_next(kIn, fault, 2);
      for (int k = 0; k < 2; ++k) {
        REQUIRE(in.submit() == 0);
        CHECK(in.times == 0);
        carrier.push(kIn, report(1));
        REQUIRE(in.wait());
        CHECK(in.transfer->status == status);
        CHECK(in.transfer->actual_length == 0);
        in.times = 0;
      }
      REQUIRE(in.submit() == 0);
      carrier.push(kIn, report(2));
      REQUIRE(in.wait());
      CHECK(in.transfer->status == LIBUSB_TRANSFER_COMPLETED);
      CHECK(in.bytes == report(2));
      in.times = 0;
      gadget.taken.clear();
      carrier.fail_next(kOut, fault);
      REQUIRE(out.submit() == 0);
      REQUIRE(out.wait());
      CHECK(out.transfer->status == status);
      CHECK(gadget.taken.empty());
      REQUIRE(out.submit() == 0);
      REQUIRE(out.wait());
      CHECK(out.transfer->status == LIBUSB_TRANSFER_COMPLETED);
      CHECK(gadget.taken.size() == 1);
    }
    REQUIRE(in.submit() == 0);
    carrier.push(kIn, report(4, 97));
    REQUIRE(in.wait());
    CHECK(in.transfer->status == LIBUSB_TRANSFER_OVERFLOW);
    carrier.fail_next(0, -EPIPE);
    CHECK(libusb_control_transfer(host.handle, 0x40, 8, 0, 0, nullptr, 0, kPatience_ms) ==
          LIBUSB_ERROR_PIPE);
    CHECK(libusb_control_transfer(host.handle, 0x40, 8, 0, 0, nullptr, 0, kPatience_ms) == 0);
  }

  TEST_CASE("faults: a submit without memory, as often as said") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Async in(host, kIn, 96), out(host, kOut, 56);
    carrier.refuse_submit(kIn, -ENOMEM, 2);
    CHECK(in.submit() == LIBUSB_ERROR_NO_MEM);
    CHECK(out.submit() == 0);
    REQUIRE(out.wait());
    CHECK(in.submit() == LIBUSB_ERROR_NO_MEM);
    CHECK(carrier.waiting(kIn) == 0);
    REQUIRE(in.submit() == 0);
    carrier.push(kIn, report(2));
    REQUIRE(in.wait());
    CHECK(in.transfer->status == LIBUSB_TRANSFER_COMPLETED);
  }

  TEST_CASE("unplug: in flight transfers end without a device, and nothing can be submitted") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Async a(host, kIn, 96), b(host, kIn, 96), held(host, kOut, 56);
    carrier.hold_out(true);
    for (Async* t : {&a, &b, &held}) REQUIRE(t->submit() == 0);
    std::thread([&carrier] { carrier.unplug(); }).join();
    CHECK_FALSE(carrier.plugged());
    for (Async* t : {&a, &b, &held}) {
      REQUIRE(t->wait());
      CHECK(t->transfer->status == LIBUSB_TRANSFER_NO_DEVICE);
      CHECK(t->times == 1);
      CHECK(t->submit() == LIBUSB_ERROR_NO_DEVICE);
    }
    CHECK_FALSE(carrier.push(kIn, report(1)));
    Bytes bytes(18);
    CHECK(libusb_control_transfer(host.handle, 0x80, 6, 0x100, 0, bytes.data(), 18, kPatience_ms) ==
          LIBUSB_ERROR_NO_DEVICE);
    CHECK(libusb_release_interface(host.handle, 0) == LIBUSB_ERROR_NO_DEVICE);
  }

  TEST_CASE("unplug: a report that ended before is delivered still") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Async a(host, kIn, 96), b(host, kIn, 96);
    REQUIRE(a.submit() == 0);
    REQUIRE(b.submit() == 0);
    carrier.push(kIn, report(9));
    carrier.unplug();
    REQUIRE(b.wait());
    REQUIRE(a.done == 1);
    CHECK(a.transfer->status == LIBUSB_TRANSFER_COMPLETED);
    CHECK(a.bytes == report(9));
    CHECK(b.transfer->status == LIBUSB_TRANSFER_NO_DEVICE);
  }

  TEST_CASE("unplug: while the device takes a command, which then ends without a device") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    gadget.on_out = [&carrier](std::span<const std::uint8_t>) { carrier.unplug(); };
    Async in(host, kIn, 96), out(host, kOut, 56);
    REQUIRE(in.submit() == 0);
    REQUIRE(out.submit() == 0);
    REQUIRE(out.wait());
    REQUIRE(in.wait());
    CHECK(out.transfer->status == LIBUSB_TRANSFER_NO_DEVICE);
    CHECK(in.transfer->status == LIBUSB_TRANSFER_NO_DEVICE);
    CHECK(gadget.taken.size() == 1);
  }

  TEST_CASE("unplug at resubmit: its return code is the only sign") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Async in(host, kIn, 96);
    std::vector<int> resubmits;
    in.on_end = [&] { resubmits.push_back(libusb_submit_transfer(in.transfer)); };
    REQUIRE(in.submit() == 0);
    carrier.push(kIn, report(1));
    REQUIRE(in.wait());
    REQUIRE(resubmits == std::vector<int>{0});
    carrier.unplug_at_next_resubmit();
    CHECK(carrier.plugged());
    in.done = 0;
    carrier.push(kIn, report(2));
    REQUIRE(in.wait());
    CHECK(in.transfer->status == LIBUSB_TRANSFER_COMPLETED);
    CHECK(resubmits == std::vector<int>{0, LIBUSB_ERROR_NO_DEVICE});
    CHECK_FALSE(carrier.plugged());
    for (int k = 0; k < 20; ++k) handle_pending(host);
    CHECK(in.times == 2);  // no failed completion ever comes
  }

  TEST_CASE("replug: a new carrier, a new descriptor, the same function") {
    Gadget gadget;
    Bytes bytes(96);
    int moved = 0;
    for (std::uint8_t k = 0; k < 5; ++k) {
      UsbfsCarrier carrier(gadget);
      Host host(carrier);
      carrier.push(kIn, report(k));
      REQUIRE(host.transfer(kIn, bytes, moved) == 0);
      CHECK(bytes == report(k));
      carrier.unplug();
      CHECK(host.transfer(kIn, bytes, moved) == LIBUSB_ERROR_NO_DEVICE);
    }
  }
}

}  // namespace haptic::sim
