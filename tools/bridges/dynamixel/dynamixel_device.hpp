// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A leader arm on DYNAMIXEL X servos as a haptic device: poses by its URDF, forces by the servos'
/// current mode.
///
/// A cycle is one write and one read: the goal currents of all joints, and a fast sync read of
/// current, velocity and position of all servos. Nothing waits for an answer but `open` and
/// `close`. Each servo's own watchdog is set to 20 ms and read back: it is fed by cycles alone.
///
/// | what goes wrong | what happens |
/// |---|---|
/// | an answer is late or damaged | no sample of that cycle; goals are written in the next one, and
/// its answer has another length, so that the late one is told apart |
/// | 10 ms and two cycles without a sample | the wrench ramps to zero in 10 ms; the arm's weight
/// stays carried | | 100 ms without a sample (a servo or a cable is missing) | kLost; `close` lets
/// the weight go over 1 s | | the adapter is unplugged | kLost at once; the servos cut after 20 ms,
/// and the arm falls | | a servo's watchdog has cut | fault; acknowledged by 0, set again, weight
/// back over 1 s | | a servo says alert | fault: overheated, or drive fault (voltage, encoder,
/// shock, overload) | | a servo has started again | kLost: its mode, torque and turns are not what
/// they were | | this program dies | the servos cut after 20 ms, and the arm falls |

#include <array>
#include <memory>

#include "hal/bridge/bridged_device.hpp"
#include "tools/bridges/arm/arm_settings.hpp"
#include "tools/bridges/arm/joint_torques.hpp"
#include "tools/bridges/dynamixel/dynamixel_bus.hpp"
#include "tools/bridges/dynamixel/dynamixel_servo.hpp"
#include "tools/bridges/serial/bus_timing.hpp"

namespace haptic::tools {

struct DynamixelSettings {
  ArmSettings arm;
  bool pose_only = false;           ///< no torque, ever; any X servo
  JointNumbers torque_limits_nm{};  ///< 0: a third of what the servo's current limit gives
  JointNumbers torque_nm_per_a{};   ///< 0: the model's
  double max_force_n = 0;           ///< 0: stated_force
  double gravity_share = 1;         ///< of the arm's weight that it carries
};

class DynamixelDevice final : public hal::BridgedDevice {
 public:
  explicit DynamixelDevice(DynamixelSettings settings);
  ~DynamixelDevice() override { close(); }

  /// Takes up to a second. No torque is on before the first `read`.
  [[nodiscard]] bool open(std::string& why) override;
  [[nodiscard]] const hal::BridgeFacts& facts() const override { return facts_; }
  /// Between two samples kSame, and kSilent once one is late.
  [[nodiscard]] hal::BridgeRead read(std::int64_t now_ns, hal::BridgeSample& sample) override;
  /// False while torque and watchdogs are being set, and while the servos do not answer. The wrench
  /// goes out within a cycle.
  [[nodiscard]] bool write(std::int64_t now_ns, const Wrench& wrench_d) override;
  /// The wrench goes to zero at once, the arm's weight stays carried until `close`. True once the
  /// servos have answered a cycle without a wrench.
  [[nodiscard]] bool release(std::int64_t now_ns) override;
  /// Lets the arm's weight go over 1 s, then takes torque and watchdogs off and gives back the
  /// operating modes that were found. Takes 1.2 s, and up to 3 s where servos do not answer.
  void close() noexcept override;
  [[nodiscard]] pollfd watched() const noexcept override { return {port_.descriptor(), POLLIN, 0}; }

  [[nodiscard]] const CycleCounts& cycles() const noexcept { return counts_; }
  /// Joint torques of the last cycle [N m].
  [[nodiscard]] const JointNumbers& torques_nm() const noexcept { return torques_nm_; }

 private:
  static constexpr std::size_t kMaxServos = kMaxJoints + 1;
  enum class Phase : std::uint8_t { kClosed = 0, kSetup, kRunning, kLost };
  enum class Query : std::uint8_t { kNone = 0, kPose, kWatchdog, kError, kSetup };
  struct Servo {
    std::uint8_t id = 0;
    std::string_view model;
    double unit_a = 0, nm_per_a = 0;
    int most_counts = 0;  ///< of goal current
    std::uint8_t found_mode = kCurrentMode;
    bool is_ours = false;  ///< its torque was taken off for us
    bool mode_changed = false;
    std::uint8_t hardware_error = 0;
    bool alert = false, asked = false;  ///< asked why
  };

