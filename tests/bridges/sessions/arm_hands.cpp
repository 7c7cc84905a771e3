// SPDX-License-Identifier: Apache-2.0
// Hands on leader arms: six joints led so that the handle goes where the hand wants it, and the
// servos' currents as a force at the handle. The arm is that of its URDF, by formulas that the
// bridges do not have.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <utility>

#include <Eigen/LU>

#include "hal/clock/servo_clock.hpp"
#include "tests/bridges/arms/dynamixel_emulator.hpp"
#include "tests/bridges/arms/feetech_emulator.hpp"
#include "tests/bridges/arms/random_arm.hpp"
#include "tests/bridges/sessions/emulated_hand.hpp"
#include "tests/support/program_run.hpp"

namespace haptic::test {
namespace {

using Column6 = Eigen::Matrix<double, 6, 1>;
using Square6 = Eigen::Matrix<double, 6, 6>;
using Column3d = Eigen::Matrix<double, 3, 1>;
using Square3d = Eigen::Matrix<double, 3, 3>;

constexpr double kCounts_per_rad = 4096 / 6.283185307179586;
constexpr double kGravity_m_per_s2 = 9.80665;

/// The small arm of random_arm.hpp, its base as the bridges place it: a quarter turn about z.
class LedArm {
 public:
  LedArm() {
    begin_ << 0.2, -0.6, 1.1, 0.3, 0.7, -0.2;
    angles_ = begin_;
    at_begin_ = handle(begin_);
  }
  [[nodiscard]] const Column6& angles() const { return angles_; }
  /// The handle's way in D, not turned, by Newton's method.
  void lead(const Vec3& way_d) {
    const Column3d wanted = at_begin_.p + turn_db().transpose() * way_d.cast<double>();
    for (int k = 0; k < 20; ++k) {
      const Place now = handle(angles_);
      Column6 miss;
      miss.head<3>() = wanted - now.p;
      const Square3d back = at_begin_.r * now.r.transpose();
      miss.tail<3>() << back(2, 1) - back(1, 2), back(0, 2) - back(2, 0), back(1, 0) - back(0, 1);
      miss.tail<3>() *= 0.5;
      if (miss.norm() < 1e-9) return;
      angles_ += jacobian(angles_).fullPivLu().solve(miss);
    }
    throw std::runtime_error("the arm does not reach where its hand goes");
  }
  /// Force at the handle in D of joint torques, beside those that carry the arm's weight.
  [[nodiscard]] static Vec3 force_d(const Column6& angles, const Column6& torques_nm) {
    const Column6 rest = torques_nm - weight_nm(angles);
    const Column6 wrench = jacobian(angles).transpose().fullPivLu().solve(rest);
    return (turn_db() * wrench.head<3>()).cast<Real>();
  }

