// SPDX-License-Identifier: Apache-2.0
// host_sim motion --from: one motion as many programs would record it. Each log gives the poses
// that it was written from, or is refused for what it lacks.
#include <doctest/doctest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host_sim/session/motion_csv.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/formatted.hpp"

namespace {

using haptic::sim::MotionSample;
using haptic::sim::read_motion_csv;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::tools::formatted;

struct Recorded {
  int ms = 0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
};

/// 50 Hz, with no zero in any number and a quaternion whose four numbers all differ.
std::vector<Recorded> recorded_motion() {
  std::vector<Recorded> motion;
  for (int k = 0; k < 40; ++k) {
    const double t = 0.02 * k;
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.4 + 0.5 * t, Eigen::Vector3d::UnitZ())) *
        Eigen::AngleAxisd(0.2 - 0.3 * t, Eigen::Vector3d::UnitX());
    motion.push_back(
        {20 * k, {0.03 * std::sin(2 * t) + 0.001, -0.02 + 0.01 * t, 0.05 - 0.03 * t}, q});
  }
  return motion;
}
const std::vector<Recorded> kMotion = recorded_motion();

using Cell = std::function<std::string(const Recorded&)>;
using Cells = std::vector<Cell>;

Cell text(const std::string& word) {
  return [word](const Recorded&) { return word; };
}
Cells operator+(Cells left, const Cells& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}
std::string number(double x) { return formatted("%.9f", x); }

Cells seconds() {
  return {[](const Recorded& r) { return formatted("%d.%03d", r.ms / 1000, r.ms % 1000); }};
}
/// Since 1970, with so many digits behind the milliseconds.
Cells since_1970(const std::string& digits) {
  return {[digits](const Recorded& r) { return formatted("1700000000%03d", r.ms) + digits; }};
}
Cells since_1970_s() {
  return {[](const Recorded& r) { return formatted("1700000000.%03d000", r.ms); }};
}
Cells place(double unit = 1) {
  Cells cells;
  for (int k = 0; k < 3; ++k)
    cells.push_back([k, unit](const Recorded& r) { return number(unit * r.p[k]); });
  return cells;
}
Cells xyzw() {
  Cells cells;
  for (int k = 0; k < 4; ++k)
    cells.push_back([k](const Recorded& r) { return number(r.q.coeffs()[k]); });
  return cells;
}
Cells wxyz() {
  const Cells q = xyzw();
  return {q[3], q[0], q[1], q[2]};
}
/// Row by row, with the place behind each row of the turn.
Cells matrix_rows() {
  Cells cells;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 4; ++j)
      cells.push_back([i, j](const Recorded& r) {
        return number(j < 3 ? r.q.toRotationMatrix()(i, j) : r.p[i]);
      });
  }
  return cells;
}
Cells rotation_vector() {
  Cells cells;
  for (int k = 0; k < 3; ++k)
    cells.push_back([k](const Recorded& r) {
      const Eigen::AngleAxisd turn(r.q);
      return number(turn.angle() * turn.axis()[k]);
    });
  return cells;
}
/// Roll, pitch, yaw.
Cells euler(double unit) {
  Cells cells;
  for (int k = 0; k < 3; ++k)
    cells.push_back([k, unit](const Recorded& r) {
      return number(unit * r.q.toRotationMatrix().eulerAngles(2, 1, 0)[2 - k]);
    });
  return cells;
}

std::vector<std::string> lines_of(const Cells& cells, const std::string& separator = ",") {
  std::vector<std::string> lines;
  for (const Recorded& r : kMotion) {
    std::string line;
    for (std::size_t k = 0; k < cells.size(); ++k) line += (k > 0 ? separator : "") + cells[k](r);
    lines.push_back(line);
  }
  return lines;
}
std::string joined(const std::vector<std::string>& lines, const std::string& end = "\n") {
  std::string all;
  for (const std::string& line : lines) all += line + end;
  return all;
}
std::string rows(const Cells& cells, const std::string& separator = ",",
                 const std::string& end = "\n") {
  return joined(lines_of(cells, separator), end);
}
std::string with_commas(std::string rows) {
  for (char& c : rows) c = c == '.' ? ',' : c;
  return rows;
}

struct Dialect {
  std::string name;
  std::string log;
  std::string options;
  std::string refusal;  ///< of standard error; empty: it is fed
};

