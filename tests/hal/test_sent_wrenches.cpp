// SPDX-License-Identifier: Apache-2.0
// The wrench that a device may have now, against a device that accepts commands late, never, or in
// jumps.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "hal/usb/sent_wrenches.hpp"

using namespace haptic;
using namespace haptic::hal;

namespace {

Wrench push(double force_n) {
  Wrench w;
  w.force_w[2] = static_cast<Real>(force_n);
  w.torque_w[0] = static_cast<Real>(force_n / 10);
  return w;
}

CommandReceipt receipt(std::uint32_t sent, std::uint32_t accepted, bool drives_on = true) {
  return {true, drives_on, sent, accepted, 0};
}

}  // namespace

TEST_SUITE("hal.sent_wrenches") {
  TEST_CASE("a device that says nothing of commands has the last one") {
    SentWrenches s;
    s.sent(push(4), {});
    s.sent(push(1), {});
    s.told({});
    CHECK(s.held().force_n == doctest::Approx(1));
    CHECK(s.held().torque_nm == doctest::Approx(0.1));
  }

  TEST_CASE("deaf: the force stays the one accepted, for as long as zeros are sent") {
    SentWrenches s;
    s.told(receipt(10, 10));
    s.sent(push(6), receipt(11, 10));
    s.told(receipt(11, 11));
    CHECK(s.held().force_n == doctest::Approx(6));
    for (std::uint32_t k = 12; k < 1000; ++k) {
      s.sent(push(0), receipt(k, 11));
      s.told(receipt(k, 11));
      CHECK(s.held().force_n == doctest::Approx(6));
    }
    s.told(receipt(999, 999));
    CHECK(s.held().force_n == 0);
  }

  TEST_CASE("accepted: the very wrench of the command that the device names, or none") {
    SentWrenches s;
    CHECK(s.accepted() == nullptr);
    s.told(receipt(10, 10));
    REQUIRE(s.accepted() != nullptr);
    CHECK(s.accepted()->force_w.norm() == 0);
    s.sent(push(6), receipt(11, 10));
    s.sent(push(4), receipt(12, 10));
    CHECK(s.accepted()->force_w.norm() == 0);
    s.told(receipt(12, 11));
    CHECK(static_cast<double>(s.accepted()->force_w[2]) == doctest::Approx(6));
    s.told(receipt(12, 11, false));
    CHECK(s.accepted()->force_w.norm() == 0);
  }

  TEST_CASE("drives that are off exert nothing; a zero command that is newer than all is one") {
    SentWrenches s;
    s.told(receipt(0, 0));
    s.sent(push(6), receipt(1, 0));
    s.told(receipt(1, 1));
    s.told(receipt(1, 1, false));
    CHECK(s.held().force_n == 0);
    s.told(receipt(1, 1));
    s.sent(push(5), receipt(2, 1));
    s.told(receipt(2, 2 + (1u << 30)));
    CHECK(s.held().force_n == 0);
  }

  TEST_CASE("never less than a device that lags and skips has") {
    std::mt19937 random(5);
    for (int round = 0; round < 200; ++round) {
      SentWrenches s;
      s.begin();
      std::vector<double> forces{0};
      std::uint32_t accepted = 0xffff'ff00u;  // wraps on the way
      const std::uint32_t first = accepted;
      s.told(receipt(accepted, accepted));
      std::uint32_t sent = accepted;
      for (int k = 0; k < 1000; ++k) {
        if (random() % 3 != 0) {
          forces.push_back(static_cast<double>(random() % 1000) / 100);
          s.sent(push(forces.back()), receipt(++sent, accepted));
        }
        if (random() % 100 < (round % 2 == 0 ? 50u : 2u))
          accepted += static_cast<std::uint32_t>(random()) % (sent - accepted + 1);
        s.told(receipt(sent, accepted));
        REQUIRE(s.held().force_n >= forces[accepted - first] - 1e-6);
        // And no more than the most that it can have got since.
        const double most = *std::max_element(
            forces.begin() + std::max<std::ptrdiff_t>(accepted - first, 0), forces.end());
        if (sent - accepted < 60) REQUIRE(s.held().force_n <= most + 1e-6);
      }
    }
  }
}
