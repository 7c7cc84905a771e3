// SPDX-License-Identifier: Apache-2.0
#include <ode/collision.h>
#include <ode/collision_space.h>
#include <ode/odeinit.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <limits>
#include <vector>

#include "host_sim/lab/peers/foreign_peers.hpp"

namespace haptic::sim {
namespace {

constexpr int kMaxContacts = 16;

void sides_of(const PeerSolid& solid, dVector3& sides) {
  for (std::size_t i = 0; i < 3; ++i) {
    double largest = 0;
    for (const PeerVector& v : solid.vertices) largest = std::max(largest, v[i]);
    sides[i] = static_cast<dReal>(2 * largest);
  }
}

class OdePeer final : public PeerQuery {
 public:
  OdePeer(const PeerSolid& a, const PeerSolid& b) {
    sides_of(a, side_a_);
    sides_of(b, side_b_);
    for (int i = 0; i < 3; ++i) r_b_[5 * i] = 1;
  }

  void prepare(const PeerPose& pose) override {
    for (std::size_t i = 0; i < 3; ++i) {
      p_a_[i] = static_cast<dReal>(pose.p_wa[i]);
      for (std::size_t j = 0; j < 3; ++j) r_a_[4 * i + j] = static_cast<dReal>(pose.r_wa[i][j]);
    }
  }
  void query() override {
    code_ = 0;
    count_ = dBoxBox(p_a_, r_a_, side_a_, p_b_, r_b_, side_b_, normal_, &depth_, &code_,
                     kMaxContacts, contacts_, sizeof(dContactGeom));
  }
  // ODE's normal points from the first box into the second.
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.penetrating = code_ != 0;
    answer.depth_m = std::numeric_limits<double>::quiet_NaN();
    if (code_ != 0) {
      answer.depth_m = -static_cast<double>(depth_);
      for (std::size_t i = 0; i < 3; ++i) answer.normal_w[i] = -static_cast<double>(normal_[i]);
      answer.patch_points = static_cast<std::uint32_t>(count_);
    }
    return answer;
  }

 private:
  dVector3 side_a_{}, side_b_{}, p_a_{}, p_b_{}, normal_{};
  dMatrix3 r_a_{}, r_b_{};
  dReal depth_ = 0;
  int code_ = 0, count_ = 0;
  dContactGeom contacts_[kMaxContacts];
};

/// A convex geometry in a space, its coordinates about the mean of its vertices, which ODE wants
/// inside. The library keeps pointers to the tables.
class OdeConvex {
 public:
  OdeConvex(dSpaceID space, const PeerSolid& solid) {
    for (const PeerVector& v : solid.vertices) {
      for (std::size_t i = 0; i < 3; ++i)
        middle_[i] += v[i] / static_cast<double>(solid.vertices.size());
    }
    for (const PeerVector& v : solid.vertices) {
      for (std::size_t i = 0; i < 3; ++i) points_.push_back(static_cast<dReal>(v[i] - middle_[i]));
    }
    for (const auto& loop : solid.loops) {
      polygons_.push_back(static_cast<unsigned>(loop.size()));
      polygons_.insert(polygons_.end(), loop.begin(), loop.end());
      add_plane(loop);
    }
    geometry_ = dCreateConvex(space, planes_.data(), static_cast<unsigned>(solid.loops.size()),
                              points_.data(), static_cast<unsigned>(solid.vertices.size()),
                              polygons_.data());
    place({0, 0, 0}, {PeerVector{1, 0, 0}, PeerVector{0, 1, 0}, PeerVector{0, 0, 1}});
  }
  OdeConvex(const OdeConvex&) = delete;
  OdeConvex& operator=(const OdeConvex&) = delete;
  ~OdeConvex() { dGeomDestroy(geometry_); }

  void place(const PeerVector& p_w, const std::array<PeerVector, 3>& r_w) {
    dMatrix3 r{};
    dReal p[3];
    for (std::size_t i = 0; i < 3; ++i) {
      double x = p_w[i];
      for (std::size_t j = 0; j < 3; ++j) {
        x += r_w[i][j] * middle_[j];
        r[4 * i + j] = static_cast<dReal>(r_w[i][j]);
      }
      p[i] = static_cast<dReal>(x);
    }
    dGeomSetPosition(geometry_, p[0], p[1], p[2]);
    dGeomSetRotation(geometry_, r);
  }

