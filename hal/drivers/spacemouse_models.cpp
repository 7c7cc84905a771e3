// SPDX-License-Identifier: Apache-2.0
#include "hal/drivers/spacemouse_models.hpp"

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
    {k3DconnexionId, 0xc63a, "SpaceMouse Wireless BT", true, kCurrentAxes, 0}};

constexpr std::uint16_t kRefused[] = {0xc62c, 0xc641, 0xc650, 0xc651, 0xc654, 0xc655,
                                      0xc656, 0xc657, 0xc658, 0xc664, 0xc665, 0xc668};

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

}  // namespace haptic::hal