const std::string kPlain = "t,x,y,z,qw,qx,qy,qz\n";

std::string json_lines() {
  std::string all;
  for (std::size_t k = 0; k < kMotion.size(); ++k) {
    const Recorded& r = kMotion[k];
    nlohmann::json line;
    line["observation.state"] = {r.p[0], r.p[1], r.p[2], r.q.x(), r.q.y(), r.q.z(), r.q.w(), 0.7};
    line["action"] = line["observation.state"];
    line["timestamp"] = 1e-3 * r.ms;
    line["frame_index"] = k;
    line["episode_index"] = 0;
    all += line.dump() + "\n";
  }
  return all;
}

/// As a tracker of rigid bodies exports a take.
std::string tracker_take(const std::string& unit, double scale) {
  return "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,50.000000,Rotation "
         "Type,Quaternion,Length Units," +
         unit +
         ",Coordinate Space,Global\r\n\r\n"
         ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,"
         "Rigid Body\r\n"
         ",Name,tool,tool,tool,tool,tool,tool,tool,tool\r\n,ID,1,1,1,1,1,1,1,1\r\n"
         ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error\r\n"
         "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,\r\n" +
         rows(Cells{text("7")} + seconds() + xyzw() + place(scale) + Cells{text("0.0003")}, ",",
              "\r\n");
}

std::vector<std::string> plain_lines() { return lines_of(seconds() + place() + wxyz()); }

std::string with_line_twice() {
  std::vector<std::string> lines = plain_lines();
  lines.insert(lines.begin() + 7, lines[7]);
  return kPlain + joined(lines);
}
std::string with_gap() {
  std::vector<std::string> lines = plain_lines();
  lines.erase(lines.begin() + 10, lines.begin() + 25);
  return kPlain + joined(lines);
}
std::string with_lines_swapped() {
  std::vector<std::string> lines = plain_lines();
  std::swap(lines[5], lines[6]);
  return kPlain + joined(lines);
}
std::string with_comments() {
  std::vector<std::string> lines = lines_of(seconds() + place() + wxyz(), ", ");
  lines.insert(lines.begin() + 9, "# paused, resumed");
  return "# arm 3, tool 12\n# units: m, s\n\nt, x, y, z, qw, qx, qy, qz\n" + joined(lines) +
         "# end\n";
}

const std::string kNoQuaternion =
    "no quaternion among the columns; Euler angles, rotation vectors and matrices are not read";