  // dynamixel_open.cpp
  [[nodiscard]] bool find_servos(std::string& why);
  [[nodiscard]] bool prepare(Servo& servo, bool is_joint, std::string& why);
  [[nodiscard]] bool measure_cycle(std::string& why);
  void state_facts();
  void settle_limits();
  void give_back() noexcept;

  // dynamixel_device.cpp
  void step(std::int64_t now_ns) noexcept;
  void take_answers(std::int64_t now_ns) noexcept;
  void take(const DynamixelStatus& status, std::int64_t now_ns) noexcept;
  void take_pose(const DynamixelStatus& status, std::int64_t now_ns) noexcept;
  void take_watchdogs(const DynamixelStatus& status, std::int64_t now_ns) noexcept;
  void take_setup(const DynamixelStatus& status) noexcept;
  void miss() noexcept;
  void start(Query query, std::int64_t now_ns) noexcept;
  void start_next(std::int64_t now_ns) noexcept;
  void start_cycle(std::int64_t now_ns) noexcept;
  void add_goals(std::int64_t now_ns) noexcept;
  void add_to_all(std::uint16_t address, std::uint8_t value) noexcept;
  void add_fast_read(std::uint16_t address, std::size_t bytes, std::size_t servos) noexcept;
  /// The servos have answered lately, so they hear.
  [[nodiscard]] bool is_fresh(std::int64_t now_ns) const noexcept;
  void move_shares(std::int64_t now_ns) noexcept;
  [[nodiscard]] std::uint32_t faults(std::int64_t now_ns) const noexcept;
  void fill(hal::BridgeSample& sample, std::int64_t now_ns) const noexcept;
  [[nodiscard]] std::size_t joints() const noexcept { return settings_.arm.arm.model.joint_count; }
  /// Bytes that a servo says of its presence in the newest question.
  [[nodiscard]] std::size_t present_bytes() const noexcept { return kPresentBytes + more_bytes_; }
  /// Length of the fast answer to the newest question.
  [[nodiscard]] std::size_t answer_bytes() const noexcept;

  DynamixelSettings settings_;
  hal::BridgeFacts facts_;
  SerialPort port_;
  DynamixelBus bus_{port_};
  DynamixelOutput output_;
  DynamixelInput input_;
  CycleCounts counts_;
  std::array<Servo, kMaxServos> servos_;  ///< joints first, then the trigger
  std::size_t servo_count_ = 0;
  JointNumbers limits_nm_{}, turns_rad_{};
  StatedForce stated_;

  Phase phase_ = Phase::kClosed;
  Query query_ = Query::kNone;   ///< that is being answered
  std::size_t error_servo_ = 0;  ///< of Query::kError
  std::size_t setup_step_ = 0;
  std::size_t more_bytes_ = 0;  ///< 0 to 11, another one after each answer that has not come
  unsigned clean_poses_ = 0;    ///< since then
  /// The cycle is a sixteenth shorter than the period that the facts state, so that each report has
  /// a sample of its own. An answer is late after late_ns_.
  std::int64_t cycle_ns_ = 0, late_ns_ = 0;
  std::int64_t started_ns_ = 0, next_ns_ = 0;  ///< of cycles
  std::int64_t posed_ns_ = 0;                  ///< of the last sample: when its read was written
  std::int64_t shares_ns_ = 0;                 ///< when the shares were moved last
  std::int64_t fault_until_ns_ = 0;
  unsigned cycles_to_watchdog_ = 0;
  bool posed_ = false;  ///< a sample has come since `read` handed the last one out
  bool any_pose_ = false;

  JointNumbers angles_rad_{}, rates_rad_per_s_{}, torques_nm_{};
  ArmPlace place_;
  bool trigger_pulled_ = false;
  Wrench felt_d_;
  /// After `release` until a cycle with no wrench has been written and answered.
  bool wrote_felt_ = false;  ///< the last goals had a share of a wrench
  bool zero_to_be_written_ = false, zero_unanswered_ = false;
  bool is_driven_ = false;  ///< the host has had the drives on since `open`
  bool is_closing_ = false;
  double support_share_ = 0;  ///< of weight and walls
  double felt_share_ = 0;     ///< of the wrench
};

/// The device of a configuration's keys; null with `defect` filled.
[[nodiscard]] std::unique_ptr<hal::BridgedDevice> make_dynamixel(const hal::DriverOptions& options,
                                                                 hal::DriverDefect& defect);

}  // namespace haptic::tools
