// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A handle in this process that speaks the reference protocol, and the hand that moves it: for
/// trying out the loop without hardware. It is not a model of a device: a mass and a damper in
/// three directions, no friction, encoder steps or drives, and a grip that the hand turns as it
/// wants, which holds every torque.

#include <array>
#include <cstdint>

#include "hal/drivers/reference_codec.hpp"
#include "hal/local/local_peer.hpp"
#include "rt_core/scene/scene_format.hpp"

namespace haptic::tools {

/// Where a hand wants the handle in D, and whether it holds the deadman switch.
struct HandWish {
  std::array<double, 3> position_m{};
  std::array<double, 4> q_xyzw{0, 0, 0, 1};  ///< unit
  bool deadman = false;
};

/// The peer as a loop meets it: the hand never lets go of it, so its damper counts, and no torque
/// turns it. `late_s`: from a sample to the begin of its wrench.
[[nodiscard]] DeviceParameters held_peer(double late_s) noexcept;
/// Periods that a loop by the timer and the link's thread let pass between the two, at most.
inline constexpr double kPeerLatePeriods = 2;

/// Owner: the link's thread.
class SimulatedHand {
 public:
  virtual ~SimulatedHand() = default;
  /// At `t_s` after the device was plugged in; once a period, in order. Wait-free.
  virtual HandWish wish(double t_s) noexcept = 0;
};

/// Rests with the deadman switch released, goes to where it presses with it held, presses, comes
/// back, and so on.
class PressingHand final : public SimulatedHand {
 public:
  /// @param stroke_m  to where, from the origin of D
  explicit PressingHand(const std::array<double, 3>& stroke_m) noexcept : stroke_m_(stroke_m) {}
  HandWish wish(double t_s) noexcept override;

 private:
  std::array<double, 3> stroke_m_;
};

struct SimulatedPeerSettings {
  std::int64_t period_ns = 1'000'000;  ///< of its reports; 0.1 to 20 ms
  std::uint32_t deadman = 1;           ///< switches that the hand holds while it presses
};

/// Counts since it was plugged in.
struct SimulatedPeerCounters {
  std::uint64_t commands = 0, refused = 0, watchdog_cuts = 0;
  std::uint64_t released = 0;  ///< the host took the drives off by a command
};

/// Owner: the link's thread; `counters` once that has ended. Periods that nobody asked for pass all
/// the same, at most kMostPeriods of them at once.
class SimulatedPeer final : public hal::LocalPeer {
 public:
  static constexpr int kMostPeriods = 100;

  /// `hand` outlives the peer.
  SimulatedPeer(const SimulatedPeerSettings& settings, SimulatedHand& hand) noexcept
      : settings_(settings), hand_(&hand) {}

  hal::HalStatus plug(std::int64_t now_ns) noexcept override;
  hal::HalStatus control(const hal::ControlRequest& request, std::span<std::uint8_t> bytes,
                         std::size_t& moved) noexcept override;
  [[nodiscard]] std::int64_t next_report_ns() const noexcept override { return due_ns_; }
  std::size_t report(std::int64_t now_ns, std::span<std::uint8_t> bytes,
                     std::int64_t& sampled_ns) noexcept override;
  void command(std::int64_t now_ns, std::span<const std::uint8_t> bytes) noexcept override;

  [[nodiscard]] const SimulatedPeerCounters& counters() const noexcept { return counters_; }

 private:
  void pass_period() noexcept;

  SimulatedPeerSettings settings_;
  SimulatedHand* hand_;
  HandWish wish_;
  SimulatedPeerCounters counters_;
  std::int64_t due_ns_ = 0;
  std::uint64_t periods_ = 0, fed_ = 0;  ///< fed_: period of the last command accepted
  std::array<double, 3> position_m_{}, velocity_m_per_s_{}, force_n_{};  ///< D axes
  std::array<double, 3> turn_rad_per_s_{};
  std::uint32_t sequence_ = 0, accepted_ = 0, tick_ = 0;
  bool drives_on_ = false, cut_ = false;
  bool fresh_ = true;  ///< no command without the drives' bit since it was plugged in
};

}  // namespace haptic::tools
