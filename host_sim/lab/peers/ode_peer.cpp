// SPDX-License-Identifier: Apache-2.0
#include <ode/collision.h>

#include <algorithm>
#include <limits>

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

}  // namespace

std::unique_ptr<PeerQuery> make_ode_peer(const PeerSolid& a, const PeerSolid& b) {
  return std::make_unique<OdePeer>(a, b);
}

}  // namespace haptic::sim
