// SPDX-License-Identifier: Apache-2.0
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "host_sim/device/matrix_exponential.hpp"
#include "host_sim/lab/stability/spectral_radius.hpp"

using namespace haptic::sim;

namespace {

bool near(double value, double wanted, double share) {
  return std::abs(value - wanted) <= share * std::abs(wanted);
}

}  // namespace

TEST_SUITE("host_sim.stability_theory") {
  TEST_CASE("matrix exponential: a turn, a shear, and a stiff oscillator that keeps its energy") {
    Eigen::Matrix2d turn;
    turn << 0, -1, 1, 0;
    for (const double angle : {1e-9, 0.3, 2.0, 40.0}) {
      const Eigen::Matrix2d m = matrix_exponential<Eigen::Matrix2d>(angle * turn);
      CHECK(std::abs(m(0, 0) - std::cos(angle)) < 1e-13);
      CHECK(std::abs(m(1, 0) - std::sin(angle)) < 1e-13);
    }
    Eigen::Matrix2d shear;
    shear << 0, 3, 0, 0;
    CHECK(
        (matrix_exponential<Eigen::Matrix2d>(shear) - Eigen::Matrix2d::Identity() - shear).norm() <
        1e-14);
    CHECK(
        (matrix_exponential<Eigen::Matrix2d>(Eigen::Matrix2d::Zero()) - Eigen::Matrix2d::Identity())
            .norm() == 0);
  }

  TEST_CASE("spectral radius: of matrices whose eigenvalues are known") {
    Eigen::MatrixXd m(3, 3);
    m << 0, -4, 0, 1, 0, 0, 0, 0, -1.5;  // +-2i, -1.5
    CHECK(spectral_radius(m) == doctest::Approx(2.0).epsilon(1e-14));
    CHECK(spectral_radius(1e200 * m) == doctest::Approx(2e200).epsilon(1e-14));
    CHECK(spectral_radius(1e-200 * m) == doctest::Approx(2e-200).epsilon(1e-14));
    m << 0.9, 1e6, 0, 0, 0.9, 1e6, 0, 0, 0.9;  // one eigenvector, far from normal
    CHECK(spectral_radius(m) == doctest::Approx(0.9).epsilon(1e-9));
    m << 1, 1, 1, 0, 1, 1, 0, 0, 1;  // powers grow as the square of their exponent
    CHECK(std::abs(spectral_radius(m) - 1) < 1e-12);
    m << 0, 1, 2, 0, 0, 3, 0, 0, 0;
    CHECK(spectral_radius(m) == 0);
    m << 1, 0, 0, 0, std::nan(""), 0, 0, 0, 1;
    CHECK(std::isnan(spectral_radius(m)));
  }

  TEST_CASE("spectral radius: the companion matrix of a polynomial has its largest root") {
    for (const double root : {0.3, 0.999, 1.0, 1.001, 7.0}) {
      // (x - root)(x^2 + 0.01 root^2)(x + root / 2)
      const double roots[4] = {root, -root / 2, 0.1 * root, 0.1 * root};
      const double sum = roots[0] + roots[1], product = roots[0] * roots[1];
      const double square = roots[2] * roots[3];
      Eigen::MatrixXd m = Eigen::MatrixXd::Zero(4, 4);
      m.row(0) << sum, -product - square, sum * square, -product * square;
      for (int k = 0; k < 3; ++k) m(k + 1, k) = 1;
      CAPTURE(root);
      CHECK(spectral_radius(m) == doctest::Approx(root).epsilon(1e-12));
    }
  }

  TEST_CASE("stiffness: the boundary is the closed form to first order in bT/m") {
    for (unsigned delay = 0; delay <= 2; ++delay) {
      for (const double share : {1e-4, 1e-3, 1e-2}) {  // bT/m
        LinearLoop loop;
        loop.delay_samples = delay;
        loop.damping_ns_per_m = share * loop.mass_kg / loop.period_s;
        const double form = closed_form_stiffness(loop.damping_ns_per_m, loop.period_s, delay);
        const double ratio = stiffness_limit(loop, 0) / form;
        CAPTURE(delay);
        CAPTURE(share);
        CHECK(ratio >= 0.9999);
        CHECK(ratio <= (delay < 2 ? 1.0035 : 1.0045));
      }
    }
    double largest = 0;
    for (unsigned delay = 0; delay <= 2; ++delay) {
      LinearLoop loop;
      loop.delay_samples = delay;
      loop.damping_ns_per_m = loop.mass_kg / loop.period_s;
      const double form = closed_form_stiffness(loop.damping_ns_per_m, loop.period_s, delay);
      largest = std::max(largest, stiffness_limit(loop, 0) / form);
    }
    CHECK(largest == doctest::Approx(1.27).epsilon(0.005));
  }

  TEST_CASE("stiffness: figures of the closed form at 1 N s/m") {
    const double wanted[3][3] = {{2000, 667, 400}, {4000, 1333, 800}, {8000, 2667, 1600}};
    const double periods[3] = {1e-3, 0.5e-3, 0.25e-3};
    for (int t = 0; t < 3; ++t) {
      for (unsigned d = 0; d < 3; ++d)
        CHECK(near(closed_form_stiffness(1.0, periods[t], d), wanted[t][d], 1e-3));
    }
  }

  TEST_CASE("damping alone: the boundary is the closed form, exactly") {
    const double wanted[3] = {2.0, 0.828, 0.536};
    for (unsigned delay = 0; delay <= 2; ++delay) {
      LinearLoop loop;
      loop.damping_ns_per_m = 0;
      loop.delay_samples = delay;
      const double unit = loop.mass_kg / loop.period_s;
      CHECK(near(closed_form_damping(loop.mass_kg, loop.period_s, delay) / unit, wanted[delay],
                 1e-3));
      CHECK(near(damping_limit(loop, 0), closed_form_damping(loop.mass_kg, loop.period_s, delay),
                 1e-3));
    }
  }

  TEST_CASE("stiffness with virtual damping: the best pairs") {
    const double stiffness[3] = {0.69, 0.145, 0.063}, damping[3] = {0.83, 0.42, 0.29};
    for (unsigned delay = 0; delay <= 2; ++delay) {
      LinearLoop loop;
      loop.damping_ns_per_m = 0.1;
      loop.delay_samples = delay;
      const double unit_k = loop.mass_kg / (loop.period_s * loop.period_s);
      const double unit_b = loop.mass_kg / loop.period_s;
      double best = 0, at = 0;
      for (double b = 0.05; b < 1.5; b += 0.005) {
        const double k = stiffness_limit(loop, b * unit_b) / unit_k;
        if (k > best) {
          best = k;
          at = b;
        }
      }
      CAPTURE(delay);
      CHECK(near(best, stiffness[delay], 0.02));
      CHECK(near(at, damping[delay], 0.03));
    }
  }
}
