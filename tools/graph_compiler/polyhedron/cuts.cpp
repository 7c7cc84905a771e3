// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/polyhedron/cuts.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "tools/common/split_mix.hpp"

namespace haptic::tools {

namespace {

// Best-ranked candidates that are tried in full; fewer where there are many reflex edges and each
// trial is expensive.
constexpr std::size_t kTrials = 64;
constexpr std::size_t kTrialsOfLargeParts = 12;
constexpr std::size_t kLargePart = 60;
// A cut next to a corner makes a sliver: behind all others.
constexpr double kThinPenalty = 100.0;
// Mitre planes through corners of more bits make every later sign expensive.
constexpr std::size_t kMaxMitreBits = 1200;

// In [0, 1), the same on every machine and in every order of evaluation.
double jitter_of(std::uint64_t seed, std::uint64_t part, std::uint64_t plane) {
  return unit_interval(hashed(hashed(hashed(seed) ^ part) ^ plane));
}

std::size_t content_hash(const Solid& solid) {
  std::uint64_t hash = solid.faces.size();
  for (const ExactFace& face : solid.faces) {
    hash = hashed(hash ^ (std::uint64_t{face.plane} << 1U | (face.sign > 0 ? 1U : 0U)));
    for (const ChainEdge& e : face.edges) {
      hash = hashed(hash ^ (std::uint64_t{e.first} << 32U | e.second));
    }
  }
  return static_cast<std::size_t>(hash);
}

bool same_solid(const Solid& a, const Solid& b) {
  return std::equal(a.faces.begin(), a.faces.end(), b.faces.begin(), b.faces.end(),
                    [](const ExactFace& f, const ExactFace& g) {
                      return f.plane == g.plane && f.sign == g.sign && f.edges == g.edges;
                    });
}

std::array<double, 3> difference(const ExactWorld& world, std::uint32_t from, std::uint32_t to) {
  const std::array<double, 3>& a = world.vertices[from].x_approx;
  const std::array<double, 3>& b = world.vertices[to].x_approx;
  return {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
}

std::array<double, 3> cross_approx(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double dot_approx(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

std::size_t vertex_bits(const ExactWorld& world, std::uint32_t v) {
  std::size_t bits = 0;
  for (const Rational& x : world.vertices[v].x) bits = std::max(bits, bit_size(x));
  return bits;
}

// Scaled to coprime integers: keeps the signs that use the plane cheap.
void make_primitive(Rational3& n, Rational& d) {
  Integer common = denominator(d);
  for (const Rational& x : n) common = lcm(common, Integer(denominator(x)));
  Integer divisor = abs(Integer(numerator(d) * (common / denominator(d))));
  for (const Rational& x : n) {
    divisor = gcd(divisor, Integer(numerator(x) * (common / denominator(x))));
  }
  const Rational factor(common, divisor);
  for (Rational& x : n) x *= factor;
  d *= factor;
}

}  // namespace

std::vector<ReflexEdge> reflex_edges(ExactWorld& world, const Solid& solid) {
  struct Use {
    std::uint32_t low, high;
    bool forward;
    std::size_t face;
  };
  std::vector<Use> uses;
  for (std::size_t f = 0; f < solid.faces.size(); ++f) {
    for (const auto& [u, v] : solid.faces[f].edges) {
      uses.push_back({std::min(u, v), std::max(u, v), u < v, f});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) {
    return std::tie(a.low, a.high, a.forward, a.face) < std::tie(b.low, b.high, b.forward, b.face);
  });
  std::vector<ReflexEdge> reflex;
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i;
    std::size_t middle = i;
    while (end < uses.size() && uses[end].low == uses[i].low && uses[end].high == uses[i].high) {
      if (!uses[end].forward) ++middle;
      ++end;
    }
    const bool touching = end - i > 2;
    // Backward uses come first: false < true.
    for (std::size_t g = i; g < middle; ++g) {
      for (std::size_t f = middle; f < end; ++f) {
        const ExactFace& face_f = solid.faces[uses[f].face];
        const ExactFace& face_g = solid.faces[uses[g].face];
        // (N_f x N_g).(x_v - x_u) < 0
        if (touching || face_f.sign * face_g.sign *
                                world.turn(face_f.plane, face_g.plane, uses[i].low, uses[i].high) <
                            0) {
          reflex.push_back({uses[i].low, uses[i].high, uses[f].face, uses[g].face, touching});
        }
      }
    }
    i = end;
  }
  return reflex;
}

Cutter::Cutter(ExactWorld& world, double thin) : world_(world), splitter_(world), thin_(thin) {}

Cutter::PartIndex Cutter::intern(Solid solid) {
  const std::size_t hash = content_hash(solid);
  const auto [first, last] = lookup_.equal_range(hash);
  for (auto it = first; it != last; ++it) {
    if (same_solid(parts_[it->second]->solid, solid)) return it->second;
  }
  auto part = std::make_unique<Part>();
  part->reflex = reflex_edges(world_, solid);
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const ReflexEdge& e : part->reflex) {
    pairs.insert(std::minmax(solid.faces[e.f].plane, solid.faces[e.g].plane));
  }
  part->plane_pairs = pairs.size();
  part->solid = std::move(solid);
  parts_.push_back(std::move(part));
  lookup_.emplace(hash, parts_.size() - 1);
  return parts_.size() - 1;
}

// Both half-planes of a cut at a reflex edge count: one of them must run inside both wedges, N_f.d
// <= 0 and N_g.d <= 0 with d = n_h x e or its opposite. N_f.(n_h x e) = (N_f x n_h).e, the sign
// that `turn` gives.
bool Cutter::spans_solid(const Part& part, const ReflexEdge& edge, std::uint32_t plane) {
  const ExactFace& f = part.solid.faces[edge.f];
  const ExactFace& g = part.solid.faces[edge.g];
  const int at_f = f.sign * world_.turn(f.plane, plane, edge.u, edge.v);
  const int at_g = g.sign * world_.turn(g.plane, plane, edge.u, edge.v);
  return at_f * at_g >= 0;
}

// The same in double, for a plane that is not in the table yet; true when in doubt.
bool Cutter::may_span_solid(const Part& part, const ReflexEdge& edge,
                            const std::array<double, 3>& n) const {
  const std::array<double, 3> d = cross_approx(n, difference(world_, edge.u, edge.v));
  const double length = std::sqrt(dot_approx(d, d));
  const auto at = [&](std::size_t face) {
    return part.solid.faces[face].sign *
           dot_approx(world_.planes[part.solid.faces[face].plane].unit_normal, d);
  };
  const double at_f = at(edge.f);
  const double at_g = at(edge.g);
  const double doubt = 1.0e-7 * length;
  return (at_f <= doubt && at_g <= doubt) || (at_f >= -doubt && at_g >= -doubt);
}

void Cutter::add_mitre_plane(const Part& part, const ReflexEdge& a, const ReflexEdge& b,
                             std::uint32_t third, unsigned kind,
                             std::map<std::uint32_t, unsigned>& planes) {
  const std::array<double, 3> n_approx =
      cross_approx(difference(world_, a.u, a.v), difference(world_, a.u, third));
  world_.charge(4.0);
  if (!may_span_solid(part, a, n_approx) || !may_span_solid(part, b, n_approx)) return;
  for (const std::uint32_t v : {a.u, a.v, third}) {
    if (vertex_bits(world_, v) > kMaxMitreBits) return;
  }
  const Rational3& origin = world_.vertices[a.u].x;
  const Rational3 along = subtract(world_.vertices[a.v].x, origin);
  Rational3 n = cross(along, subtract(world_.vertices[third].x, origin));
  if (n[0] == 0 && n[1] == 0 && n[2] == 0) return;
  Rational d = dot(n, origin);
  make_primitive(n, d);
  int sign = 1;
  const std::uint32_t plane = world_.find_or_add_plane(n, d, sign);
  world_.charge(200.0);
  if (spans_solid(part, a, plane) && world_.side(b.u, plane) == 0 && world_.side(b.v, plane) == 0 &&
      spans_solid(part, b, plane)) {
    planes[plane] |= kind;
  }
}

void Cutter::add_mitre_planes(const Part& part, std::map<std::uint32_t, unsigned>& planes) {
  std::map<std::uint32_t, std::vector<std::size_t>> at_corner;
  for (std::size_t i = 0; i < part.reflex.size(); ++i) {
    if (part.reflex[i].touching) continue;
    at_corner[part.reflex[i].u].push_back(i);
    at_corner[part.reflex[i].v].push_back(i);
  }
  for (const auto& [corner, edges] : at_corner) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      for (std::size_t k = i + 1; k < edges.size(); ++k) {
        const ReflexEdge& a = part.reflex[edges[i]];
        const ReflexEdge& b = part.reflex[edges[k]];
        add_mitre_plane(part, a, b, b.u == corner ? b.v : b.u, kSharingMitre, planes);
      }
    }
  }
  // The number of parallel pairs grows with the square; a large part has shorter ways.
  if (part.reflex.size() > kLargePart) return;
  for (std::size_t i = 0; i < part.reflex.size(); ++i) {
    const ReflexEdge& a = part.reflex[i];
    const std::array<double, 3> da = difference(world_, a.u, a.v);
    for (std::size_t k = i + 1; k < part.reflex.size(); ++k) {
      const ReflexEdge& b = part.reflex[k];
      if (a.touching || b.touching) continue;
      if (a.u == b.u || a.u == b.v || a.v == b.u || a.v == b.v) continue;
      const std::array<double, 3> db = difference(world_, b.u, b.v);
      const std::array<double, 3> c = cross_approx(da, db);
      if (dot_approx(c, c) > 1.0e-18 * dot_approx(da, da) * dot_approx(db, db)) continue;
      add_mitre_plane(part, a, b, b.u, kParallelMitre, planes);
    }
  }
}

