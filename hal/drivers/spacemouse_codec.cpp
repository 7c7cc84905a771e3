// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/spacemouse_codec.hpp"

#include <algorithm>

namespace haptic::hal {
namespace {

constexpr std::uint16_t kLogitech = 0x046d;

constexpr SpaceMouseModel kModels[] = {
    {kLogitech, 0xc603, "SpaceMouse Plus XT", false, kOlderAxes, 0},
    {kLogitech, 0xc605, "CadMan", false, kOlderAxes, 0},
    {kLogitech, 0xc606, "SpaceMouse Classic", false, kOlderAxes, 0},
    {kLogitech, 0xc621, "Spaceball 5000", false, kOlderAxes, 0},
    {kLogitech, 0xc623, "SpaceTraveler", false, kCurrentAxes, 0},
    {kLogitech, 0xc625, "SpacePilot", false, kCurrentAxes, 0},
    {kLogitech, 0xc626, "SpaceNavigator", false, kCurrentAxes, 0},
    {kLogitech, 0xc627, "SpaceExplorer", false, kCurrentAxes, 0},
    {kLogitech, 0xc628, "SpaceNavigator for Notebooks", false, kCurrentAxes, 0},
    // Its first interface is the display's.
    {kLogitech, 0xc629, "SpacePilot Pro", false, kCurrentAxes, 1},
    {kLogitech, 0xc62b, "SpaceMouse Pro", false, kCurrentAxes, 0},
    {k3DconnexionId, 0xc62e, "SpaceMouse Wireless (cable)", true, kCurrentAxes, 0},
    {k3DconnexionId, 0xc62f, "SpaceMouse Wireless (receiver)", true, kCurrentAxes, 0},
    {k3DconnexionId, 0xc631, "SpaceMouse Pro Wireless (cable)", true, kCurrentAxes, 0},
    {k3DconnexionId, 0xc632, "SpaceMouse Pro Wireless (receiver)", true, kCurrentAxes, 0},
    {k3DconnexionId, 0xc633, "SpaceMouse Enterprise", true, kCurrentAxes, 0},
    {k3DconnexionId, 0xc635, "SpaceMouse Compact", false, kCurrentAxes, 0},
    {k3DconnexionId, 0xc636, "SpaceMouse Module", false, kCurrentAxes, 0},
    {k3DconnexionId, 0xc638, "SpaceMouse Pro Wireless BT", true, kCurrentAxes, 0},
    {k3DconnexionId, 0xc63a, "SpaceMouse Wireless BT", true, kCurrentAxes, 0},
    // Five interfaces, of which the device's own has its reports: a Pro Wireless is on the first, a
    // SpaceMouse Wireless on the second, and is not heard here
    // (github.com/JakubAndrysek/PySpaceMouse/issues/49).
    {k3DconnexionId, 0xc652, "Universal Receiver with a SpaceMouse Pro Wireless", true,
     kCurrentAxes, 0}};

constexpr std::uint16_t kRefused[] = {0xc62c, 0xc641, 0xc650, 0xc651, 0xc654, 0xc655,
                                      0xc656, 0xc657, 0xc658, 0xc664, 0xc665, 0xc668};

void take_axes(std::span<const std::uint8_t> bytes, std::span<std::int16_t> axes) noexcept {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i] =
        static_cast<std::int16_t>(static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8));
  }
}

void put_axes(std::span<const std::int16_t> axes, std::span<std::uint8_t> bytes) noexcept {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto pattern = static_cast<std::uint16_t>(axes[i]);
    bytes[2 * i] = static_cast<std::uint8_t>(pattern & 0xffu);
    bytes[2 * i + 1] = static_cast<std::uint8_t>(pattern >> 8);
  }
}

}  // namespace

std::span<const SpaceMouseModel> spacemouse_models() noexcept { return kModels; }

const SpaceMouseModel* find_spacemouse(std::uint16_t vendor_id, std::uint16_t product_id) noexcept {
  for (const SpaceMouseModel& model : kModels) {
    if (model.vendor_id == vendor_id && model.product_id == product_id) return &model;
  }
  return nullptr;
}

bool is_refused_spacemouse(std::uint16_t vendor_id, std::uint16_t product_id) noexcept {
  if (vendor_id != k3DconnexionId) return false;
  for (const std::uint16_t refused : kRefused) {
    if (refused == product_id) return true;
  }
  return false;
}

SpaceMouseReport decode(std::span<const std::uint8_t> report, bool may_be_joined,
                        SpaceMouseInput& input) noexcept {
  if (report.empty()) return SpaceMouseReport::kBadLength;
  const std::span<const std::uint8_t> rest = report.subspan(1);
  const std::span<std::int16_t> axes(input.axes);
  switch (report[0]) {
    case 1:
      if (report.size() < kSpaceMouseShortBytes) return SpaceMouseReport::kBadLength;
      if (!may_be_joined || report.size() < kSpaceMouseLongBytes) {
        take_axes(rest, axes.first(3));
        return SpaceMouseReport::kTranslation;
      }
      take_axes(rest, axes);
      return SpaceMouseReport::kAllAxes;
    case 2:
      if (report.size() < kSpaceMouseShortBytes) return SpaceMouseReport::kBadLength;
      take_axes(rest, axes.last(3));
      return SpaceMouseReport::kRotation;
    case 3:
      if (rest.empty()) return SpaceMouseReport::kBadLength;
      input.buttons = 0;
      for (std::size_t i = 0; i < std::min<std::size_t>(rest.size(), 4); ++i) {
        input.buttons |= static_cast<std::uint32_t>(rest[i]) << (8 * i);
      }
      return SpaceMouseReport::kButtons;
    case 23:
      if (rest.empty()) return SpaceMouseReport::kBadLength;
      input.battery_percent = std::min<std::uint8_t>(rest[0], 100);
      return SpaceMouseReport::kBattery;
    default:
      return SpaceMouseReport::kUnknown;
  }
}

std::array<std::uint8_t, kSpaceMouseShortBytes> encode_short(
    std::uint8_t number, std::span<const std::int16_t, 3> values) noexcept {
  std::array<std::uint8_t, kSpaceMouseShortBytes> bytes{number};
  put_axes(values, std::span(bytes).subspan(1));
  return bytes;
}

std::array<std::uint8_t, kSpaceMouseLongBytes> encode_long(
    std::span<const std::int16_t, 6> values) noexcept {
  std::array<std::uint8_t, kSpaceMouseLongBytes> bytes{1};
  put_axes(values, std::span(bytes).subspan(1));
  return bytes;
}

}  // namespace haptic::hal
