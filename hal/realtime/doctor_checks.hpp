// SPDX-License-Identifier: Apache-2.0
#pragma once
/// The single questions of the doctor, by what they look at. Only doctor.cpp calls them.

#include <string>
#include <vector>

#include "hal/realtime/doctor.hpp"

namespace haptic::hal {

/// Input of every check.
struct Examination {
  const SystemTree& tree;
  SystemProbes& probes;
  const DoctorQuestions& questions;
};

[[nodiscard]] DoctorLine passed(std::string name, std::string found);
[[nodiscard]] DoctorLine warned(std::string name, std::string found, std::string fix);
/// A warning that refuses in strict.
[[nodiscard]] DoctorLine refused(std::string name, std::string found, std::string fix);
[[nodiscard]] DoctorLine failed(std::string name, std::string found, std::string fix);
[[nodiscard]] DoctorLine skipped(std::string name, std::string found, std::string fix);

/// "EPERM (Operation not permitted)".
[[nodiscard]] std::string errno_text(int error);

/// Processors in use; {0} where the tree does not say.
[[nodiscard]] std::vector<int> online_cpus(const SystemTree& tree);
/// Where the loop's threads go: those asked for, else the last two of four or more, the last one of
/// fewer: what a fix proposes.
[[nodiscard]] std::vector<int> proposed_cpus(const Examination& e);

/// Kept free at boot (isolcpus=).
[[nodiscard]] std::vector<int> isolated_cpus(const SystemTree& tree);
/// Cores that nobody else should use: those asked for, else the isolated ones.
[[nodiscard]] std::vector<int> loop_cpus(const Examination& e);
[[nodiscard]] std::vector<int> without(const std::vector<int>& all, const std::vector<int>& some);

// doctor_checks_kernel.cpp: what the kernel is and what it grants.
[[nodiscard]] DoctorLine check_preempt_rt(const Examination& e);
[[nodiscard]] DoctorLine check_fifo(const Examination& e);
[[nodiscard]] DoctorLine check_memory_lock(const Examination& e);
[[nodiscard]] DoctorLine check_swap(const Examination& e);
[[nodiscard]] DoctorLine check_throttling(const Examination& e);
[[nodiscard]] DoctorLine check_kernel_watchdog(const Examination& e);
[[nodiscard]] DoctorLine check_virtual_machine(const Examination& e);

// doctor_checks_cores.cpp: the processors, their clock and their sleep.
[[nodiscard]] DoctorLine check_clock(const Examination& e);
[[nodiscard]] DoctorLine check_cores(const Examination& e);
[[nodiscard]] DoctorLine check_smt(const Examination& e);
[[nodiscard]] DoctorLine check_isolation(const Examination& e);
[[nodiscard]] DoctorLine check_affinity(const Examination& e);
[[nodiscard]] DoctorLine check_governor(const Examination& e);
[[nodiscard]] DoctorLine check_idle_states(const Examination& e);

// doctor_checks_housekeeping.cpp: what the kernel does on the side, and on which cores.
[[nodiscard]] DoctorLine check_fair_server(const Examination& e);
[[nodiscard]] DoctorLine check_timer_migration(const Examination& e);
[[nodiscard]] DoctorLine check_tick_skew(const Examination& e);
[[nodiscard]] DoctorLine check_vm_statistics(const Examination& e);
[[nodiscard]] DoctorLine check_hung_tasks(const Examination& e);
[[nodiscard]] DoctorLine check_soft_lockups(const Examination& e);
[[nodiscard]] DoctorLine check_huge_pages(const Examination& e);
[[nodiscard]] DoctorLine check_numa_balancing(const Examination& e);
[[nodiscard]] DoctorLine check_page_merging(const Examination& e);
[[nodiscard]] DoctorLine check_workqueues(const Examination& e);
[[nodiscard]] DoctorLine check_writeback(const Examination& e);
[[nodiscard]] DoctorLine check_default_interrupts(const Examination& e);
[[nodiscard]] DoctorLine check_irqbalance(const Examination& e);
[[nodiscard]] DoctorLine check_machine_checks(const Examination& e);
[[nodiscard]] DoctorLine check_tracer(const Examination& e);
[[nodiscard]] DoctorLine check_debug_kernel(const Examination& e);
[[nodiscard]] DoctorLine check_partition(const Examination& e);

// doctor_checks_bridges.cpp: devices behind a daemon, a service, a library or a serial port.
[[nodiscard]] DoctorLine check_usb_rights(const Examination& e);
[[nodiscard]] DoctorLine check_spacenavd(const Examination& e);
[[nodiscard]] DoctorLine check_hidraw(const Examination& e);
[[nodiscard]] DoctorLine check_haply(const Examination& e);
[[nodiscard]] DoctorLine check_openhaptics(const Examination& e);
[[nodiscard]] DoctorLine check_touch_port(const Examination& e);
[[nodiscard]] DoctorLine check_touch_pairing(const Examination& e);
[[nodiscard]] DoctorLine check_force_dimension(const Examination& e);
[[nodiscard]] DoctorLine check_force_dimension_rights(const Examination& e);
[[nodiscard]] DoctorLine check_servo_ports(const Examination& e);
[[nodiscard]] DoctorLine check_servo_latency(const Examination& e);
[[nodiscard]] DoctorLine check_modem_manager(const Examination& e);

// doctor_checks_power.cpp: what saves power and costs time.
[[nodiscard]] DoctorLine check_energy_preference(const Examination& e);
[[nodiscard]] DoctorLine check_least_speed(const Examination& e);
[[nodiscard]] DoctorLine check_turbo(const Examination& e);
[[nodiscard]] DoctorLine check_controller_power(const Examination& e);
[[nodiscard]] DoctorLine check_pcie_power(const Examination& e);

// doctor_checks_usb.cpp: the bus, its interrupts, and libusb.
[[nodiscard]] DoctorLine check_usb_controller(const Examination& e);
[[nodiscard]] DoctorLine check_usb_library(const Examination& e);
[[nodiscard]] DoctorLine check_usb_interrupts(const Examination& e);
[[nodiscard]] DoctorLine check_usb_interrupt_threads(const Examination& e);

// doctor_checks_device.cpp: the named device, six lines.
[[nodiscard]] std::vector<DoctorLine> check_device(const Examination& e);

// doctor_checks_wakeup.cpp: measured, and who is late.
[[nodiscard]] std::vector<DoctorLine> check_wakeups(const Examination& e,
                                                    WakeupMeasurement& measurement);

}  // namespace haptic::hal