std::vector<Dialect> dialects() {
  const std::string odometry =
      "__time,/odom/header/stamp,/odom/header/seq,/odom/pose/pose/position/x,"
      "/odom/pose/pose/position/y,/odom/pose/pose/position/z,/odom/pose/pose/orientation/x,"
      "/odom/pose/pose/orientation/y,/odom/pose/pose/orientation/z,/odom/pose/pose/orientation/w,"
      "/odom/pose/covariance[0],/odom/twist/twist/linear/x,/odom/twist/twist/linear/y,"
      "/odom/twist/twist/linear/z\n";
  return {
      {"odometry of a plotter",
       odometry + rows(since_1970_s() + since_1970_s() + Cells{text("5")} + place() + xyzw() +
                       Cells(4, text("0"))),
       "", ""},
      {"topic echoed, ns",
       "%time,field.header.stamp,field.header.frame_id,field.pose.position.x,"
       "field.pose.position.y,field.pose.position.z,field.pose.orientation.x,"
       "field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w\n" +
           rows(since_1970("000001") + since_1970("000001") + Cells{text("base")} + place() +
                xyzw()),
       "", ""},
      {"stamp in two columns",
       "header.stamp.sec,header.stamp.nanosec,pose.position.x,pose.position.y,pose.position.z,"
       "pose.orientation.x,pose.orientation.y,pose.orientation.z,pose.orientation.w\n" +
           rows(Cells{text("1700000000"),
                      [](const Recorded& r) { return formatted("%d000001", r.ms); }} +
                place() + xyzw()),
       "", ""},
      {"TUM", "# ground truth\n" + rows(since_1970_s() + place() + xyzw(), " "), "", ""},
      {"EuRoC",
       "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
       "q_RS_z []\r\n" +
           rows(since_1970("000000") + place() + wxyz(), ",", "\r\n"),
       "", ""},
      {"ms and mm by name",
       "time_ms,x_mm,y_mm,z_mm,qx,qy,qz,qw\n" + rows(since_1970("") + place(1000) + xyzw()), "",
       ""},
      {"us since 1970, of no unit",
       "timestamp,x,y,z,qw,qx,qy,qz\n" + rows(since_1970("000") + place() + wxyz()), "", ""},
      {"mm that the file does not state", kPlain + rows(seconds() + place(1000) + wxyz()),
       "--unit mm", ""},
      {"semicolons and decimal commas",
       "\xEF\xBB\xBFtime;X [mm];Y [mm];Z [mm];qw;qx;qy;qz\r\n" +
           with_commas(rows(seconds() + place(1000) + wxyz(), ";", "\r\n")),
       "", ""},
      {"tabs, in other case",
       "Frame\tTime\tX\tY\tZ\tQX\tQY\tQZ\tQW\t\n" +
           rows(Cells{text("3")} + seconds() + place() + xyzw() + Cells{text("")}, "\t"),
       "", ""},
      {"quoted names, byte order mark, CR LF",
       "\xEF\xBB\xBF\"Time (s)\",\"Position X (m)\",\"Position Y (m)\",\"Position Z (m)\","
       "\"Rotation X\",\"Rotation Y\",\"Rotation Z\",\"Rotation W\"\r\n" +
           rows(seconds() + place() + xyzw(), ",", "\r\n"),
       "", ""},
      {"comments before, between and behind", with_comments(), "", ""},
      {"names of an arm, without a header's order",
       "id,tcp_qw,tcp_qx,tcp_qy,tcp_qz,tcp_px,tcp_py,"
       "tcp_pz,t\n" +
           rows(Cells{text("9")} + wxyz() + place() + seconds()),
       "", ""},
      {"JSON lines of an episode", json_lines(), "--key observation.state --order xyzw", ""},
      {"take of a tracker, mm", tracker_take("Millimeters", 1000), "", ""},
      {"take of a tracker, m", tracker_take("Meters", 1), "", ""},
      {"units in a line below the names",
       "time,x,y,z,qw,qx,qy,qz\n[ms],[cm],[cm],[cm],-,-,-,-\n" +
           rows(since_1970("") + place(100) + wxyz()),
       "", ""},
      {"no names, xyzw", rows(seconds() + place() + xyzw()), "--order xyzw", ""},
      {"a gap", with_gap(), "", ""},
      {"rows without times", "x,y,z,qx,qy,qz,qw\n" + rows(place() + xyzw()), "--rows-hz 50", ""},

      {"KITTI", rows(matrix_rows(), " "), "",
       ":1: has 12 numbers where 8 are expected; matrices are not read, convert them to "
       "quaternions "
       "(KITTI's files have no times either"},
      {"KITTI with a rate", rows(matrix_rows(), " "), "--rows-hz 10",
       ":1: has 12 numbers where 7 are expected; matrices are not read"},
      {"4 x 4 matrix behind a time",
       rows(seconds() + matrix_rows() + Cells{text("0"), text("0"), text("0"), text("1")}, " "), "",
       ":1: has 17 numbers where 8 are expected; matrices are not read"},
      {"Euler angles in degrees",
       "t,x,y,z,roll_deg,pitch_deg,yaw_deg\n" + rows(seconds() + place() + euler(180 / M_PI)), "",
       kNoQuaternion},
      {"Euler angles in radians", "t,x,y,z,roll,pitch,yaw\n" + rows(seconds() + place() + euler(1)),
       "", kNoQuaternion},
      {"rotation vector", "t,x,y,z,rx,ry,rz\n" + rows(seconds() + place() + rotation_vector()), "",
       kNoQuaternion},
      {"segments of a tracker, rotation vector",
       "Objects\n50\n,,Global Angle tool:tool,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n"
       ",,rad,rad,rad,mm,mm,mm\n" +
           rows(Cells{text("1"), text("0")} + rotation_vector() + place(1000)),
       "", kNoQuaternion},
      {"two bodies",
       "t,a_px,a_py,a_pz,a_qx,a_qy,a_qz,a_qw,b_px,b_py,b_pz,b_qx,b_qy,b_qz,b_qw\n" +
           rows(seconds() + place() + xyzw() + place() + xyzw()),
       "", "holds several positions: a_px, a_py, a_pz and b_px, b_py, b_pz"},
      {"forces and torques, no place",
       "t,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz\n" + rows(seconds() + place() + place() + wxyz()), "",
       "no position among the columns"},
      {"q0 to q3 in an open order", "t,x,y,z,q0,q1,q2,q3\n" + rows(seconds() + place() + wxyz()),
       "", "numbers leave open the order of the quaternion q0, q1, q2, q3; add --order"},
      {"inches",
       "t,x [in],y [in],z [in],qw,qx,qy,qz\n" + rows(seconds() + place(1 / 0.0254) + wxyz()), "",
       "column x [in] is in 'in'; give positions in m, cm, mm or um"},
      {"a stamp twice", with_line_twice(), "", ":10: the time is that of line 9"},
      {"stamps out of order", with_lines_swapped(), "",
       ":8: the time runs backwards, from that of line 7; sort the samples"},
      {"dates",
       kPlain + rows(Cells{[](const Recorded& r) {
                       return formatted("2024-05-01T10:00:00.%03dZ", r.ms);
                     }} +
                     place() + wxyz()),
       "", ":2: column t is a date or a time of day"},
      {"ms of no unit from 0",
       kPlain +
           rows(Cells{[](const Recorded& r) { return formatted("%d", r.ms); }} + place() + wxyz()),
       "", "has a sample every 20 s with times in seconds; say --time-unit ms"},
      {"ns by name, ms by size",
       "time_ns,x,y,z,qw,qx,qy,qz\n" + rows(since_1970("") + place() + wxyz()), "",
       "less than a sample at 1000 Hz; correct the unit of its times with --time-unit"},
      {"UTF-16", std::string("\xFF\xFEt\0,\0x\0", 8), "", "is no text; save it as UTF-8 text"},
      {"one JSON array", "[{\"t\":0,\"x\":0}]", "", "is one JSON array; write an object a line"},
      {"the tracker lost the body", kPlain + "0,nan,nan,nan,nan,nan,nan,nan\n", "",
       ":2: column x is nan; drop or complete the sample"}};
}

