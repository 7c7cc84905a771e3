// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <functional>

#include "tests/bridges/arms/random_arm.hpp"
#include "tests/support/text_search.hpp"
#include "tools/bridges/arm/arm_description.hpp"
#include "tools/bridges/arm/joint_torques.hpp"
#include "tools/common/error.hpp"

using namespace haptic;
using namespace haptic::tools;
using haptic::test::Complex;
using haptic::test::has;
using haptic::test::OracleLink;
using haptic::test::OraclePlace;

namespace {

constexpr long double kStep = 1e-60L;  // of a complex step: nothing cancels

double off(const Column3& found, const std::array<long double, 3>& right) {
  double worst = 0;
  for (int k = 0; k < 3; ++k) {
    worst = std::max(worst,
                     std::abs(found[k] - static_cast<double>(right[static_cast<std::size_t>(k)])));
  }
  return worst;
}

std::string arm_refusal(const std::string& text, const std::string& base = "base",
                        const std::string& tip = "tip") {
  try {
    static_cast<void>(arm_of(text, "arm.urdf", base, tip));
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// Worst differences to the oracle over one random arm at one random pose.
struct ArmDifference {
  double place = 0, jacobian = 0, weight = 0;
};
ArmDifference difference(test::Random& random, std::size_t joints) {
  const std::vector<OracleLink> chain = test::random_chain(random, joints);
  const ArmModel model = arm_of(test::urdf_of(chain), "arm.urdf", "base", "tip").model;
  REQUIRE(model.joint_count == joints);
  JointNumbers angles{};
  std::vector<Complex> at(joints);
  for (std::size_t k = 0; k < joints; ++k) at[k] = angles[k] = random.uniform(-3, 3);
  const ArmPlace place = place_of(model, angles);
  const JointNumbers weights = weight_torques(place);
  ArmDifference worst;
  for (std::size_t k = 0; k < joints; ++k) {
    std::vector<Complex> moved = at;
    moved[k] += Complex(0, kStep);
    const std::vector<OraclePlace> places = test::oracle_places(chain, moved);
    const OraclePlace& tip = places.back();
    const JacobianColumn column = jacobian_column(place, k);
    std::array<long double, 3> here{}, linear{}, angular{};
    for (std::size_t i = 0; i < 3; ++i) {
      here[i] = tip.at[i].real();
      linear[i] = tip.at[i].imag() / kStep;
      // Omega = dR R^T.
      for (std::size_t j = 0; j < 3; ++j) {
        angular[i] += tip.turn[(i + 2) % 3][j].imag() / kStep * tip.turn[(i + 1) % 3][j].real();
        worst.place =
            std::max(worst.place, std::abs(place.turn_dh(static_cast<int>(i), static_cast<int>(j)) -
                                           static_cast<double>(tip.turn[i][j].real())));
      }
    }
    worst.place = std::max(worst.place, off(place.tip, here));
    worst.jacobian =
        std::max({worst.jacobian, off(column.linear, linear), off(column.angular, angular)});
    Complex height = 0;
    for (std::size_t l = 0; l < chain.size(); ++l) {
      Complex z = places[l].at[2];
      for (std::size_t i = 0; i < 3; ++i) z += places[l].turn[2][i] * Complex(chain[l].centre[i]);
      height += Complex(chain[l].mass) * z;
    }
    const long double torque = kGravity_m_per_s2 * height.imag() / kStep;
    worst.weight = std::max(worst.weight, std::abs(weights[k] - static_cast<double>(torque)));
  }
  return worst;
}

}  // namespace

TEST_SUITE("bridges.arm_model") {
  TEST_CASE("place, Jacobian and weight: within 1e-12 of complex steps by URDF's definition") {
    test::Random random(1);
    for (std::size_t arm = 0; arm < 200; ++arm) {
      const ArmDifference worst = difference(random, 1 + arm % kMaxJoints);
      CAPTURE(arm);
      CHECK(worst.place < 1e-12);
      CHECK(worst.jacobian < 1e-12);
      CHECK(worst.weight < 1e-12);
    }
  }

  TEST_CASE(
      "torques_of: the work of a wrench is that of its torques, and twist_of its other half") {
    test::Random random(2);
    const ArmModel model =
        arm_of(test::urdf_of(test::random_chain(random, 7)), "arm.urdf", "base", "tip").model;
    JointNumbers angles{}, rates{};
    for (std::size_t k = 0; k < 7; ++k) angles[k] = random.uniform(-3, 3);
    for (std::size_t k = 0; k < 7; ++k) rates[k] = random.uniform(-1, 1);
    const ArmPlace place = place_of(model, angles);
    const Column3 force(1, -2, 0.5), torque(0.1, 0.2, -0.3);
    const JointNumbers torques = torques_of(place, force, torque);
    double power = 0;
    for (std::size_t k = 0; k < 7; ++k) power += torques[k] * rates[k];
    const Twist twist = twist_of(place, rates);
    const double out =
        twist.linear_w.cast<double>().dot(force) + twist.angular_w.cast<double>().dot(torque);
    CHECK(power == doctest::Approx(out).epsilon(sizeof(Real) == 4 ? 1e-5 : 1e-12));
  }

  TEST_CASE("weight_torques: a pendulum, and a base that is turned on its side") {
    std::vector<OracleLink> chain(2);
    chain[0] = {{0, 0, 0.1}, {}, {0, 1, 0}, {0.2, 0, 0}, 0.5, true};
    chain[1] = {{0.4, 0, 0}, {}, {0, 0, 1}, {}, 0, false};
    ArmModel model = arm_of(test::urdf_of(chain), "arm.urdf", "base", "tip").model;
    // About +y a positive angle lowers +x.
    const double held = -0.5 * kGravity_m_per_s2 * 0.2;
    CHECK(weight_torques(place_of(model, {}))[0] == doctest::Approx(held));
    CHECK(weight_torques(place_of(model, {0.7}))[0] == doctest::Approx(held * std::cos(0.7)));
    model.turn_db = Eigen::AngleAxis<double>(M_PI / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();
    CHECK(weight_torques(place_of(model, {0.7}))[0] == doctest::Approx(0).epsilon(1e-12));
  }

  TEST_CASE("stated_force: no pose and no direction shortens it, and a stretched arm needs all") {
    test::Random random(3);
    const ArmModel model =
        arm_of(test::urdf_of(test::leader_chain()), "arm.urdf", "base", "tip").model;
    const JointNumbers limits{1, 1, 0.6, 0.4, 0.3, 0.2};
    const StatedForce stated = stated_force(model, limits, 1);
    CHECK(stated.force_n > 0.1);
    CHECK(stated.torque_nm > 0.01);
    for (int trial = 0; trial < 2000; ++trial) {
      JointNumbers angles{};
      for (std::size_t k = 0; k < 6; ++k) angles[k] = random.uniform(-3, 3);
      Vec3 force(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)),
          torque(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
      force *= static_cast<Real>(0.999 * stated.force_n) / force.norm();
      torque *= static_cast<Real>(0.999 * stated.torque_nm) / torque.norm();
      const ArmPlace place = place_of(model, angles);
      const JointNumbers support = weight_torques(place);
      double share = 0;
      const JointNumbers torques = limited_torques(place, support, {force, torque}, limits, share);
      CHECK(share == 1);
      for (std::size_t k = 0; k < 6; ++k) CHECK(std::abs(torques[k]) <= limits[k]);
    }
    // Three joints in a row, straight, no weight: a force across takes the whole of the first one.
    std::vector<OracleLink> chain(4);
    for (std::size_t k = 0; k < 3; ++k) chain[k] = {{0.1, 0, 0}, {}, {0, 0, 1}, {}, 0, true};
    chain[3] = {{0.1, 0, 0}, {}, {0, 0, 1}, {}, 0, false};
    const ArmModel row = arm_of(test::urdf_of(chain), "arm.urdf", "base", "tip").model;
    const StatedForce most = stated_force(row, {1, 1, 1}, 1);
    CHECK(most.force_n == doctest::Approx(1 / 0.3));
    CHECK(most.torque_nm == 0);
    double share = 0;
    static_cast<void>(
        limited_torques(place_of(row, {}), {}, {Vec3(0, 4, 0), Vec3::Zero()}, {1, 1, 1}, share));
    CHECK(share == doctest::Approx(1 / 1.2));
  }

  TEST_CASE("support_torques: a soft wall pushes back beyond a limit, half of the torque at most") {
    const ArmModel model =
        arm_of(test::urdf_of(test::leader_chain(), -1, 1), "arm.urdf", "base", "tip").model;
    const JointNumbers limits{2, 2, 2, 2, 2, 2};
    const auto wall = [&](double angle) {
      const JointNumbers angles{angle};
      return support_torques(model, place_of(model, angles), angles, limits, 0)[0];
    };
    CHECK(wall(0.99) == 0);
    CHECK(wall(1 + kWallWay_rad / 2) == doctest::Approx(-0.5));
    CHECK(wall(-1 - kWallWay_rad / 2) == doctest::Approx(0.5));
    CHECK(wall(2.5) == doctest::Approx(-1));
  }

  TEST_CASE("limited_torques: a wrench that is no number is none, the weight stays") {
    const ArmModel model =
        arm_of(test::urdf_of(test::leader_chain()), "arm.urdf", "base", "tip").model;
    const JointNumbers limits{1, 1, 1, 1, 1, 1}, support{0.1, 5, -0.2};
    for (const Real bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
      double share = 1;
      const JointNumbers torques = limited_torques(place_of(model, {}), support,
                                                   {Vec3(0, bad, 0), Vec3::Zero()}, limits, share);
      CHECK(share == 0);
      CHECK(torques[0] == 0.1);
      CHECK(torques[1] == 1);
      CHECK(torques[2] == -0.2);
    }
  }

  TEST_CASE("arm_of: what is no arm is refused with its line and a fix") {
    const std::string right = test::urdf_of(test::leader_chain());
    CHECK(arm_refusal(right) == "accepted");
    CHECK(has(arm_refusal(right, "bass"),
              "no link 'bass', which base_link names; its links: 'root'"));
    CHECK(has(arm_refusal(right, "tip", "base"), "link 'base' is not below link 'tip'"));
    CHECK(has(arm_refusal(right, "l5", "tip"), "0 moving joints; an arm has 1 to 8"));
    CHECK(has(arm_refusal(replaced(right, "type=\"revolute\"", "type=\"prismatic\"")),
              "arm.urdf:6: joint 'j0' is 'prismatic'; joints of an arm are"));
    CHECK(has(arm_refusal(replaced(right, "<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 0\"/>")),
              "the axis of joint 'j0' has no direction"));
    CHECK(has(arm_refusal(replaced(right, "<limit ", "<mimic joint=\"j1\"/><limit ")),
              "follows another one (<mimic>)"));
    CHECK(has(arm_refusal(replaced(right, "lower=\"-3.000000\"", "lower=\"4\"")),
              "leave it no way; give lower below upper"));
    CHECK(has(arm_refusal(replaced(right, "<limit ", "<limits ")), "revolute and has no <limit>"));
    CHECK(
        has(arm_refusal(replaced(right, "value=\"0.1", "value=\"-0.1")), "below 0 or above 50 kg"));
    CHECK(has(arm_refusal("<robot/>"), "the robot has no <link>"));
    CHECK(has(arm_refusal("\x7f"
                          "ELF"),
              "arm.urdf"));
  }

  TEST_CASE("arm_of: texts with any byte changed are an arm or refused, never more") {
    const std::string right = test::urdf_of(test::leader_chain());
    test::Random random(4);
    std::size_t arms = 0;
    for (int trial = 0; trial < 1500; ++trial) {
      std::string text = right;
      for (std::uint64_t k = 0; k <= random.next() % 3; ++k) {
        const std::size_t at = random.next() % text.size();
        if (random.next() % 4 == 0) text.resize(at + 1);
        text[at % text.size()] = static_cast<char>(
            "<>\"/0-9.e \xff"
            "azn"[random.next() % 14]);
      }
      try {
        const ArmDescription arm = arm_of(text, "arm.urdf", "base", "tip");
        ++arms;
        const ArmPlace place = place_of(arm.model, {1, 1, 1, 1, 1, 1, 1, 1});
        CHECK(arm.model.joint_count <= kMaxJoints);
        CHECK(place.joint_count == arm.joint_names.size());
      } catch (const InputError& error) {
        CHECK(has(error.what(), "arm.urdf"));
      }
    }
    CHECK(arms > 100);
  }
}
