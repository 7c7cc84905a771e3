// SPDX-License-Identifier: Apache-2.0
#pragma once
/// One connection to the Inverse service, held by a thread of its own: each period it sends the
/// newest force and waits for the answer, which is the newest state. Nothing queues: one message is
/// in flight, and a force that grew old on the way is not sent.
///
/// The service exerts the last force until the next message, also while it stalls, and no one else
/// can take it away then. When it answers again after HaplyTimes::cut_ns the next force is zero,
/// and stays zero until the drives have been off once: force comes back as a ramp, never as a jump.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>

#include "hal/bridge/device_tap.hpp"
#include "rt_core/exchange/newest_record.hpp"
#include "tools/bridges/haply/haply_messages.hpp"
#include "tools/bridges/haply/service_socket.hpp"

namespace haptic::tools {

/// Times of a connection [ns], all of its period.
struct HaplyTimes {
  std::int64_t period_ns = 1'000'000;
  /// A force older than this is not sent.
  [[nodiscard]] std::int64_t old_ns() const { return 2 * period_ns; }
  /// Without an answer for longer than this the service is silent.
  [[nodiscard]] std::int64_t silent_ns() const { return 3 * period_ns; }
  /// Without an answer, or without a new force, for longer than this: zero.
  [[nodiscard]] std::int64_t cut_ns() const { return 10 * period_ns; }
};

/// No answer for so long: the service is gone.
inline constexpr std::int64_t kHaplyGone_ns = 2'000'000'000;
/// Messages in a row that are wrong, or that do not list the device.
inline constexpr unsigned kMostHaplyErrors = 10;
/// A grip that is not heard for so long: the orientation is not true.
inline constexpr std::int64_t kHaplyGripGone_ns = 200'000'000;

/// Why the force was taken away with the connection alive.
enum class HaplyCut : std::uint64_t {
  kNone = 0,
  kStalled,     ///< the service did not answer
  kLate,        ///< no new force came from the host
  kOtherForce,  ///< the service exerts a force that is not ours
  kUnpowered,   ///< the device says that its supply is off
  kBadForce,    ///< a force that is not finite was handed over
  kNotTaken,    ///< the service says that it exerts nothing of what it is sent
  kCount
};

/// Why the connection ended.
enum class HaplyEnd : std::uint64_t {
  kNone = 0,
  kClosed,     ///< the service ended, or was started again
  kTooLong,    ///< a text of more than 64 kB
  kErrors,     ///< kMostHaplyErrors wrong messages in a row; `verdict` is the last one's
  kUnplugged,  ///< as many that do not list the device
  kNoAnswer,   ///< for kHaplyGone_ns
  kNotSent,    ///< the system did not take a message
  kCount
};

/// The thread's word, newest alone. All members of 8 bytes: no padding crosses the threads.
struct HaplyReport {
  std::int64_t answered_ns = 0;  ///< when the newest state came; 0: none yet
  std::int64_t grip_ns = 0;      ///< when the newest orientation came; 0: none
  double position_m[3] = {0, 0, 0}, velocity_m_per_s[3] = {0, 0, 0}, q_xyzw[4] = {0, 0, 0, 1};
  std::uint64_t buttons = 0;
  std::uint64_t has_velocity = 0, calibrated = 0, moved = 0, grip_awake = 1;
  std::uint64_t wrong = 0;    ///< messages since the beginning that were not taken
  std::uint64_t verdict = 0;  ///< HaplyVerdict of the last of them
  HaplyCut cut = HaplyCut::kNone;
  HaplyEnd end = HaplyEnd::kNone;
};

/// Takes over what a message says of the device; times, cut and end stay.
void put_state(const HaplyState& state, HaplyReport& report) noexcept;
/// The members that `put_state` fills, as a recording has them.
using HaplyParsed = std::array<std::byte, sizeof(HaplyReport)>;
[[nodiscard]] HaplyParsed parsed_bytes(HaplyReport report) noexcept;

/// The bridge's word.
struct HaplyForce {
  std::int64_t handed_ns = 0;
  double force_n[3] = {0, 0, 0};
  std::uint64_t is_on = 0;
  std::uint64_t release = 0;  ///< counts the times that the drives went off
};

/// Finds a force in what the service exerts that is not among the last ones of ours. A force that
/// is shorter than ours, as filters and limits of the service make it, is ours.
class OtherForce {
 public:
  /// @param exerted_n  by the service, as it answers. @return true: not ours, for 10 answers.
  [[nodiscard]] bool look(const double (&exerted_n)[3]) noexcept;
  void sent(const double (&force_n)[3]) noexcept;