/// The played motion at the times of the log is what was recorded.
void check_poses(const std::vector<MotionSample>& played) {
  REQUIRE(played.size() == 781);
  double farthest_m = 0, most_rad = 0;
  for (const Recorded& r : kMotion) {
    const MotionSample& sample = played[static_cast<std::size_t>(r.ms)];
    farthest_m =
        std::max(farthest_m, (Eigen::Vector3d(sample.p[0], sample.p[1], sample.p[2]) - r.p).norm());
    const double* q = sample.q_wxyz;
    most_rad = std::max(most_rad, Eigen::Quaterniond(q[0], q[1], q[2], q[3]).angularDistance(r.q));
  }
  // Rounding of nine decimals.
  CHECK(farthest_m < 3e-9);
  CHECK(most_rad < 1e-7);
}

}  // namespace

TEST_SUITE("host_sim.log_dialects") {
  TEST_CASE("twenty logs in twenty dialects, and as many that are refused for what they lack") {
    const ScratchFolder folder("log_dialects");
    const std::string log = folder.file("log"), out = folder.file("m.csv");
    std::size_t fed = 0;
    for (const Dialect& dialect : dialects()) {
      CAPTURE(dialect.name);
      std::ofstream(log, std::ios::binary) << dialect.log;
      std::filesystem::remove(out);
      const ProgramResult r = run_program(
          HAPTIC_HOST_SIM, "motion --from '" + log + "' -o '" + out + "' " + dialect.options);
      CAPTURE(r.err);
      if (!dialect.refusal.empty()) {
        CHECK(r.exit_code == 3);
        CHECK(r.err.find(dialect.refusal) != std::string::npos);
        CHECK(!std::filesystem::exists(out));
        continue;
      }
      fed += 1;
      REQUIRE(r.exit_code == 0);
      if (dialect.name == "a gap") {  // goes straight through it, which was not recorded
        CHECK(r.err.find("no sample for 0.32 s before line 12") != std::string::npos);
        CHECK(read_motion_csv(out).size() == 781);
        continue;
      }
      CHECK(r.err.empty());
      check_poses(read_motion_csv(out));
    }
    CHECK(fed == 20);
  }
}
