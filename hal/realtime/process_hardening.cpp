// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/process_hardening.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/futex.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstdint>

namespace haptic::hal {
namespace {

// g++ first: headers define __has_feature for it, which then knows of no sanitizer.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif
#else
constexpr bool kSanitized = false;
#endif

#if defined(__x86_64__)
constexpr std::uint32_t kFilterArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kFilterArchitecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kFilterArchitecture = 0;
#endif

#ifdef SYS_close_range
constexpr long kCloseRange = SYS_close_range;
#else
constexpr long kCloseRange = 436;  // the same on every architecture
#endif

// In the order of how often they come. restart_syscall: a futex wait goes on after SIGCONT.
constexpr std::array<long, 7> kServoCalls = {
    SYS_clock_nanosleep, SYS_clock_gettime, SYS_rt_sigreturn, SYS_restart_syscall,
    SYS_getrusage,       SYS_exit_group,    SYS_exit};
constexpr std::array<std::uint32_t, 4> kFutexRequests = {FUTEX_WAIT, FUTEX_WAKE, FUTEX_WAIT_BITSET,
                                                         FUTEX_WAKE_BITSET};

constexpr std::uint32_t kAllow = SECCOMP_RET_ALLOW, kKill = SECCOMP_RET_KILL_PROCESS;

constexpr sock_filter load(std::size_t offset) {
  return {BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<std::uint32_t>(offset)};
}
// Where the accumulator is not `value`, `otherwise` instructions are passed over.
constexpr sock_filter go_on_if(std::uint32_t value, std::size_t otherwise) {
  return {BPF_JMP | BPF_JEQ | BPF_K, 0, static_cast<std::uint8_t>(otherwise), value};
}
constexpr sock_filter answer(std::uint32_t action) { return {BPF_RET | BPF_K, 0, 0, action}; }

constexpr std::size_t kFutexLength = 1 + 2 + 2 * kFutexRequests.size() + 1;
constexpr std::size_t kFilterLength = 3 + kFutexLength + 2 * kServoCalls.size() + 1;

constexpr auto servo_filter() {
  std::array<sock_filter, kFilterLength> program{};
  std::size_t at = 0;
  const auto add = [&](const sock_filter& instruction) { program[at++] = instruction; };
  add(load(offsetof(seccomp_data, arch)));
  add(go_on_if(kFilterArchitecture, kFilterLength - 3));  // else to the last, which kills
  add(load(offsetof(seccomp_data, nr)));
  add(go_on_if(SYS_futex, kFutexLength - 1));
  // The lower half comes first in memory on both processors.
  add(load(offsetof(seccomp_data, args) + sizeof(std::uint64_t)));
  add({BPF_ALU | BPF_AND | BPF_K, 0, 0,
       ~static_cast<std::uint32_t>(FUTEX_PRIVATE_FLAG | FUTEX_CLOCK_REALTIME)});
  for (const std::uint32_t request : kFutexRequests) {
    add(go_on_if(request, 1));
    add(answer(kAllow));
  }
  add(answer(kKill));
  for (const long call : kServoCalls) {
    add(go_on_if(static_cast<std::uint32_t>(call), 1));
    add(answer(kAllow));
  }
  add(answer(kKill));
  return program;
}

// Calls by which a process starts another program, reaches into another process, changes the names
// and rights of files, or the kernel.
constexpr std::array kRefusedCalls = std::to_array<long>({
  SYS_execve, SYS_execveat, SYS_ptrace, SYS_process_vm_readv, SYS_process_vm_writev, SYS_kcmp,
      SYS_renameat2, SYS_linkat, SYS_symlinkat, SYS_mkdirat, SYS_mknodat, SYS_fchmod, SYS_fchmodat,
      SYS_fchown, SYS_fchownat, SYS_truncate, SYS_setxattr, SYS_mount, SYS_umount2, SYS_pivot_root,
      SYS_chroot, SYS_setns, SYS_unshare, SYS_bpf, SYS_perf_event_open, SYS_userfaultfd,
      SYS_io_uring_setup, SYS_init_module, SYS_finit_module, SYS_delete_module, SYS_kexec_load,
      SYS_reboot, SYS_swapon, SYS_add_key, SYS_keyctl, SYS_personality,
#if defined(__x86_64__)  // older names of the same
      SYS_rename, SYS_renameat, SYS_link, SYS_symlink, SYS_mkdir, SYS_mknod, SYS_chmod, SYS_chown,
      SYS_lchown,
#endif
});
// Numbers from here on are the same calls by another convention, on x86-64.
constexpr std::uint32_t kFirstOfOtherConvention = 0x40000000;

constexpr auto bridge_filter() {
  std::array<sock_filter, 6 + 2 * kRefusedCalls.size() + 1> program{};
  std::size_t at = 0;
  const auto add = [&](const sock_filter& instruction) { program[at++] = instruction; };
  add(load(offsetof(seccomp_data, arch)));
  add({BPF_JMP | BPF_JEQ | BPF_K, 1, 0, kFilterArchitecture});
  add(answer(kKill));
  add(load(offsetof(seccomp_data, nr)));
  add({BPF_JMP | BPF_JGE | BPF_K, 0, 1, kFirstOfOtherConvention});
  add(answer(kKill));
  for (const long call : kRefusedCalls) {
    add(go_on_if(static_cast<std::uint32_t>(call), 1));
    add(answer(SECCOMP_RET_ERRNO | EPERM));
  }
  add(answer(kAllow));
  return program;
}

int enter_filter(std::span<const sock_filter> instructions) noexcept {
  static_assert(std::endian::native == std::endian::little || kFilterArchitecture == 0);
  static_assert(kFilterLength < 256, "jumps are one byte");
  sock_fprog program{};
  program.len = static_cast<unsigned short>(instructions.size());
  program.filter = const_cast<sock_filter*>(instructions.data());
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return errno;
  // SPEC_ALLOW: before Linux 5.16 a filter would otherwise switch off the speculative store bypass,
  // which costs each tick time and protects secrets that this process does not have.
  for (const unsigned long flags :
       {SECCOMP_FILTER_FLAG_TSYNC | SECCOMP_FILTER_FLAG_SPEC_ALLOW, SECCOMP_FILTER_FLAG_TSYNC}) {
    const long result = syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, flags, &program);
    if (result == 0) return 0;
    if (result > 0) return EBUSY;  // a thread that has a filter of its own
    if (errno != EINVAL) return errno;
  }
  return errno;
}

bool is_decimal(char c) noexcept { return c >= '0' && c <= '9'; }

// Closes the descriptors between the two that /proc/self/fd lists; false: that folder cannot be
// read. No heap, hence no opendir.
bool close_listed(unsigned first, unsigned last) noexcept {
  const int folder = open("/proc/self/fd", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return false;
  alignas(dirent64) char entries[1024];
  long size = 0;
  while ((size = syscall(SYS_getdents64, folder, entries, sizeof entries)) > 0) {
    for (const char* at = entries; at < entries + size;) {
      const auto* const entry = reinterpret_cast<const dirent64*>(at);
      at += entry->d_reclen;
      unsigned number = 0;
      const char* digit = entry->d_name;
      for (; is_decimal(*digit); ++digit)
        number = 10 * number + static_cast<unsigned>(*digit - '0');
      if (!is_decimal(entry->d_name[0]) || number < first || number > last) continue;
      if (static_cast<int>(number) != folder) close(static_cast<int>(number));
    }
  }
  close(folder);
  return size == 0;
}

int close_between(unsigned first, unsigned last) noexcept {
  if (syscall(kCloseRange, first, last, 0u) == 0) return 0;  // Linux 5.9
  const int error = errno;
  return close_listed(first, last) ? 0 : error;
}

template <typename Resource>
bool has_limit(Resource which, rlim_t wanted) noexcept {
  rlimit limit{};
  if (getrlimit(which, &limit) != 0) return false;
  if (limit.rlim_cur >= wanted) return true;
  const rlimit raised{wanted, std::max(limit.rlim_max, wanted)};
  return setrlimit(which, &raised) == 0;
}

struct CapabilitySets {
  std::array<__user_cap_data_struct, 2> words{};

  [[nodiscard]] int read() noexcept {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    return syscall(SYS_capget, &header, words.data()) == 0 ? 0 : errno;
  }
  [[nodiscard]] int write() const noexcept {
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    return syscall(SYS_capset, &header, words.data()) == 0 ? 0 : errno;
  }
  [[nodiscard]] bool permits(unsigned number) const noexcept {
    return ((words[number / 32].permitted >> (number % 32)) & 1U) != 0;
  }
  [[nodiscard]] bool permits_any() const noexcept {
    return words[0].permitted != 0 || words[1].permitted != 0;
  }
  void add(unsigned number) noexcept {
    words[number / 32].permitted |= 1U << (number % 32);
    words[number / 32].effective |= 1U << (number % 32);
  }
};

// The bounding set may be made smaller with CAP_SETPCAP alone. Numbers end with the first that the
// kernel does not know.
int empty_bounding_set() noexcept {
  for (unsigned long number = 0;; ++number) {
    const int present = prctl(PR_CAPBSET_READ, number, 0, 0, 0);
    if (present < 0) return 0;
    if (present == 1 && prctl(PR_CAPBSET_DROP, number, 0, 0, 0) != 0) return errno;
  }
}

}  // namespace

int confine_servo() noexcept {
  if (kFilterArchitecture == 0) return ENOSYS;
  if (kSanitized) return ENOTSUP;
  static constexpr std::array kProgram = servo_filter();
  const int error = enter_filter(kProgram);
  return error == EINVAL ? ENOSYS : error;
}

int confine_bridge() noexcept {
  if (kFilterArchitecture == 0) return ENOSYS;
  if (kSanitized) return ENOTSUP;
  static constexpr std::array kProgram = bridge_filter();
  const int error = enter_filter(kProgram);
  return error == EINVAL ? ENOSYS : error;
}

int close_inherited_descriptors(std::span<const int> keep) noexcept {
  // The next kept one at or after `first`, again and again: few are kept, and nothing is sorted.
  unsigned first = 0;
  for (;;) {
    unsigned next = UINT_MAX;
    for (const int each : keep) {
      if (each >= 0 && static_cast<unsigned>(each) >= first)
        next = std::min(next, static_cast<unsigned>(each));
    }
    const int error = next > first ? close_between(first, next == UINT_MAX ? next : next - 1) : 0;
    if (error != 0 || next == UINT_MAX) return error;
    first = next + 1;
  }
}

KeptCapabilities drop_capabilities(const KeptRights& kept) noexcept {
  KeptCapabilities result;
  CapabilitySets held;
  result.error = held.read();
  if (result.error != 0) return result;
  result.held_any = held.permits_any();
  if (!result.held_any) return result;
  const auto priority = static_cast<rlim_t>(std::max(kept.fifo_priority, 0));
  result.nice = priority > 0 && !has_limit(RLIMIT_RTPRIO, priority) && held.permits(CAP_SYS_NICE);
  result.memory =
      kept.lock_memory && !has_limit(RLIMIT_MEMLOCK, RLIM_INFINITY) && held.permits(CAP_IPC_LOCK);
  result.files = kept.files_of_others && held.permits(CAP_DAC_OVERRIDE);
  CapabilitySets left;
  if (result.nice) left.add(CAP_SYS_NICE);
  if (result.memory) left.add(CAP_IPC_LOCK);
  if (result.files) left.add(CAP_DAC_OVERRIDE);
  // Linux 4.3; there is no ambient set before.
  (void)prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
  const int bounding = held.permits(CAP_SETPCAP) ? empty_bounding_set() : 0;
  const int privileges = prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 ? 0 : errno;
  const int sets = left.write();
  result.error = sets != 0 ? sets : bounding != 0 ? bounding : privileges;
  return result;
}

int refuse_attachment() noexcept {
  if (kSanitized) return ENOTSUP;
  return prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) == 0 ? 0 : errno;
}

}  // namespace haptic::hal
