// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/virtual_tool.hpp"

#include <cmath>

#include "host_sim/device/matrix_exponential.hpp"

namespace haptic::sim {
namespace {

/// Next position and velocity of the tool as rows over (x_t, v_t, x_d, v_d): wall, coupling and the
/// device's sample held through the step.
using ToolStep = Eigen::Matrix<double, 2, 4>;

struct ToolForces {
  double wall, spring, damper;
};

ToolStep tool_step(const ToolModel& tool, const ToolForces& f, double period_s) {
  const double m = tool.mass_kg, t = period_s;
  const Eigen::RowVector4d force(-f.wall - f.spring, -f.damper, f.spring, f.damper);
  ToolStep step = ToolStep::Zero();
  Eigen::RowVector4d position = Eigen::RowVector4d::Unit(0), velocity = Eigen::RowVector4d::Unit(1);
  switch (tool.integrator) {
    case Integrator::kExplicit:
      step.row(0) = position + t * velocity;
      step.row(1) = velocity + t / m * force;
      break;
    case Integrator::kSemiImplicit:
      step.row(1) = velocity + t / m * force;
      step.row(0) = position + t * step.row(1);
      break;
    case Integrator::kExponential: {
      Eigen::Matrix4d rate = Eigen::Matrix4d::Zero();
      rate(0, 1) = 1;
      rate.row(1) = force / m;
      step = matrix_exponential<Eigen::Matrix4d>(rate * t).topRows<2>();
      break;
    }
    case Integrator::kBackward:
      // (m + T B_c + T^2 (K_c + k)) v+ = m v + T (K_c e + B_c v_d - k x)
      step.row(1) = m * velocity + t * force;
      step(1, 1) = m;
      step.row(1) /= m + t * f.damper + t * t * (f.spring + f.wall);
      step.row(0) = position + t * step.row(1);
      break;
  }
  return step;
}

}  // namespace

const char* to_text(Integrator integrator) {
  constexpr const char* kNames[] = {"explicit", "semi-implicit", "matrix exponential",
                                    "backward Euler"};
  return kNames[static_cast<std::size_t>(integrator)];
}

Eigen::Matrix2d tool_matrix(const ToolModel& tool, double stiffness_n_per_m,
                            double damping_ns_per_m, double period_s) {
  return tool_step(tool, {0, stiffness_n_per_m, damping_ns_per_m}, period_s).leftCols<2>();
}

double tool_limit(Integrator integrator, double ratio) {
  // Lengths of time and mass of 1 make the stiffness k_s T^2 / m_t.
  return first_unstable(1e-6, [&](double stiffness) {
    const double damping = 2 * ratio * std::sqrt(stiffness);
    return spectral_radius(tool_matrix({integrator, 1.0}, stiffness, damping, 1.0));
  });
}

Eigen::MatrixXd coupled_matrix(const LinearLoop& loop, const ToolModel& tool,
                               const ToolCoupling& coupling, double wall_n_per_m) {
  enum : Eigen::Index { kDevice, kDeviceSpeed, kBefore, kTool, kToolSpeed, kUnderWay };
  const double t = loop.period_s, spring = coupling.stiffness_n_per_m;
  const double damper = 2 * coupling.ratio * std::sqrt(spring * tool.mass_kg);
  Eigen::Matrix3d rate = Eigen::Matrix3d::Zero();
  rate(0, 1) = 1;
  rate.row(1) << -loop.hand_stiffness, -(loop.damping_ns_per_m + loop.hand_damping), 1;
  rate.row(1) /= loop.mass_kg;
  const Eigen::Matrix3d step = matrix_exponential<Eigen::Matrix3d>(rate * t);

  const Eigen::Index delay = loop.delay_samples, size = kUnderWay + delay;
  Eigen::RowVectorXd device = Eigen::RowVectorXd::Unit(size, kDevice);
  Eigen::RowVectorXd speed = device / t;
  speed[kBefore] = -1 / t;
  Eigen::MatrixXd seen(4, size);  // x_t, v_t, x_d, v_d
  seen.row(0) = Eigen::RowVectorXd::Unit(size, kTool);
  seen.row(1) = Eigen::RowVectorXd::Unit(size, kToolSpeed);
  seen.row(2) = device;
  seen.row(3) = speed;
  const Eigen::MatrixXd moved = tool_step(tool, {wall_n_per_m, spring, damper}, t) * seen;
  const Eigen::RowVectorXd force =
      spring * (moved.row(0) - device) + damper * (moved.row(1) - speed);
  Eigen::RowVectorXd acting = force;
  if (delay > 0) acting = Eigen::RowVectorXd::Unit(size, kUnderWay);

  Eigen::MatrixXd next = Eigen::MatrixXd::Zero(size, size);
  next.topLeftCorner<2, 2>() = step.topLeftCorner<2, 2>();
  next.topRows<2>() += step.topRightCorner<2, 1>() * acting;
  next(kBefore, kDevice) = 1;
  next.row(kTool) = moved.row(0);
  next.row(kToolSpeed) = moved.row(1);
  for (Eigen::Index k = 0; k + 1 < delay; ++k) next(kUnderWay + k, kUnderWay + k + 1) = 1;
  if (delay > 0) next.row(size - 1) = force;
  return next;
}

double coupling_limit(const LinearLoop& loop, const ToolModel& tool, double wall_n_per_m,
                      double ratio) {
  const double limit = first_unstable(1.0, [&](double stiffness) {
    if (stiffness > kLargestCoupling_n_per_m) return 0.0;
    return spectral_radius(coupled_matrix(loop, tool, {stiffness, ratio}, wall_n_per_m));
  });
  return limit > kLargestCoupling_n_per_m ? kNoLimit : limit;
}

}  // namespace haptic::sim
