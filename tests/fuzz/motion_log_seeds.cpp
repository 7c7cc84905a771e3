// SPDX-License-Identifier: Apache-2.0
/// Seeds of fuzz_motion_log: logs in their dialects, and some that are refused.
#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {

std::vector<Seed> seeds() {
  const std::string plain("\0", 1);
  const std::string rows = "0,0.01,-2e-3,0.03,0,0,0,1\n0.01,0.011,0,0.03,0,0,0.6,0.8\n";
  return {
      {"named", plain + "t,x,y,z,qx,qy,qz,qw\n" + rows},
      {"semicolons", plain +
                         "\xEF\xBB\xBFTime [ms];\"X (mm)\";\"Y (mm)\";\"Z (mm)\";qw;qx;qy;qz\r\n"
                         "0;1,5;2;3;1;0;0;0\r\n10;1,6;2;3;-1;0;0;0\r\n"},
      {"tum", plain + "# a b\n1700000000.1 1 2 3 0 0 0 1\n1700000000.2 1 2 3 0 0 0 -1\n"},
      {"euroc", plain + "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x "
                        "[],q_RS_y [],q_RS_z []\n1700000000100000000,1,2,3,1,0,0,0\n"
                        "1700000000110000000,1,2,3,1,0,0,0\n"},
      {"stamps", plain + "header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,"
                         "pose.position.z,pose.orientation.x,pose.orientation.y,"
                         "pose.orientation.z,pose.orientation.w\n"
                         "7,999999999,0,0,0,0,0,0,1\n8,1,0,0,0,0,0,0,1\n"},
      {"json", plain + "{\"timestamp\": 0, \"position\": {\"x\": 1, \"y\": 2, \"z\": 3}, "
                       "\"orientation\": {\"x\": 0, \"y\": 0, \"z\": 0, \"w\": 1}}\n"
                       "{\"timestamp\": 0.1, \"position\": {\"x\": 1, \"y\": 2, \"z\": 3}, "
                       "\"orientation\": {\"x\": 0, \"y\": 0, \"z\": 0, \"w\": 1}}\n"},
      {"state",
       "\x03{\"timestamp\": 0, \"state\": [1,2,3,0,0,0,1,0.5]}\n"
       "{\"timestamp\": 0.1, \"state\": [1,2,3,0,0,0,1,0.5]}\n"},
      {"bare", "\x01" + rows},
      {"counted", "\x08x,y,z,qw,qx,qy,qz\n1,2,3,1,0,0,0\n1,2,3,1,0,0,0\n"},
      {"millimetres", "\x04t,x,y,z,qw,qx,qy,qz\n0,100,200,300,1,0,0,0\n0.1,1,2,3,1,0,0,0\n"},
      {"ordered",
       "\x10"
       "0,1,2,3,1,0,0,0\n0.1,1,2,3,1,0,0,0\n"},
      {"renamed", " stamp,a,y,z,qw,qx,qy,qz\n0,1,2,3,1,0,0,0\n0.1,1,2,3,1,0,0,0\n"},
      {"backwards", plain + "t,x,y,z,qx,qy,qz,qw\n" + rows + rows},
      {"huge", plain + "t,x,y,z,qw,qx,qy,qz\n-9e18,1,2,3,1,0,0,0\n9e18,1,2,3,1,0,0,0\n"},
      {"deep", plain + std::string(500, '{')},
      {"zeros", std::string(40, '\0')}};
}

}  // namespace haptic::fuzz
