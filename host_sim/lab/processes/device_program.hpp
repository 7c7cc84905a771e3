// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The very program that a user starts, run_device, as a process under test: started, found in all
/// its parts, signalled, scribbled over, read from or not.

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace haptic::sim {

enum class ProgramPart : std::uint8_t { kGuardian = 0, kServo, kSpare, kZeroKeeper };
[[nodiscard]] const char* to_text(ProgramPart part);

/// Where its standard output goes.
enum class ProgramReader : std::uint8_t {
  kFile = 0,  ///< read by the test
  kNobody,    ///< a pipe of one page that is not read
  kTerminal   ///< a terminal of its own, which controls its session
};

/// Owner: one thread. The program and what it has forked are killed with this object.
class DeviceProgram {
 public:
  /// @param out  prefix of the files that its two streams go to: ".out", ".err"
  /// @throws std::system_error  it cannot be started
  DeviceProgram(const std::vector<std::string>& arguments, const std::string& out,
                ProgramReader reader);
  ~DeviceProgram();
  DeviceProgram(const DeviceProgram&) = delete;
  DeviceProgram& operator=(const DeviceProgram&) = delete;

  /// Looked up once; a part that has ended keeps its number. 0: not there.
  [[nodiscard]] pid_t pid(ProgramPart part);
  /// False: there is no such process any more.
  bool signal(ProgramPart part, int number);
  bool signal_group(int number);
  /// Overwrites every page of every shared mapping that this part can write to itself.
  /// @return bytes overwritten; those it has read-only are refused to us as to it.
  std::size_t scribble(ProgramPart part, const std::vector<std::byte>& pattern);
  /// Bytes of shared mappings that it has read-only and that could be overwritten all the same.
  [[nodiscard]] std::size_t writable_read_only(ProgramPart part);
  /// The reader of its standard output goes: the pipe's or terminal's end is closed.
  void close_reader();

  /// Exit code, or 128 + signal; nothing while it runs.
  [[nodiscard]] std::optional<int> exit_code();
  /// What it has said on standard output, as far as that goes to a file.
  [[nodiscard]] std::string output() const;
  /// All that it has said on both streams, as far as it goes to files.
  [[nodiscard]] std::string said() const;

 private:
  std::string out_;
  pid_t pid_ = -1;
  pid_t parts_[4] = {};
  int reader_ = -1;
  std::optional<int> exit_code_;
};

/// run_device next to this program. @throws tools::InputError  it is not there
[[nodiscard]] std::string device_program_path();

/// Overwrites every page of every shared mapping that a process can write to itself.
/// @return bytes overwritten
std::size_t scribble_shared(pid_t process, const std::vector<std::byte>& pattern);

}  // namespace haptic::sim