 private:
  void add_plane(const std::vector<std::uint32_t>& loop) {
    double n[3] = {0, 0, 0};  // Newell: of a whole loop
    const auto at = [&](std::size_t k, std::size_t i) {
      return static_cast<double>(points_[3 * std::size_t{loop[k % loop.size()]} + i]);
    };
    for (std::size_t k = 0; k < loop.size(); ++k) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t a = (i + 1) % 3, b = (i + 2) % 3;
        n[i] += (at(k, a) - at(k + 1, a)) * (at(k, b) + at(k + 1, b));
      }
    }
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    double offset = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      planes_.push_back(static_cast<dReal>(n[i] / length));
      offset += n[i] / length * at(0, i);
    }
    planes_.push_back(static_cast<dReal>(offset));
  }

  PeerVector middle_{};
  std::vector<dReal> points_, planes_;
  std::vector<unsigned> polygons_;
  dGeomID geometry_ = nullptr;
};

/// The library's tables of colliders, while there is a penalty.
struct OdeLibrary {
  OdeLibrary() { dInitODE2(0); }
  OdeLibrary(const OdeLibrary&) = delete;
  OdeLibrary& operator=(const OdeLibrary&) = delete;
  ~OdeLibrary() { dCloseODE(); }
};

/// A space that empties itself of the geometries that others own.
struct OdeSpace {
  OdeSpace() : id(dHashSpaceCreate(nullptr)) { dSpaceSetCleanup(id, 0); }
  OdeSpace(const OdeSpace&) = delete;
  OdeSpace& operator=(const OdeSpace&) = delete;
  ~OdeSpace() { dSpaceDestroy(id); }
  dSpaceID id;
};

class OdePenalty final : public PenaltyPeer {
 public:
  OdePenalty(const PenaltyBodies& bodies, double stiffness_n_per_m)
      : stiffness_n_per_m_(stiffness_n_per_m) {
    for (const PeerSolid& solid : bodies.moving) moving_.emplace_back(moving_space_.id, solid);
    for (const PeerSolid& solid : bodies.fixed) fixed_.emplace_back(fixed_space_.id, solid);
  }

  void prepare(const PeerPose& pose) override { pose_ = pose; }
  PenaltyWrench render() override {
    wrench_ = {};
    for (OdeConvex& convex : moving_) convex.place(pose_.p_wa, pose_.r_wa);
    dSpaceCollide2(
        reinterpret_cast<dGeomID>(moving_space_.id), reinterpret_cast<dGeomID>(fixed_space_.id),
        this, [](void* self, dGeomID a, dGeomID b) { static_cast<OdePenalty*>(self)->meet(a, b); });
    return wrench_;
  }

 private:
  // Of dCollide the normal points into the first geometry.
  void meet(dGeomID a, dGeomID b) {
    const double sign = dGeomGetSpace(a) == moving_space_.id ? 1 : -1;
    const int count = dCollide(a, b, kMaxContacts, contacts_, sizeof(dContactGeom));
    if (count == 0) return;
    ++wrench_.pairs;
    for (int k = 0; k < count; ++k) {
      const dContactGeom& c = contacts_[k];
      PeerVector normal{}, point{};
      for (std::size_t i = 0; i < 3; ++i) {
        normal[i] = sign * static_cast<double>(c.normal[i]);
        point[i] = static_cast<double>(c.pos[i]);
      }
      wrench_.push(stiffness_n_per_m_ / count, static_cast<double>(c.depth), normal, point,
                   pose_.p_wa);
    }
  }

  OdeLibrary library_;
  double stiffness_n_per_m_;
  OdeSpace moving_space_, fixed_space_;
  std::deque<OdeConvex> moving_, fixed_;
  PeerPose pose_;
  PenaltyWrench wrench_;
  dContactGeom contacts_[kMaxContacts];
};

}  // namespace

std::unique_ptr<PeerQuery> make_ode_peer(const PeerSolid& a, const PeerSolid& b) {
  return std::make_unique<OdePeer>(a, b);
}

std::unique_ptr<PenaltyPeer> make_ode_penalty(const PenaltyBodies& bodies,
                                              double stiffness_n_per_m) {
  return std::make_unique<OdePenalty>(bodies, stiffness_n_per_m);
}

}  // namespace haptic::sim
