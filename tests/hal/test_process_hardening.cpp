// SPDX-License-Identifier: Apache-2.0
// What a process can no longer do once it has given it up. Each try is a child's, which cannot take
// it back either.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/futex.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <new>
#include <string>

#include "hal/clock/linux_process.hpp"
#include "hal/clock/servo_clock.hpp"
#include "hal/realtime/process_hardening.hpp"
#include "hal/realtime/servo_process.hpp"
#include "hal/realtime/shared_memory.hpp"
#include "hal/realtime/system_tree.hpp"

using namespace haptic::hal;

namespace {

constexpr int kPatience_ms = 20'000;
constexpr unsigned kNobody = 65'534;

ProcessEnd end_of(const std::function<int()>& body) {
  ServoProcess child;
  REQUIRE(child.start([&body] {
    const rlimit none{0, 0};
    setrlimit(RLIMIT_CORE, &none);
    return body();
  }) == 0);
  return child.finish(kPatience_ms);
}

struct NamedCall {
  const char* name;
  void (*make)();
};

// What somebody who took over the servo process would try next.
const NamedCall kRefusedCalls[] = {
    {"getpid", [] { syscall(SYS_getpid); }},
    {"write", [] { (void)!write(-1, "", 0); }},
    {"openat", [] { (void)open("/dev/null", O_RDONLY); }},
    {"ioctl", [] { syscall(SYS_ioctl, -1, 0, 0); }},
    {"mmap", [] { (void)mmap(nullptr, 4096, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0); }},
    {"mprotect", [] { syscall(SYS_mprotect, 0, 0, 0); }},
    {"socket", [] { (void)socket(AF_UNIX, SOCK_STREAM, 0); }},
    {"clone", [] { syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); }},
    {"execve", [] { syscall(SYS_execve, "/nowhere", nullptr, nullptr); }},
    {"kill", [] { kill(getppid(), 0); }},
    {"ptrace", [] { ptrace(PTRACE_PEEKDATA, 0, nullptr, nullptr); }},
    {"prctl", [] { prctl(PR_GET_DUMPABLE, 0, 0, 0, 0); }},
    {"sched_setscheduler", [] { syscall(SYS_sched_setscheduler, 0, SCHED_OTHER, nullptr); }},
    {"futex, another request",
     [] {
       static int word = 0;
       syscall(SYS_futex, &word, FUTEX_CMP_REQUEUE_PI, 1, 0, &word, 0);
     }},
    {"a call of another numbering", [] { syscall(0x40000000L | 39L); }},
};

bool can_be_confined() {
  const ProcessEnd end = end_of([] { return confine_servo() == ENOTSUP ? 1 : 0; });
  if (end.exit_code == 0) return true;
  MESSAGE("skipped: a sanitizer is compiled in, whose run-time makes system calls");
  return false;
}

std::string status_value(const char* key) {
  std::ifstream stream("/proc/self/status");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  return value_after(text, key);
}

bool has_only(const char* set, unsigned long long mask) {
  return std::stoull(status_value(set), nullptr, 16) == mask;
}

bool have_only(unsigned long long mask) {
  return has_only("CapPrm:", mask) && has_only("CapEff:", mask) && has_only("CapInh:", 0) &&
         has_only("CapAmb:", 0);
}

#if defined(__x86_64__)
constexpr bool kFilterIsOfX86 = true;
#else
constexpr bool kFilterIsOfX86 = false;
#endif

constexpr unsigned long long bit_of(unsigned capability) { return 1ULL << capability; }

bool has_capability(unsigned number, const std::string& what) {
  if ((std::stoull(status_value("CapEff:"), nullptr, 16) & bit_of(number)) != 0) return true;
  MESSAGE("skipped: no ", what);
  return false;
}

void give_up(unsigned capability) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct sets[2] = {};
  syscall(SYS_capget, &header, sets);
  sets[capability / 32].permitted &= ~(1U << (capability % 32));
  sets[capability / 32].effective &= ~(1U << (capability % 32));
  syscall(SYS_capset, &header, sets);
}

