// SPDX-License-Identifier: Apache-2.0
// host_sim motion --from: logs of other programs, in their dialects, and what is refused.
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/motion_log/log_judgement.hpp"
#include "host_sim/motion_log/motion_log.hpp"
#include "host_sim/motion_log/resampled.hpp"
#include "host_sim/session/motion_csv.hpp"
#include "host_sim/shapes/shapes.hpp"
#include "tests/support/program_run.hpp"
#include "tools/common/error.hpp"

namespace {

using namespace haptic::sim;
using haptic::sim::test::ProgramResult;
using haptic::sim::test::run_program;
using haptic::sim::test::ScratchFolder;
using haptic::sim::test::text_of_file;

/// A log in a file of its own.
struct LogFile {
  static inline int made = 0;
  ScratchFolder folder{"motion_log_" + std::to_string(made++)};
  LogOptions options;
  explicit LogFile(const std::string& text, const std::string& name = "log.csv") {
    options.path = folder.file(name);
    std::ofstream(options.path, std::ios::binary) << text;
  }
};

/// Three poses a hundredth of a second apart: at 1, 2, 3 mm on x, turned about z by 0, 0.6, 1.2
/// rad.
constexpr double kAngles_rad[] = {0, 0.6, 1.2};

void check_three(const MotionLog& log) {
  REQUIRE(log.samples.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    const MotionSample& sample = log.samples[k];
    CHECK(sample.t_s == doctest::Approx(0.01 * static_cast<double>(k)).epsilon(1e-6));
    CHECK(sample.p[0] == doctest::Approx(0.001 * static_cast<double>(k + 1)));
    CHECK(sample.p[1] == doctest::Approx(-0.02));
    CHECK(sample.p[2] == doctest::Approx(0.3));
    CHECK(sample.q_wxyz[0] == doctest::Approx(std::cos(kAngles_rad[k] / 2)).epsilon(1e-5));
    CHECK(std::abs(sample.q_wxyz[1]) + std::abs(sample.q_wxyz[2]) < 1e-9);
    CHECK(sample.q_wxyz[3] == doctest::Approx(std::sin(kAngles_rad[k] / 2)).epsilon(1e-5));
  }
}

/// The rows of the three poses: each of `times`, and the numbers in the order of `letters`, of
/// which x, y, z are a place (times `unit`), a, b, c, w a quaternion and - any text.
std::string three_rows(const std::vector<std::string>& times, const std::string& letters,
                       const std::string& separator = ",", double unit = 1) {
  std::string text;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto number = [&](char letter) -> std::string {
      if (letter == 't') return times[k];
      if (letter == 'x') return std::to_string(unit * 0.001 * static_cast<double>(k + 1));
      if (letter == 'y') return std::to_string(unit * -0.02);
      if (letter == 'z') return std::to_string(unit * 0.3);
      if (letter == 'w') return std::to_string(std::cos(kAngles_rad[k] / 2));
      if (letter == 'c') return std::to_string(std::sin(kAngles_rad[k] / 2));
      return letter == '-' ? "world" : "0";
    };
    for (std::size_t i = 0; i < letters.size(); ++i)
      text += (i > 0 ? separator : "") + number(letters[i]);
    text += "\n";
  }
  return text;
}

const std::vector<std::string> kSeconds = {"0", "0.01", "0.02"};
const std::vector<std::string> kEpoch_s = {"1700000000.10", "1700000000.11", "1700000000.12"};
const std::vector<std::string> kEpoch_ms = {"1700000000100", "1700000000110", "1700000000120"};
const std::vector<std::string> kEpoch_ns = {"1700000000100000001", "1700000000110000001",
                                            "1700000000120000001"};

std::string refusal_of_log(const std::string& text, LogOptions said = {}) {
  const LogFile file(text);
  said.path = file.options.path;
  try {
    (void)read_motion_log(said);
  } catch (const haptic::tools::InputError& error) {
    return error.what();
  }
  return "";
}

