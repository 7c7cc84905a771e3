// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One device of a run: its link, what is seen of it, what is said of it, and its account.

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "hal/device_link.hpp"
#include "hal/input/key_switch.hpp"
#include "hal/local/process_peer.hpp"
#include "hal/zero_command.hpp"
#include "tools/run_device/bridge_process.hpp"
#include "tools/run_device/device_fit.hpp"
#include "tools/run_device/device_run.hpp"
#include "tools/run_device/link_watch.hpp"
#include "tools/run_device/run_events.hpp"
#include "tools/run_device/simulated_peer.hpp"

namespace haptic::tools {

/// Owner: the thread that runs it. What the link's thread works with is in it.
class RunLine {
 public:
  /// `stroke_m`: of the hand of a simulated device.
  RunLine(const DeviceConfig& config, std::size_t device, const std::array<double, 3>& stroke_m,
          const RunWatch& watch);
  RunLine(const RunLine&) = delete;
  RunLine& operator=(const RunLine&) = delete;

  /// Starts the bridge of a device that is reached by one, with the rights that this process has.
  /// @throws OsError  it cannot be started.
  void start_bridge();
  /// Before the link is made: a share of force and torque, on a machine that is not fit.
  void lower(double share) {
    limits_ = lowered(limits_, share);
    share_ = share;
  }
  void make_link(const hal::DeviceMailbox& mailbox, hal::ZeroHolder& keeper,
                 const SceneBytes& scene);
  [[nodiscard]] hal::DeviceLink& link() { return *link_; }
  /// Watches for another servo process from now on.
  void follow(const ServoBoard& board) { bus_.follow(board.window); }

  // While it runs.
  [[nodiscard]] RunStatus status(double t_s, std::int64_t silence_ns,
                                 const ServoBoard& board) const;
  /// Events since the last look.
  void look(const RunStatus& status) { events_.look(status); }
  void tell_notes();
  /// Tells the words of its bridge as events.
  void look_at_bridge(double t_s);
  void stop() { link_->emergency_stop(); }
  /// From any thread.
  void stop_if_held() noexcept {
    if (is_held_.load(std::memory_order_acquire)) link_->emergency_stop();
  }
  void begin_ending() { bus_.begin_ending(); }
  [[nodiscard]] bool was_there() const { return link_->counters().connects > 0; }
  /// Why the device that was found is not driven; empty: it is, or was.
  [[nodiscard]] std::string refusal() const;
  /// Nothing would take its force away but this process.
  [[nodiscard]] bool needs_keeper() const;
  /// "device 2: " of two.
  [[nodiscard]] const std::string& words() const { return words_; }

  // At the end of a servo process, and of the run.
  void add(const ServoBoard& board);
  /// While the servo process still runs: what is not of the end.
  void note_last(const ServoBoard& board);
  /// Once all has ended.
  void finish();
  [[nodiscard]] const DeviceAccount& account() const { return account_; }

 private:
  [[nodiscard]] hal::LinkSettings link_settings(const SceneBytes& scene);
  [[nodiscard]] std::string admit(const hal::DeviceCapabilities& device);
  [[nodiscard]] StatedDevice stated() const;

  const DeviceConfig& config_;
  const HandDevice& device_;
  std::size_t number_;
  std::string words_;
  const RunWatch& watch_;
  LinkWatch bus_;
  RunEvents events_;
  PressingHand hand_;  ///< of the peer
  std::unique_ptr<SimulatedPeer> peer_;
  std::unique_ptr<BridgeProcess> bridge_;  ///< outlives the link: it gets the last zero
  std::unique_ptr<hal::ProcessPeer> socket_;
  std::unique_ptr<hal::KeySwitch> deadman_;
  SafetyLimits limits_;             ///< the configuration's, lowered as the machine is not fit
  double share_ = 1;                ///< by which they are lowered, and what the device states
  std::optional<DeviceGate> gate_;  ///< made with the link
  std::unique_ptr<hal::DeviceLink> link_;
  mutable std::mutex stated_mutex_;
  StatedDevice stated_;               ///< at the last connection
  std::string unfit_;                 ///< why its switches cannot be used; empty: they can
  std::atomic<bool> is_held_{false};  ///< link_ is there
  DeviceAccount account_;
};

}  // namespace haptic::tools
