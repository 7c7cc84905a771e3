// SPDX-License-Identifier: Apache-2.0
#include "host_sim/lab/stability/spectral_radius.hpp"

#include <cmath>
#include <numbers>

#include "host_sim/device/matrix_exponential.hpp"

namespace haptic::sim {
namespace {

/// Gains at which the search for the boundary looks are this far apart.
constexpr double kScanRatio = 1.05;
constexpr int kBisections = 40;
constexpr double kLeastGain = 1e-6;
/// Of a matrix of size n, whose powers may grow by N^(n-1) faster than its eigenvalues: 2^-48 of
/// their logarithm is below the rounding of a double.
constexpr int kSquarings = 48;

}  // namespace

double spectral_radius(const Eigen::MatrixXd& matrix) {
  // Gelfand: |A^N|^(1/N) for N = 2^k, A brought to norm 1 before each square.
  Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic> power = matrix.cast<long double>();
  long double logarithm = 0, share = 1;
  for (int k = 0; k <= kSquarings; ++k, share /= 2) {
    const long double size = power.cwiseAbs().rowwise().sum().maxCoeff();
    if (!(size > 0)) return static_cast<double>(size);  // a power is zero; or not a number
    logarithm += share * std::log(size);
    power /= size;
    power = power.lazyProduct(power).eval();
  }
  return static_cast<double>(std::exp(logarithm));
}

Eigen::MatrixXd wall_matrix(const LinearLoop& loop, double stiffness_n_per_m,
                            double damping_ns_per_m) {
  enum : Eigen::Index { kPosition, kVelocity, kBefore, kUnderWay };
  const double period_s = loop.period_s;
  Eigen::Matrix3d rate = Eigen::Matrix3d::Zero();  // position, velocity, held force
  rate(0, 1) = 1;
  rate.row(1) << -loop.hand_stiffness, -(loop.damping_ns_per_m + loop.hand_damping), 1;
  rate.row(1) /= loop.mass_kg;
  const Eigen::Matrix3d step = matrix_exponential<Eigen::Matrix3d>(rate * period_s);

  const Eigen::Index delay = loop.delay_samples, size = kUnderWay + delay;
  // Damping of the difference of two positions.
  Eigen::RowVectorXd force = Eigen::RowVectorXd::Zero(size);
  force[kPosition] = -stiffness_n_per_m - damping_ns_per_m / period_s;
  force[kBefore] = damping_ns_per_m / period_s;
  Eigen::RowVectorXd acting = force;
  if (delay > 0) acting = Eigen::RowVectorXd::Unit(size, kUnderWay);

  Eigen::MatrixXd next = Eigen::MatrixXd::Zero(size, size);
  next.topLeftCorner<2, 2>() = step.topLeftCorner<2, 2>();
  next.topRows<2>() += step.topRightCorner<2, 1>() * acting;
  next(kBefore, kPosition) = 1;
  for (Eigen::Index k = 0; k + 1 < delay; ++k) next(kUnderWay + k, kUnderWay + k + 1) = 1;
  if (delay > 0) next.row(size - 1) = force;
  return next;
}

double first_unstable(double low, const std::function<double(double)>& radius) {
  const auto stable = [&](double gain) { return radius(gain) <= 1 + kNeutral; };
  if (!stable(low)) return 0;
  double high = low;
  do {
    low = high;
    high *= kScanRatio;
    if (high > kNoLimit) return kNoLimit;
  } while (stable(high));
  for (int k = 0; k < kBisections; ++k) {
    const double middle = 0.5 * (low + high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

double stiffness_limit(const LinearLoop& loop, double damping_ns_per_m) {
  return first_unstable(kLeastGain * loop.mass_kg / (loop.period_s * loop.period_s), [&](double k) {
    return spectral_radius(wall_matrix(loop, k, damping_ns_per_m));
  });
}

double damping_limit(const LinearLoop& loop, double stiffness_n_per_m) {
  return first_unstable(kLeastGain * loop.mass_kg / loop.period_s, [&](double b) {
    return spectral_radius(wall_matrix(loop, stiffness_n_per_m, b));
  });
}

double closed_form_stiffness(double damping_ns_per_m, double period_s, unsigned delay_samples) {
  return damping_ns_per_m / (period_s * (0.5 + delay_samples));
}

double closed_form_damping(double mass_kg, double period_s, unsigned delay_samples) {
  return 2 * mass_kg / period_s * std::tan(std::numbers::pi / (4.0 * (delay_samples + 1)));
}

}  // namespace haptic::sim