 private:
  struct Place {
    Column3d p;
    Square3d r;
  };
  static Square3d turn_db() { return (Square3d() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished(); }
  static std::vector<OraclePlace> places(const Column6& q, int imaginary = -1) {
    std::vector<Complex> angles;
    for (int k = 0; k < 6; ++k)
      angles.emplace_back(q[k], k == imaginary ? static_cast<long double>(kStep) : 0.0L);
    return oracle_places(leader_chain(), angles);
  }
  static Place handle(const Column6& q) {
    const OraclePlace at = places(q).back();
    Place place;
    for (int i = 0; i < 3; ++i) {
      const auto row = static_cast<std::size_t>(i);
      place.p[i] = static_cast<double>(at.at[row].real());
      for (int j = 0; j < 3; ++j)
        place.r(i, j) = static_cast<double>(at.turn[row][static_cast<std::size_t>(j)].real());
    }
    return place;
  }
  /// By a step in the imaginary direction: exact to rounding.
  static Square6 jacobian(const Column6& q) {
    Square6 j;
    const Square3d r = handle(q).r;
    for (int k = 0; k < 6; ++k) {
      const OraclePlace at = places(q, k).back();
      Square3d dr;
      for (int i = 0; i < 3; ++i) {
        const auto row = static_cast<std::size_t>(i);
        j(i, k) = static_cast<double>(at.at[row].imag()) / kStep;
        for (int c = 0; c < 3; ++c)
          dr(i, c) = static_cast<double>(at.turn[row][static_cast<std::size_t>(c)].imag()) / kStep;
      }
      const Square3d w = dr * r.transpose();
      j.block<3, 1>(3, k) << w(2, 1), w(0, 2), w(1, 0);
    }
    return j;
  }
  /// Torques that hold the arm against its weight: the derivative of its potential.
  static Column6 weight_nm(const Column6& q) {
    const std::vector<OracleLink> chain = leader_chain();
    Column6 torques;
    for (int k = 0; k < 6; ++k) {
      const std::vector<OraclePlace> at = places(q, k);
      double sum = 0;
      for (std::size_t link = 0; link < chain.size(); ++link) {
        Complex height = at[link].at[2];
        for (std::size_t j = 0; j < 3; ++j)
          height += at[link].turn[2][j] * static_cast<long double>(chain[link].centre[j]);
        sum += chain[link].mass * static_cast<double>(height.imag()) / kStep;
      }
      torques[k] = kGravity_m_per_s2 * sum;
    }
    return torques;
  }

  static constexpr double kStep = 1e-20;
  Column6 begin_, angles_;
  Place at_begin_;
};

/// Common to both buses: a folder that stands for this machine's adapters, the arm's description.
class ArmHand : public EmulatedHand {
 public:
  ArmHand(const std::string& adapter, const std::string& port) {
    const std::filesystem::path by_id = root_.file("dev/serial/by-id");
    std::filesystem::create_directories(by_id);
    std::filesystem::create_symlink(port, by_id / adapter);
    std::ofstream(root_.file("arm.urdf")) << urdf_of(leader_chain());
  }
  [[nodiscard]] std::string absence() const override {
    return HAPTIC_READS_URDF != 0 ? "" : "this build reads no URDF (libtinyxml2-dev)";
  }
  [[nodiscard]] std::string list_arguments() const override {
    return "--root '" + std::filesystem::path(root_.file("dev")).parent_path().string() + "'";
  }
  [[nodiscard]] std::string filled(std::string toml) const override {
    const auto machine = std::filesystem::path(root_.file("dev")).parent_path().string();
    fill(toml, "\"/dev/serial/", "\"" + machine + "/dev/serial/");
    fill(toml, "\"ARM.urdf\"", "\"" + root_.file("arm.urdf") + "\"");
    fill(toml, "\"BASE\"", "\"base\"");
    fill(toml, "\"HANDLE\"", "\"tip\"");
    return toml + "trigger_id = 7\ntrigger_rad = \"0 0.5\"\n";
  }

 protected:
  LedArm arm_;

