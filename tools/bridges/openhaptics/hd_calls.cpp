// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/openhaptics/hd_calls.hpp"

#include <cstdio>

namespace haptic::tools {

bool bind_hd(VendorLibrary& library, HdCalls& calls, std::string& why) {
  library.bind(calls.init_device, "hdInitDevice");
  library.bind(calls.disable_device, "hdDisableDevice");
  library.bind(calls.make_current, "hdMakeCurrentDevice");
  library.bind(calls.begin_frame, "hdBeginFrame");
  library.bind(calls.end_frame, "hdEndFrame");
  library.bind(calls.enable, "hdEnable");
  library.bind(calls.disable, "hdDisable");
  library.bind(calls.is_enabled, "hdIsEnabled");
  library.bind(calls.get_error, "hdGetError");
  library.bind(calls.get_error_string, "hdGetErrorString");
  library.bind(calls.get_string, "hdGetString");
  library.bind(calls.get_integer, "hdGetIntegerv");
  library.bind(calls.get_double, "hdGetDoublev");
  library.bind(calls.set_double, "hdSetDoublev");
  library.bind(calls.check_calibration, "hdCheckCalibration");
  library.bind(calls.update_calibration, "hdUpdateCalibration");
  library.bind(calls.set_scheduler_rate, "hdSetSchedulerRate");
  library.bind(calls.schedule, "hdScheduleAsynchronous");
  library.bind(calls.unschedule, "hdUnschedule");
  library.bind(calls.start_scheduler, "hdStartScheduler");
  library.bind(calls.stop_scheduler, "hdStopScheduler");
  why = library.defect();
  return why.empty();
}

HdErrorInfo take_hd_errors(const HdCalls& calls) noexcept {
  HdErrorInfo oldest;
  for (int k = 0; k < kMostHdErrors; ++k) {
    const HdErrorInfo error = calls.get_error();
    if (error.code == kHdSuccess) break;
    oldest = error;
  }
  return oldest;
}

std::string hd_error_text(const HdCalls& calls, const HdErrorInfo& error) {
  const char* const words = calls.get_error_string(error.code);
  char numbers[64];
  (void)std::snprintf(numbers, sizeof numbers, " (0x%04x, internal %d)", error.code,
                      error.internal);
  return (words != nullptr && *words != '\0' ? words : "an error without a name") +
         std::string(numbers);
}

}  // namespace haptic::tools