bool log_says(const std::string& text, const std::string& part) {
  INFO(text);
  INFO(part);
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_SUITE("host_sim.motion_log") {
  TEST_CASE("columns are found by name, in any order, case and separator") {
    const std::string named = three_rows(kSeconds, "txyzwabc");
    const std::string last_w = three_rows(kSeconds, "txyzabcw");
    const std::string dialects[] = {
        "t,x,y,z,qw,qx,qy,qz\n" + named,
        "t,x,y,z,qx,qy,qz,qw\n" + last_w,
        "Timestamp,PX,PY,PZ,QX,QY,QZ,QW\r\n" + last_w,
        "\xEF\xBB\xBF\n\nt_s;pos_x;pos_y;pos_z;q_x;q_y;q_z;q_w\n" +
            three_rows(kSeconds, "txyzabcw", ";"),
        "time\tposition.x\tposition.y\tposition.z\torientation.x\torientation.y\torientation.z\t"
        "orientation.w\n" +
            three_rows(kSeconds, "txyzabcw", "\t"),
        "time x y z qx qy qz qw\n" + three_rows(kSeconds, "txyzabcw", "   "),
        "\"q.w\",\"q.x\",\"q.y\",\"q.z\",\"x\",\"y\",\"z\",\"t\"\n" +
            three_rows(kSeconds, "wabcxyzt"),
        "tx,ty,tz,qx,qy,qz,qw,timestamp\n" + three_rows(kEpoch_s, "xyzabcwt"),
        "px,py,pz,x,y,z,w,t\n" + three_rows(kSeconds, "xyzabcwt"),
        "TCP_x,TCP_y,TCP_z,TCP_qx,TCP_qy,TCP_qz,TCP_qw,Time\n" + three_rows(kSeconds, "xyzabcwt"),
        "t,x,y,z,qw,qx,qy,qz,fx,tx,ty,tz,note,\n" + three_rows(kSeconds, "txyzwabcaaaa-"),
        "frame,t,x [m],y [m],z [m],qw,qx,qy,qz\n" + three_rows(kSeconds, "-txyzwabc")};
    for (const std::string& text : dialects) {
      INFO(text);
      const LogFile file(text);
      check_three(read_motion_log(file.options));
    }
  }

  TEST_CASE("ROS exports: stamps in one column or two, and the names of messages") {
    const std::string pose =
        "pose.position.x,pose.position.y,pose.position.z,pose.orientation.x,pose.orientation.y,"
        "pose.orientation.z,pose.orientation.w\n";
    std::string two = "header.stamp.sec,header.stamp.nanosec,header.frame_id," + pose;
    const char* nanoseconds[] = {"990000000", "0", "10000000"};
    std::string rows = three_rows({"7", "8", "8"}, "t-xyzabcw");
    for (std::size_t k = 0, at = 0; k < 3; ++k) {
      at = rows.find(",world", at);
      rows.insert(at, "," + std::string(nanoseconds[k]));
      at += 12;
    }
    check_three(read_motion_log(LogFile(two + rows).options));
    std::string echoed = "%time,field.header.seq,field.header.stamp,field.header.frame_id";
    for (const char* name : {"position.x", "position.y", "position.z", "orientation.x",
                             "orientation.y", "orientation.z", "orientation.w"})
      echoed += std::string(",field.pose.") + name;
    check_three(
        read_motion_log(LogFile(echoed + "\n" + three_rows(kEpoch_ns, "tat-xyzabcw")).options));
    const std::string odometry =
        "rosbagTimestamp,pose.pose.position.x,pose.pose.position.y,pose.pose.position.z,"
        "pose.pose.orientation.x,pose.pose.orientation.y,pose.pose.orientation.z,"
        "pose.pose.orientation.w,twist.twist.linear.x,twist.twist.linear.y,twist.twist.linear.z\n";
    const MotionLog log =
        read_motion_log(LogFile(odometry + three_rows(kEpoch_ns, "txyzabcwaaa")).options);
    check_three(log);
    CHECK(log_says(log.clock, "nanoseconds since 1970"));
    check_three(read_motion_log(
        LogFile("transform.translation.x,transform.translation.y,transform.translation.z,"
                "transform.rotation.x,transform.rotation.y,transform.rotation.z,"
                "transform.rotation.w,time\n" +
                three_rows(kEpoch_ms, "xyzabcwt"))
            .options));
  }

  TEST_CASE("TUM and EuRoC files") {
    const MotionLog tum = read_motion_log(
        LogFile("# ground truth\n# made by hand\n" + three_rows(kEpoch_s, "txyzabcw", " "))
            .options);
    check_three(tum);
    CHECK(log_says(tum.form, "blanks"));
    CHECK(tum.columns.order == QuaternionOrder::kXyzw);
    check_three(read_motion_log(
        LogFile("# timestamp tx ty tz qx qy qz qw\n" + three_rows(kEpoch_s, "txyzabcw", " "))
            .options));
    const MotionLog euroc = read_motion_log(
        LogFile("#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
                "q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
                "b_w_RS_S_x [rad s^-1]\n" +
                three_rows(kEpoch_ns, "txyzwabcaaaa"))
            .options);
    check_three(euroc);
    CHECK(euroc.columns.unit_told);
  }

  TEST_CASE("JSON lines: objects by the same names, and arrays by key and order") {
    std::string objects, states, elements;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::string t = std::to_string(0.5 + 0.01 * static_cast<double>(k));
      const std::string x = std::to_string(0.001 * static_cast<double>(k + 1));
      const std::string w = std::to_string(std::cos(kAngles_rad[k] / 2));
      const std::string z = std::to_string(std::sin(kAngles_rad[k] / 2));
      objects += "{\"timestamp\": " + t + ", \"pose\": {\"position\": {\"x\": " + x +
                 ", \"y\": -0.02, \"z\": 0.3}, \"orientation\": {\"x\": 0, \"y\": 0, \"z\": " + z +
                 ", \"w\": " + w + "}}}\n";
      states += "{\"frame_index\": 4, \"timestamp\": " + t + ", \"observation.state\": [" + x +
                ", -0.02, 0.3, 0, 0, " + z + ", " + w + ", 0.5], \"task\": null}\n\n";
      elements += "{\"t\": " + t + ", \"position\": [" + x + ", -0.02, 0.3], \"orientation\": [" +
                  w + ", 0, 0, " + z + "]}\n";
    }
    check_three(read_motion_log(LogFile(objects).options));
    LogFile state(states);
    CHECK(log_says(refusal_of_log(states), "--key NAME --order xyzw"));
    state.options.key = "observation.state";
    state.options.order = QuaternionOrder::kXyzw;
    check_three(read_motion_log(state.options));
    LogFile element(elements);
    CHECK(log_says(refusal_of_log(elements), "add --order xyzw or --order wxyz"));
    element.options.order = QuaternionOrder::kWxyz;
    check_three(read_motion_log(element.options));
    CHECK(
        log_says(refusal_of_log(objects + "{\"timestamp\": 0.6}\n"), ":4: column pose.position.x"));
    CHECK(log_says(refusal_of_log(objects + "{\"timestamp\": NaN}\n"), ":4: is no JSON object"));
    CHECK(log_says(refusal_of_log("[" + objects + "]"), "one JSON array"));
  }

  TEST_CASE("options name what the file leaves open") {
    const std::string bare = three_rows(kSeconds, "txyzabcw");
    CHECK(log_says(refusal_of_log(bare), "has no line of names"));
    LogFile file(bare);
    file.options.order = QuaternionOrder::kXyzw;
    check_three(read_motion_log(file.options));
    LogFile named(three_rows(kSeconds, "-xyzabcwt"));
    named.options.columns = {"id", "x", "y", "z", "qx", "qy", "qz", "qw", "t"};
    check_three(read_motion_log(named.options));
    LogFile other("STAMP,A,B,C,D,E,F,G,x\n" + three_rows(kSeconds, "txyzwabcc"));
    CHECK(log_says(refusal_of_log(text_of_file(other.options.path)),
                   "no position among the columns"));
    other.options.columns = {"t=STAMP", "x=A", "y=B", "z=C", "qw=D", "qx=E", "qy=F", "qz=G"};
    check_three(read_motion_log(other.options));
    LogFile timeless("x,y,z,qw,qx,qy,qz\n" + three_rows(kSeconds, "xyzwabc"));
    CHECK(log_says(refusal_of_log(text_of_file(timeless.options.path)), "--rows-hz"));
    timeless.options.rows_hz = 100;
    check_three(read_motion_log(timeless.options));
    // Names that lie about the order.
    LogFile lying("t,x,y,z,qw,qx,qy,qz\n" + three_rows(kSeconds, "txyzabcw"));
    lying.options.order = QuaternionOrder::kXyzw;
    check_three(read_motion_log(lying.options));
  }

  TEST_CASE("units of lengths and times, by name, option and size") {
    const std::string mm = three_rows(kSeconds, "txyzwabc", ",", 1000);
    for (const char* names :
         {"t,x_mm,y_mm,z_mm,qw,qx,qy,qz\n", "t,X (mm),Y (mm),Z (mm),qw,qx,qy,qz\n",
          "t,pos_mm_x,pos_mm_y,pos_mm_z,qw,qx,qy,qz\n"})
      check_three(read_motion_log(LogFile(names + mm).options));
    LogFile option("t,x,y,z,qw,qx,qy,qz\n" + mm);
    option.options.unit_m = 1e-3;
    check_three(read_motion_log(option.options));
    CHECK(log_says(refusal_of_log("t,x_mm,y,z,qw,qx,qy,qz\n" + mm), "a unit stands at some"));
    CHECK(log_says(refusal_of_log("t,x [in],y [in],z [in],qw,qx,qy,qz\n" + mm), "in 'in'"));
    const std::vector<std::string> ms = {"0", "10", "20"};
    const std::string names = "x,y,z,qw,qx,qy,qz\n", rows = three_rows(ms, "txyzwabc");
    check_three(read_motion_log(LogFile("time_ms," + names + rows).options));
    check_three(read_motion_log(LogFile("time [ms]," + names + rows).options));
    CHECK(log_says(refusal_of_log("time," + names + rows), "--time-unit ms"));
    LogFile told("time," + names + rows);
    told.options.time_unit_s = 1e-3;
    check_three(read_motion_log(told.options));
    check_three(
        read_motion_log(LogFile("time," + names + three_rows(kEpoch_ms, "txyzwabc")).options));
    // A comma before the decimals, where it does not separate.
    std::string commas = three_rows(kSeconds, "txyzwabc", ";");
    for (char& c : commas) c = c == '.' ? ',' : c;
    check_three(read_motion_log(LogFile("t;x;y;z;qw;qx;qy;qz\n" + commas).options));
  }

  TEST_CASE("signs are made continuous and rounded quaternions normalised, and both are counted") {
    const MotionLog log = read_motion_log(LogFile("t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n"
                                                  "0.1,0,0,0,-0.999,0,0,0\n0.2,0,0,0,-1,0,0,0\n"
                                                  "0.3,0,0,0,1,0,0,0\n")
                                              .options);
    for (const MotionSample& sample : log.samples) CHECK(sample.q_wxyz[0] == 1);
    CHECK(log.turned == 2);
    CHECK(log.normalised == 1);
    CHECK(log.worst_length == doctest::Approx(0.999));
  }

  TEST_CASE("bad rows are refused with file and line") {
    const std::string names = "t,x,y,z,qw,qx,qy,qz\n", first = "0,0,0,0,1,0,0,0\n";
    CHECK(log_says(refusal_of_log(""), "log.csv: is empty"));
    CHECK(log_says(refusal_of_log(names), "holds 0 samples"));
    CHECK(log_says(refusal_of_log(names + first), "holds 1 samples"));
    CHECK(log_says(refusal_of_log(std::string("t,x\0y", 5)), "is no text"));
    CHECK(log_says(refusal_of_log("RTSCENE.."), "compiled scene"));
    const std::pair<const char*, const char*> rows[] = {
        {"0.1,,0,0,1,0,0,0", "log.csv:3: column x is empty"},
        {"0.1,0,nan,0,1,0,0,0", "log.csv:3: column y is nan"},
        {"0.1,0,0,Inf,1,0,0,0", "log.csv:3: column z is Inf"},
        {"0.1,0,0,1e999,1,0,0,0", "log.csv:3: column z is '1e999', no number in range"},
        {"0.1,0,0,one,1,0,0,0", "log.csv:3: column z is 'one'"},
        {"0.1,0,0,0,1,0,0", "log.csv:3: has 7 fields"},
        {"0.1,0,0,0,1,0,0,0,5", "log.csv:3: has more than 8 fields"},
        {"0.1,\"0,0,0,1,0,0,0", "log.csv:3: a quote does not end"},
        {"0.1,0,0,0,0,0,0,0", "log.csv:3: the quaternion qw, qx, qy, qz has length 0"},
        {"0.1,0,0,0,1,0.5,0,0", "has length 1.118, not 1"},
        {"2024-05-01T10:00:00,0,0,0,1,0,0,0", "log.csv:3: column t is a date"},
        {"0,0,0,0,1,0,0,0", "log.csv:3: the time is that of line 2"},
        {"-1,0,0,0,1,0,0,0", "log.csv:3: the time runs backwards"}};
    for (const auto& [row, text] : rows)
      CHECK(log_says(refusal_of_log(names + first + row + "\n"), text));
    CHECK(log_says(refusal_of_log("t,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n"), "no quaternion"));
    CHECK(log_says(
        refusal_of_log("t,a.position.x,a.position.y,a.position.z,b.position.x,b.position.y,"
                       "b.position.z,qw,qx,qy,qz\n0,0,0,0,0,0,0,1,0,0,0\n"),
        "holds several positions"));
    CHECK(log_says(refusal_of_log("t,x,x,y,z,qw,qx,qy,qz\n0,0,0,0,0,1,0,0,0\n"), "two columns"));
    CHECK(log_says(refusal_of_log("1 2 3\n2 3 4\n"), ":1: has 3 numbers where 8 are expected"));
  }

  TEST_CASE("resampled: through every sample, straight between, never beyond") {
    const LogFile file("t,x,y,z,qx,qy,qz,qw\n" + three_rows(kSeconds, "txyzabcw"));
    const MotionLog log = read_motion_log(file.options);
    const std::vector<MotionSample> even = resampled(log.samples, 1000);
    REQUIRE(even.size() == 21);
    for (std::size_t k = 0; k < even.size(); ++k) {
      const double share = static_cast<double>(k) / 10;
      CHECK(even[k].t_s == doctest::Approx(0.001 * static_cast<double>(k)));
      CHECK(even[k].p[0] == doctest::Approx(0.001 * (1 + share)).epsilon(1e-6));
      CHECK(turn_between(even[k], even[0]) == doctest::Approx(0.6 * share).epsilon(1e-4));
    }
    write_motion_csv(file.folder.file("m.csv"), even);
    CHECK(read_played_motion(file.folder.file("m.csv")).size() == 21);
  }

  TEST_CASE("placed: turned, then moved; or so that one pose is another") {
    MotionSample a, b;
    a.p[0] = 1;
    b.p[2] = 0.5;
    b.q_wxyz[0] = b.q_wxyz[3] = std::sqrt(0.5);
    std::vector<MotionSample> motion = {a, a};
    motion[1].p[0] = 2;
    place(motion, placement_between(a, b));
    CHECK(motion[0].p[2] == doctest::Approx(0.5));
    CHECK(turn_between(motion[0], b) < 1e-7);
    CHECK(motion[1].p[0] == doctest::Approx(0));
    CHECK(motion[1].p[1] == doctest::Approx(1));
  }

  TEST_CASE("what can hardly be meant is told: unit, speed, gap, order") {
    const auto warnings = [](const std::string& text) {
      const MotionLog log = read_motion_log(LogFile("t,x,y,z,qw,qx,qy,qz\n" + text).options);
      std::string all;
      for (const std::string& each : log_warnings(log, log_figures(log), std::nullopt)) all += each;
      return all + order_warning(log, std::nullopt).value_or("");
    };
    CHECK(warnings("0,0,0,0,1,0,0,0\n0.1,0.01,0,0,1,0,0,0\n") == "");
    CHECK(log_says(warnings("0,5,0,0,1,0,0,0\n0.1,5.1,0,0,1,0,0,0\n"), "say --unit mm"));
    CHECK(log_says(warnings("0,0,0,0,1,0,0,0\n0.1,1,0,0,1,0,0,0\n"), "10 m/s in the mean"));
    CHECK(log_says(warnings("0,0,0,0,1,0,0,0\n0.01,0,0,0,1,0,0,0\n0.02,0,0,0,1,0,0,0\n"
                            "0.5,0,0,0,1,0,0,0\n"),
                   "no sample for 0.48 s before line 5"));
    CHECK(log_says(warnings("0,0,0,0,0,0,0,1\n0.1,0,0,0,0,0,0.1,0.995\n"), "say --order xyzw"));
    const MotionLog far = read_motion_log(
        LogFile("t,x,y,z,qw,qx,qy,qz\n0,412,0,0,1,0,0,0\n0.1,413,0,0,1,0,0,0\n").options);
    CHECK_THROWS_WITH_AS(require_near(far, log_figures(far)), doctest::Contains("say --unit mm"),
                         haptic::tools::InputError);
  }

  TEST_CASE("the program: a motion that is played, what it says, and where it starts") {
    const LogFile file("t,x,y,z,qx,qy,qz,qw\n" + three_rows(kSeconds, "txyzabcw"));
    const std::string scene = file.folder.file("s.rtscene"), out = file.folder.file("m.csv");
    const haptic::sim::Solid block = box_solid("block", {-0.1, -0.1, -0.08}, {0.1, 0.1, -0.03});
    const std::vector<std::byte> bytes = scene_of(centred_box("cube", 0.01, 0.01, 0.01),
                                                  {&block, 1}, 800, 1e-4, haptic::LawId::kProxy);
    std::ofstream(scene, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    const std::string from = "motion --from '" + file.options.path + "' -o '" + out + "'";
    const ProgramResult far = run_program(HAPTIC_HOST_SIM, from + " --scene '" + scene + "'");
    CHECK(far.exit_code == 0);
    CHECK(log_says(far.out, "m.csv: 21 samples, 0.020 s at 1000 Hz"));
    CHECK(log_says(far.out, "longest 10 ms, before line 3"));
    CHECK(log_says(far.err, "from the scene's start"));
    const ProgramResult near = run_program(HAPTIC_HOST_SIM, from + " --start-at '" + scene + "'");
    CHECK(near.exit_code == 0);
    CHECK(near.err.empty());
    const std::string play = "replay '" + scene + "' --motion '";
    CHECK(run_program(HAPTIC_HOST_SIM, play + out + "'").exit_code == 0);
    const ProgramResult raw = run_program(HAPTIC_HOST_SIM, play + file.options.path + "'");
    CHECK(raw.exit_code == 3);
    CHECK(log_says(raw.err, "host_sim motion --from " + file.options.path));
    const ProgramResult turned =
        run_program(HAPTIC_HOST_SIM, from + " --place=-1mm,0,0.1 --turn 0,0,0,2");
    CHECK(turned.exit_code == 0);
    const std::vector<MotionSample> motion = read_motion_csv(out);
    CHECK(motion[0].p[0] == doctest::Approx(-0.002));
    CHECK(motion[0].p[2] == doctest::Approx(0.4));
    CHECK(std::abs(motion[0].q_wxyz[3]) == doctest::Approx(1));
    for (const char* wrong : {" --place 1,2", " --turn 0,0,0,0", " --order zyx", " --unit inch",
                              " --start-at x --place 0,0,0", " --rate 0"})
      CHECK(run_program(HAPTIC_HOST_SIM, from + wrong).exit_code == 2);
    const LogFile distant("t,x,y,z,qw,qx,qy,qz\n0,412,0,0,1,0,0,0\n0.1,412.001,0,0,1,0,0,0\n");
    const ProgramResult moved =
        run_program(HAPTIC_HOST_SIM, "motion --from '" + distant.options.path + "' -o '" + out +
                                         "' --start-at '" + scene + "'");
    CHECK(moved.exit_code == 0);
    CHECK(log_says(moved.err, "positions reached 412 m from the origin; where these are milli"));
    CHECK(run_program(HAPTIC_HOST_SIM, "motion '" + file.options.path + "' -o '" + out + "'")
              .exit_code == 2);
  }
}
