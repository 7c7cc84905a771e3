// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Arms as text, and where their links are by the definition of URDF, in complex long double: an
/// oracle that shares nothing with the bridge, and whose derivatives are exact (complex step).

#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/support/random.hpp"

namespace haptic::test {

using Complex = std::complex<long double>;

struct OracleLink {
  std::array<double, 3> xyz{}, rpy{}, axis{0, 0, 1}, centre{};
  double mass = 0;
  bool turns = false;
};

struct OraclePlace {
  std::array<std::array<Complex, 3>, 3> turn{};
  std::array<Complex, 3> at{};
};

inline OraclePlace product(const OraclePlace& a, const OraclePlace& b) {
  OraclePlace c;
  for (std::size_t i = 0; i < 3; ++i) {
    c.at[i] = a.at[i];
    for (std::size_t k = 0; k < 3; ++k) {
      c.at[i] += a.turn[i][k] * b.at[k];
      for (std::size_t j = 0; j < 3; ++j) c.turn[i][j] += a.turn[i][k] * b.turn[k][j];
    }
  }
  return c;
}

/// About a coordinate axis.
inline OraclePlace turned(std::size_t axis, Complex angle) {
  OraclePlace place;
  const std::size_t i = (axis + 1) % 3, j = (axis + 2) % 3;
  place.turn[axis][axis] = 1;
  place.turn[i][i] = place.turn[j][j] = std::cos(angle);
  place.turn[j][i] = std::sin(angle);
  place.turn[i][j] = -std::sin(angle);
  return place;
}

/// About any axis: turned into z, about z, and back.
inline OraclePlace turned_about(const std::array<double, 3>& axis, Complex angle) {
  std::array<long double, 3> z{axis[0], axis[1], axis[2]};
  const long double length = std::sqrt(z[0] * z[0] + z[1] * z[1] + z[2] * z[2]);
  for (long double& v : z) v /= length;
  const long double tilt = std::atan2(std::hypot(z[0], z[1]), z[2]);
  const long double heading = std::atan2(z[1], z[0]);
  const OraclePlace there = product(turned(2, heading), turned(1, tilt));
  const OraclePlace back = product(turned(1, -tilt), turned(2, -heading));
  return product(product(there, turned(2, angle)), back);
}

/// Places of all links of a chain in the frame of its base.
inline std::vector<OraclePlace> oracle_places(const std::vector<OracleLink>& chain,
                                              const std::vector<Complex>& angles) {
  std::vector<OraclePlace> places;
  OraclePlace at = turned(2, 0);
  std::size_t joint = 0;
  for (const OracleLink& link : chain) {
    OraclePlace origin =
        product(product(turned(2, link.rpy[2]), turned(1, link.rpy[1])), turned(0, link.rpy[0]));
    for (std::size_t k = 0; k < 3; ++k) origin.at[k] = link.xyz[k];
    at = product(at, origin);
    if (link.turns) at = product(at, turned_about(link.axis, angles[joint++]));
    places.push_back(at);
  }
  return places;
}

inline std::string numbers_text(const std::array<double, 3>& v) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%.17g %.17g %.17g", v[0], v[1], v[2]);
  return text.data();
}

/// The chain below links "root" and "base", with a loaded gripper on its last link "tip".
inline std::string urdf_of(const std::vector<OracleLink>& chain, double lower = -3,
                           double upper = 3) {
  std::string text =
      "<robot name=\"arm\">\n<link name=\"root\"/>\n<link name=\"base\"><inertial><mass "
      "value=\"9\"/>"
      "</inertial></link>\n<joint name=\"stand\" type=\"fixed\"><origin xyz=\"1 2 3\" rpy=\"0.3 -1 "
      "2\"/><parent link=\"root\"/><child link=\"base\"/></joint>\n";
  for (std::size_t k = 0; k < chain.size(); ++k) {
    const OracleLink& link = chain[k];
    const std::string name = k + 1 == chain.size() ? "tip" : "l" + std::to_string(k);
    std::array<char, 48> mass{};
    std::snprintf(mass.data(), mass.size(), "%.17g", link.mass);
    text += "<link name=\"" + name + "\"><inertial><origin xyz=\"" + numbers_text(link.centre) +
            "\"/><mass value=\"" + mass.data() + "\"/></inertial></link>\n<joint name=\"j" +
            std::to_string(k) + "\" type=\"" + (link.turns ? "revolute" : "fixed") +
            "\"><origin xyz=\"" + numbers_text(link.xyz) + "\" rpy=\"" + numbers_text(link.rpy) +
            "\"/><parent link=\"" + (k == 0 ? "base" : "l" + std::to_string(k - 1)) +
            "\"/><child link=\"" + name + "\"/><axis xyz=\"" + numbers_text(link.axis) +
            "\"/><limit lower=\"" + std::to_string(lower) + "\" upper=\"" + std::to_string(upper) +
            "\" effort=\"1\" velocity=\"1\"/></joint>\n";
  }
  return text + "</robot>\n";
}

inline std::vector<OracleLink> random_chain(Random& random, std::size_t joints) {
  std::vector<OracleLink> chain;
  const auto vector = [&](double size) {
    return std::array<double, 3>{random.uniform(-size, size), random.uniform(-size, size),
                                 random.uniform(-size, size)};
  };
  for (std::size_t turning = 0; turning < joints;) {
    OracleLink link;
    link.xyz = vector(0.3);
    link.rpy = vector(3);
    link.axis = vector(1);
    link.centre = vector(0.1);
    link.mass = random.uniform(0, 0.5);
    link.turns = random.uniform(0, 1) < 0.7;
    turning += link.turns ? 1 : 0;
    chain.push_back(link);
  }
  chain.push_back({vector(0.2), vector(3), {0, 0, 1}, vector(0.1), 0.2, false});
  return chain;
}

/// Six joints like a small leader arm, 0.4 m long, the last link is the handle.
inline std::vector<OracleLink> leader_chain() {
  std::vector<OracleLink> chain(7);
  chain[0] = {{0, 0, 0.05}, {}, {0, 0, 1}, {0, 0, 0.02}, 0.1, true};
  chain[1] = {{0, 0, 0.04}, {}, {0, 1, 0}, {0.07, 0, 0}, 0.06, true};
  chain[2] = {{0.15, 0, 0}, {}, {0, 1, 0}, {0.06, 0, 0}, 0.05, true};
  chain[3] = {{0.12, 0, 0}, {}, {1, 0, 0}, {0.01, 0, 0}, 0.03, true};
  chain[4] = {{0.03, 0, 0}, {}, {0, 1, 0}, {0.01, 0, 0}, 0.03, true};
  chain[5] = {{0.03, 0, 0}, {}, {1, 0, 0}, {0.01, 0, 0}, 0.02, true};
  chain[6] = {{0.04, 0, 0}, {}, {0, 0, 1}, {0, 0, 0}, 0.02, false};
  return chain;
}

}  // namespace haptic::test
