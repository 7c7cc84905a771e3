// SPDX-License-Identifier: Apache-2.0
#include <ccd/ccd.h>
#include <ccd/quat.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/lab/peers/foreign_peers.hpp"

namespace haptic::sim {
namespace {

/// From this many vertices on the support is walked to from the last one, as FCL does.
constexpr std::size_t kWalkVertices = 32;
/// MPR has no end of its own when rounding keeps it from its tolerance.
constexpr unsigned long kMaxIterations = 10000;

/// A body with its pose, as the support callbacks see it.
struct CcdBody {
  std::vector<PeerVector> vertices;
  std::vector<std::uint32_t> neighbor_begin, neighbors;
  PeerVector middle{};
  PeerVector p{};
  std::array<PeerVector, 3> r{PeerVector{1, 0, 0}, PeerVector{0, 1, 0}, PeerVector{0, 0, 1}};
  mutable std::uint32_t last = 0;  ///< support vertex of the last call

  explicit CcdBody(const PeerSolid& solid) : vertices(solid.vertices) {
    std::vector<std::vector<std::uint32_t>> lists(vertices.size());
    for (const auto& loop : solid.loops) {
      for (std::size_t k = 0; k < loop.size(); ++k)
        lists[loop[k]].push_back(loop[(k + 1) % loop.size()]);
    }
    for (const auto& list : lists) {
      neighbor_begin.push_back(static_cast<std::uint32_t>(neighbors.size()));
      neighbors.insert(neighbors.end(), list.begin(), list.end());
    }
    neighbor_begin.push_back(static_cast<std::uint32_t>(neighbors.size()));
    for (const PeerVector& v : vertices) {
      for (std::size_t i = 0; i < 3; ++i) middle[i] += v[i] / static_cast<double>(vertices.size());
    }
  }

  /// Point `v` of the body in W.
  void place(const PeerVector& v, ccd_vec3_t* out) const {
    for (std::size_t i = 0; i < 3; ++i)
      out->v[i] = p[i] + r[i][0] * v[0] + r[i][1] * v[1] + r[i][2] * v[2];
  }
  [[nodiscard]] double along(const PeerVector& d, std::uint32_t v) const {
    return d[0] * vertices[v][0] + d[1] * vertices[v][1] + d[2] * vertices[v][2];
  }
  void support(const ccd_vec3_t* direction, ccd_vec3_t* out) const {
    PeerVector d{};
    for (std::size_t i = 0; i < 3; ++i) {
      d[i] = r[0][i] * direction->v[0] + r[1][i] * direction->v[1] + r[2][i] * direction->v[2];
    }
    std::uint32_t best = 0;
    if (vertices.size() <= kWalkVertices) {
      double largest = -std::numeric_limits<double>::infinity();
      for (std::uint32_t v = 0; v < vertices.size(); ++v) {
        const double value = along(d, v);
        if (value > largest) largest = value, best = v;
      }
    } else {
      best = last;
      double largest = along(d, best);
      for (bool moved = true; moved;) {
        moved = false;
        const std::uint32_t from = best;
        for (std::uint32_t k = neighbor_begin[from]; k < neighbor_begin[from + 1]; ++k) {
          const double value = along(d, neighbors[k]);
          if (value > largest) largest = value, best = neighbors[k], moved = true;
        }
      }
    }
    last = best;
    place(vertices[best], out);
  }
};

void support_of(const void* body, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  static_cast<const CcdBody*>(body)->support(direction, out);
}

void centre_of(const void* body, ccd_vec3_t* out) {
  const auto* b = static_cast<const CcdBody*>(body);
  b->place(b->middle, out);
}

class CcdPeer final : public PeerQuery {
 public:
  CcdPeer(const PeerSolid& a, const PeerSolid& b, bool portal) : a_(a), b_(b), portal_(portal) {
    CCD_INIT(&ccd_);
    ccd_.support1 = ccd_.support2 = support_of;
    ccd_.center1 = ccd_.center2 = centre_of;
    ccd_.max_iterations = kMaxIterations;
  }
  ccd_t& settings() { return ccd_; }

  void prepare(const PeerPose& pose) override {
    a_.p = pose.p_wa;
    a_.r = pose.r_wa;
  }
  // B first: the direction is the one in which A has to leave.
  void query() override {
    status_ = portal_ ? ccdMPRPenetration(&b_, &a_, &ccd_, &depth_, &direction_, &position_)
                      : ccdGJKPenetration(&b_, &a_, &ccd_, &depth_, &direction_, &position_);
  }
  [[nodiscard]] PeerAnswer answer() const override {
    PeerAnswer answer;
    answer.penetrating = status_ == 0;
    answer.depth_m =
        status_ == 0 ? -static_cast<double>(depth_) : std::numeric_limits<double>::quiet_NaN();
    if (status_ == 0) {
      for (std::size_t i = 0; i < 3; ++i) answer.normal_w[i] = static_cast<double>(direction_.v[i]);
      answer.patch_points = 1;
    }
    return answer;
  }
  void reset() override { a_.last = b_.last = 0; }
  [[nodiscard]] bool coherent() const override { return a_.vertices.size() > kWalkVertices; }

