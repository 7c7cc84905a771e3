// SPDX-License-Identifier: Apache-2.0
#pragma once
/// A machine made of files, as the doctor sees one: healthy at first, then changed by a test.

#include <array>
#include <cerrno>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "hal/realtime/doctor.hpp"
#include "tests/support/program_run.hpp"

namespace haptic::test {

/// Answers that a test states; healthy by default. Counts what was asked for.
class FakeProbes final : public hal::SystemProbes {
 public:
  int fifo_error = 0, cpu_error = 0, memory_error = 0, idle_error = 0, node_error = 0;
  int last_priority = 0;
  std::string last_node;
  hal::UsbLibrary library{0, "", "1.0.26"};
  hal::WakeupQuestion last_question;
  std::size_t measured = 0;
  hal::WakeupMeasurement answer;

  FakeProbes();
  int try_fifo(int priority) override { return last_priority = priority, fifo_error; }
  int try_cpu(int /*cpu*/) override { return cpu_error; }
  int try_memory_lock() override { return memory_error; }
  int try_idle_hold() override { return idle_error; }
  int try_node(const std::string& path) override {
    last_node = path;
    return refused_nodes.count(path) != 0 ? EACCES : node_error;
  }
  int try_socket(const std::string& path) override {
    return sockets.count(path) == 0 ? ENOENT : sockets[path];
  }
  hal::BridgeReply try_bridge(const std::string& name) override { return bridges[name]; }
  std::string variable(const std::string& name) override { return variables[name]; }
  hal::UsbLibrary try_usb_library() override { return library; }
  void measure(const hal::WakeupQuestion& question, hal::WakeupMeasurement& m) override {
    last_question = question;
    measured += 1;
    m = answer;
  }
  bool has_program(const std::string& name) override { return name == program; }
  std::string run_program(const std::vector<std::string>& command) override {
    ran = command;
    return said;
  }
  std::set<std::string> refused_nodes;
  std::map<std::string, int> sockets;
  std::map<std::string, hal::BridgeReply> bridges;
  std::map<std::string, std::string> variables;
  std::string program = "rtla", said;
  std::vector<std::string> ran;
};

/// Four cores, two of them isolated for the loop; PREEMPT_RT; the reference device on port 2 of bus
/// 1, high speed, with the interrupt of its controller on the other cores.
class FakeMachine {
 public:
  FakeMachine();
  void write(const std::string& path, const std::string& text) const;
  void remove(const std::string& path) const;
  [[nodiscard]] std::vector<hal::DoctorLine> examine();
  /// The line of that name; an empty one where there is none.
  [[nodiscard]] hal::DoctorLine line(const std::string& name);

  FakeProbes probes;
  hal::DoctorQuestions questions;

 private:
  void plug_bridged();

  sim::test::ScratchFolder folder_;
};

}  // namespace haptic::test
