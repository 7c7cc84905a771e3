// SPDX-License-Identifier: Apache-2.0
// Round and prismatic parts that go along their axis: shafts, pegs, sockets, gears, threads.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/strangers/families.hpp"

namespace haptic::sim {
namespace {

using std::numbers::pi;

std::uint32_t one_of(Seeded& random, std::initializer_list<std::uint32_t> values) {
  return values.begin()[random.below(static_cast<std::uint32_t>(values.size()))];
}

Outline round(double radius_mm, double chord_mm, PlanePoint at = {0, 0}) {
  return circle_outline(radius_mm, facets_of(radius_mm, chord_mm), at);
}

/// A circle with `count` lobes of parallel sides, `width_mm` wide, out to `reach_mm` or in to it.
Outline lobed(double radius_mm, double reach_mm, double width_mm, std::uint32_t count,
              double phase_rad, double chord_mm) {
  const double half = std::asin(width_mm / 2 / radius_mm), pitch = 2 * pi / count;
  const std::uint32_t chords = std::max(
      1u,
      static_cast<std::uint32_t>(facets_of(radius_mm, chord_mm) * (pitch - 2 * half) / (2 * pi)));
  Outline outline;
  for (std::uint32_t k = 0; k < count; ++k) {
    const double middle = phase_rad + k * pitch;
    for (const double side : {-1.0, 1.0}) {
      const double x = std::sqrt(reach_mm * reach_mm - width_mm * width_mm / 4),
                   y = side * width_mm / 2;
      outline.push_back({x * std::cos(middle) - y * std::sin(middle),
                         x * std::sin(middle) + y * std::cos(middle)});
    }
    append_arc(outline, radius_mm, middle + half, middle + pitch - half, chords);
  }
  return outline;
}

/// An outline with a chamfered end that goes into a bore of the same outline.
StrangerPair shaft_in_bore(Seeded& random, double clearance_mm, const Outline& outline,
                           double radius_mm) {
  const double depth = radius_mm * random.uniform(1.2, 2.2), chamfer = random.uniform(0.2, 0.6);
  StrangerPair pair;
  pair.depth_mm = depth;
  pair.moving = chamfered_peg(outline, depth + 6, chamfer);
  pair.fixed = {bored_block(grown_outline(outline, clearance_mm), round(2 * radius_mm, 0.05), depth,
                            chamfer, 0)};
  return pair;
}

}  // namespace

StrangerPair draw_keyed_shaft(Seeded& random, double clearance_mm) {
  const double radius = random.uniform(4, 10), chord = random.uniform(0.01, 0.06);
  const double width = radius * random.uniform(0.4, 0.6),
               reach = radius * random.uniform(1.2, 1.35);
  return shaft_in_bore(random, clearance_mm, lobed(radius, reach, width, 1, 0.3, chord), radius);
}

StrangerPair draw_splined_shaft(Seeded& random, double clearance_mm) {
  const std::uint32_t count = one_of(random, {6, 8, 10, 12});
  const double radius = random.uniform(5, 10), chord = random.uniform(0.01, 0.05);
  const double width = pi * radius / count * random.uniform(0.9, 1.1);
  return shaft_in_bore(random, clearance_mm, lobed(radius, 1.18 * radius, width, count, 0, chord),
                       radius);
}

StrangerPair draw_stepped_shaft(Seeded& random, double clearance_mm) {
  const double first = random.uniform(3, 5), second = first + random.uniform(1, 2),
               third = second + random.uniform(1, 3);
  const double low = random.uniform(5, 9), high = low + random.uniform(4, 8), chamfer = 0.4;
  const std::uint32_t facets = facets_of(third, random.uniform(0.01, 0.05));
  const auto shaft = [&](double radius) { return circle_outline(radius, facets); };
  const auto bore = [&](double radius) { return grown_outline(shaft(radius), clearance_mm); };
  StrangerPair pair;
  pair.moving = layered_mesh({{0, chamfer, {shaft(first - chamfer)}, {shaft(first)}},
                              straight(chamfer, low, {shaft(first)}),
                              straight(low, high, {shaft(second)}),
                              straight(high, high + 6, {shaft(third)})});
  const Outline outside = rectangle_outline(5 * third, 4 * third);
  pair.fixed = {layered_mesh({straight(0, low, {outside, bore(first)}),
                              straight(low, high - chamfer, {outside, bore(second)}),
                              {high - chamfer,
                               high,
                               {outside, bore(second)},
                               {outside, grown_outline(bore(second), chamfer)}}})};
  pair.depth_mm = high;
  return pair;
}

StrangerPair draw_hex_socket(Seeded& random, double clearance_mm) {
  const double across = one_of(random, {7, 8, 10, 13, 17}), height = 0.7 * across;
  const Outline hexagon = flats_outline(6, across);
  const Outline flange = round(across, 0.05),
                outside = round(0.85 * across, random.uniform(0.02, 0.08));
  StrangerPair pair;
  pair.fixed = {layered_mesh({straight(-6, 0, {flange}),
                              straight(0, height - 0.6, {hexagon}),
                              {height - 0.6, height, {hexagon}, {grown_outline(hexagon, -1.2)}}})};
  Outline bore = flats_outline(6, across + 2 * clearance_mm);
  if (random.below(2) == 1) {
    // Two hexagons, one turned by 30 degrees: twelve points.
    const double corner = (across / 2 + clearance_mm) / std::cos(pi / 6);
    const double notch = (across / 2 + clearance_mm) / std::cos(pi / 12);
    bore.clear();
    for (std::uint32_t k = 0; k < 24; ++k) {
      const double radius = k % 2 == 0 ? corner : notch, angle = k * pi / 12;
      bore.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    }
    bore = moved_outline(bore, {0, 0}, pi / 6);
  }
  const double top = height + clearance_mm;
  pair.moving = layered_mesh({{0.4, 0.8, {outside, grown_outline(bore, 0.3)}, {outside, bore}},
                              straight(0.8, top, {outside, bore}),
                              straight(top, top + 8, {outside})});
  pair.depth_mm = height;
  return pair;
}

StrangerPair draw_hex_key(Seeded& random, double clearance_mm) {
  const double across = one_of(random, {4, 5, 6, 8}), depth = 0.8 * across;
  const Outline hexagon = flats_outline(6, across);
  StrangerPair pair;
  // The short arm, and the long one across it in the same file.
  const double high = depth + 15;
  pair.moving =
      chamfered_peg(hexagon, high, 0.3) + block_mesh({-across / 2, -across / 2, high - 0.5},
                                                     {6 * across, across / 2, high - 0.5 + across});
  const Outline head = round(across, random.uniform(0.02, 0.06));
  pair.fixed = {bored_block(grown_outline(hexagon, clearance_mm), head, depth, 0.3, 4) +
                block_mesh({-30, -30, -9}, {30, 30, -4})};
  pair.depth_mm = depth;
  return pair;
}

StrangerPair draw_ring_on_post(Seeded& random, double clearance_mm) {
  const double radius = random.uniform(3, 8), height = random.uniform(6, 15),
               chord = random.uniform(0.01, 0.05);
  const double thick = random.uniform(3, 6), chamfer = random.uniform(0.3, 0.8);
  const Outline post = round(radius, chord), bore = grown_outline(post, clearance_mm);
  const Outline ring = circle_outline(1.7 * radius, static_cast<std::uint32_t>(post.size()));
  StrangerPair pair;
  pair.fixed = {
      layered_mesh({straight(-5, 0, {rectangle_outline(6 * radius, 5 * radius)}),
                    straight(0, height - chamfer, {post}),
                    {height - chamfer, height, {post}, {grown_outline(post, -chamfer)}}})};
  pair.moving = layered_mesh({{0, 0.3, {ring, grown_outline(bore, 0.3)}, {ring, bore}},
                              straight(0.3, thick, {ring, bore})});
  pair.depth_mm = height;
  return pair;
}

StrangerPair draw_filleted_peg(Seeded& random, double clearance_mm) {
  const double width = random.uniform(10, 20), height = random.uniform(8, 14),
               depth = random.uniform(8, 16);
  const double fillet = random.uniform(0.8, 2), corner = random.uniform(2.2, 3.5);
  const std::uint32_t chords = one_of(random, {3, 4, 6}), facets = one_of(random, {4, 6, 8});
  const Outline peg = rounded_outline(width, height, corner, facets);
  const Outline bore = grown_outline(peg, clearance_mm);
  const Outline outside = rounded_outline(width + 16, height + 16, 5, 4);
  StrangerPair pair;
  pair.moving = layered_mesh(filleted_layers(peg, 0, depth + 6, fillet, chords, true, true));
  std::vector<Layer> block{straight(-4, 0, {outside})};
  // The rim of the bore is rounded: the bore grows like a peg that is rounded inside out.
  block.push_back(straight(0, depth - 1, {outside, bore}));
  Outline last = bore;
  double low = depth - 1;
  for (std::uint32_t k = 1; k <= chords; ++k) {
    const double angle = pi / 2 * k / chords;
    const Outline next = grown_outline(bore, 1 - std::cos(angle));
    const double high = depth - 1 + std::sin(angle);
    block.push_back({low, high, {outside, last}, {outside, next}});
    last = next;
    low = high;
  }
  pair.fixed = {layered_mesh(block)};
  pair.depth_mm = depth;
  return pair;
}

StrangerPair draw_taper_plug(Seeded& random, double clearance_mm) {
  const double radius = random.uniform(4, 8), depth = random.uniform(8, 15),
               slope = random.uniform(0.08, 0.25);
  const std::uint32_t facets = facets_of(radius, random.uniform(0.01, 0.05));
  const auto outline = [&](double r) { return circle_outline(r, facets); };
  const double wide = radius + slope * depth;
  StrangerPair pair;
  pair.moving = layered_mesh({{0, depth, {outline(radius)}, {outline(wide)}},
                              straight(depth, depth + 8, {outline(wide)})});
  const Outline outside = outline(2 * wide);
  pair.fixed = {layered_mesh({straight(-4, -1, {outside}),
                              straight(-1, 0, {outside, outline(radius + clearance_mm)}),
                              {0,
                               depth,
                               {outside, outline(radius + clearance_mm)},
                               {outside, outline(wide + clearance_mm)}}})};
  pair.depth_mm = depth;
  return pair;
}

StrangerPair draw_hinge_pin(Seeded& random, double clearance_mm) {
  const double radius = random.uniform(1.5, 3), knuckle = random.uniform(8, 14), outer = radius + 2;
  const std::uint32_t facets = facets_of(radius, random.uniform(0.01, 0.03));
  const Outline pin = circle_outline(radius, facets), bore = grown_outline(pin, clearance_mm);
  const Outline shell = round(outer, 0.03);
  constexpr double kGap = 0.1;
  StrangerPair pair;
  pair.moving = layered_mesh({{-1, 0, {grown_outline(pin, -0.5)}, {pin}},
                              straight(0, 3 * knuckle, {pin}),
                              straight(3 * knuckle, 3 * knuckle + 2, {grown_outline(pin, 1.5)})});
  const auto leaf = [&](double low, double high, double side) {
    const double near = outer - 0.3, far = 25;
    return prism_of(low, high, {shell, bore}) +
           block_mesh({side > 0 ? near : -far, -1, low}, {side > 0 ? far : -near, 1, high});
  };
  pair.fixed = {leaf(0, knuckle - kGap, 1) + leaf(2 * knuckle + kGap, 3 * knuckle, 1),
                leaf(knuckle + kGap, 2 * knuckle - kGap, -1)};
  pair.depth_mm = 3 * knuckle;
  return pair;
}

StrangerPair draw_gear_pair(Seeded& random, double clearance_mm) {
  const double module = 0.5 * one_of(random, {2, 3, 4}), width = random.uniform(5, 10);
  const std::uint32_t small = one_of(random, {12, 14, 16}), large = one_of(random, {18, 20, 24});
  const double apart = module * (small + large) / 2;
  // The moving one about the origin; its hand turns about it.
  const Outline wheel = moved_outline(gear_outline(large, module, clearance_mm, 4), {-apart, 0});
  const Outline hole = circle_outline(4 * module, 24, {-apart, 0});
  const Outline pinion =
      moved_outline(gear_outline(small, module, clearance_mm, 4), {0, 0}, pi + pi / small);
  StrangerPair pair;
  pair.moving = layered_mesh(
      {straight(0, width, {pinion}), straight(width, width + 8, {circle_outline(3 * module, 20)})});
  pair.fixed = {prism_of(0, width, {wheel, hole}),
                block_mesh({-apart - 5, -0.7 * module * large, -3},
                           {module * small, 0.7 * module * large, 0})};
  pair.depth_mm = width;
  return pair;
}

StrangerPair draw_bayonet(Seeded& random, double clearance_mm) {
  const double radius = random.uniform(5, 9), reach = radius + random.uniform(1.5, 2.5);
  const double width = random.uniform(2.5, 4), lug = random.uniform(2, 3),
               rim = random.uniform(3, 5);
  const double chord = random.uniform(0.02, 0.06), turn = random.uniform(0.7, 1.1);
  const std::uint32_t count = one_of(random, {2, 3});
  StrangerPair pair;
  pair.moving = layered_mesh({straight(0, lug, {lobed(radius, reach, width, count, 0, chord)}),
                              straight(lug, lug + rim + 8, {round(radius - 0.3, chord)})});
  // Below the rim the lugs can turn; its slots are where they come in.
  const double roof = lug + std::max(clearance_mm, 0.05), wide = reach + 0.5 + clearance_mm;
  const Outline outside = round(wide + 3, 0.05);
  const Outline slots =
      grown_outline(lobed(radius, reach, width, count, turn, chord), clearance_mm);
  pair.fixed = {
      layered_mesh({straight(-3, 0, {outside}), straight(0, roof, {outside, round(wide, chord)}),
                    straight(roof, roof + rim, {outside, slots})})};
  pair.depth_mm = roof + rim;
  pair.turn_rad = -turn;  // about the way, which looks down
  pair.turns = {WayPose{}};
  pair.beyond_mm = 2;
  return pair;
}

StrangerPair draw_thread_start(Seeded& random, double clearance_mm) {
  const double diameter = one_of(random, {10, 12, 16}),
               pitch = diameter > 12 ? 2 : 0.25 * (diameter > 10 ? 7 : 6);
  const std::uint32_t segments = one_of(random, {24, 32, 48});
  tools::ThreadShape rod;
  rod.diameter_m = 1e-3 * diameter;
  rod.pitch_m = 1e-3 * pitch;
  rod.turns = 6;
  rod.segments = segments;
  tools::ThreadShape nut = rod;
  nut.turns = 3;
  nut.internal = true;
  nut.outer_radius_m = 0.8 * rod.diameter_m;
  nut.clearance_m = 1e-3 * clearance_mm;
  StrangerPair pair;
  // Half the nut is over the rod where it is home.
  pair.moving = placed_mesh(shape_drawn(nut), Rotation::Identity(), {0, 0, 3 * pitch});
  pair.fixed = {shape_drawn(rod)};
  constexpr double kTurns = 1.75, kStep = 0.25;
  pair.depth_mm = kTurns * pitch;
  pair.turn_rad = -2 * pi * kTurns;  // right-hand: up and to the left
  for (double left = kTurns; left >= 0; left -= kStep) {
    WayPose at;
    at.to_go_mm = left * pitch;
    at.turn_rad = -2 * pi * left;
    pair.turns.push_back(at);
  }
  pair.beyond_mm = 1;
  return pair;
}

StrangerPair shaft_of_facets(std::uint32_t facets, double clearance_mm) {
  constexpr double kRadius = 8, kDepth = 12, kChamfer = 0.4;
  const Outline shaft = circle_outline(kRadius, facets);
  StrangerPair pair;
  pair.depth_mm = kDepth;
  pair.moving = chamfered_peg(shaft, kDepth + 6, kChamfer);
  pair.fixed = {bored_block(grown_outline(shaft, clearance_mm), rectangle_outline(32, 32), kDepth,
                            kChamfer, 0)};
  return pair;
}

StrangerPair shaft_of_splines(std::uint32_t splines, double clearance_mm) {
  constexpr double kDepth = 12, kChamfer = 0.4;
  const double radius = std::max(10.0, 0.5 * splines), width = pi * radius / splines;
  const Outline shaft = lobed(radius, radius + 1.5, width, splines, 0, 0.05);
  StrangerPair pair;
  pair.depth_mm = kDepth;
  pair.moving = chamfered_peg(shaft, kDepth + 6, kChamfer);
  pair.fixed = {bored_block(grown_outline(shaft, clearance_mm),
                            rectangle_outline(4 * radius, 4 * radius), kDepth, kChamfer, 0)};
  return pair;
}

}  // namespace haptic::sim
