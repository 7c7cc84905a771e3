// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/program/shape_table.hpp"

#include <algorithm>
#include <limits>

#include "tools/graph_compiler/shapes/fasteners.hpp"

namespace haptic::tools {
namespace {

constexpr Range kDimension{0.0, std::numeric_limits<double>::infinity(), true};
constexpr Range kGap{0.0, std::numeric_limits<double>::infinity()};
/// Length of a bolt without one, in diameters.
constexpr double kBoltLength = 4.0;
constexpr std::string_view kDefaultFit = "6H/6g";

double dimension(const TomlTable& t, std::string_view key) {
  const auto value = t.number(key, kDimension);
  if (!value) t.fail_missing(key, "give it in metres");
  return *value;
}

std::uint32_t count(const TomlTable& t, std::string_view key, std::uint32_t least) {
  const auto value = t.integer(key);
  if (!value) return kDefaultSegments;
  if (*value < least || *value > kMaxSegments) {
    t.fail(key, "is " + std::to_string(*value) + "; give a whole number from " +
                    std::to_string(least) + " to " + std::to_string(kMaxSegments));
  }
  return static_cast<std::uint32_t>(*value);
}

std::uint32_t segments(const TomlTable& t) { return count(t, "segments", 3); }

std::string words_text(const std::vector<std::string_view>& words) {
  std::string text;
  for (const std::string_view word : words) text += (text.empty() ? "" : ", ") + std::string(word);
  return text;
}

/// Refuses a word that is not in `known`, with the nearest one.
[[noreturn]] void fail_word(const TomlTable& t, std::string_view key, const std::string& word,
                            const std::vector<std::string_view>& known) {
  const std::string nearest = nearest_word(word, known);
  t.fail(key, "no " + std::string(key) + " '" + word + "'; " +
                  (nearest.empty() ? "give one of " + words_text(known)
                                   : "did you mean '" + nearest + "'?"));
}

/// Nothing where the key is absent.
const FastenerSize* size_of(const TomlTable& t) {
  const auto name = t.text("size");
  if (!name) return nullptr;
  const FastenerSize* size = fastener_size(*name);
  if (size != nullptr) return size;
  std::vector<std::string_view> known;
  for (const FastenerSize& s : fastener_sizes()) known.push_back(s.name);
  t.fail("size", "no size '" + *name + "'; give one of " + words_text(known));
}

double clearance(const TomlTable& t, bool internal, double pitch_m) {
  const auto given = t.number("clearance_m", kGap);
  const auto fit = t.text("fit");
  if (given && fit) t.fail("clearance_m", "fit is given too; keep one of the two");
  if (given) return *given;
  const auto allowed = fit_clearance_m(fit ? *fit : kDefaultFit, internal, pitch_m);
  if (!allowed) {
    t.fail("fit", "is '" + *fit + "'; give a class of ISO 965-1 for this " +
                      (internal ? "internal" : "external") + " thread, such as \"" +
                      (internal ? "6H" : "6g") + "\" (" + (internal ? "G or H" : "e, f, g or h") +
                      "), or clearance_m");
  }
  return *allowed;
}

ThreadShape read_thread(const TomlTable& t) {
  ThreadShape s;
  s.internal = t.flag("internal").value_or(false);
  if (const FastenerSize* size = size_of(t)) {
    for (const char* key : {"diameter_m", "pitch_m"}) {
      if (t.has(key)) t.fail(key, "size is given too, which has it; keep one of the two");
    }
    s.diameter_m = size->diameter_m;
    s.pitch_m = size->pitch_m;
  } else {
    s.diameter_m = dimension(t, "diameter_m");
    s.pitch_m = dimension(t, "pitch_m");
  }
  s.turns = dimension(t, "turns");
  if (s.internal) {
    s.outer_radius_m = dimension(t, "outer_radius_m");
  } else if (t.has("outer_radius_m")) {
    t.fail("outer_radius_m",
           "belongs to an internal thread; leave it out, or give internal = true");
  }
  s.clearance_m = clearance(t, s.internal, s.pitch_m);
  s.segments = segments(t);
  return s;
}

const FastenerSize& needed_size(const TomlTable& t) {
  const FastenerSize* size = size_of(t);
  if (size == nullptr) t.fail_missing("size", "give one from \"M3\" to \"M20\"");
  return *size;
}

BoltShape read_bolt(const TomlTable& t) {
  const FastenerSize& size = needed_size(t);
  return {size.diameter_m,
          size.pitch_m,
          size.width_across_flats_m,
          size.head_height_m,
          t.number("length_m", kDimension).value_or(kBoltLength * size.diameter_m),
          clearance(t, false, size.pitch_m),
          segments(t)};
}

NutShape read_nut(const TomlTable& t) {
  const FastenerSize& size = needed_size(t);
  return {size.diameter_m,
          size.pitch_m,
          size.width_across_flats_m,
          size.nut_height_m,
          clearance(t, true, size.pitch_m),
          segments(t)};
}

BoxShape read_box(const TomlTable& t) {
  const auto size = t.vector3("size_m", kDimension);
  if (!size) t.fail_missing("size_m", "give the lengths along x, y and z in metres");
  return {*size};
}

PrismShape read_prism(const TomlTable& t) {
  if (!t.has("sides")) t.fail_missing("sides", "give the number of sides, from 3");
  return {dimension(t, "radius_m"), dimension(t, "height_m"), count(t, "sides", 3)};
}

/// A word of the scene file with the keys that belong to it.
struct ShapeWord {
  std::vector<std::string_view> keys;
  Shape (*read)(const TomlTable&);
};

/// In the order of shape_words().
const std::vector<ShapeWord>& words() {
  using T = TomlTable;
  static const std::vector<ShapeWord> kWords{
      {{"size_m"}, [](const T& t) -> Shape { return read_box(t); }},
      {{"radius_m", "height_m", "sides"}, [](const T& t) -> Shape { return read_prism(t); }},
      {{"radius_m", "height_m", "segments"},
       [](const T& t) -> Shape {
         return CylinderShape{dimension(t, "radius_m"), dimension(t, "height_m"), segments(t)};
       }},
      {{"radius_m", "height_m", "segments"},
       [](const T& t) -> Shape {
         return ConeShape{dimension(t, "radius_m"), dimension(t, "height_m"), segments(t)};
       }},
      {{"radius_m", "segments"},
       [](const T& t) -> Shape {
         return SphereShape{dimension(t, "radius_m"), segments(t)};
       }},
      {{"radius_m", "height_m", "segments"},
       [](const T& t) -> Shape {
         return CapsuleShape{dimension(t, "radius_m"), dimension(t, "height_m"), segments(t)};
       }},
      {{"inner_radius_m", "outer_radius_m", "height_m", "segments"},
       [](const T& t) -> Shape {
         return TubeShape{dimension(t, "inner_radius_m"), dimension(t, "outer_radius_m"),
                          dimension(t, "height_m"), segments(t)};
       }},
      {{"size", "diameter_m", "pitch_m", "turns", "internal", "outer_radius_m", "fit",
        "clearance_m", "segments"},
       [](const T& t) -> Shape { return read_thread(t); }},
      {{"size", "fit", "clearance_m", "segments"}, [](const T& t) -> Shape { return read_nut(t); }},
      {{"size", "length_m", "fit", "clearance_m", "segments"},
       [](const T& t) -> Shape { return read_bolt(t); }}};
  return kWords;
}

}  // namespace

const std::vector<std::string_view>& shape_keys() {
  static const std::vector<std::string_view> kKeys = [] {
    std::vector<std::string_view> keys{"shape"};
    for (const ShapeWord& word : words()) {
      for (const std::string_view key : word.keys) {
        if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
      }
    }
    return keys;
  }();
  return kKeys;
}

Shape read_shape(const TomlTable& table) {
  const std::string word = *table.text("shape");
  const auto& known = shape_words();
  const auto at = std::ranges::find(known, word);
  if (at == known.end()) fail_word(table, "shape", word, known);
  const ShapeWord& kind = words()[static_cast<std::size_t>(at - known.begin())];
  for (const std::string_view key : shape_keys()) {
    if (key == "shape" || !table.has(key) || std::ranges::find(kind.keys, key) != kind.keys.end())
      continue;
    table.fail(key, "is no key of shape = \"" + word + "\", which has " + words_text(kind.keys) +
                        "; leave it out");
  }
  const Shape shape = kind.read(table);
  if (const auto defect = defect_of(shape)) table.fail(defect->key, defect->text);
  return shape;
}

}  // namespace haptic::tools