 private:
  CcdBody a_, b_;
  bool portal_;
  ccd_t ccd_{};
  int status_ = -1;
  ccd_real_t depth_ = 0;
  ccd_vec3_t direction_{}, position_{};
};

/// Tolerance of the penalty: that which stands for the method in the pictures of one pair.
constexpr double kPenaltyTolerance_m = 1e-8;

/// Box along the axes.
struct CcdBox {
  PeerVector low, high;
};

class CcdPenalty final : public PenaltyPeer {
 public:
  CcdPenalty(const PenaltyBodies& bodies, double stiffness_n_per_m, bool portal)
      : stiffness_n_per_m_(stiffness_n_per_m), portal_(portal) {
    for (const PeerSolid& solid : bodies.moving) {
      moving_.emplace_back(solid);
      local_.push_back(box_of(solid));
    }
    for (const PeerSolid& solid : bodies.fixed) {
      fixed_.emplace_back(solid);
      boxes_.push_back(box_of(solid));
    }
    CCD_INIT(&ccd_);
    ccd_.support1 = ccd_.support2 = support_of;
    ccd_.center1 = ccd_.center2 = centre_of;
    ccd_.max_iterations = kMaxIterations;
    ccd_.mpr_tolerance = ccd_.epa_tolerance = kPenaltyTolerance_m;
  }

  void prepare(const PeerPose& pose) override {
    for (CcdBody& body : moving_) {
      body.p = pose.p_wa;
      body.r = pose.r_wa;
    }
  }
  PenaltyWrench render() override {
    PenaltyWrench wrench;
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const CcdBox box = placed(local_[i], moving_[i]);
      for (std::size_t j = 0; j < fixed_.size(); ++j) {
        if (meet(box, boxes_[j])) collide(moving_[i], fixed_[j], wrench);
      }
    }
    return wrench;
  }

 private:
  static CcdBox box_of(const PeerSolid& solid) {
    CcdBox box{solid.vertices.front(), solid.vertices.front()};
    for (const PeerVector& v : solid.vertices) {
      for (std::size_t i = 0; i < 3; ++i) {
        box.low[i] = std::min(box.low[i], v[i]);
        box.high[i] = std::max(box.high[i], v[i]);
      }
    }
    return box;
  }
  /// The box along the axes of W around the turned box.
  static CcdBox placed(const CcdBox& local, const CcdBody& body) {
    CcdBox box{};
    for (std::size_t i = 0; i < 3; ++i) {
      double middle = body.p[i], half = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        middle += body.r[i][j] * 0.5 * (local.low[j] + local.high[j]);
        half += std::abs(body.r[i][j]) * 0.5 * (local.high[j] - local.low[j]);
      }
      box.low[i] = middle - half;
      box.high[i] = middle + half;
    }
    return box;
  }
  static bool meet(const CcdBox& a, const CcdBox& b) {
    return a.low[0] <= b.high[0] && b.low[0] <= a.high[0] && a.low[1] <= b.high[1] &&
           b.low[1] <= a.high[1] && a.low[2] <= b.high[2] && b.low[2] <= a.high[2];
  }
  // B first: the direction is the one in which A has to leave.
  void collide(const CcdBody& a, const CcdBody& b, PenaltyWrench& wrench) const {
    ccd_real_t depth = 0;
    ccd_vec3_t direction{}, position{};
    const int status = portal_ ? ccdMPRPenetration(&b, &a, &ccd_, &depth, &direction, &position)
                               : ccdGJKPenetration(&b, &a, &ccd_, &depth, &direction, &position);
    if (status == -2) ++wrench.failures;  // out of memory
    if (status != 0) return;
    PeerVector normal{}, point{};
    for (std::size_t i = 0; i < 3; ++i) {
      normal[i] = static_cast<double>(direction.v[i]);
      point[i] = static_cast<double>(position.v[i]);
    }
    ++wrench.pairs;
    wrench.push(stiffness_n_per_m_, static_cast<double>(depth), normal, point, a.p);
  }

  double stiffness_n_per_m_;
  bool portal_;
  std::vector<CcdBody> moving_, fixed_;
  std::vector<CcdBox> local_, boxes_;
  ccd_t ccd_{};
};

}  // namespace

std::unique_ptr<PeerQuery> make_ccd_mpr_peer(const PeerSolid& a, const PeerSolid& b,
                                             double tolerance_m) {
  auto peer = std::make_unique<CcdPeer>(a, b, true);
  peer->settings().mpr_tolerance = tolerance_m;
  return peer;
}

std::unique_ptr<PeerQuery> make_ccd_epa_peer(const PeerSolid& a, const PeerSolid& b,
                                             double tolerance_m) {
  auto peer = std::make_unique<CcdPeer>(a, b, false);
  peer->settings().epa_tolerance = tolerance_m;
  return peer;
}

std::unique_ptr<PenaltyPeer> make_ccd_mpr_penalty(const PenaltyBodies& bodies,
                                                  double stiffness_n_per_m) {
  return std::make_unique<CcdPenalty>(bodies, stiffness_n_per_m, true);
}

std::unique_ptr<PenaltyPeer> make_ccd_epa_penalty(const PenaltyBodies& bodies,
                                                  double stiffness_n_per_m) {
  return std::make_unique<CcdPenalty>(bodies, stiffness_n_per_m, false);
}

}  // namespace haptic::sim
