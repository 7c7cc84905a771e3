// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Rights that a process gives up once it is set up, so that an error in it reaches little: system
/// calls, descriptors, capabilities, being attached to. Each request is answered with 0 or an
/// errno; nothing that was given up comes back.

#include <span>

namespace haptic::hal {

/// For the servo's process, right before its loop. From now on Linux kills it with SIGSYS at any
/// system call but those of ServoLoop::run (clock_nanosleep; futex wait and wake; clock_gettime,
/// where the kernel's clock needs one), getrusage, the return from a signal handler, and exit. A
/// kill is a crash of the servo process: the parent ramps the force
/// down. No destructor that unmaps, closes or unlocks may run afterwards; end with _exit.
/// SIGABRT cannot be raised either: a failed assertion shows as SIGSYS.
/// ENOSYS: not built for this processor (x86-64 and 64-bit Arm only), or a kernel without seccomp.
/// ENOTSUP: a sanitizer is compiled in, whose run-time makes calls of its own. EBUSY: another
/// thread has a filter already.
[[nodiscard]] int confine_servo() noexcept;

/// For a process that reads what others send it, all its threads at once: from now on it starts no
/// program, reaches into no other process, and changes neither names nor rights of files; such a
/// call answers EPERM. Sockets and files are opened as before. Errors as of confine_servo.
[[nodiscard]] int confine_bridge() noexcept;

/// Closes every descriptor but those of `keep` (any order; negative ones are ignored), so that what
/// the parent, a shell or sudo had open is not held by us. No heap: also for a forked child.
[[nodiscard]] int close_inherited_descriptors(std::span<const int> keep) noexcept;

/// Rights that a process started by root or sudo goes on using.
struct KeptRights {
  int fifo_priority = 0;     ///< highest SCHED_FIFO priority that a thread takes later; 0: none
  bool lock_memory = false;  ///< memory is mapped and locked later too
  /// Files of the user who called sudo are read or written later: CAP_DAC_OVERRIDE stays.
  bool files_of_others = false;
};

/// Rights of `KeptRights` that could not be kept as a resource limit and stay as a capability.
struct KeptCapabilities {
  int error = 0;         ///< errno; then not all was given up
  bool nice = false;     ///< CAP_SYS_NICE, since RLIMIT_RTPRIO could not be raised
  bool memory = false;   ///< CAP_IPC_LOCK, since RLIMIT_MEMLOCK could not be raised
  bool files = false;    ///< CAP_DAC_OVERRIDE, as asked for
  bool held_any = true;  ///< false: an ordinary user's process, nothing was changed
};

/// For the only thread of a process. Real-time priority and locked memory become resource limits
/// where the process may set them, so that no capability is needed for either; all others leave the
/// permitted, inheritable, ambient and bounding sets, and programs executed later gain none
/// (PR_SET_NO_NEW_PRIVS). Without any capability: changes nothing.
[[nodiscard]] KeptCapabilities drop_capabilities(const KeptRights& kept) noexcept;

/// For the process that holds the device. No other process of the same user may attach to it, write
/// its memory or take its descriptors (PR_SET_DUMPABLE 0); and a crash of it writes no core file,
/// which would keep the device's descriptor open until gigabytes of locked memory are on disk. The
/// servo process stays as it is: it holds no descriptor, and its core file is worth having. Call it
/// after the fork: children inherit it. ENOTSUP: a sanitizer is compiled in, which attaches to its
/// own process.
[[nodiscard]] int refuse_attachment() noexcept;

}  // namespace haptic::hal
