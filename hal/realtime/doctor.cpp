// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/doctor.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <memory>
#include <utility>

#include "hal/realtime/doctor_checks.hpp"

namespace haptic::hal {
namespace {

DoctorLine line(std::string name, DoctorLevel level, bool refuses, std::string found,
                std::string fix) {
  return {std::move(name), level, refuses, std::move(found), std::move(fix)};
}

void append(std::vector<DoctorLine>& lines, std::vector<DoctorLine> more) {
  lines.insert(lines.end(), std::make_move_iterator(more.begin()),
               std::make_move_iterator(more.end()));
}

}  // namespace

const char* to_text(DoctorLevel level) noexcept {
  static constexpr const char* kTexts[] = {"pass", "warning", "failure", "skipped"};
  static_assert(sizeof(kTexts) / sizeof(kTexts[0]) ==
                static_cast<std::size_t>(DoctorLevel::kCount));
  return level < DoctorLevel::kCount ? kTexts[static_cast<std::size_t>(level)] : "?";
}

DoctorLine passed(std::string name, std::string found) {
  return line(std::move(name), DoctorLevel::kPass, false, std::move(found), "none needed");
}

DoctorLine warned(std::string name, std::string found, std::string fix) {
  return line(std::move(name), DoctorLevel::kWarning, false, std::move(found), std::move(fix));
}

DoctorLine refused(std::string name, std::string found, std::string fix) {
  return line(std::move(name), DoctorLevel::kWarning, true, std::move(found), std::move(fix));
}

DoctorLine failed(std::string name, std::string found, std::string fix) {
  return line(std::move(name), DoctorLevel::kFailure, true, std::move(found), std::move(fix));
}

DoctorLine skipped(std::string name, std::string found, std::string fix) {
  return line(std::move(name), DoctorLevel::kSkipped, false, std::move(found), std::move(fix));
}

std::string errno_text(int error) {
  const char* name = strerrorname_np(error);
  return std::string(name != nullptr ? name : "unknown error") + " (" + std::strerror(error) + ")";
}

std::vector<int> online_cpus(const SystemTree& tree) {
  std::vector<int> cpus = parse_cpu_list(tree.text("/sys/devices/system/cpu/online").value_or("0"));
  if (cpus.empty()) cpus.push_back(0);
  return cpus;
}

std::vector<int> proposed_cpus(const Examination& e) {
  if (!e.questions.cpus.empty()) return e.questions.cpus;
  std::vector<int> cpus = online_cpus(e.tree);
  const auto kept = static_cast<std::ptrdiff_t>(cpus.size() >= 4 ? 2 : 1);
  cpus.erase(cpus.begin(), cpus.end() - kept);
  return cpus;
}

std::vector<int> isolated_cpus(const SystemTree& tree) {
  return parse_cpu_list(tree.text("/sys/devices/system/cpu/isolated").value_or(""));
}

std::vector<int> loop_cpus(const Examination& e) {
  return e.questions.cpus.empty() ? isolated_cpus(e.tree) : e.questions.cpus;
}

std::vector<int> without(const std::vector<int>& all, const std::vector<int>& some) {
  std::vector<int> rest;
  std::copy_if(all.begin(), all.end(), std::back_inserter(rest),
               [&](int cpu) { return std::find(some.begin(), some.end(), cpu) == some.end(); });
  return rest;
}

std::vector<DoctorLine> examine(const SystemTree& tree, SystemProbes& probes,
                                const DoctorQuestions& questions, WakeupMeasurement* measurement) {
  const Examination e{tree, probes, questions};
  using Check = DoctorLine (*)(const Examination&);
  static constexpr Check kChecks[] = {check_preempt_rt,
                                      check_fifo,
                                      check_memory_lock,
                                      check_swap,
                                      check_throttling,
                                      check_virtual_machine,
                                      check_kernel_watchdog,
                                      check_clock,
                                      check_cores,
                                      check_smt,
                                      check_isolation,
                                      check_affinity,
                                      check_partition,
                                      check_governor,
                                      check_idle_states,
                                      check_energy_preference,
                                      check_least_speed,
                                      check_turbo,
                                      check_fair_server,
                                      check_timer_migration,
                                      check_tick_skew,
                                      check_vm_statistics,
                                      check_hung_tasks,
                                      check_soft_lockups,
                                      check_huge_pages,
                                      check_numa_balancing,
                                      check_page_merging,
                                      check_workqueues,
                                      check_writeback,
                                      check_default_interrupts,
                                      check_irqbalance,
                                      check_machine_checks,
                                      check_tracer,
                                      check_debug_kernel,
                                      check_usb_controller,
                                      check_usb_library,
                                      check_usb_interrupts,
                                      check_usb_interrupt_threads,
                                      check_controller_power,
                                      check_pcie_power,
                                      check_usb_rights,
                                      check_spacenavd,
                                      check_hidraw,
                                      check_haply,
                                      check_openhaptics,
                                      check_touch_port,
                                      check_touch_pairing,
                                      check_force_dimension,
                                      check_force_dimension_rights,
                                      check_servo_ports,
                                      check_servo_latency,
                                      check_modem_manager};
  std::vector<DoctorLine> lines;
  for (const Check check : kChecks) lines.push_back(check(e));
  append(lines, check_device(e));
  const auto own = std::make_unique<WakeupMeasurement>();
  append(lines, check_wakeups(e, measurement != nullptr ? *measurement : *own));
  return lines;
}

bool is_fit(const std::vector<DoctorLine>& lines, bool strict) noexcept {
  return std::none_of(lines.begin(), lines.end(), [&](const DoctorLine& each) {
    return each.level == DoctorLevel::kFailure ||
           (strict && each.level == DoctorLevel::kWarning && each.refuses_in_strict);
  });
}

}  // namespace haptic::hal
