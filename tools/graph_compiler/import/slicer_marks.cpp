// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/import/slicer_marks.hpp"

#include <algorithm>

#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

using tinyxml2::XMLElement;

struct Kind {
  std::string_view name;  ///< in the settings
  const char* words;
  bool is_hole;
};

constexpr Kind kPrusaKinds[] = {{"ParameterModifier", "a modifier of PrusaSlicer", false},
                                {"SupportBlocker", "a support blocker of PrusaSlicer", false},
                                {"SupportEnforcer", "a support enforcer of PrusaSlicer", false},
                                {"NegativeVolume", "a negative volume of PrusaSlicer", true}};
constexpr Kind kBambuKinds[] = {{"modifier_part", "a modifier of the slicer", false},
                                {"support_blocker", "a support blocker of the slicer", false},
                                {"support_enforcer", "a support enforcer of the slicer", false},
                                {"negative_part", "a negative part of the slicer", true}};
constexpr Kind kCuraKinds[] = {{"support_mesh", "a support mesh of Cura", false},
                               {"anti_overhang_mesh", "a support blocker of Cura", false},
                               {"infill_mesh", "a modifier of Cura", false},
                               {"cutting_mesh", "a modifier of Cura", false}};

template <std::size_t kCount>
std::optional<SlicerMark> mark_of(const Kind (&kinds)[kCount], std::string_view name) {
  for (const Kind& kind : kinds) {
    if (kind.name == name) return SlicerMark{kind.words, kind.is_hole};
  }
  return std::nullopt;
}

/// A part of the archive with settings, where it has such.
class Settings {
 public:
  Settings(ThreemfPackage& package, const char* name, const std::string& file)
      : file_(file + ": " + name) {
    text_ = package.part(name);
    if (!text_) return;
    root_ = &parse_xml(document_, *text_, "config", file_);
  }

  [[nodiscard]] const XMLElement* first_object() const {
    return root_ != nullptr ? root_->FirstChildElement("object") : nullptr;
  }
  [[nodiscard]] std::size_t index(const XMLElement& at, const char* name) const {
    const std::int64_t value = parse_integer(attribute(at, name), file_, line_of(at), name);
    if (value < 0) {
      refuse_line(file_, line_of(at), std::string(name) + " is negative", "save the project again");
    }
    return static_cast<std::size_t>(value);
  }

 private:
  std::string file_;
  std::optional<std::string> text_;
  tinyxml2::XMLDocument document_;
  const XMLElement* root_ = nullptr;
};

/// Name of an object or a part in the settings; empty if they have none.
std::string name_in(const XMLElement& settings) {
  for (const auto* m = settings.FirstChildElement("metadata"); m != nullptr;
       m = m->NextSiblingElement("metadata")) {
    if (attribute(*m, "key") == "name") return attribute(*m, "value");
  }
  return {};
}

std::optional<SlicerMark> mark_of_volume(const XMLElement& volume) {
  for (const auto* m = volume.FirstChildElement("metadata"); m != nullptr;
       m = m->NextSiblingElement("metadata")) {
    const std::string key = attribute(*m, "key"), value = attribute(*m, "value");
    // Slic3r and the first PrusaSlicers knew no other kinds.
    if (key == "modifier" && value == "1") return mark_of(kPrusaKinds, "ParameterModifier");
    if (key == "volume_type") return mark_of(kPrusaKinds, value);
  }
  return std::nullopt;
}

}  // namespace

SlicerMarks read_slicer_marks(ThreemfPackage& package, const std::string& file) {
  SlicerMarks marks;
  const Settings prusa(package, "Metadata/Slic3r_PE_model.config", file);
  for (const auto* o = prusa.first_object(); o != nullptr; o = o->NextSiblingElement("object")) {
    marks.names[attribute(*o, "id")] = name_in(*o);
    std::vector<MarkedTriangles> marked;
    for (const auto* v = o->FirstChildElement("volume"); v != nullptr;
         v = v->NextSiblingElement("volume")) {
      if (const auto mark = mark_of_volume(*v)) {
        marked.push_back(
            {prusa.index(*v, "firstid"), prusa.index(*v, "lastid"), line_of(*v), *mark});
      }
    }
    std::ranges::sort(marked, {}, &MarkedTriangles::first);
    if (!marked.empty()) marks.triangles[attribute(*o, "id")] = std::move(marked);
  }
  const Settings bambu(package, "Metadata/model_settings.config", file);
  for (const auto* o = bambu.first_object(); o != nullptr; o = o->NextSiblingElement("object")) {
    marks.names[attribute(*o, "id")] = name_in(*o);
    for (const auto* p = o->FirstChildElement("part"); p != nullptr;
         p = p->NextSiblingElement("part")) {
      marks.component_names[{attribute(*o, "id"), attribute(*p, "id")}] = name_in(*p);
      if (auto mark = mark_of(kBambuKinds, attribute(*p, "subtype"))) {
        marks.components[{attribute(*o, "id"), attribute(*p, "id")}] = std::move(*mark);
      }
    }
  }
  return marks;
}

std::optional<SlicerMark> mark_of_cura(const XMLElement& object) {
  for (const auto* group = object.FirstChildElement(); group != nullptr;
       group = group->NextSiblingElement()) {
    const std::string_view name = group->Name();
    if (!name.ends_with("metadatagroup") && !name.ends_with("settings")) continue;
    for (const auto* m = group->FirstChildElement(); m != nullptr; m = m->NextSiblingElement()) {
      // "cura:support_mesh", and in older files a key "support_mesh".
      std::string key = attribute(*m, "name");
      if (key.empty()) key = attribute(*m, "key");
      key.erase(0, key.find(':') + 1);
      const char* text = m->GetText();
      const std::string_view value = text != nullptr ? text : "";
      if (value != "True" && value != "true") continue;
      if (auto mark = mark_of(kCuraKinds, key)) return mark;
    }
  }
  return std::nullopt;
}

}  // namespace haptic::tools