void set_limit(__rlimit_resource which, rlim_t value) {
  const rlimit limit{value, value};
  setrlimit(which, &limit);
}

bool is_open(int descriptor) { return fcntl(descriptor, F_GETFD) >= 0; }

// As a kernel before 5.9 answers close_range.
void forget_close_range() {
  sock_filter program[] = {
      {BPF_LD | BPF_W | BPF_ABS, 0, 0, offsetof(seccomp_data, nr)},
      {BPF_JMP | BPF_JEQ | BPF_K, 0, 1, SYS_close_range},
      {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ERRNO | ENOSYS},
      {BPF_RET | BPF_K, 0, 0, SECCOMP_RET_ALLOW},
  };
  const sock_fprog filter{static_cast<unsigned short>(std::size(program)), program};
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &filter);
}

// 0: of all that was open, the kept ones still are and no other.
int close_all_but_some() {
  const int first = open("/dev/null", O_RDONLY);
  if (first < 0) return 1;
  for (const int number : {20, 21, 22, 40, 900}) {
    if (dup2(first, number) != number) return 2;
  }
  const std::array<int, 5> keep = {900, 2, -1, 21, 1};
  if (close_inherited_descriptors(keep) != 0) return 3;
  for (int each = 0; each < 1024; ++each) {
    const bool kept = each == 1 || each == 2 || each == 21 || each == 900;
    if (is_open(each) != kept) return 4;
  }
  return 0;
}

}  // namespace

