// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/processes/device_program.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <thread>

#include "host_sim/session/child_run.hpp"

namespace haptic::sim {
namespace {

constexpr const char* kPartNames[] = {"guardian", "servo", "spare", "zero-keeper"};
constexpr const char* kCommNames[] = {"", "haptic-servo", "haptic-spare", "haptic-zero"};

std::string text_of(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

struct SharedMapping {
  std::uint64_t begin = 0, end = 0;
  bool writable = false;
};

std::vector<SharedMapping> shared_mappings(pid_t process) {
  std::vector<SharedMapping> found;
  std::istringstream maps(text_of("/proc/" + std::to_string(process) + "/maps"));
  for (std::string line; std::getline(maps, line);) {
    unsigned long long begin = 0, end = 0;
    char rights[5] = {};
    if (std::sscanf(line.c_str(), "%llx-%llx %4s", &begin, &end, rights) != 3) continue;
    if (rights[3] == 's') found.push_back({begin, end, rights[1] == 'w'});
  }
  return found;
}

pid_t child_by_name(pid_t parent, const std::string& name) {
  const std::string number = std::to_string(parent);
  std::istringstream children(text_of("/proc/" + number + "/task/" + number + "/children"));
  for (pid_t child = 0; children >> child;) {
    if (text_of("/proc/" + std::to_string(child) + "/comm") == name + "\n") return child;
  }
  return 0;
}

/// The reading end of what a program writes to, and the writing end.
struct Ends {
  int reader = -1, writer = -1;
};

Ends unread_pipe() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  (void)fcntl(ends[1], F_SETPIPE_SZ, 4096);
  return {ends[0], ends[1]};
}

Ends terminal() {
  const int reader = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  if (reader < 0 || grantpt(reader) != 0 || unlockpt(reader) != 0)
    throw std::system_error(errno, std::generic_category(), "a terminal");
  const int writer = open(ptsname(reader), O_RDWR | O_NOCTTY | O_CLOEXEC);
  return {reader, writer};
}

}  // namespace

const char* to_text(ProgramPart part) { return kPartNames[static_cast<std::size_t>(part)]; }

std::string device_program_path() { return program_beside("run_device"); }

DeviceProgram::DeviceProgram(const std::vector<std::string>& arguments, const std::string& out,
                             ProgramReader reader)
    : out_(out) {
  const int err = open((out + ".err").c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
  Ends ends;
  (void)unlink((out + ".out").c_str());  // of the program before, which nobody is to take for ours
  if (reader == ProgramReader::kFile)
    ends.writer = open((out + ".out").c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
  if (reader == ProgramReader::kNobody) ends = unread_pipe();
  if (reader == ProgramReader::kTerminal) ends = terminal();
  if (err < 0 || ends.writer < 0) throw std::system_error(errno, std::generic_category(), out);
  std::vector<char*> list;
  for (const std::string& argument : arguments) list.push_back(const_cast<char*>(argument.c_str()));
  list.push_back(nullptr);
  pid_ = fork();
  if (pid_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // nothing outlives a test that is killed
    setsid();                          // a group of its own, to be signalled as one
    if (reader == ProgramReader::kTerminal) (void)ioctl(ends.writer, TIOCSCTTY, 0);
    if (dup2(ends.writer, STDOUT_FILENO) < 0 || dup2(err, STDERR_FILENO) < 0) _exit(126);
    execv(list[0], list.data());
    _exit(127);
  }
  close(err);
  close(ends.writer);
  reader_ = ends.reader;
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  parts_[0] = pid_;
}

DeviceProgram::~DeviceProgram() {
  for (const ProgramPart part :
       {ProgramPart::kServo, ProgramPart::kSpare, ProgramPart::kZeroKeeper})
    (void)pid(part);
  for (const pid_t each : parts_) {
    if (each > 0) kill(each, SIGKILL);
  }
  if (!exit_code_) (void)waitpid(pid_, nullptr, 0);
  close_reader();
}

pid_t DeviceProgram::pid(ProgramPart part) {
  pid_t& known = parts_[static_cast<std::size_t>(part)];
  if (known == 0) known = child_by_name(pid_, kCommNames[static_cast<std::size_t>(part)]);
  return known;
}

bool DeviceProgram::signal(ProgramPart part, int number) {
  const pid_t process = pid(part);
  return process > 0 && kill(process, number) == 0;
}

bool DeviceProgram::signal_group(int number) { return kill(-pid_, number) == 0; }

std::size_t scribble_shared(pid_t process, const std::vector<std::byte>& pattern) {
  std::size_t total = 0;
  for (const SharedMapping& mapping : shared_mappings(process)) {
    if (!mapping.writable) continue;
    std::vector<std::byte> bytes(mapping.end - mapping.begin);
    for (std::size_t k = 0; k < bytes.size(); ++k) bytes[k] = pattern[k % pattern.size()];
    const iovec here{bytes.data(), bytes.size()};
    const iovec there{reinterpret_cast<void*>(mapping.begin), bytes.size()};
    const ssize_t written = process_vm_writev(process, &here, 1, &there, 1, 0);
    if (written > 0) total += static_cast<std::size_t>(written);
  }
  return total;
}

std::size_t DeviceProgram::scribble(ProgramPart part, const std::vector<std::byte>& pattern) {
  return scribble_shared(pid(part), pattern);
}

std::size_t DeviceProgram::writable_read_only(ProgramPart part) {
  std::size_t total = 0;
  for (const SharedMapping& mapping : shared_mappings(pid(part))) {
    if (mapping.writable) continue;
    std::byte byte{};
    const iovec here{&byte, 1};
    const iovec there{reinterpret_cast<void*>(mapping.begin), 1};
    if (process_vm_readv(pid(part), &here, 1, &there, 1, 0) != 1) continue;
    if (process_vm_writev(pid(part), &here, 1, &there, 1, 0) == 1) ++total;
  }
  return total;
}

void DeviceProgram::close_reader() {
  if (reader_ >= 0) close(reader_);
  reader_ = -1;
}

std::optional<int> DeviceProgram::exit_code() {
  int status = 0;
  if (!exit_code_ && waitpid(pid_, &status, WNOHANG) == pid_)
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return exit_code_;
}

std::string DeviceProgram::output() const { return text_of(out_ + ".out"); }

std::string DeviceProgram::said() const { return output() + text_of(out_ + ".err"); }

}  // namespace haptic::sim