 private:
  static void fill(std::string& toml, const std::string& gap, const std::string& with) {
    const std::size_t at = toml.find(gap);
    if (at == std::string::npos) throw std::runtime_error("list does not ask for " + gap);
    toml.replace(at, gap.size(), with);
  }
  const sim::test::ScratchFolder root_{"arm_hand_" + std::to_string(hal::monotonic_ns())};
};

class DynamixelHand final : public ArmHand {
 public:
  DynamixelHand() : DynamixelHand(std::make_unique<DynamixelEmulator>(7, kXc330T288)) {}
  /// With a third of what its servos can, this arm carries its weight and nothing else: its bridge
  /// says so, and which key helps.
  [[nodiscard]] std::string filled(std::string toml) const override {
    return ArmHand::filled(std::move(toml)) + "torque_limits_nm = \"0.9 0.9 0.9 0.5 0.5 0.5\"\n";
  }
  /// A cycle of up to 4 ms, as a busy machine has it: a cue.
  [[nodiscard]] double stiffness_n_per_m() const override { return 60; }
  /// The arm's weight is carried from arming on, over a second.
  [[nodiscard]] double settling_s() const override { return 1.2; }
  void press(bool pressed) override {
    bus_->with([&](DynamixelEmulator& e) {
      DynamixelEmulator::set(e.servo(7), 132, 4, counts(pressed ? 0.5 : 0.0));
    });
  }
  void move(const Vec3& way_d) override {
    const std::int64_t now_ns = hal::monotonic_ns();
    if (now_ns - moved_ns_ < 3'000'000) return;
    moved_ns_ = now_ns;
    arm_.lead(way_d);
    bus_->with([&](DynamixelEmulator& e) {
      for (int k = 0; k < 6; ++k)
        DynamixelEmulator::set(e.servo(k + 1), 132, 4, counts(arm_.angles()[k]));
    });
    led_.emplace_back(now_ns, arm_.angles());
  }
  /// By the angles that stood when the goals came.
  [[nodiscard]] std::vector<WireForce> wire() const override {
    std::vector<WireForce> forces;
    std::size_t at = 0;
    for (const DynamixelEmulator::Goals& goal :
         bus_->with([](DynamixelEmulator& e) { return e.goals; })) {
      while (at + 1 < led_.size() && led_[at + 1].first <= goal.at_ns) ++at;
      Column6 torques;
      for (int k = 0; k < 6; ++k)
        torques[k] = kAmperes_per_unit * kNm_per_ampere * goal.current.at(k + 1);
      if (!led_.empty()) forces.push_back({goal.at_ns, LedArm::force_d(led_[at].second, torques)});
    }
    return forces;
  }
  [[nodiscard]] bool is_limp() const override {
    return bus_->with([](DynamixelEmulator& e) {
      for (int id = 1; id <= 7; ++id)
        if (e.current(id) != 0) return false;
      return true;
    });
  }

 private:
  // e-Manual, XC330-T288: model number, unit of goal current, stall torque over stall current.
  static constexpr int kXc330T288 = 1220;
  static constexpr double kAmperes_per_unit = 0.001, kNm_per_ampere = 1.15;
  explicit DynamixelHand(std::unique_ptr<DynamixelEmulator> bus)
      : ArmHand("usb-FTDI_USB__-__Serial_Converter_FT1234-if00-port0", bus->path()),
        bus_(std::move(bus)) {
    move(Vec3::Zero());
    press(false);
  }
  static int counts(double angle_rad) {
    return static_cast<int>(std::lround(angle_rad * kCounts_per_rad));
  }
  const std::unique_ptr<DynamixelEmulator> bus_;
  std::vector<std::pair<std::int64_t, Column6>> led_;
  std::int64_t moved_ns_ = 0;
};

class FeetechHand final : public ArmHand {
 public:
  FeetechHand() : FeetechHand(std::make_unique<FeetechEmulator>(7)) {}
  void press(bool pressed) override {
    bus_->with([&](FeetechEmulator& e) {
      FeetechEmulator::turn(e.servo(7), counts(pressed ? 0.5 : 0.0));
    });
  }
  void move(const Vec3& way_d) override {
    const std::int64_t now_ns = hal::monotonic_ns();
    if (now_ns - moved_ns_ < 3'000'000) return;
    moved_ns_ = now_ns;
    arm_.lead(way_d);
    bus_->with([&](FeetechEmulator& e) {
      for (int k = 0; k < 6; ++k) FeetechEmulator::turn(e.servo(k + 1), counts(arm_.angles()[k]));
    });
  }

 private:
  explicit FeetechHand(std::unique_ptr<FeetechEmulator> bus)
      : ArmHand("usb-1a86_USB_Single_Serial_0000000000-if00", bus->path()), bus_(std::move(bus)) {
    move(Vec3::Zero());
    press(false);
  }
  /// Within one turn.
  static int counts(double angle_rad) {
    const int steps = static_cast<int>(std::lround(angle_rad * kCounts_per_rad)) % 4096;
    return steps < 0 ? steps + 4096 : steps;
  }
  const std::unique_ptr<FeetechEmulator> bus_;
  std::int64_t moved_ns_ = 0;
};

}  // namespace

std::unique_ptr<EmulatedHand> make_dynamixel_hand() { return std::make_unique<DynamixelHand>(); }
std::unique_ptr<EmulatedHand> make_feetech_hand() { return std::make_unique<FeetechHand>(); }

}  // namespace haptic::test