double Cutter::rank(const Part& part, std::uint32_t plane,
                    const std::vector<std::uint32_t>& vertices) {
  double rank = 0.0;
  for (const ReflexEdge& e : part.reflex) {
    const int su = world_.side(e.u, plane);
    const int sv = world_.side(e.v, plane);
    if (su * sv < 0) rank += 1.0;
    if (su == 0 && sv == 0 && (e.touching || spans_solid(part, e, plane))) rank -= 1.0;
  }
  const ExactPlane& p = world_.planes[plane];
  world_.charge(0.25 * static_cast<double>(vertices.size()));
  for (const std::uint32_t v : vertices) {
    const double distance = dot_approx(p.unit_normal, world_.vertices[v].x_approx) - p.unit_offset;
    if (std::abs(distance) < thin_ && world_.side(v, plane) != 0) return rank + kThinPenalty;
  }
  return rank;
}

void Cutter::find_candidates(Part& part) {
  std::map<std::uint32_t, unsigned> planes;
  for (const ReflexEdge& e : part.reflex) {
    planes[part.solid.faces[e.f].plane] |= kFacePlane;
    planes[part.solid.faces[e.g].plane] |= kFacePlane;
  }
  add_mitre_planes(part, planes);
  const std::vector<std::uint32_t> vertices = vertices_of(part.solid);
  for (const auto& [plane, kind] : planes) {
    part.candidates.push_back({plane, kind, rank(part, plane, vertices)});
  }
  std::stable_sort(part.candidates.begin(), part.candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.rank < b.rank; });
  part.ranked = true;
}

