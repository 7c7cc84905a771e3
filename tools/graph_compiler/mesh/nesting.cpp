// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/nesting.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "tools/graph_compiler/mesh/shell_interior.hpp"
#include "tools/graph_compiler/mesh/vec3.hpp"

namespace haptic::tools {
namespace {

class Nesting {
 public:
  Nesting(const WorkMesh& mesh, const std::vector<WorkShell>& shells)
      : mesh_(mesh), shells_(shells), boxes_(shells.size()), interiors_(shells.size()) {
    for (std::size_t s = 0; s < shells.size(); ++s) {
      for (const std::uint32_t f : shells[s].faces) {
        for (const std::uint32_t v : mesh.faces[f].loop) {
          boxes_[s].include(mesh.points[v]);
        }
      }
    }
  }

  bool lies_in(std::size_t inner, std::size_t outer) {
    if (inner == outer || !boxes_[outer].grown(mesh_.tolerance_m).holds(boxes_[inner]) ||
        std::abs(shells_[inner].volume) > std::abs(shells_[outer].volume)) {
      return false;
    }
    const ShellInterior& interior = interior_of(outer);
    bool any_inside = false;
    for (const std::uint32_t f : shells_[inner].faces) {
      for (const std::uint32_t v : mesh_.faces[f].loop) {
        const PointPlace place = interior.place_of(mesh_.points[v]);
        if (place == PointPlace::kOutside) {
          return false;
        }
        any_inside = any_inside || place == PointPlace::kInside;
      }
    }
    return any_inside || a_face_middle_is_inside(inner, interior);
  }

 private:
  bool a_face_middle_is_inside(std::size_t inner, const ShellInterior& interior) const {
    bool any_inside = false;
    for (const std::uint32_t f : shells_[inner].faces) {
      const std::vector<std::uint32_t>& loop = mesh_.faces[f].loop;
      Point3 middle{0, 0, 0};
      for (std::size_t i = 0; i < 3; ++i) {
        middle = vec::add(middle, vec::scaled(mesh_.points[loop[i]], 1.0 / 3.0));
      }
      const PointPlace place = interior.place_of(middle);
      if (place == PointPlace::kOutside) {
        return false;
      }
      any_inside = any_inside || place == PointPlace::kInside;
    }
    return any_inside;
  }

  const ShellInterior& interior_of(std::size_t shell) {
    if (!interiors_[shell]) {
      std::vector<ShellInterior::Triangle> triangles;
      for (const std::uint32_t f : shells_[shell].faces) {
        const std::vector<std::uint32_t>& loop = mesh_.faces[f].loop;
        for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
          triangles.push_back(
              {mesh_.points[loop[0]], mesh_.points[loop[i]], mesh_.points[loop[i + 1]]});
        }
      }
      interiors_[shell] = std::make_unique<ShellInterior>(std::move(triangles), mesh_.tolerance_m);
    }
    return *interiors_[shell];
  }

  const WorkMesh& mesh_;
  const std::vector<WorkShell>& shells_;
  std::vector<vec::Box> boxes_;
  std::vector<std::unique_ptr<ShellInterior>> interiors_;
};

/// True if most faces of the shell point, in the file, to the side of positive volume.
bool file_points_outward(const WorkShell& shell, const std::vector<std::uint8_t>& flipped) {
  std::size_t turned = 0;
  for (const std::uint32_t f : shell.faces) {
    turned += flipped[f];
  }
  const bool mostly_turned = 2 * turned > shell.faces.size();
  return (shell.volume > 0.0) != mostly_turned;
}

}  // namespace

std::vector<Shell> nest_shells(WorkMesh& mesh, std::vector<WorkShell>& work_shells,
                               std::vector<std::uint8_t>& flipped, std::size_t& solid_count) {
  const std::size_t count = work_shells.size();
  std::vector<std::vector<std::uint32_t>> around(count);
  {
    Nesting nesting(mesh, work_shells);
    for (std::size_t inner = 0; inner < count; ++inner) {
      for (std::size_t outer = 0; outer < count; ++outer) {
        if (nesting.lies_in(inner, outer)) {
          around[inner].push_back(static_cast<std::uint32_t>(outer));
        }
      }
    }
  }
  // Outermost first: what a shell is depends on the shells around it.
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) {
    return around[l].size() < around[r].size();
  });
  std::vector<Shell> shells(count);
  std::vector<std::uint8_t> outward_in_file(count);
  CleaningStep inside_out{"inside-out shells", 0, 0.0};
  for (const std::size_t s : order) {
    WorkShell& shell = work_shells[s];
    shells[s].faces = shell.faces;
    outward_in_file[s] = file_points_outward(shell, flipped) ? 1 : 0;
    // Depth of material around the shell, and the shells against which orientation is decided: a
    // part that is inside-out as a whole is turned as a whole, so a shell is inverted if it differs
    // from the outermost one around it.
    int material = 0;
    std::size_t outermost = s;
    std::size_t innermost_solid = count;
    for (const std::uint32_t outer : around[s]) {
      material += shells[outer].is_void ? -1 : 1;
      if (around[outer].empty()) {
        outermost = outer;
      }
      if (!shells[outer].is_void &&
          (innermost_solid == count ||
           std::abs(work_shells[outer].volume) < std::abs(work_shells[innermost_solid].volume))) {
        innermost_solid = outer;
      }
    }
    const bool inverted = outward_in_file[s] != outward_in_file[outermost];
    shells[s].is_void = inverted && material > 0;
    if (shells[s].is_void) {
      shells[s].parent = static_cast<std::uint32_t>(innermost_solid);
    } else if (material > 0) {
      mesh.warnings.push_back(
          "the shell at " + place_text(mesh, mesh.points[mesh.faces[shell.faces[0]].loop[0]]) +
          " lies inside another solid and its faces point outward too: the two overlap and are "
          "united; turn its faces if it is meant as a cavity");
    }
    inside_out.count += shells[s].is_void == (outward_in_file[s] != 0) ? 1U : 0U;
    if ((shell.volume < 0.0) != shells[s].is_void) {
      turn_shell(mesh, shell, flipped);
    }
  }
  solid_count = 0;
  for (std::size_t s = 0; s < count; ++s) {
    if (!shells[s].is_void) {
      shells[s].parent = static_cast<std::uint32_t>(s);
      shells[s].solid = static_cast<std::uint32_t>(solid_count++);
    }
  }
  for (Shell& shell : shells) {
    shell.solid = shells[shell.parent].solid;
  }
  mesh.steps.push_back(inside_out);
  return shells;
}

}  // namespace haptic::tools
