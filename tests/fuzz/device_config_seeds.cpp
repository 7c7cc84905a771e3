// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_device_config: the least, every key, each driver, and what is refused late. The
/// scene is only looked for, so that any file will do.
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  const std::string file(1, '\0'), sim(1, '\x01'), falcon(1, '\x03'), spacemouse(1, '\x04');
  const std::string scene = "scene = \"/proc/self/maps\"\n";
  const std::string reference = scene + "[device]\ndriver = \"reference\"\n";
  return {
      {"least", file + scene + "[device]\ndriver = \"sim\"\n"},
      {"command_line", sim + scene},
      {"every_key",
       file + reference +
           "address = \"1209:0001:A7\"\n[loop]\nrate_hz = 2000.0\nclocking = \"report\"\n"
           "servo_priority = 90\nusb_priority = 80\nservo_cpu = 3\nusb_cpu = 2\n"
           "lock_memory = false\nstrict = true\n[workspace]\nscale = 2.5\n"
           "offset_m = [0.1, -0.2, 3]\nrotation = { w = 0.6, x = 0.8, y = 0, z = -0.0 }\n"
           "part_rotation = { w = 0, x = 0, y = 1, z = 0 }\n"
           "[limits]\nmax_force_n = 2\nmax_torque_nm = 0.01\nfull_speed_m_per_s = 0.5\n"
           "zero_speed_m_per_s = 0.6\nfull_turn_rad_per_s = 1\nzero_turn_rad_per_s = 2\n"
           "[switches]\ndeadman = 4\nclutch = 8\nemergency_stop = 0xffffffff\n"
           "[recorder]\nflight_seconds = 0.5\n"},
      {"falcon", file + scene + "[device]\ndriver = \"falcon\"\nfirmware = \"/proc/self/maps\"\n"},
      {"falcon_keys", file + scene +
                          "[device]\ndriver = \"falcon\"\nfirmware = \"no.bin\"\n"
                          "firmware_sha256 = \"" +
                          std::string(64, '7') + "\"\nfirmware_accept_unknown = true\n"},
      {"falcon_instead", falcon + reference + "firmware = \"no.bin\"\n"},
      {"spacemouse", spacemouse + scene + "[device]\ndriver = 'spacemouse'\naddress='256f:c62e'\n"},
      {"polhem", file + scene + "device.driver = \"polhem\"\nworkspace.scale = 1e-3\n"},
      {"zero_force", file + reference + "[limits]\nmax_force_n = 0\nmax_torque_nm = 0.0\n"},
      {"fades_crossed", file + reference + "[limits]\nzero_speed_m_per_s = 0.5\n"},
      {"beyond", file + reference + "[limits]\nmax_force_n = 1e300\n"},
      {"no_deadman", file + reference + "[switches]\ndeadman = 0\n"},
      {"shared_switch", file + reference + "[switches]\nclutch = 1\n"},
      {"priorities_crossed", file + reference + "[loop]\nusb_priority = 95\n"},
      {"crash_file", file + reference + "[recorder]\ncrash_file = \"/proc/self/maps\"\n"},
      {"no_folder", file + reference + "[recorder]\ncrash_file = \"nowhere/crash.txt\"\n"},
      {"no_rotation",
       file + reference + "[workspace]\nrotation = { w = 0, x = 0, y = 0, z = 0 }\n"},
      {"bad_address", file + scene + "[device]\ndriver = \"reference\"\naddress = \"12g9:1\"\n"},
      {"no_scene", file + "scene = \"\"\n"},
      {"misspelt", file + reference + "[limit]\nmax_force = 3\n"}};
}

}  // namespace haptic::fuzz
