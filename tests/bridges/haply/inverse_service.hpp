// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Haply's Inverse service as docs.haply.co describes it, for one device on a table: versions 3.0
/// (HTTP alone), 3.1 and 3.5, with what a service may do wrong on order, and a log of each force
/// that it would exert. It shares no code with the bridge.
///
/// Two sockets, or one with version 3.5, as the documents have it. One message in, one answer out;
/// the force of a session stays until its next message or its end, and those of all sessions add
/// up. The key of another version is taken without a word and exerts nothing.

#include <array>
#include <atomic>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace haptic::test {

enum class InverseKind : std::uint8_t { k30, k31, k35 };

/// A wrong answer.
enum class WrongAnswer : std::uint8_t {
  kTruncated,
  kNan,       ///< the word NaN where a number belongs
  kText,      ///< "0.1" where a number belongs
  kOverflow,  ///< 1e999
  kFar,       ///< 1e30 m
  kDeep,      ///< 30 000 open brackets
  kLong,      ///< right, and 80 kB long
  kEmpty,
  kOtherShape,  ///< an array
  kNoPosition,
  kQuaternion,  ///< of length zero
  kCount
};

struct Exerted {
  std::int64_t at_ns = 0;  ///< CLOCK_MONOTONIC, when the message was read
  unsigned session = 0;
  std::array<double, 3> force_n{};  ///< by this session from now on
  bool was_understood = false;      ///< the message had the force under the key of this version
  bool is_end = false;              ///< the session has ended; no message
};

struct TableDevice {
  std::string id = "049D", kind = "inverse3";
  std::array<double, 3> position_m{0.05, -0.12, 0.15}, velocity_m_per_s{0, 0, 0};
  bool is_there = true, calibrated = true, powered = true;
  std::string wireless_grip = "61548", wired_grip;  ///< names; empty: none
  std::array<double, 4> q_wxyz{1, 0, 0, 0};
  bool a = false, b = false, c = false, wired_button = false, awake = true;
  std::array<double, 3> workspace_m{0, 0, 0};  ///< moved by another program
  std::string second_id;                       ///< of another device; empty: none
};

class InverseService {
 public:
  /// @param version  "3.1.1.0", as /version gives it
  /// @param http_port, websocket_port  0: any that are free
  InverseService(InverseKind kind, std::string version, std::uint16_t http_port = 0,
                 std::uint16_t websocket_port = 0);
  ~InverseService();

  [[nodiscard]] std::uint16_t http_port() const { return http_port_; }
  [[nodiscard]] std::uint16_t websocket_port() const { return websocket_port_; }

  /// Closes all sessions and both sockets; `start` opens the same ports again.
  void stop();
  void start();

  void set(const TableDevice& device);
  [[nodiscard]] TableDevice device() const;
  /// The next message is read so much later [ns].
  void stall_once(std::int64_t length_ns) { stall_ns_ = length_ns; }
  /// The next `count` answers are wrong.
  void answer_wrongly(WrongAnswer how, unsigned count);
  /// The next `count` answers are sent twice.
  void answer_twice(unsigned count) { twice_left_ = count; }
  /// A force of another program, which adds to that of all sessions.
  void exert(const std::array<double, 3>& other_n);

  [[nodiscard]] std::vector<Exerted> log() const;
  [[nodiscard]] unsigned sessions() const { return open_sessions_; }
  [[nodiscard]] unsigned messages() const { return messages_; }
  /// The first message of the last session, whole.
  [[nodiscard]] std::string first_message() const;

 private:
  struct Sockets;
  struct Session;
  void accept(int listener);
  void serve(const std::shared_ptr<Session>& session);
  void hear(Session& session, const std::string& text);
  std::string inventory(unsigned session) const;
  std::string answer(unsigned session);
  std::string devices_text(bool with_config, unsigned session) const;
  void note(unsigned session, const std::array<double, 3>& force_n, bool was_understood,
            bool is_end);

  InverseKind kind_;
  std::string version_;
  std::uint16_t http_port_, websocket_port_;
  std::vector<int> listeners_;
  std::vector<std::thread> acceptors_;

  mutable std::mutex mutex_;  ///< of what follows
  TableDevice device_;
  std::list<std::shared_ptr<Session>> all_;
  std::vector<std::array<double, 3>> forces_;  ///< by session
  std::array<double, 3> other_n_{0, 0, 0};
  std::vector<Exerted> log_;
  std::string first_message_;
  WrongAnswer wrong_ = WrongAnswer::kCount;
  unsigned wrong_left_ = 0;

  std::atomic<std::int64_t> stall_ns_{0};
  std::atomic<unsigned> open_sessions_{0}, messages_{0}, twice_left_{0};
  std::atomic<bool> is_over_{false};
};

}  // namespace haptic::test