TEST_SUITE("hal.process_hardening") {
  TEST_CASE("confine_servo: any other system call is the end, by SIGSYS") {
    if (!can_be_confined()) return;
    for (const NamedCall& call : kRefusedCalls) {
      CAPTURE(std::string(call.name));
      const ProcessEnd without = end_of([&call] {
        call.make();
        return 0;
      });
      CHECK(without.signal == 0);
      const ProcessEnd end = end_of([&call] {
        if (confine_servo() != 0) return 1;
        call.make();
        return 0;
      });
      CHECK(end.signal == SIGSYS);
    }
  }

  TEST_CASE("confine_servo: sleeping, waking, the clock, the end's account and exit are left") {
    if (!can_be_confined()) return;
    const ProcessEnd end = end_of([] {
      static std::atomic<std::uint32_t> word{0};
      struct sigaction action {};
      action.sa_handler = [](int) { word.store(1); };
      sigaction(SIGALRM, &action, nullptr);
      if (confine_servo() != 0) return 1;
      if (sleep_until(monotonic_ns() + 1'000'000) != 0) return 2;
      timespec wait{0, 1'000'000};
      if (syscall(SYS_futex, &word, FUTEX_WAIT, 0, &wait, nullptr, 0) != -1) return 3;
      if (errno != ETIMEDOUT) return 4;
      if (syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0) != 0) return 5;
      timespec now{};
      if (syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now) != 0) return 6;
      if (page_faults_of_thread().minor <= 0) return 7;
      return 42;
    });
    CHECK(end.signal == 0);
    CHECK(end.exit_code == 42);
  }

  TEST_CASE("confine_servo: a signal is handled, and a stopped wait goes on") {
    if (!can_be_confined()) return;
    struct Shared {
      std::atomic<std::uint32_t> confined{0}, handled{0}, word{0};
    };
    SharedMemory memory(sizeof(Shared));
    static Shared* shared;
    shared = new (memory.bytes().data()) Shared;
    ServoProcess child;
    REQUIRE(child.start([] {
      struct sigaction action {};
      action.sa_handler = [](int) { shared->handled.fetch_add(1); };
      sigaction(SIGTERM, &action, nullptr);
      if (confine_servo() != 0) return 1;
      shared->confined = 1;
      const std::int64_t end_ns = monotonic_ns() + 10'000'000'000;
      while (shared->word.load() == 0 && monotonic_ns() < end_ns) {
        timespec deadline{end_ns / 1'000'000'000, end_ns % 1'000'000'000};
        syscall(SYS_futex, &shared->word, FUTEX_WAIT_BITSET, 0, &deadline, nullptr,
                FUTEX_BITSET_MATCH_ANY);
      }
      return shared->word.load() == 1 ? 42 : 2;
    }) == 0);
    while (shared->confined.load() == 0 && !child.poll(1).ended) {
    }
    usleep(20'000);
    child.signal(SIGTERM);
    while (shared->handled.load() == 0 && !child.poll(1).ended) {
    }
    child.signal(SIGSTOP);
    usleep(20'000);
    child.signal(SIGCONT);
    CHECK_FALSE(child.poll(50).ended);
    shared->word = 1;
    syscall(SYS_futex, &shared->word, FUTEX_WAKE, 1, nullptr, nullptr, 0);
    const ProcessEnd end = child.finish(kPatience_ms);
    CHECK(end.signal == 0);
    CHECK(end.exit_code == 42);
  }

  TEST_CASE("close_inherited_descriptors: all but the named, also on a kernel without the call") {
    CHECK(end_of(close_all_but_some).exit_code == 0);
    CHECK(end_of([] {
            forget_close_range();
            return close_all_but_some();
          }).exit_code == 0);
    CHECK(end_of([] {
            if (close_inherited_descriptors({}) != 0) return 1;
            return is_open(0) || is_open(1) || is_open(2) ? 2 : 0;
          }).exit_code == 0);
  }

  TEST_CASE("drop_capabilities: nothing asked for, nothing left, nor to be had from a program") {
    if (!has_capability(CAP_SETPCAP, "CAP_SETPCAP: the bounding set cannot be made smaller"))
      return;
    CHECK(end_of([] {
            const KeptCapabilities kept = drop_capabilities({});
            if (kept.error != 0 || !kept.held_any) return 1;
            if (!have_only(0) || !has_only("CapBnd:", 0)) return 2;
            if (prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) != 1) return 3;
            return setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) - 1) != 0 ? 0 : 4;
          }).exit_code == 0);
  }

  TEST_CASE("confine_bridge: no program, no other process, no name of a file; the rest as before") {
    if (!can_be_confined()) return;
    const ProcessEnd end = end_of([] {
      if (confine_bridge() != 0) return 1;
      const auto is_refused = [](long result) { return result == -1 && errno == EPERM; };
      char* none[] = {nullptr};
      if (!is_refused(execve("/bin/true", none, none))) return 2;
      if (!is_refused(ptrace(PTRACE_ATTACH, getppid(), nullptr, nullptr))) return 3;
      if (!is_refused(std::rename("/nowhere/a", "/nowhere/b"))) return 4;
      if (!is_refused(chmod("/nowhere", 0))) return 5;
      if (socket(AF_UNIX, SOCK_STREAM, 0) < 0 || open("/dev/null", O_RDWR) < 0) return 6;
      return 0;
    });
    CHECK(end.exit_code == 0);
    if (kFilterIsOfX86) {
      const ProcessEnd other = end_of([] {
        if (confine_bridge() != 0) return 1;
        return syscall(0x40000000L | 39L) == 0 ? 2 : 0;
      });
      CHECK(other.signal == SIGSYS);
    }
  }

  TEST_CASE("drop_capabilities: priority and locked memory as limits, no capability left") {
    if (!has_capability(CAP_SYS_RESOURCE, "CAP_SYS_RESOURCE: limits cannot be raised")) return;
    const ProcessEnd end = end_of([] {
      set_limit(RLIMIT_RTPRIO, 0);
      set_limit(RLIMIT_MEMLOCK, 65'536);
      const KeptCapabilities kept = drop_capabilities({.fifo_priority = 7, .lock_memory = true});
      if (kept.error != 0 || !kept.held_any || kept.nice || kept.memory || kept.files) return 1;
      if (!have_only(0) || !has_only("CapBnd:", 0)) return 2;
      if (prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) != 1) return 3;
      if (set_fifo_priority(7) != 0 || set_fifo_priority(8) != EPERM) return 4;
      if (lock_all_memory() != 0) return 5;
      void* const room =
          mmap(nullptr, 1 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
      return room == MAP_FAILED ? 6 : 0;
    });
    CHECK(end.exit_code == 0);
    CHECK(end.signal == 0);
  }

  TEST_CASE("drop_capabilities: where limits cannot be raised, the capability itself stays") {
    if (!has_capability(CAP_SETPCAP, "CAP_SETPCAP: the bounding set cannot be made smaller"))
      return;
    CHECK(end_of([] {
            set_limit(RLIMIT_RTPRIO, 0);
            set_limit(RLIMIT_MEMLOCK, 65'536);
            give_up(CAP_SYS_RESOURCE);
            const KeptCapabilities kept =
                drop_capabilities({.fifo_priority = 7, .lock_memory = true});
            if (kept.error != 0 || !kept.nice || !kept.memory) return 1;
            if (!have_only(bit_of(CAP_SYS_NICE) | bit_of(CAP_IPC_LOCK))) return 2;
            return set_fifo_priority(7) == 0 && lock_all_memory() == 0 ? 0 : 3;
          }).exit_code == 0);
    CHECK(end_of([] {
            const KeptCapabilities kept = drop_capabilities({.files_of_others = true});
            if (kept.error != 0 || !kept.files || kept.nice || kept.memory) return 1;
            return have_only(bit_of(CAP_DAC_OVERRIDE)) && has_only("CapBnd:", 0) ? 0 : 2;
          }).exit_code == 0);
  }

  TEST_CASE("drop_capabilities: an ordinary user's process is left as it is") {
    if (getuid() != 0) MESSAGE("as the user who runs the tests, who has none");
    CHECK(end_of([] {
            if (getuid() == 0 && setresuid(kNobody, kNobody, kNobody) != 0) return 1;
            const KeptCapabilities kept =
                drop_capabilities({.fifo_priority = 7, .lock_memory = true});
            if (kept.error != 0 || kept.held_any) return 2;
            return prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 0 ? 0 : 3;
          }).exit_code == 0);
  }

  TEST_CASE("refuse_attachment: a process of the same user reads nothing of its memory") {
    if (getuid() != 0) {
      MESSAGE("skipped: not root, so no two processes of another user can be made");
      return;
    }
    // Read by somebody of the same user: 1 it worked, 2 refused.
    const auto read_of = [](bool refuses) {
      struct Shared {
        std::atomic<int> answer{-1};
        long secret = 7;
      };
      SharedMemory memory(sizeof(Shared));
      Shared& shared = *new (memory.bytes().data()) Shared;
      ServoProcess holder, reader;
      REQUIRE(holder.start([&] {
        if (setresuid(kNobody, kNobody, kNobody) != 0) return 1;
        prctl(PR_SET_DUMPABLE, 1, 0, 0, 0);
        shared.answer = refuses ? refuse_attachment() : 0;
        for (;;) pause();
      }) == 0);
      while (shared.answer.load() == -1 && !holder.poll(1).ended) {
      }
      if (shared.answer.load() == ENOTSUP) return 0;
      REQUIRE(reader.start([&] {
        if (setresuid(kNobody, kNobody, kNobody) != 0) return 3;
        long copy = 0;
        const iovec to{&copy, sizeof copy}, from{&shared.secret, sizeof copy};
        const ssize_t count = process_vm_readv(holder.pid(), &to, 1, &from, 1, 0);
        return count == sizeof copy ? 1 : errno == EPERM ? 2 : 4;
      }) == 0);
      return reader.finish(kPatience_ms).exit_code;
    };
    if (read_of(false) != 1) {
      MESSAGE("skipped: this kernel refuses it to everybody (kernel.yama.ptrace_scope)");
      return;
    }
    const int answer = read_of(true);
    if (answer == 0) {
      MESSAGE("skipped: a sanitizer is compiled in, which attaches to its own process");
      return;
    }
    CHECK(answer == 2);
  }
}
