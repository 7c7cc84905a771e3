// SPDX-License-Identifier: Apache-2.0
/// The makers' own libraries read and write the emulated servos: proof that these speak the
/// published protocols, not ours. Left out, with a message, where the libraries are not installed.
#include <doctest/doctest.h>

#include "tests/bridges/arms/dynamixel_emulator.hpp"
#include "tests/bridges/arms/feetech_emulator.hpp"
#include "tests/support/program_run.hpp"
#include "tests/support/text_search.hpp"

namespace {

constexpr int kNotThere = 77;

void check_by(const std::string& script, const std::string& port, const char* package) {
  const std::string path = std::string(HAPTIC_TEST_DIR) + "/bridges/arms/" + script;
  const auto result =
      haptic::sim::test::run_program(HAPTIC_SERIAL_PYTHON, "'" + path + "' '" + port + "' 3");
  if (result.exit_code == kNotThere) {
    MESSAGE("not checked: pip install " << package);
    return;
  }
  CAPTURE(result.err);
  CHECK(result.exit_code == 0);
  CHECK(haptic::test::has(result.out, "the official SDK has read and written 3 servos"));
}

}  // namespace

TEST_SUITE("bridges.official_sdks") {
  TEST_CASE("dynamixel-sdk: ping, read, write, errors, stuffing, sync write, fast sync read") {
    haptic::test::DynamixelEmulator bus(3, 1220);
    bus.with([](auto& b) {
      for (int id = 1; id <= 3; ++id)
        haptic::test::DynamixelEmulator::set(b.servo(id), 132, 4, 2048 + id);
    });
    check_by("dynamixel_sdk_check.py", bus.path(), "dynamixel-sdk");
  }

  TEST_CASE("ftservo-python-sdk: ping, read, write, signs, sync read") {
    haptic::test::FeetechEmulator bus(3);
    bus.with([](auto& b) {
      for (int id = 1; id <= 3; ++id)
        haptic::test::FeetechEmulator::turn(b.servo(id), 2048 - 700 * id);
    });
    check_by("feetech_sdk_check.py", bus.path(), "ftservo-python-sdk");
  }
}
