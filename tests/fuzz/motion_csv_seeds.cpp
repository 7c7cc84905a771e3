// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_motion_csv: motions that are played, read only, and refused in each way.
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  const std::string header = "t,x,y,z,qw,qx,qy,qz\n";
  const std::string first = "0,0.01,-2e-3,0.03,1,0,0,0\n";
  return {{"played", header + first + "0.001,0.0101,0,0.03,0.6,0.8,0,0\n" +
                         "0.002,0.0102,0,0.03,0.6000001,0.8,-0.0,0\n"},
          {"crlf", "\xEF\xBB\xBFt,x,y,z,qw,qx,qy,qz\r\n0,1,2,3,1,0,0,0\r\n1,1,2,3,1,0,0,0\r\n\r\n"},
          {"one", header + first},
          {"slow", header + first + "0.5,0,0,0,1,0,0,0\n"},
          {"far", header + "0,10,20,30,1,0,0,0\n0.001,10,20,30,1,0,0,0\n"},
          {"jump", header + first + "0.001,5,0,0,1,0,0,0\n"},
          {"huge", header + "1e308,1e308,-1e308,1e-320,1,0,0,0\n1.7e308,1e308,0,0,1,0,0,0\n"},
          {"backwards", header + first + first},
          {"not_unit", header + "0,0,0,0,1e200,1e200,0,0\n"},
          {"not_finite", header + "0,nan,inf,0,1,0,0,0\n"},
          {"too_many", header + "0,0,0,0,1,0,0,0,9\n"},
          {"cut", header + "0,0,0,0,1"},
          {"blank", header + first + "\n" + first},
          {"other_header", "t;x;y;z\n0;1;2;3\n"},
          {"zeros", std::string(40, '\0')}};
}

}  // namespace haptic::fuzz