 private:
  static constexpr unsigned kRemembered = 8, kAnswers = 10;
  double sent_n_[kRemembered][3] = {};
  unsigned at_ = 0, foreign_ = 0;
};

/// Owner: the bridge's thread. The destructor takes the force away, and returns within 0.3 s.
class HaplySession {
 public:
  /// @param socket  connected, its inventory read. Starts the thread.
  /// @param accepts_other_forces  does not look for forces of other sessions
  /// @param tap  hears what each message was read as; may be null
  HaplySession(std::unique_ptr<ServiceSocket> socket, HaplyFormat format, HaplyChoice choice,
               HaplyTimes times, bool accepts_other_forces,
               std::shared_ptr<hal::DeviceTap> tap = nullptr);
  HaplySession(const HaplySession&) = delete;
  HaplySession& operator=(const HaplySession&) = delete;
  ~HaplySession();

  /// Never waits. `is_new`: something has changed since the last look.
  const HaplyReport& report(bool& is_new) noexcept { return reader_.newest(&is_new); }
  void hand_over(const HaplyForce& force) noexcept { writer_.publish(force); }
  /// Number of the last release that the service has answered with zero in force.
  [[nodiscard]] std::uint64_t released() const noexcept {
    return released_.load(std::memory_order_acquire);
  }
  /// True while a message is without an answer for longer than HaplyTimes::silent_ns.
  [[nodiscard]] bool is_stalled(std::int64_t now_ns) const noexcept {
    const std::int64_t since_ns = in_flight_ns_.load(std::memory_order_relaxed);
    return since_ns != 0 && now_ns - since_ns > times_.silent_ns();
  }
  /// Readable when there is a new report. Negative: none could be made.
  [[nodiscard]] int wake() const noexcept { return wake_; }

 private:
  void run();
  /// One period. False: the connection has ended.
  bool exchange();
  /// The force of this period. False: none may be sent now, and no zero is due yet.
  bool choose(std::int64_t now_ns, double (&force_n)[3]);
  bool take_answer();
  bool pass_over_texts();
  [[nodiscard]] bool is_not_taken(const HaplyState& state) noexcept;
  void take_state(const HaplyState& state);
  void cut(HaplyCut why) noexcept;
  bool end(HaplyEnd why) noexcept;
  void publish() noexcept;
  void say_goodbye();

  std::unique_ptr<ServiceSocket> socket_;
  HaplyFormat format_;
  HaplyChoice choice_;
  HaplyTimes times_;
  bool accepts_other_forces_;
  std::shared_ptr<hal::DeviceTap> tap_;
  int wake_ = -1;

  NewestRecord<HaplyReport> reports_;
  NewestReader<HaplyReport> reader_{reports_};
  NewestRecord<HaplyForce> forces_;
  NewestWriter<HaplyForce> writer_{forces_};

  // The thread's.
  NewestWriter<HaplyReport> said_{reports_};
  NewestReader<HaplyForce> heard_{forces_};
  HaplyReport report_;
  HaplyState state_;
  HaplyForce force_;
  OtherForce other_;
  std::string out_, in_;
  std::int64_t sent_ns_ = 0;
  std::uint64_t sent_release_ = 0;
  unsigned wrong_in_row_ = 0, absent_in_row_ = 0, not_taken_ = 0;
  double asked_n_ = 0;  ///< size of the force in flight
  bool is_first_ = true, is_zero_ = true, is_foreign_ = false;

  std::atomic<bool> is_over_{false};
  std::atomic<std::uint64_t> released_{0};
  std::atomic<std::int64_t> in_flight_ns_{0};  ///< when the message in flight was sent; 0: none is
  std::thread thread_;
};

}  // namespace haptic::tools
