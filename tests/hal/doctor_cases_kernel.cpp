// SPDX-License-Identifier: Apache-2.0
#include "tests/hal/doctor_cases.hpp"

#include <cerrno>

namespace haptic::test {
namespace {

const std::string kCpus = "/sys/devices/system/cpu/";

const DoctorCase kKernelCases[] = {
    {"no PREEMPT_RT",
     "PREEMPT_RT",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.remove("/sys/kernel/realtime");
       m.write("/proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian\n");
     },
     {"6.1.0-rt", "no /sys/kernel/realtime"},
     {"linux-image-rt-amd64"}},
    {"real-time switched off",
     "PREEMPT_RT",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.write("/sys/kernel/realtime", "0\n");
       m.remove("/proc/sys/kernel/version");
     },
     {"reads 0"},
     {"linux-image-rt-amd64"}},
    {"only the version says so",
     "PREEMPT_RT",
     kPass,
     false,
     [](FakeMachine& m) { m.remove("/sys/kernel/realtime"); },
     {"has it"},
     {"none needed"}},
    {"no right to SCHED_FIFO",
     "SCHED_FIFO",
     kFailure,
     true,
     [](FakeMachine& m) {
       m.probes.fifo_error = EPERM;
       m.write("/proc/self/limits", "Max realtime priority     0                    0\n");
     },
     {"priority 80", "EPERM", "RLIMIT_RTPRIO 0", "no CAP_SYS_NICE"},
     {"@realtime - rtprio 95", "usermod -aG realtime"}},
    {"SCHED_FIFO refused in spite of the right",
     "SCHED_FIFO",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.fifo_error = EPERM; },
     {"RLIMIT_RTPRIO 95"},
     {"--cap-add=SYS_NICE"}},
    {"no such priority",
     "SCHED_FIFO",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.fifo_error = EINVAL; },
     {"EINVAL"},
     {"1 to 99"}},
    {"a capability in the limit's place",
     "SCHED_FIFO",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write("/proc/self/status", "CapEff:\t0000000000800000\n");
       m.write("/proc/self/limits", "Max realtime priority     0                    0\n");
     },
     {"CAP_SYS_NICE held"},
     {}},
    {"no right to lock memory",
     "memory lock",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.memory_error = ENOMEM; },
     {"ENOMEM"},
     {"@realtime - memlock unlimited", "run_device doctor --print haptic-limits.conf"}},
    {"little memory may be locked",
     "memory lock",
     kWarning,
     true,
     [](FakeMachine& m) {
       m.write("/proc/self/limits", "Max locked memory         8388608     8388608     bytes\n");
     },
     {"8388608 bytes", "later"},
     {"memlock unlimited"}},
    {"a small limit that a capability lifts",
     "memory lock",
     kPass,
     false,
     [](FakeMachine& m) {
       m.write("/proc/self/status", "CapEff:\t0000000000004000\n");
       m.write("/proc/self/limits", "Max locked memory         8388608     8388608     bytes\n");
     },
     {"CAP_IPC_LOCK held"},
     {}},
    {"swap on",
     "swap",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write("/proc/swaps", "Filename Type Size\n/dev/nvme0n1p3   partition 999\n");
     },
     {"/dev/nvme0n1p3"},
     {"swapoff -a"}},
    {"throttling as it comes",
     "RT throttling",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/sys/kernel/sched_rt_runtime_us", "950000\n"); },
     {"950000 of every 1000000"},
     {"sched_rt_runtime_us=-1"}},
    {"throttling unknown",
     "RT throttling",
     kSkipped,
     false,
     [](FakeMachine& m) { m.remove("/proc/sys/kernel/sched_rt_period_us"); },
     {},
     {}},
    {"watchdog interrupts",
     "kernel watchdog",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/sys/kernel/nmi_watchdog", "1\n"); },
     {"cores 0-3"},
     {"kernel.nmi_watchdog=0"}},
    {"a hypervisor",
     "virtual machine",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/cpuinfo", "flags\t\t: fpu hypervisor tsc\n"); },
     {"hypervisor"},
     {"wake-ups"}},
};

const DoctorCase kCoreCases[] = {
    {"another clock",
     "clock",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n");
     },
     {"hpet"},
     {"clocksource=tsc"}},
    {"a counter that stops",
     "clock",
     kWarning,
     false,
     [](FakeMachine& m) { m.write("/proc/cpuinfo", "flags\t\t: fpu constant_tsc tsc\n"); },
     {"lacks nonstop_tsc"},
     {}},
    {"one core",
     "cores",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "online", "0\n"); },
     {"1 core, 1 processors"},
     {"two cores"}},
    {"both threads on one core",
     "cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kCpus + "cpu2/topology/thread_siblings_list", "2-3\n");
       m.write(kCpus + "cpu3/topology/thread_siblings_list", "2-3\n");
     },
     {"share the core of 3,2"},
     {"--cpu N,M"}},
    {"SMT on",
     "SMT",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "smt/active", "1\n"); },
     {"on"},
     {"smt/control"}},
    {"nothing isolated",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kCpus + "isolated", "\n");
       m.remove(kCpus + "nohz_full");
     },
     {"isolated: none"},
     {"isolcpus=managed_irq,domain,2-3 nohz_full=2-3 rcu_nocbs=2-3 irqaffinity=0-1"}},
    {"other cores isolated",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.questions.cpus = {1, 0};
     },
     {"isolated: 2-3"},
     {"isolcpus=managed_irq,domain,0-1", "irqaffinity=2-3"}},
    {"ticks on the isolated cores",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "nohz_full", "(null)\n"); },
     {"nohz_full: none"},
     {"nohz_full=2-3"}},
    {"no core left for the system",
     "isolated cores",
     kWarning,
     false,
     [](FakeMachine& m) {
       m.write(kCpus + "online", "2-3\n");
       m.write(kCpus + "isolated", "\n");
     },
     {"all 2"},
     {"name fewer"}},
    {"a core refused",
     "affinity",
     kFailure,
     true,
     [](FakeMachine& m) { m.probes.cpu_error = EINVAL; },
     {"core 3 refused", "online: 0-3"},
     {"--cpu N,M"}},
    {"isolated cores left unused",
     "affinity",
     kWarning,
     false,
     [](FakeMachine& m) { m.questions.cpus.clear(); },
     {"2-3"},
     {"--cpu 2,3"}},
    {"a saving governor",
     "governor",
     kWarning,
     false,
     [](FakeMachine& m) { m.write(kCpus + "cpufreq/policy2/scaling_governor", "powersave\n"); },
     {"powersave"},
     {"echo performance"}},
    {"no frequency control",
     "governor",
     kSkipped,
     false,
     [](FakeMachine& m) { m.remove(kCpus + "cpufreq"); },
     {},
     {}},
    {"idle states not to be held",
     "idle states",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.idle_error = EACCES; },
     {"EACCES"},
     {"KERNEL==\"cpu_dma_latency\""}},
    {"no idle states file",
     "idle states",
     kWarning,
     false,
     [](FakeMachine& m) { m.probes.idle_error = ENOENT; },
     {"ENOENT"},
     {"processor.max_cstate=1"}},
};

}  // namespace

std::span<const DoctorCase> kernel_cases() { return kKernelCases; }
std::span<const DoctorCase> core_cases() { return kCoreCases; }

}  // namespace haptic::test
