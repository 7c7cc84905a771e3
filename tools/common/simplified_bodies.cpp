// SPDX-License-Identifier: Apache-2.0
#include "tools/common/simplified_bodies.hpp"

#include <cstdio>
#include <mutex>
#include <set>
#include <utility>

#include "tools/common/formatted.hpp"

namespace haptic::tools {

std::vector<std::string> simplification_texts(const SceneView& view) {
  std::vector<std::string> texts;
  for (const SimplifiedBody& s : view.simplified_bodies()) {
    const BodyRecord& body = view.bodies()[s.body];
    const std::string name(view.text(body.name_offset, body.name_bytes));
    std::string text =
        formatted("'%s' was simplified: the surface is up to %.3g m from that of the mesh",
                  name.c_str(), s.distance_m);
    if (body.volume_m3 > 0) {
      text += formatted(", the volume changed by %+.3g %% (%+.3g m3)",
                        100.0 * s.volume_change_m3 / (body.volume_m3 - s.volume_change_m3),
                        s.volume_change_m3);
    }
    texts.push_back(std::move(text));
  }
  return texts;
}

void tell_simplification(const std::string& program, const std::string& scene,
                         const SceneView& view) {
  static std::mutex mutex;
  static std::set<std::string> told;
  const std::lock_guard lock(mutex);
  if (!told.insert(scene).second) return;
  for (const std::string& text : simplification_texts(view)) {
    std::fprintf(stderr, "%s: warning: %s: %s\n", program.c_str(), scene.c_str(), text.c_str());
  }
}

}  // namespace haptic::tools
