// SPDX-License-Identifier: Apache-2.0
// USB/IP: the bytes of the protocol, and the carrier against a client that speaks the host's side.
#include <doctest/doctest.h>

#include <random>
#include <thread>

#include "host_sim/device/usbip_carrier.hpp"
#include "tests/host_sim/usbfs_gadget.hpp"
#include "tests/host_sim/usbip_client.hpp"

namespace haptic::sim {
namespace {

using Header = std::array<std::uint8_t, kUsbipHeaderBytes>;

Header header_of(const UsbipMessage& message) {
  Header header;
  header.fill(0xee);
  encode(message, header);
  return header;
}

/// The gadget of the usbfs tests behind USB/IP, and a client.
struct Bench {
  explicit Bench(unsigned room = BusCarrier::kRoom)
      : carrier(gadget, room), client(carrier.descriptor()) {}
  UsbipAnswer answer() {
    const std::optional<UsbipAnswer> received = client.receive();
    REQUIRE(received);
    return *received;
  }
  Gadget gadget;
  UsbipCarrier carrier;
  UsbipClient client;
};

}  // namespace

TEST_SUITE("host_sim.usbip_codec") {
  TEST_CASE("encode: byte by byte as the protocol's text has it") {
    UsbipSubmit submit;
    submit.sequence = 0x01020304;
    submit.device = 0x00010002;
    submit.to_host = true;
    submit.endpoint = 1;
    submit.flags = 0x200;
    submit.byte_count = 96;
    submit.interval = 8;
    submit.setup = {1, 2, 3, 4, 5, 6, 7, 8};
    const Header begun = {0, 0, 0, 1,  1, 2, 3, 4, 0, 1, 0, 2, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 2, 0,
                          0, 0, 0, 96, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 8, 1, 2, 3, 4, 5, 6, 7, 8};
    CHECK(header_of(submit) == begun);
    const Header ended = {0, 0, 0, 3, 0, 0, 0,    9,    0,    0,    0, 0, 0, 0,
                          0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0xe0, 0, 0, 0, 4};
    CHECK(header_of(UsbipSubmitEnd{9, -EPIPE, 4}) == ended);
    const Header unlink = {0, 0, 0, 2, 0, 0, 0, 7, 0, 1, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 5};
    CHECK(header_of(UsbipUnlink{7, 0x00010002, 5}) == unlink);
    const Header unlinked = {0, 0, 0, 4, 0, 0, 0, 7, 0,    0,    0,    0,
                             0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0x98};
    CHECK(header_of(UsbipUnlinkEnd{7, -ECONNRESET}) == unlinked);
  }

  TEST_CASE("decode: refuses what no device here can do, and leaves the message alone") {
    UsbipSubmit submit;
    submit.byte_count = 64;
    const Header good = header_of(submit);
    const auto verdict = [&](std::size_t at, std::uint8_t value) {
      Header header = good;
      header[at] = value;
      UsbipMessage message = UsbipUnlink{1, 2, 3};
      const UsbipVerdict result = decode(header, message);
      if (result != UsbipVerdict::kOk) CHECK(message == UsbipMessage(UsbipUnlink{1, 2, 3}));
      return result;
    };
    CHECK(verdict(3, 1) == UsbipVerdict::kOk);
    CHECK(verdict(3, 0) == UsbipVerdict::kUnknownCommand);
    CHECK(verdict(3, 5) == UsbipVerdict::kUnknownCommand);
    CHECK(verdict(0, 1) == UsbipVerdict::kUnknownCommand);
    CHECK(verdict(15, 2) == UsbipVerdict::kBadDirection);
    CHECK(verdict(19, 15) == UsbipVerdict::kOk);
    CHECK(verdict(19, 16) == UsbipVerdict::kBadEndpoint);
    CHECK(verdict(24, 0x80) == UsbipVerdict::kBadByteCount);
    CHECK(verdict(25, 3) == UsbipVerdict::kBadByteCount);
    CHECK(verdict(35, 1) == UsbipVerdict::kIsochronous);
    Header by_text = good;
    std::fill_n(by_text.begin() + 32, 4, std::uint8_t{0xff});
    UsbipMessage message;
    CHECK(decode(by_text, message) == UsbipVerdict::kOk);
    CHECK(message == UsbipMessage(submit));
  }

  TEST_CASE("decode: any bytes are refused, or a message that encodes to itself") {
    const unsigned seed = 20260101;
    CAPTURE(seed);
    std::mt19937 random(seed);
    unsigned accepted = 0;
    for (int k = 0; k < 200000; ++k) {
      Header header;
      for (std::uint8_t& byte : header) byte = static_cast<std::uint8_t>(random());
      // Most words small, so that headers are nearly right.
      for (std::size_t word = 0; word < kUsbipHeaderBytes / 4; ++word) {
        if (random() % 4 != 0) std::fill_n(header.begin() + 4 * static_cast<long>(word), 3, 0);
        if (random() % 2 != 0) header[4 * word + 3] &= 3;
      }
      UsbipMessage message, again;
      if (decode(header, message) != UsbipVerdict::kOk) continue;
      ++accepted;
      REQUIRE(decode(header_of(message), again) == UsbipVerdict::kOk);
      REQUIRE(message == again);
    }
    CHECK(accepted > 1000);
  }
}

TEST_SUITE("host_sim.usbip_carrier") {
  TEST_CASE("IN: held until there is a report, ended in order, the newest kept") {
    Bench bench;
    const std::uint32_t first = bench.client.submit_in(kInNumber, 96);
    const std::uint32_t second = bench.client.submit_in(kInNumber, 96);
    CHECK(bench.client.is_silent());
    CHECK(bench.carrier.push(kIn, report(1)));
    CHECK(bench.carrier.push(kIn, report(2)));
    UsbipAnswer answer = bench.answer();
    CHECK(answer.end() == UsbipSubmitEnd{first, 0, 96});
    CHECK(answer.bytes == report(1));
    answer = bench.answer();
    CHECK(answer.end() == UsbipSubmitEnd{second, 0, 96});
    CHECK(answer.bytes == report(2));
    // Nobody waits: the newer one stays.
    CHECK(bench.carrier.push(kIn, report(3)));
    CHECK_FALSE(bench.carrier.push(kIn, report(4)));
    bench.client.submit_in(kInNumber, 96);
    CHECK(bench.answer().bytes == report(4));
    CHECK_FALSE(bench.carrier.push(0x82, report(5)));
    CHECK_FALSE(bench.carrier.push(kOut, report(5)));
  }

  TEST_CASE("IN: short, over-long, failing and refused transfers") {
    Bench bench(8);
    bench.client.submit_in(kInNumber, 96);
    bench.carrier.push(kIn, report(1, 20));
    CHECK(bench.answer().end().byte_count == 20);
    bench.client.submit_in(kInNumber, 96, kUsbipShortNotOk);
    bench.carrier.push(kIn, report(1, 20));
    UsbipAnswer answer = bench.answer();
    CHECK(answer.end().status == -EREMOTEIO);
    CHECK(answer.bytes == report(1, 20));
    bench.client.submit_in(kInNumber, 10);
    bench.carrier.push(kIn, report(1, 20));
    answer = bench.answer();
    CHECK(answer.end().status == -EOVERFLOW);
    CHECK(answer.bytes == report(1, 10));
    bench.carrier.fail_next(kIn, -EPROTO, 2);
    for (int k = 0; k < 3; ++k) {
      bench.client.submit_in(kInNumber, 96);
      bench.carrier.push(kIn, report(7));
      answer = bench.answer();
      CHECK(answer.end().status == (k < 2 ? -EPROTO : 0));
      CHECK(answer.bytes.size() == (k < 2 ? 0 : 96));
    }
    bench.carrier.refuse_submit(kIn, -ENOMEM, 1);
    bench.client.submit_in(kInNumber, 96);  // no report is there: at once
    CHECK(bench.answer().end().status == -ENOMEM);
    bench.client.submit_in(5, 96);
    CHECK(bench.answer().end().status == -EPIPE);
  }

  TEST_CASE("OUT: bytes arrive once and in order; what is pushed meanwhile follows") {
    Bench bench;
    bench.gadget.on_out = [&](std::span<const std::uint8_t>) {
      CHECK(bench.carrier.push(kIn, report(9)));
    };
    const std::uint32_t in = bench.client.submit_in(kInNumber, 96);
    const std::uint32_t out = bench.client.submit_out(kOutNumber, report(50, 56));
    CHECK(bench.answer().end() == UsbipSubmitEnd{out, 0, 56});
    CHECK(bench.answer().end() == UsbipSubmitEnd{in, 0, 96});
    REQUIRE(bench.gadget.taken.size() == 1);
    CHECK(bench.gadget.taken[0] == report(50, 56));
    bench.carrier.fail_next(kOut, -EPIPE, 1);
    bench.client.submit_out(kOutNumber, report(51, 56));
    CHECK(bench.answer().end().status == -EPIPE);
    CHECK(bench.gadget.taken.size() == 1);
  }

  TEST_CASE("control: what the kernel asks while it enumerates") {
    Bench bench;
    const Bytes all = bench.gadget.descriptors();
    const auto asked = [&](std::uint8_t type, std::uint8_t request, std::uint16_t value,
                           std::uint16_t index, std::uint16_t length) {
      const std::uint32_t sequence = bench.client.control(type, request, value, index, length);
      const UsbipAnswer answer = bench.answer();
      CHECK(answer.end().sequence == sequence);
      return answer;
    };
    CHECK(asked(0x80, 6, 0x0100, 0, 64).bytes == Bytes(all.begin(), all.begin() + 18));
    CHECK(asked(0x80, 6, 0x0100, 0, 8).bytes == Bytes(all.begin(), all.begin() + 8));
    CHECK(asked(0x80, 6, 0x0200, 0, 9).bytes == Bytes(all.begin() + 18, all.begin() + 27));
    CHECK(asked(0x80, 6, 0x0200, 0, 512).bytes == Bytes(all.begin() + 18, all.end()));
    CHECK(asked(0x80, 6, 0x0201, 0, 512).end().status == -EPIPE);
    CHECK(asked(0x80, 6, 0x0301, 0x0409, 255).end().status == -EPIPE);  // the gadget has no text
    CHECK(asked(0x80, 8, 0, 0, 1).bytes == Bytes{1});
    CHECK(asked(0x80, 0, 0, 0, 2).bytes == Bytes{0, 0});
    CHECK(asked(0x81, 10, 0, 0, 1).bytes == Bytes{0});
    CHECK(asked(0x82, 0, 0, kIn, 2).bytes == Bytes{0, 0});
    CHECK(asked(0x82, 0, 0, 0x85, 2).end().status == -EPIPE);
    bench.gadget.requests.clear();
    CHECK(asked(0x00, 9, 1, 0, 0).end().status == 0);
    CHECK(asked(0x02, 1, 0, kIn, 0).end().status == 0);
    REQUIRE(bench.gadget.requests.size() == 2);
    CHECK(bench.gadget.requests[0] == std::array<std::uint8_t, 4>{0x00, 9, 1, 0});
    CHECK(bench.gadget.requests[1] == std::array<std::uint8_t, 4>{0x02, 1, 0, kIn});
    CHECK(asked(0xc0, 7, 0x21, 3, 16).bytes == report(0x24, 16));
    bench.client.control(0x40, 8, 0, 0, 12, report(9, 12));
    CHECK(bench.answer().end().byte_count == 12);
    CHECK(bench.gadget.taken.back() == report(9, 12));
    CHECK(asked(0x40, 99, 0, 0, 0).end().status == -EPIPE);
    bench.carrier.fail_next(0, -EPROTO, 1);
    CHECK(asked(0x80, 8, 0, 0, 1).end().status == -EPROTO);
  }

  TEST_CASE("control: a setup that asks for more than there is room gets the room") {
    Bench bench;
    UsbipSubmit submit;
    submit.sequence = 1;
    submit.to_host = true;
    submit.byte_count = 4;
    submit.setup = {0x80, 6, 0, 1, 0, 0, 64, 0};
    const Header header = header_of(submit);
    bench.client.submit_out(kOutNumber, {});  // so that the client knows sequence 1
    CHECK(bench.answer().end().sequence == 1);
    bench.client.send_raw(header);
    CHECK(bench.answer().end() == UsbipSubmitEnd{1, 0, 4});
  }

  TEST_CASE("unlink: a held transfer is taken back and answered once") {
    Bench bench;
    const std::uint32_t kept = bench.client.submit_in(kInNumber, 96);
    const std::uint32_t target = bench.client.submit_in(kInNumber, 96);
    const std::uint32_t unlink = bench.client.unlink(target);
    CHECK(bench.answer().unlinked() == UsbipUnlinkEnd{unlink, -ECONNRESET});
    bench.carrier.push(kIn, report(1));
    CHECK(bench.answer().end().sequence == kept);
    bench.carrier.push(kIn, report(2));  // nobody waits for it any more
    CHECK(bench.client.is_silent());
    const std::uint32_t late = bench.client.unlink(kept);
    CHECK(bench.answer().unlinked() == UsbipUnlinkEnd{late, 0});
  }

  TEST_CASE("unplug: the host finds its end hung up, at once or behind a report") {
    SUBCASE("at once") {
      Bench bench;
      bench.client.submit_in(kInNumber, 96);
      CHECK(bench.client.is_silent());
      bench.carrier.unplug();
      CHECK_FALSE(bench.client.receive());
      CHECK_FALSE(bench.carrier.plugged());
      CHECK_FALSE(bench.carrier.push(kIn, report(1)));
    }
    SUBCASE("behind a report") {
      Bench bench;
      bench.client.submit_in(kInNumber, 96);
      bench.client.submit_in(kInNumber, 96);
      CHECK(bench.client.is_silent());
      bench.carrier.unplug_at_next_resubmit();
      CHECK(bench.carrier.push(kIn, report(1)));
      CHECK(bench.answer().bytes == report(1));
      CHECK_FALSE(bench.client.receive());
    }
    SUBCASE("while the device is at a transfer") {
      Bench bench;
      bench.gadget.on_out = [&](std::span<const std::uint8_t>) { bench.carrier.unplug(); };
      bench.client.submit_out(kOutNumber, report(1, 56));
      CHECK_FALSE(bench.client.receive());
    }
    SUBCASE("by the host") {
      Bench bench;
      shutdown(bench.carrier.descriptor(), SHUT_RDWR);
      while (bench.carrier.plugged()) std::this_thread::yield();
      CHECK_FALSE(bench.carrier.push(kIn, report(1)));
    }
  }

  TEST_CASE("hostile host: cut off, for anything that it sends or does not take") {
    SUBCASE("not a command") {
      Bench bench;
      bench.client.send_raw(Bytes(kUsbipHeaderBytes, 0xff));
      CHECK_FALSE(bench.client.receive());
    }
    SUBCASE("an answer, which is not its to give") {
      Bench bench;
      bench.client.send_raw(header_of(UsbipSubmitEnd{1, 0, 0}));
      CHECK_FALSE(bench.client.receive());
    }
    SUBCASE("takes nothing") {
      Bench bench;
      while (bench.carrier.plugged()) bench.client.control(0x80, 6, 0x0200, 0, 512);
      CHECK_FALSE(bench.carrier.plugged());
    }
    SUBCASE("nearly right streams") {
      const unsigned seed = 7;
      CAPTURE(seed);
      std::mt19937 random(seed);
      for (int connection = 0; connection < 300; ++connection) {
        Bench bench;
        for (int k = 0; k < 40; ++k) {
          UsbipSubmit submit;
          submit.sequence = static_cast<std::uint32_t>(random() % 64);
          submit.to_host = random() % 2 == 0;
          submit.endpoint = static_cast<std::uint8_t>(random() % 3);
          submit.byte_count = static_cast<std::uint32_t>(random() % 200);
          for (std::uint8_t& byte : submit.setup) byte = static_cast<std::uint8_t>(random() % 12);
          const auto target = static_cast<std::uint32_t>(random() % 64);
          Header header = random() % 4 == 0 ? header_of(UsbipUnlink{submit.sequence, 0, target})
                                            : header_of(submit);
          if (random() % 16 == 0)
            header[random() % header.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
          bench.client.send_raw(header);
          if (!submit.to_host) bench.client.send_raw(report(1, submit.byte_count));
          if (random() % 4 == 0) bench.carrier.push(kIn, report(2));
        }
        bench.carrier.close();
        CHECK_FALSE(bench.carrier.plugged());
      }
    }
  }
}

}  // namespace haptic::sim
