// SPDX-License-Identifier: Apache-2.0
#include "hal/realtime/flight_report.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <type_traits>

#include "rt_core/exchange/device_exchange.hpp"
#include "rt_core/safety/arming.hpp"

namespace haptic::hal {
namespace {

struct BitText {
  std::uint32_t bit;
  const char* text;
};

constexpr BitText kDeviceTexts[] = {
    {kDeviceEmergencyStop, "the device's emergency stop"},
    {kDeviceWatchdogCut, "the device's watchdog cut the drives"},
    {kDeviceOverheated, "the device is overheated"},
    {kDeviceDriveFault, "a drive or encoder of the device failed"},
    {kDeviceNotHomed, "the device lost its calibration"},
    {kDeviceRefused, "the device rejected a command"},
    {kLinkLost, "the link was lost"},
    {kLinkSilent, "the device is silent"},
    {kLinkCorrupt, "reports are damaged"},
    {kLinkFrozen, "reports do not advance"},
    {kLinkStaleCommand, "the servo's command was too old"},
    {kLinkServoLost, "the servo process ended"},
    {kLinkSendFailed, "commands can not be handed to the bus"},
    {kLinkOtherDevice, "the device that came back states other capabilities"},
    {kLinkStopCalled, "an emergency stop was called"},
    {kLinkSuspended, "the machine was suspended"},
    {kLinkDeaf, "the device accepts no commands"},
};

constexpr std::array kLinkTexts = {"absent", "starting", "ready"};
static_assert(kLinkTexts.size() == static_cast<std::size_t>(LinkState::kReady) + 1);
constexpr std::array kArmingTexts = {"disarmed", "arming", "armed", "disarming", "faulted"};
static_assert(kArmingTexts.size() == static_cast<std::size_t>(ArmingState::kFaulted) + 1);

// Data of a crashed process are checked.
template <std::size_t count>
const char* text_of(const std::array<const char*, count>& texts, std::uint8_t value) {
  return value < count ? texts[value] : "?";
}

[[gnu::format(printf, 2, 3)]] void append(std::string& text, const char* format, ...) {
  // A double printed with %f has up to 309 digits before the point.
  char line[4096];
  std::va_list values;
  va_start(values, format);
  const int size = std::vsnprintf(line, sizeof line, format, values);
  va_end(values);
  if (size > 0) text.append(line, std::min(sizeof line - 1, static_cast<std::size_t>(size)));
}

double norm(const double (&v)[3]) { return std::hypot(v[0], v[1], v[2]); }

double ms_between(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-6 * (static_cast<double>(to_ns) - static_cast<double>(from_ns));
}

void join(std::string& texts, const char* text) {
  if (!texts.empty()) texts += "; ";
  texts += text;
}

void append_faults(std::string& text, const StepTrace& r) {
  const std::string safety = safety_fault_texts(r.faults);
  const std::string device = device_fault_texts(r.device_faults);
  if (safety.empty() && device.empty()) text += "            no fault any more\n";
  if (!safety.empty()) text += "            latched: " + safety + "\n";
  if (!device.empty()) text += "            device and link: " + device + "\n";
}

void append_tick(std::string& text, const StepTrace& r, std::int64_t last_ns) {
  append(text, "%10llu %9.3f", static_cast<unsigned long long>(r.tick),
         ms_between(last_ns, r.now_ns));
  if (r.sequence != 0) {
    append(text, " %7.3f", ms_between(r.stamp_ns, r.now_ns));
  } else {
    append(text, " %7s", "-");
  }
  append(text, " %4u %-8s %-9s %8.3f %8.3f %8.3f %8.3f %7.3f %7.4f %7.3f %7.4f\n", r.late_periods,
         text_of(kLinkTexts, r.link), text_of(kArmingTexts, r.arming), 1e3 * r.pose_p_m[0],
         1e3 * r.pose_p_m[1], 1e3 * r.pose_p_m[2], 1e3 * r.d_near_m, norm(r.rendered_force_n),
         norm(r.rendered_torque_nm), norm(r.command_force_n), norm(r.command_torque_nm));
}

template <class Number>
void append_field(std::string& csv, Number number, int base = 10) {
  char digits[64];
  std::to_chars_result end{};
  if constexpr (std::is_floating_point_v<Number>) {
    end = std::to_chars(digits, digits + sizeof digits, number == 0 ? Number{0} : number);
  } else {
    end = std::to_chars(digits, digits + sizeof digits, number, base);
  }
  if (!csv.empty() && csv.back() != '\n') csv += ',';
  csv.append(digits, end.ptr);
}

template <std::size_t count>
void append_fields(std::string& csv, const double (&numbers)[count]) {
  for (const double number : numbers) append_field(csv, number);
}

}  // namespace

std::string safety_fault_texts(std::uint32_t faults) {
  std::string texts;
  for (std::uint32_t left = faults; left != 0; left &= left - 1)
    join(texts, fault_text(left & (~left + 1)));
  return texts;
}

std::string device_fault_texts(std::uint32_t faults) {
  std::string texts;
  for (const BitText& known : kDeviceTexts) {
    if ((faults & known.bit) != 0) join(texts, known.text);
    faults &= ~known.bit;
  }
  if (faults != 0) join(texts, "unknown fault");
  return texts;
}

std::string flight_text(std::span<const StepTrace> records, std::size_t most_ticks) {
  if (records.empty()) return "flight recorder: no tick was recorded\n";
  const std::size_t kept = records.size();
  if (kept > most_ticks) records = records.last(most_ticks);
  if (records.empty()) return {};
  std::string text;
  append(text, "flight recorder: ticks %llu to %llu, the last of %zu\n",
         static_cast<unsigned long long>(records.front().tick),
         static_cast<unsigned long long>(records.back().tick), kept);
  text +=
      "      tick      t_ms  age_ms late link     arming        x_mm     y_mm     z_mm  near_mm"
      "  rend_n rend_nm   cmd_n  cmd_nm\n";
  const StepTrace* before = nullptr;
  for (const StepTrace& r : records) {
    if (before != nullptr && r.tick != before->tick + 1) text += "            ticks are missing\n";
    append_tick(text, r, records.back().now_ns);
    const bool faulty = (r.faults | r.device_faults) != 0;
    const bool changed =
        before == nullptr ? faulty
                          : r.faults != before->faults || r.device_faults != before->device_faults;
    if (changed) append_faults(text, r);
    before = &r;
  }
  return text;
}

std::string flight_csv(std::span<const StepTrace> records) {
  std::string csv =
      "tick,sequence,stamp_ns,now_ns,state_hash,x_m,y_m,z_m,qx,qy,qz,qw,command_fx_n,command_fy_n,"
      "command_fz_n,command_tx_nm,command_ty_nm,command_tz_nm,rendered_fx_n,rendered_fy_n,"
      "rendered_fz_n,rendered_tx_nm,rendered_ty_nm,rendered_tz_nm,d_near_m,step_flags,"
      "limiter_flags,faults,device_faults,switches,late_periods,link,arming,situation,work\n";
  csv.reserve(csv.size() + 400 * records.size());
  for (const StepTrace& r : records) {
    append_field(csv, r.tick);
    append_field(csv, r.sequence);
    append_field(csv, r.stamp_ns);
    append_field(csv, r.now_ns);
    append_field(csv, r.state_hash, 16);
    append_fields(csv, r.pose_p_m);
    append_fields(csv, r.pose_q_xyzw);
    append_fields(csv, r.command_force_n);
    append_fields(csv, r.command_torque_nm);
    append_fields(csv, r.rendered_force_n);
    append_fields(csv, r.rendered_torque_nm);
    append_field(csv, r.d_near_m);
    for (const std::uint32_t bits :
         {r.step_flags, r.limiter_flags, r.faults, r.device_faults, r.switches, r.late_periods})
      append_field(csv, bits);
    for (const std::uint8_t state : {r.link, r.arming, r.situation})
      append_field(csv, unsigned{state});
    append_field(csv, r.work);
    csv += '\n';
  }
  return csv;
}

}  // namespace haptic::hal
