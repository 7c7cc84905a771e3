// SPDX-License-Identifier: Apache-2.0
#include "tools/common/limited_child.hpp"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <vector>

#include "tools/common/error.hpp"

namespace haptic::tools {
namespace {

// The first byte that the child writes.
constexpr char kAnswer = 'a', kException = 'e', kNoMemory = 'm';
/// Between the signal that the time is up and the end in any case [s].
constexpr rlim_t kGrace_s = 5;

bool send_all(int to, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ::ssize_t n = ::write(to, text.data() + done, text.size() - done);
    if (n < 0 && errno != EINTR) return false;
    if (n > 0) done += static_cast<std::size_t>(n);
  }
  return true;
}

/// Up to the end, or to more than `most` bytes.
std::string receive_all(int from, std::size_t most) {
  std::string text;
  std::vector<char> buffer(std::size_t{1} << 16);
  while (text.size() <= most) {
    const ::ssize_t n = ::read(from, buffer.data(), buffer.size());
    if (n == 0 || (n < 0 && errno != EINTR)) break;
    if (n > 0) text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  return text;
}

/// Address space that this process uses now [bytes].
rlim_t address_space() {
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return static_cast<rlim_t>(pages) * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
}

/// Lowers a limit; one that is lower already stays.
template <typename Resource>
bool lower(Resource which, rlim_t soft, rlim_t hard) {
  rlimit now{};
  if (::getrlimit(which, &now) != 0) return false;
  const rlim_t most = std::min(hard, now.rlim_max);
  const rlimit limit{std::min(soft, most), most};
  return ::setrlimit(which, &limit) == 0;
}

bool set_limits(const ChildLimits& limits) {
  // Handlers of this process (a test's, a sanitizer's) would hide how the child ends.
  for (const int number : {SIGABRT, SIGALRM, SIGBUS, SIGFPE, SIGILL, SIGSEGV, SIGXCPU}) {
    std::signal(number, SIG_DFL);
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // it ends with the process that asked
  const rlim_t memory = address_space() + limits.memory_bytes;
  ::alarm(limits.waiting_seconds);
  return lower(RLIMIT_CPU, limits.seconds, limits.seconds + kGrace_s) &&
         lower(RLIMIT_AS, memory, memory) && lower(RLIMIT_CORE, 0, 0);
}

std::string answer_of(const std::function<std::string()>& work) {
  try {
    return kAnswer + work();
  } catch (const std::bad_alloc&) {
    return {kNoMemory};
  } catch (const std::exception& error) {
    return kException + std::string(error.what());
  } catch (...) {
    return {kException};
  }
}

/// Nothing of the parent's stack is unwound in the child, not even where no memory is left to say
/// why.
[[noreturn]] void run_child(int to, const ChildLimits& limits,
                            const std::function<std::string()>& work) noexcept {
  const bool told = set_limits(limits) && send_all(to, answer_of(work));
  ::_exit(told ? 0 : 1);
}

ChildEnd end_of(const std::string& answer, int status) {
  if (WIFSIGNALED(status)) {
    const int number = WTERMSIG(status);
    return number == SIGXCPU || number == SIGALRM ? ChildEnd::kOutOfTime : ChildEnd::kSignal;
  }
  if (WEXITSTATUS(status) != 0 || answer.empty()) return ChildEnd::kEnded;
  switch (answer[0]) {
    case kAnswer:
      return ChildEnd::kAnswered;
    case kException:
      return ChildEnd::kThrew;
    case kNoMemory:
      return ChildEnd::kOutOfMemory;
    default:
      return ChildEnd::kEnded;
  }
}

[[noreturn]] void fail(const std::string& name, const char* what) {
  throw OsError(name + ": " + what + " (" + std::strerror(errno) +
                "); end other programs, or raise the limits that 'ulimit -a' shows");
}

}  // namespace

ChildResult run_in_child(const std::string& name, const ChildLimits& limits,
                         const std::function<std::string()>& work) {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) fail(name, "no pipe to a process of its own");
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) {
    const int reason = errno;
    ::close(ends[0]);
    ::close(ends[1]);
    errno = reason;
    fail(name, "no process of its own");
  }
  if (child == 0) {
    ::close(ends[0]);
    run_child(ends[1], limits, work);
  }
  ::close(ends[1]);
  ChildResult result;
  const std::size_t most = limits.answer_bytes + 1;  // with the mark
  result.text = receive_all(ends[0], most);
  const bool too_long = result.text.size() > most;
  if (too_long) ::kill(child, SIGKILL);
  ::close(ends[0]);
  int status = 0;
  rusage usage{};
  while (::wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  result.memory_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  result.end = too_long ? ChildEnd::kTooLong : end_of(result.text, status);
  result.number = WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status);
  if (result.end == ChildEnd::kAnswered || result.end == ChildEnd::kThrew) {
    result.text.erase(0, 1);
  } else {
    result.text.clear();
  }
  return result;
}

}  // namespace haptic::tools
