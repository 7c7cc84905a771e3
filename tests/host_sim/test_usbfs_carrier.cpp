// SPDX-License-Identifier: Apache-2.0
// The real libusb over the USB device that is not there.
#include <doctest/doctest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <optional>
#include <thread>
#include <vector>

#include "host_sim/device/descriptor_answer.hpp"
#include "tests/host_sim/usbfs_gadget.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {

TEST_SUITE("host_sim.usbfs_carrier") {
  TEST_CASE("wrap: libusb sees descriptors, speed and the active configuration") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    libusb_device* device = libusb_get_device(host.handle);
    libusb_device_descriptor identity{};
    REQUIRE(libusb_get_device_descriptor(device, &identity) == 0);
    CHECK(identity.idVendor == 0x1209);
    CHECK(identity.idProduct == 1);
    CHECK(libusb_get_device_speed(device) == LIBUSB_SPEED_HIGH);
    libusb_config_descriptor* configuration = nullptr;
    REQUIRE(libusb_get_active_config_descriptor(device, &configuration) == 0);
    CHECK(configuration->bConfigurationValue == 1);
    REQUIRE(configuration->bNumInterfaces == 1);
    const libusb_interface_descriptor& face = configuration->interface[0].altsetting[0];
    REQUIRE(face.bNumEndpoints == 2);
    CHECK(face.endpoint[0].bEndpointAddress == kIn);
    CHECK(face.endpoint[1].wMaxPacketSize == 56);
    libusb_free_config_descriptor(configuration);
    int value = 0;
    CHECK(libusb_get_configuration(host.handle, &value) == 0);
    CHECK(value == 1);
    CHECK(libusb_kernel_driver_active(host.handle, 0) == 0);
    CHECK(libusb_claim_interface(host.handle, 5) == LIBUSB_ERROR_NOT_FOUND);
    Bytes bytes(8);
    int moved = 0;
    CHECK(host.transfer(0x82, bytes, moved) == LIBUSB_ERROR_IO);  // ENOENT, which it does not name
  }

  TEST_CASE("control: both directions, standard requests, refusal as a stall") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Bytes bytes(16);
    REQUIRE(libusb_control_transfer(host.handle, 0xc0, 7, 0x21, 3, bytes.data(), 16,
                                    kPatience_ms) == 16);
    CHECK(bytes == report(0x24, 16));
    bytes = report(9, 12);
    REQUIRE(libusb_control_transfer(host.handle, 0x40, 8, 0, 0, bytes.data(), 12, kPatience_ms) ==
            12);
    REQUIRE(gadget.taken.size() == 1);
    CHECK(gadget.taken[0] == bytes);
    CHECK(libusb_control_transfer(host.handle, 0x40, 99, 0, 0, nullptr, 0, kPatience_ms) ==
          LIBUSB_ERROR_PIPE);
    Bytes device(18);
    REQUIRE(libusb_get_descriptor(host.handle, LIBUSB_DT_DEVICE, 0, device.data(), 18) == 18);
    Bytes expected = gadget.descriptors();
    expected.resize(18);
    CHECK(device == expected);
    gadget.requests.clear();
    CHECK(libusb_clear_halt(host.handle, kIn) == 0);
    CHECK(libusb_set_interface_alt_setting(host.handle, 0, 0) == 0);
    CHECK(libusb_set_interface_alt_setting(host.handle, 0, 1) == LIBUSB_ERROR_NOT_FOUND);
    CHECK(libusb_set_configuration(host.handle, 1) == 0);
    CHECK(libusb_clear_halt(host.handle, 0x85) == LIBUSB_ERROR_NOT_FOUND);
    CHECK(libusb_reset_device(host.handle) == 0);
    REQUIRE(gadget.requests.size() == 4);
    CHECK(gadget.requests[0] == std::array<std::uint8_t, 4>{0x02, 1, 0, kIn});
    CHECK(gadget.requests[1] == std::array<std::uint8_t, 4>{0x01, 11, 0, 0});
    CHECK(gadget.requests[2] == std::array<std::uint8_t, 4>{0x00, 9, 1, 0});
    CHECK(gadget.requests[3] == gadget.requests[2]);  // a reset configures again
  }

  TEST_CASE("sync: reports and commands pass; a report ends the transfer that waits for it") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Bytes bytes(96);
    int moved = 0;
    for (std::uint8_t k = 0; k < 200; ++k) {
      CHECK(carrier.push(kIn, report(k)));
      REQUIRE(host.transfer(kIn, bytes, moved) == 0);
      CHECK(moved == 96);
      CHECK(bytes == report(k));
      Bytes command = report(static_cast<std::uint8_t>(k + 1), 56);
      REQUIRE(host.transfer(kOut, command, moved) == 0);
      CHECK(moved == 56);
      CHECK(gadget.taken.back() == command);
    }
    // Now the host waits first, and the report comes from another thread.
    std::thread device([&carrier] {
      while (carrier.waiting(kIn) == 0) std::this_thread::yield();
      carrier.push(kIn, report(77, 40));
    });
    const int status = host.transfer(kIn, bytes, moved);
    device.join();
    REQUIRE(status == 0);
    CHECK(moved == 40);
    CHECK(Bytes(bytes.begin(), bytes.begin() + 40) == report(77, 40));
  }

  TEST_CASE("sync: nothing to read times out, and the late report serves the next transfer") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Bytes bytes(96);
    int moved = -1;
    CHECK(host.transfer(kIn, bytes, moved, 20) == LIBUSB_ERROR_TIMEOUT);
    CHECK(moved == 0);
    CHECK(carrier.waiting(kIn) == 0);
    CHECK(carrier.push(kIn, report(5)));
    REQUIRE(host.transfer(kIn, bytes, moved) == 0);
    CHECK(bytes == report(5));
  }

  TEST_CASE("push: what nobody waits for is kept, and the oldest goes first out of the door") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget, 3);
    Host host(carrier);
    for (std::uint8_t k = 1; k <= 3; ++k) CHECK(carrier.push(kIn, report(k)));
    CHECK_FALSE(carrier.push(kIn, report(4)));
    CHECK_FALSE(carrier.push(kOut, report(4)));
    CHECK_FALSE(carrier.push(0x83, report(4)));
    Bytes bytes(96);
    int moved = 0;
    for (std::uint8_t k = 2; k <= 4; ++k) {
      REQUIRE(host.transfer(kIn, bytes, moved) == 0);
      CHECK(bytes == report(k));
    }
    CHECK(host.transfer(kIn, bytes, moved, 10) == LIBUSB_ERROR_TIMEOUT);
  }

  TEST_CASE("async: three transfers end in the order of their submission, once each") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Async a(host, kIn, 96), b(host, kIn, 96), c(host, kIn, 96);
    std::vector<int> order;
    a.on_end = [&order] { order.push_back(0); };
    b.on_end = [&order] { order.push_back(1); };
    c.on_end = [&order] { order.push_back(2); };
    for (Async* t : {&a, &b, &c}) REQUIRE(t->submit() == 0);
    CHECK(carrier.waiting(kIn) == 3);
    for (std::uint8_t k = 1; k <= 3; ++k) CHECK(carrier.push(kIn, report(k)));
    CHECK(carrier.waiting(kIn) == 0);
    REQUIRE(c.wait());
    CHECK(order == std::vector<int>{0, 1, 2});
    CHECK(a.bytes == report(1));
    CHECK(c.bytes == report(3));
    CHECK((a.times == 1 && b.times == 1 && c.times == 1));
  }

  TEST_CASE("async: an answer pushed while the device takes a command ends after the command") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Async in(host, kIn, 96), out(host, kOut, 56);
    std::vector<char> order;
    in.on_end = [&order] { order.push_back('i'); };
    out.on_end = [&order] { order.push_back('o'); };
    gadget.on_out = [&carrier](std::span<const std::uint8_t> bytes) {
      carrier.push(kIn, report(bytes[0]));
    };
    for (int k = 0; k < 50; ++k) {
      out.bytes[0] = static_cast<std::uint8_t>(k);
      REQUIRE(in.submit() == 0);
      REQUIRE(out.submit() == 0);
      REQUIRE(in.wait());
      REQUIRE(out.wait());
      CHECK(in.bytes == report(static_cast<std::uint8_t>(k)));
    }
    REQUIRE(order.size() == 100);
    for (std::size_t k = 0; k < order.size(); ++k) CHECK(order[k] == (k % 2 == 0 ? 'o' : 'i'));
  }

  TEST_CASE("cancel: the transfer ends cancelled, and the report that comes then is kept") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    Async in(host, kIn, 96);
    REQUIRE(in.submit() == 0);
    REQUIRE(libusb_cancel_transfer(in.transfer) == 0);
    CHECK(carrier.waiting(kIn) == 0);
    CHECK(in.times == 0);
    CHECK(carrier.push(kIn, report(3)));
    REQUIRE(in.wait());
    CHECK(in.transfer->status == LIBUSB_TRANSFER_CANCELLED);
    CHECK(libusb_cancel_transfer(in.transfer) == LIBUSB_ERROR_NOT_FOUND);
    REQUIRE(in.submit() == 0);
    REQUIRE(in.wait());
    CHECK(in.transfer->status == LIBUSB_TRANSFER_COMPLETED);
    CHECK(in.bytes == report(3));
  }

  TEST_CASE("hold: OUT transfers stay in flight, then go in order; a held one can be cancelled") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    carrier.hold_out(true);
    Async a(host, kOut, 8), b(host, kOut, 8), c(host, kOut, 8);
    a.bytes[0] = 1, b.bytes[0] = 2, c.bytes[0] = 3;
    for (Async* t : {&a, &b, &c}) REQUIRE(t->submit() == 0);
    handle_pending(host);
    CHECK(carrier.waiting(kOut) == 3);
    CHECK(gadget.taken.empty());
    REQUIRE(libusb_cancel_transfer(b.transfer) == 0);
    carrier.hold_out(false);
    REQUIRE(c.wait());
    REQUIRE(a.done == 1);
    REQUIRE(b.done == 1);
    CHECK(b.transfer->status == LIBUSB_TRANSFER_CANCELLED);
    REQUIRE(gadget.taken.size() == 2);
    CHECK(gadget.taken[0][0] == 1);
    CHECK(gadget.taken[1][0] == 3);
  }

  TEST_CASE("close: in order with an event thread; releasing cancels what is in flight") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    std::optional<Host> host(std::in_place, carrier);
    std::atomic<bool> stop = false;
    std::thread events([&] {
      while (!stop) {
        timeval pause{0, 50000};
        libusb_handle_events_timeout_completed(host->context, &pause, nullptr);
      }
    });
    std::atomic<int> ended = 0;
    {
      Async in(*host, kIn, 96), out(*host, kOut, 56);
      for (Async* t : {&in, &out}) t->on_end = [&ended] { ++ended; };
      carrier.hold_out(true);
      REQUIRE(in.submit() == 0);
      REQUIRE(out.submit() == 0);
      CHECK(carrier.waiting(kIn) + carrier.waiting(kOut) == 2);
      REQUIRE(libusb_release_interface(host->handle, 0) == 0);
      while (ended < 2) std::this_thread::yield();
      // libusb did not ask for it, and takes what the kernel cancelled for an empty transfer.
      for (const Async* t : {&in, &out}) {
        CHECK(t->transfer->status == LIBUSB_TRANSFER_COMPLETED);
        CHECK(t->transfer->actual_length == 0);
      }
      CHECK(gadget.taken.empty());
    }
    CHECK(carrier.waiting(kIn) + carrier.waiting(kOut) == 0);
    stop = true;
    libusb_interrupt_event_handler(host->context);
    events.join();
    CHECK(libusb_claim_interface(host->handle, 0) == 0);
    host.reset();
  }

  TEST_CASE("threads: a device thread and an event thread, every report once and in order") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget, 100000);
    Host host(carrier);
    constexpr int kReports = 4000;
    std::atomic<int> commands = 0;
    gadget.on_out = [&commands](std::span<const std::uint8_t>) { ++commands; };
    std::thread device([&carrier] {
      for (int k = 0; k < kReports; ++k) {
        const std::array<std::uint8_t, 4> bytes = {static_cast<std::uint8_t>(k),
                                                   static_cast<std::uint8_t>(k >> 8), 0, 0};
        carrier.push(kIn, bytes);
        if (k % 16 == 0) std::this_thread::yield();
      }
    });
    Async a(host, kIn, 4), b(host, kIn, 4), out(host, kOut, 8);
    int received = 0, wrong = 0;
    for (Async* t : {&a, &b}) {
      t->on_end = [t, &received, &wrong] {
        const int k = t->bytes[0] | t->bytes[1] << 8;
        if (k != received || t->transfer->status != LIBUSB_TRANSFER_COMPLETED) ++wrong;
        ++received;
        if (received + 1 < kReports && libusb_submit_transfer(t->transfer) != 0) ++wrong;
      };
      REQUIRE(t->submit() == 0);
    }
    int sent = 0;
    while (received < kReports && wrong == 0) {
      REQUIRE(out.submit() == 0);
      ++sent;
      REQUIRE(out.wait());
    }
    device.join();
    CHECK(wrong == 0);
    CHECK(received == kReports);
    CHECK(commands == sent);
  }

  TEST_CASE("interposer: other descriptors are the kernel's, with and without a device") {
    std::array<int, 2> ends{};
    REQUIRE(pipe(ends.data()) == 0);
    Gadget gadget;
    for (int round = 0; round < 2; ++round) {
      std::optional<UsbfsCarrier> carrier;
      if (round == 1) carrier.emplace(gadget);
      char c = 0;
      REQUIRE(write(ends[1], "x", 1) == 1);
      CHECK(read(ends[0], &c, 1) == 1);
      CHECK(c == 'x');
      CHECK(lseek(ends[0], 0, SEEK_SET) == -1);
      CHECK(errno == ESPIPE);
      CHECK(read(-1, &c, 1) == -1);
      CHECK(errno == EBADF);
      CHECK(answer_of(ends[0]) == nullptr);
      if (carrier) CHECK(answer_of(carrier->descriptor()) != nullptr);
    }
    close(ends[0]);
    close(ends[1]);
    int descriptor = -1;
    {
      UsbfsCarrier carrier(gadget);
      descriptor = carrier.descriptor();
      Bytes bytes(300);
      REQUIRE(lseek(descriptor, 18, SEEK_SET) == 18);
      CHECK(read(descriptor, bytes.data(), bytes.size()) == 32);
      CHECK(bytes[1] == 2);
    }
    CHECK(answer_of(descriptor) == nullptr);
  }

  TEST_CASE("descriptors that are none are refused") {
    struct Broken : Gadget {
      [[nodiscard]] Bytes descriptors() const override { return bytes; }
      Bytes bytes;
    } broken;
    CHECK_THROWS_AS(UsbfsCarrier{broken}, tools::InputError);
    for (const std::size_t at : {0u, 1u, 18u, 19u, 21u, 27u, 36u}) {
      broken.bytes = Gadget().descriptors();
      broken.bytes[at] = at == 21u ? 9 : 200;
      CAPTURE(at);
      CHECK_THROWS_AS(UsbfsCarrier{broken}, tools::InputError);
    }
  }
}

}  // namespace haptic::sim
