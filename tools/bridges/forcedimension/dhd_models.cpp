// SPDX-License-Identifier: Apache-2.0
#include "tools/bridges/forcedimension/dhd_models.hpp"

#include <array>
#include <utility>

namespace haptic::tools {
namespace {

constexpr DhdModel kOmega3 = {"omega.3", 12, 0, 5000, 30, 0.075_r};
constexpr DhdModel kOmega6 = {"omega.6", 12, 0, 5000, 30, 0.075_r};
constexpr DhdModel kOmega7 = {"omega.7", 12, 0, 5000, 30, 0.075_r};
constexpr DhdModel kDelta3 = {"delta.3", 20, 0, 5000, 30, 0.15_r};
constexpr DhdModel kSigma7 = {"sigma.7", 12, 0.2_r, 4000, 30, 0.075_r};
constexpr DhdModel kLambda7 = {"lambda.7", 12, 0.2_r, 8000, 30, 0.1125_r};
constexpr DhdModel kFalcon = {"Falcon", 8, 0, 3000, 20, 0.04_r};

// Types are those of the DHD reference; a handed device has one for each hand.
constexpr std::array<std::pair<int, DhdModel>, 11> kModels = {{{33, kOmega3},
                                                               {34, kOmega6},
                                                               {36, kOmega6},
                                                               {35, kOmega7},
                                                               {37, kOmega7},
                                                               {60, kFalcon},
                                                               {63, kDelta3},
                                                               {104, kSigma7},
                                                               {105, kSigma7},
                                                               {108, kLambda7},
                                                               {109, kLambda7}}};
constexpr DhdModel kUnknown = {"unknown type", 8, 0.1_r, 0, 0, 0};

}  // namespace

const DhdModel* find_dhd_model(int type) noexcept {
  for (const auto& [number, model] : kModels) {
    if (number == type) return &model;
  }
  return nullptr;
}

const DhdModel& unknown_dhd_model() noexcept { return kUnknown; }

}  // namespace haptic::tools
