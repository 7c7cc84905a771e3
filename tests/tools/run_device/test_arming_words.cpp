// SPDX-License-Identifier: Apache-2.0
// What a person is told about arming: why it does not come about, what to do, where the part
// begins.
#include <doctest/doctest.h>

#include <set>
#include <string>

#include "rt_core/base/rotation.hpp"
#include "tools/run_device/arming_words.hpp"

using namespace haptic;
using namespace haptic::tools;

namespace {

bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

ServoParameters parameters_at_start(bool finds) {
  ServoParameters p;
  p.map.grip_a = Vec3(0, 0, 0.01_r);
  p.start.place = p.start.turn = finds;
  p.start.pose_wa.p_wa = Vec3(0.02_r, 0, 0.04_r);
  return p;
}

}  // namespace

TEST_SUITE("tools.run_device.arming_words") {
  TEST_CASE("every fault has a fix of its own that names a key, and says how to arm then") {
    std::set<std::string> fixes;
    for (std::uint32_t fault = 1; fault <= kFaultFrame; fault <<= 1) {
      CAPTURE(fault_text(fault));
      const std::string fix = fix_text(fault, ArmingNews{});
      CHECK(has(fix, "; then release and press the deadman switch"));
      CHECK(fix.size() > 60);
      CHECK(fixes.insert(fix).second);
    }
    CHECK(fix_text(0, ArmingNews{}).empty());
    for (const auto& [fault, key] : {std::pair{kFaultScene, "[workspace] offset_m = ["},
                                     {kFaultLateTick, "[loop] servo_cpu"},
                                     {kFaultWorkspace, "[motion_limits] workspace"},
                                     {kFaultEnvelope, "orientation"},
                                     {kFaultJump, "[limits] jump_speed_m_per_s"},
                                     {kFaultEmergencyStop, "[switches] emergency_stop"}}) {
      const auto& named = key;
      CAPTURE(named);
      const std::string fix = fix_text(fault, ArmingNews{});
      CHECK((has(fix, key) || has(fix, std::string(key).substr(7))));
    }
    const std::string both = fix_text(kFaultDeviceLost | kFaultDevice, ArmingNews{});
    CHECK(has(both, "plug the device in again; what the device"));
  }

  TEST_CASE("what has to come first is told alone") {
    ArmingNews news;
    CHECK(wait_text(news).empty());
    news.waits = kWaitDeadmanPressed;
    news.deadman = 4;
    CHECK(wait_text(news) == "the deadman switch ([switches] deadman = 4) is not pressed");
    news.waits = kWaitDeadmanReleased;
    CHECK(has(wait_text(news), "released and is pressed again"));
    news.waits |= kWaitCause;
    news.present = kFaultEmergencyStop;
    CHECK(has(wait_text(news), "emergency stop; let go of the stop"));
    news.waits |= kWaitInside;
    news.inside_ticks = 12;
    CHECK(has(wait_text(news), "inside an obstacle, for 12 ticks so far; give [workspace] offset"));
    news.finds_place = 1;
    CHECK(has(wait_text(news), "[moving] position_m"));
    news.waits |= kWaitHomed;
    CHECK(has(wait_text(news), "not calibrated"));
    news.waits |= kWaitDevice;
    CHECK(wait_text(news) == "the device does not report");
  }

  TEST_CASE("the keys that are told give the place that was found") {
    for (const bool finds : {true, false}) {
      const ServoParameters parameters = parameters_at_start(finds);
      ArmingNewsTaker taker(parameters);
      ServoInput input;
      const Pose handle{Vec3(0.1_r, -0.2_r, 0.3_r), so3_exp(Vec3(0, 0, 0.5_r))};
      input.state.pose_dh = record_of(handle);
      ServoResult result;
      result.rendered_new = result.began = true;
      taker.take(input, result);
      const ArmingNews& news = taker.news();
      CHECK(news.begins == 1);
      CHECK(news.finds_place == (finds ? 1u : 0u));
      ServoParameters copied;
      copied.map = parameters.map;
      for (int k = 0; k < 3; ++k) copied.map.offset_w[k] = static_cast<Real>(news.offset_m[k]);
      const double* q = news.part_rotation_wxyz;
      copied.map.q_ha = Quat(static_cast<Real>(q[0]), static_cast<Real>(q[1]),
                             static_cast<Real>(q[2]), static_cast<Real>(q[3]));
      const Pose begun = mesh_pose(copied.map, handle);
      CHECK((begun.p_wa - parameters.start.pose_wa.p_wa).norm() < 1e-6_r);
      CHECK(so3_log(begun.q_wa).norm() < 1e-6_r);
      // The next tick goes on from there; the keys stay.
      result.began = false;
      input.state.pose_dh = record_of(Pose{});
      taker.take(input, result);
      CHECK(taker.news().begins == 1);
      const std::string keys = place_keys(taker.news());
      CHECK(
          has(keys, "[workspace] offset_m = [-0.08, 0.2, -0.25], part_rotation = { w = 0.968912"));
    }
    ArmingNews plain;
    plain.offset_m[2] = -1e-12;
    CHECK(place_keys(plain) == "[workspace] offset_m = [0, 0, 0]");
  }

  TEST_CASE("ticks inside are counted in a row, and again from the next time on") {
    ArmingNewsTaker taker(parameters_at_start(true));
    ServoInput input;
    ServoResult result;
    result.rendered_new = true;
    result.rendered.flags = kFlagRecovery;
    for (int k = 0; k < 5; ++k) taker.take(input, result);
    result.rendered_new = false;  // no new state: no tick of the core
    taker.take(input, result);
    CHECK(taker.news().inside_ticks == 5);
    result.rendered_new = true;
    result.rendered.flags = 0;
    taker.take(input, result);
    CHECK(taker.news().inside_ticks == 0);
  }
}
