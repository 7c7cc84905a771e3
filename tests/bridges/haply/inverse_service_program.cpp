// SPDX-License-Identifier: Apache-2.0
// A stand-in for Haply's Inverse service to try a client with, without hardware: the handle of an
// Inverse3 goes 4 cm down and up again every 4 s, with button a of its grip pressed but for the
// first half second of them.
//   inverse_service_stand_in 3.1|3.5|3.0 [HTTP_PORT WEBSOCKET_PORT [SECONDS]]
// It prints a line once it listens, and once a second the force that it would exert.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "tests/bridges/haply/inverse_service.hpp"

int main(int count, char** words) {
  using haptic::test::InverseKind;
  const std::string version = count > 1 ? words[1] : "";
  if (version != "3.0" && version != "3.1" && version != "3.5") {
    std::fprintf(stderr,
                 "inverse_service_stand_in: '%s' is no version; 3.1, 3.5 or 3.0, then two ports "
                 "(10000 10001), then seconds\n",
                 version.c_str());
    return 2;
  }
  const auto number = [&](int at, double otherwise) {
    return count > at ? std::atof(words[at]) : otherwise;
  };
  const InverseKind kind = version == "3.0"   ? InverseKind::k30
                           : version == "3.1" ? InverseKind::k31
                                              : InverseKind::k35;
  try {
    haptic::test::InverseService service(kind, version + ".0.0",
                                         static_cast<std::uint16_t>(number(2, 10000)),
                                         static_cast<std::uint16_t>(number(3, 10001)));
    std::printf("listens: HTTP %u, WebSocket %u\n", unsigned{service.http_port()},
                unsigned{service.websocket_port()});
    std::fflush(stdout);
    const double seconds = number(4, 1e9);
    for (int k = 0; k * 0.001 < seconds; ++k) {
      haptic::test::TableDevice device = service.device();
      const double turn = k * 0.001 * 2 * 3.14159265358979 / 4;
      device.position_m[2] = 0.15 - 0.02 * (1 - std::cos(turn));
      device.velocity_m_per_s[2] = -0.02 * std::sin(turn) * 2 * 3.14159265358979 / 4;
      device.a = k % 4000 >= 500;
      service.set(device);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (k % 1000 != 999) continue;
      const auto log = service.log();
      if (log.empty()) continue;
      std::printf("%u messages, %u sessions, force %.3f %.3f %.3f N\n", service.messages(),
                  service.sessions(), log.back().force_n[0], log.back().force_n[1],
                  log.back().force_n[2]);
      std::fflush(stdout);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "inverse_service_stand_in: %s\n", error.what());
    return 4;
  }
  return 0;
}