const std::vector<Cutter::PartIndex>& Cutter::apply(PartIndex index, std::uint32_t plane) {
  const auto known = parts_[index]->cuts.find(plane);
  if (known != parts_[index]->cuts.end()) return known->second;
  std::vector<PartIndex> result;
  std::optional<Halves> halves;
  try {
    halves = splitter_.split(parts_[index]->solid, plane);
  } catch (const BrokenChain&) {
    // This plane is of no use here; others may be.
  }
  if (halves) {
    for (Solid& solid : halves->below) result.push_back(intern(std::move(solid)));
    for (Solid& solid : halves->above) result.push_back(intern(std::move(solid)));
  }
  return parts_[index]->cuts.emplace(plane, std::move(result)).first->second;
}

const std::vector<Cutter::PartIndex>& Cutter::best_cut(PartIndex index,
                                                       const CutStrategy& strategy) {
  if (!parts_[index]->ranked) find_candidates(*parts_[index]);
  const Part& part = *parts_[index];
  const std::size_t trials = part.reflex.size() > kLargePart ? kTrialsOfLargeParts : kTrials;
  const std::vector<PartIndex>* best = nullptr;
  double best_score = 0.0;
  std::size_t tried = 0;
  for (const Candidate& candidate : part.candidates) {
    if (tried == trials && best != nullptr) break;
    if ((candidate.kind & strategy.kinds) == 0) continue;
    ++tried;
    const std::vector<PartIndex>& cut = apply(index, candidate.plane);
    if (cut.empty()) continue;
    double score = candidate.rank >= kThinPenalty / 2 ? kThinPenalty : 0.0;
    for (const PartIndex i : cut) {
      score += 1.0 + strategy.alpha * static_cast<double>(parts_[i]->plane_pairs);
    }
    if (strategy.seed != 0)
      score += strategy.jitter * jitter_of(strategy.seed, index, candidate.plane);
    if (best == nullptr || score < best_score) {
      best = &cut;
      best_score = score;
    }
  }
  if (best == nullptr) throw BrokenChain("a reflex edge is resolved by no plane");
  return *best;
}

std::vector<Solid> Cutter::cut(const std::vector<Solid>& parts, const CutStrategy& strategy,
                               std::size_t max_pieces) {
  std::vector<PartIndex> open;
  for (const Solid& part : parts) open.push_back(intern(part));
  std::vector<Solid> pieces;
  while (!open.empty()) {
    const PartIndex index = open.back();
    open.pop_back();
    if (parts_[index]->reflex.empty()) {
      pieces.push_back(parts_[index]->solid);
      if (pieces.size() > max_pieces) throw PieceLimitReached(max_pieces);
      continue;
    }
    const std::vector<PartIndex>& halves = best_cut(index, strategy);
    open.insert(open.end(), halves.rbegin(), halves.rend());
  }
  return pieces;
}

}  // namespace haptic::tools
