// SPDX-License-Identifier: Apache-2.0
// The real libusb over the USB device that is not there.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <libusb.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "host_sim/device/descriptor_answer.hpp"
#include "host_sim/device/usbfs_carrier.hpp"
#include "tools/common/error.hpp"

namespace haptic::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint8_t kIn = 0x81, kOut = 0x01;
constexpr unsigned kPatience_ms = 20000;  // bounds a test that hangs; no test waits for it

/// Interface 0 with an interrupt endpoint each way; answers what the test says.
class Gadget : public UsbFunction {
 public:
  [[nodiscard]] Bytes descriptors() const override {
    return {18, 1, 0x00, 2,  0xff, 0, 0,  64, 0x09, 0x12, 1, 0,    0, 1,  1, 2,    3,
            1,  9, 2,    32, 0,    1, 1,  0,  0x80, 50,   9, 4,    0, 0,  2, 0xff, 0,
            0,  0, 7,    5,  kIn,  3, 96, 0,  1,    7,    5, kOut, 3, 56, 0, 1};
  }
  [[nodiscard]] int speed() const override { return 3; }
  int control(std::uint8_t request_type, std::uint8_t request, std::uint16_t value,
              std::uint16_t index, std::span<std::uint8_t> bytes) override {
    requests.push_back({request_type, request, static_cast<std::uint8_t>(value),
                        static_cast<std::uint8_t>(index)});
    if (request_type == 0xc0 && request == 7) {
      for (std::size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = static_cast<std::uint8_t>(value + index + i);
      return static_cast<int>(bytes.size());
    }
    if (request_type == 0x40 && request == 8) {
      taken.emplace_back(bytes.begin(), bytes.end());
      return static_cast<int>(bytes.size());
    }
    return request_type == 0x02 || request_type == 0x00 || request_type == 0x01 ? 0 : -EPIPE;
  }
  int out(std::uint8_t, std::span<const std::uint8_t> bytes) override {
    taken.emplace_back(bytes.begin(), bytes.end());
    if (on_out) on_out(bytes);
    return static_cast<int>(bytes.size());
  }

  std::vector<Bytes> taken;
  std::vector<std::array<std::uint8_t, 4>> requests;
  std::function<void(std::span<const std::uint8_t>)> on_out;
};

/// libusb on the carrier, interface claimed.
struct Host {
  explicit Host(const UsbfsCarrier& carrier) {
    // Per process and for the contexts made after it; set again each time it does no harm.
    libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
    REQUIRE(libusb_init(&context) == 0);
    REQUIRE(libusb_wrap_sys_device(context, carrier.descriptor(), &handle) == 0);
    REQUIRE(libusb_claim_interface(handle, 0) == 0);
  }
  ~Host() {
    libusb_release_interface(handle, 0);
    libusb_close(handle);
    libusb_exit(context);
  }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  int transfer(std::uint8_t endpoint, Bytes& bytes, int& moved,
               unsigned timeout_ms = kPatience_ms) {
    return libusb_interrupt_transfer(handle, endpoint, bytes.data(), static_cast<int>(bytes.size()),
                                     &moved, timeout_ms);
  }

  libusb_context* context = nullptr;
  libusb_device_handle* handle = nullptr;
};

/// One asynchronous transfer and what became of it.
struct Async {
  Async(Host& host_, std::uint8_t endpoint, std::size_t size) : host(host_), bytes(size) {
    transfer = libusb_alloc_transfer(0);
    libusb_fill_interrupt_transfer(transfer, host.handle, endpoint, bytes.data(),
                                   static_cast<int>(size), &Async::ended, this, 0);
  }
  ~Async() { libusb_free_transfer(transfer); }
  Async(const Async&) = delete;
  Async& operator=(const Async&) = delete;

  int submit() {
    done = 0;
    return libusb_submit_transfer(transfer);
  }
  static void LIBUSB_CALL ended(libusb_transfer* transfer) {
    auto& self = *static_cast<Async*>(transfer->user_data);
    self.done = 1;
    ++self.times;
    if (self.on_end) self.on_end();
  }
  /// Handles events until this transfer has ended.
  [[nodiscard]] bool wait() {
    const auto begin = std::chrono::steady_clock::now();
    while (done == 0) {
      timeval pause{0, 100000};
      if (libusb_handle_events_timeout_completed(host.context, &pause, &done) != 0) return false;
      if (std::chrono::steady_clock::now() - begin > std::chrono::milliseconds(kPatience_ms))
        return false;
    }
    return true;
  }

  Host& host;
  Bytes bytes;
  libusb_transfer* transfer = nullptr;
  std::function<void()> on_end;
  int done = 0;
  unsigned times = 0;
};

Bytes report(std::uint8_t first, std::size_t size = 96) {
  Bytes bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(first + i);
  return bytes;
}

/// Handles what there is, without waiting.
void handle_pending(Host& host) {
  timeval none{0, 0};
  CHECK(libusb_handle_events_timeout_completed(host.context, &none, nullptr) == 0);
}

}  // namespace

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
    CHECK(host.transfer(0x82, bytes, moved) == LIBUSB_ERROR_NOT_FOUND);
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
    CHECK(device == Bytes(gadget.descriptors().begin(), gadget.descriptors().begin() + 18));
    gadget.requests.clear();
    CHECK(libusb_clear_halt(host.handle, kIn) == 0);
    CHECK(libusb_set_interface_alt_setting(host.handle, 0, 0) == 0);
    CHECK(libusb_set_interface_alt_setting(host.handle, 0, 1) == LIBUSB_ERROR_NOT_FOUND);
    CHECK(libusb_set_configuration(host.handle, 1) == 0);
    CHECK(libusb_clear_halt(host.handle, 0x85) == LIBUSB_ERROR_NOT_FOUND);
    CHECK(libusb_reset_device(host.handle) == 0);
    REQUIRE(gadget.requests.size() == 3);
    CHECK(gadget.requests[0] == std::array<std::uint8_t, 4>{0x02, 1, 0, kIn});
    CHECK(gadget.requests[1] == std::array<std::uint8_t, 4>{0x01, 11, 0, 0});
    CHECK(gadget.requests[2] == std::array<std::uint8_t, 4>{0x00, 9, 1, 0});
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

  TEST_CASE("faults: stall, babble, bus error and over-long reports, then all is well again") {
    Gadget gadget;
    UsbfsCarrier carrier(gadget);
    Host host(carrier);
    const std::pair<int, libusb_transfer_status> cases[] = {{-EPIPE, LIBUSB_TRANSFER_STALL},
                                                            {-EOVERFLOW, LIBUSB_TRANSFER_OVERFLOW},
                                                            {-EPROTO, LIBUSB_TRANSFER_ERROR}};
    Async in(host, kIn, 96), out(host, kOut, 56);
    for (const auto& [fault, status] : cases) {
      CAPTURE(fault);
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
      CHECK(in.transfer->status == LIBUSB_TRANSFER_CANCELLED);
      CHECK(out.transfer->status == LIBUSB_TRANSFER_CANCELLED);
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
