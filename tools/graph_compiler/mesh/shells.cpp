// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/shells.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tools/graph_compiler/mesh/edge_table.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

/// Faces closer than this around an edge count as lying on each other [rad].
constexpr double kSameAngle_rad = 1.0e-6;

std::string edge_text(const WorkMesh& mesh, const HalfEdge& half, std::size_t face_count) {
  const Point3 middle = vec::scaled(vec::add(mesh.points[half.low], mesh.points[half.high]), 0.5);
  return "edge with " + std::to_string(face_count) + " faces at " + place_text(mesh, middle);
}

constexpr const char* kSeparate =
    "separate the solids that touch there, or give them as separate groups";

class ShellBuilder {
 public:
  explicit ShellBuilder(WorkMesh& mesh)
      : mesh_(mesh), table_(mesh.faces), sides_(mesh.faces.size()), turn_(mesh.faces.size(), 0) {}

  std::vector<WorkShell> build(std::vector<std::uint8_t>& flipped) {
    orient_over_plain_edges();
    follow_file_orientation();
    relate_at_crowded_edges();
    choose_sign_by_volume();
    flipped = turn_;
    pair_at_crowded_edges();
    split_points();
    return collect_shells();
  }

 private:
  /// Two faces at an edge run through it in opposite directions, or one of them must be turned.
  void orient_over_plain_edges() {
    for (const EdgeRange& edge : table_.edges) {
      if (edge.size() % 2 == 1) {
        refuse_mesh(mesh_, edge_text(mesh_, table_.half_edges[edge.begin], edge.size()), kSeparate);
      }
      if (edge.size() != 2) {
        crowded_.push_back(edge);
        continue;
      }
      const HalfEdge& a = table_.half_edges[edge.begin];
      const HalfEdge& b = table_.half_edges[edge.begin + 1];
      if (!sides_.unite(a.face, b.face, a.forward == b.forward)) {
        refuse_mesh(mesh_,
                    face_text(mesh_, mesh_.faces[b.face].source_face) + " at " +
                        place_text(mesh_, mesh_.points[b.low]) +
                        " cannot be oriented: the surface is one-sided",
                    "repair the mesh");
      }
    }
  }

  /// First guess: in each connected patch the direction of the majority of its faces in the file.
  void follow_file_orientation() {
    std::vector<std::int64_t> votes(mesh_.faces.size(), 0);
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      votes[sides_.root_of(f)] += sides_.parity_of(f) ? -1 : 1;
    }
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      turn_[f] = sides_.parity_of(f) != (votes[sides_.root_of(f)] < 0) ? 1 : 0;
    }
  }

  /// True if the face, as turned so far, runs through the edge from its low to its high point.
  bool runs_forward(const HalfEdge& half) const { return half.forward != (turn_[half.face] != 0); }

  /// Half-edges of one edge by angle around it, counter-clockwise seen against low -> high. Faces
  /// on each other: the one that ends solid first, so that no solid of zero angle opens between
  /// them.
  std::vector<HalfEdge> sorted_around(const EdgeRange& edge) const {
    struct Entry {
      double angle = 0.0;
      HalfEdge half;
    };
    std::vector<Entry> entries;
    const HalfEdge& first = table_.half_edges[edge.begin];
    const Point3 e = vec::unit(vec::sub(mesh_.points[first.high], mesh_.points[first.low]));
    Point3 x{0, 0, 0};
    Point3 y{0, 0, 0};
    for (std::size_t h = edge.begin; h < edge.end; ++h) {
      const HalfEdge& half = table_.half_edges[h];
      const Point3 area = vec::twice_area(mesh_.points, mesh_.faces[half.face].loop);
      const Point3 inward = vec::unit(vec::cross(area, half.forward ? e : vec::scaled(e, -1.0)));
      if (h == edge.begin) {
        x = inward;
        y = vec::cross(e, x);
      }
      double angle = std::atan2(vec::dot(inward, y), vec::dot(inward, x));
      if (angle < -kSameAngle_rad) {
        angle += 6.283185307179586;
      }
      entries.push_back({angle, half});
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return a.angle != b.angle ? a.angle < b.angle : a.half.face < b.half.face;
    });
    for (std::size_t begin = 0; begin < entries.size();) {
      std::size_t end = begin + 1;
      while (end < entries.size() && entries[end].angle - entries[end - 1].angle < kSameAngle_rad) {
        ++end;
      }
      std::stable_partition(entries.begin() + static_cast<std::ptrdiff_t>(begin),
                            entries.begin() + static_cast<std::ptrdiff_t>(end),
                            [&](const Entry& entry) { return runs_forward(entry.half); });
      begin = end;
    }
    std::vector<HalfEdge> sorted;
    for (const Entry& entry : entries) {
      sorted.push_back(entry.half);
    }
    return sorted;
  }

  /// Solid and empty alternate around an edge, so neighbouring faces run through it in opposite
  /// directions.
  void relate_at_crowded_edges() {
    for (const EdgeRange& edge : crowded_) {
      const std::vector<HalfEdge> sorted = sorted_around(edge);
      for (std::size_t i = 0; i + 1 < sorted.size(); ++i) {
        const HalfEdge& a = sorted[i];
        const HalfEdge& b = sorted[i + 1];
        if (!sides_.unite(a.face, b.face, a.forward == b.forward)) {
          refuse_mesh(mesh_, edge_text(mesh_, a, edge.size()) + ", not alternating", kSeparate);
        }
      }
    }
  }

  /// Touching solids together have a positive volume.
  void choose_sign_by_volume() {
    std::vector<double> volume(mesh_.faces.size(), 0.0);
    std::vector<std::uint32_t> apex(mesh_.faces.size(), 0);
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      const std::uint32_t root = sides_.root_of(f);
      const std::vector<std::uint32_t>& loop = mesh_.faces[f].loop;
      if (root == f) {
        apex[root] = loop[0];
      }
    }
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      const std::uint32_t root = sides_.root_of(f);
      const double sign = sides_.parity_of(f) ? -1.0 : 1.0;
      volume[root] +=
          sign * vec::six_volumes(mesh_.points, mesh_.faces[f].loop, mesh_.points[apex[root]]);
    }
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      const bool turn = sides_.parity_of(f) != (volume[sides_.root_of(f)] < 0.0);
      turn_[f] = turn ? 1 : 0;
    }
  }

  /// Position of a half-edge's start corner in the flat numbering of corners.
  std::uint32_t corner_index(std::uint32_t face, std::size_t corner) const {
    const std::size_t size = mesh_.faces[face].loop.size();
    return first_corner_[face] + static_cast<std::uint32_t>(corner == size ? 0 : corner);
  }

  /// The two faces of a pair share the sheet around both ends of their edge.
  void join(const HalfEdge& a, const HalfEdge& b) {
    const auto corners = [&](const HalfEdge& half) {
      const std::uint32_t start = corner_index(half.face, half.corner);
      const std::uint32_t end = corner_index(half.face, half.corner + std::size_t{1});
      return half.forward ? std::pair{start, end} : std::pair{end, start};
    };
    const auto [a_low, a_high] = corners(a);
    const auto [b_low, b_high] = corners(b);
    sheets_.unite(a_low, b_low, false);
    sheets_.unite(a_high, b_high, false);
    faces_of_shell_.unite(a.face, b.face, false);
  }

  /// Pairs of a crowded edge. A face that runs backward opens a solid sector (increasing angle
  /// leads from its inner side into the solid), the next one, forward, ends it. `across_solid`
  /// false: pairs across the gaps.
  std::vector<std::pair<HalfEdge, HalfEdge>> pairs_of(const EdgeRange& edge,
                                                      bool across_solid) const {
    const std::vector<HalfEdge> sorted = sorted_around(edge);
    std::vector<std::pair<HalfEdge, HalfEdge>> pairs;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
      const HalfEdge& a = sorted[i];
      const HalfEdge& b = sorted[(i + 1) % sorted.size()];
      if (runs_forward(a) == runs_forward(b)) {
        refuse_mesh(mesh_, edge_text(mesh_, a, edge.size()) + ", not alternating", kSeparate);
      }
      if (runs_forward(a) != across_solid) {
        pairs.emplace_back(a, b);
      }
    }
    return pairs;
  }

  /// Joins everything. A shell that touches itself along an edge may keep one sheet around both of
  /// its ends when paired across the solid; the edge would then carry four faces on the same two
  /// points. Pairing such edges across the gap separates the sheets; both are boundaries of the
  /// same solid.
  void pair_at_crowded_edges() {
    std::vector<std::uint8_t> across_solid(crowded_.size(), 1);
    for (int round = 0;; ++round) {
      reset_joins();
      for (const EdgeRange& edge : table_.edges) {
        if (edge.size() == 2) {
          join(table_.half_edges[edge.begin], table_.half_edges[edge.begin + 1]);
        }
      }
      std::vector<std::vector<std::pair<HalfEdge, HalfEdge>>> pairs;
      for (std::size_t i = 0; i < crowded_.size(); ++i) {
        pairs.push_back(pairs_of(crowded_[i], across_solid[i] != 0));
        for (const auto& [a, b] : pairs.back()) {
          join(a, b);
        }
      }
      bool changed = false;
      for (std::size_t i = 0; i < crowded_.size(); ++i) {
        if (shares_both_ends(pairs[i])) {
          if (across_solid[i] == 0 || round > 0) {
            refuse_mesh(mesh_,
                        edge_text(mesh_, table_.half_edges[crowded_[i].begin], crowded_[i].size()),
                        kSeparate);
          }
          across_solid[i] = 0;
          changed = true;
        }
      }
      if (!changed) {
        step_edges_.count = crowded_.size();
        mesh_.steps.push_back(step_edges_);
        return;
      }
    }
  }

  void reset_joins() {
    first_corner_.assign(mesh_.faces.size(), 0);
    std::uint32_t corners = 0;
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      first_corner_[f] = corners;
      corners += static_cast<std::uint32_t>(mesh_.faces[f].loop.size());
    }
    sheets_ = ParitySets(corners);
    faces_of_shell_ = ParitySets(mesh_.faces.size());
  }

  bool shares_both_ends(const std::vector<std::pair<HalfEdge, HalfEdge>>& pairs) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ends;
    for (const auto& [a, b] : pairs) {
      const std::uint32_t start = sheets_.root_of(corner_index(a.face, a.corner));
      const std::uint32_t end = sheets_.root_of(corner_index(a.face, a.corner + std::size_t{1}));
      ends.push_back(a.forward ? std::pair{start, end} : std::pair{end, start});
    }
    std::sort(ends.begin(), ends.end());
    return std::adjacent_find(ends.begin(), ends.end()) != ends.end();
  }

  /// One point per sheet: the first sheet at a point keeps it, the others get copies.
  void split_points() {
    constexpr std::uint32_t kFree = 0xFFFFFFFFU;
    CleaningStep step{"touching corners", 0, 0.0};
    std::vector<std::uint32_t> point_of_sheet(
        mesh_.faces.empty() ? 0 : first_corner_.back() + mesh_.faces.back().loop.size(), kFree);
    std::vector<std::uint8_t> taken(mesh_.points.size(), 0);
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      std::vector<std::uint32_t>& loop = mesh_.faces[f].loop;
      for (std::size_t i = 0; i < loop.size(); ++i) {
        std::uint32_t& point = point_of_sheet[sheets_.root_of(corner_index(f, i))];
        if (point == kFree) {
          point = loop[i];
          if (taken[loop[i]] != 0) {
            point = static_cast<std::uint32_t>(mesh_.points.size());
            const Point3 position = mesh_.points[loop[i]];
            const std::uint32_t source = mesh_.source_vertex[loop[i]];
            mesh_.points.push_back(position);
            mesh_.source_vertex.push_back(source);
            taken.push_back(1);
            ++step.count;
          }
          taken[point] = 1;
        }
        loop[i] = point;
      }
    }
    mesh_.steps.push_back(step);
  }

  std::vector<WorkShell> collect_shells() {
    constexpr std::uint32_t kNone = 0xFFFFFFFFU;
    std::vector<std::uint32_t> shell_of_root(mesh_.faces.size(), kNone);
    std::vector<WorkShell> shells;
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      std::vector<std::uint32_t>& loop = mesh_.faces[f].loop;
      if (turn_[f] != 0) {
        std::reverse(loop.begin(), loop.end());
      }
      std::uint32_t& shell = shell_of_root[faces_of_shell_.root_of(f)];
      if (shell == kNone) {
        shell = static_cast<std::uint32_t>(shells.size());
        shells.emplace_back();
      }
      shells[shell].faces.push_back(f);
    }
    for (WorkShell& shell : shells) {
      const Point3& apex = mesh_.points[mesh_.faces[shell.faces[0]].loop[0]];
      for (const std::uint32_t f : shell.faces) {
        shell.volume += vec::six_volumes(mesh_.points, mesh_.faces[f].loop, apex) / 6.0;
      }
    }
    return shells;
  }

  WorkMesh& mesh_;
  EdgeTable table_;
  ParitySets sides_;
  std::vector<std::uint8_t> turn_;
  std::vector<EdgeRange> crowded_;  ///< edges with four or more faces
  std::vector<std::uint32_t> first_corner_;
  ParitySets sheets_{0};
  ParitySets faces_of_shell_{0};
  CleaningStep step_edges_{"touching edges", 0, 0.0};
};

}  // namespace

std::vector<WorkShell> build_shells(WorkMesh& mesh, std::vector<std::uint8_t>& flipped) {
  return ShellBuilder(mesh).build(flipped);
}

void turn_shell(WorkMesh& mesh, WorkShell& shell, std::vector<std::uint8_t>& flipped) {
  for (const std::uint32_t f : shell.faces) {
    std::reverse(mesh.faces[f].loop.begin(), mesh.faces[f].loop.end());
    flipped[f] ^= 1;
  }
  shell.volume = -shell.volume;
}

}  // namespace haptic::tools
