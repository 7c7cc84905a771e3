// SPDX-License-Identifier: Apache-2.0
// Plates on pins, parts on rails and in slots, fixtures, nests, and a scan.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/lab/strangers/families.hpp"

namespace haptic::sim {
namespace {

using std::numbers::pi;

/// Places of `columns` by `rows` about the origin.
std::vector<PlanePoint> grid(std::uint32_t columns, std::uint32_t rows, double pitch_mm) {
  std::vector<PlanePoint> places;
  for (std::uint32_t i = 0; i < columns; ++i) {
    for (std::uint32_t j = 0; j < rows; ++j) {
      places.push_back({pitch_mm * (i - (columns - 1) / 2.0), pitch_mm * (j - (rows - 1) / 2.0)});
    }
  }
  return places;
}

/// The same outline at every place.
Outlines at_places(const Outline& outline, const std::vector<PlanePoint>& places) {
  Outlines outlines;
  for (const PlanePoint& place : places) outlines.push_back(moved_outline(outline, place));
  return outlines;
}

Outlines with(const Outline& outside, Outlines holes) {
  holes.insert(holes.begin(), outside);
  return holes;
}

/// A plate with chamfered holes over a base with pins that are chamfered above.
StrangerPair plate_on_pins(const Outline& plate, double thick_mm, const Outline& pin,
                           const std::vector<PlanePoint>& places, double clearance_mm,
                           double chamfer_mm) {
  const Outline hole = grown_outline(pin, clearance_mm);
  const Outlines pins = at_places(pin, places), holes = at_places(hole, places);
  StrangerPair pair;
  pair.fixed = {layered_mesh({straight(-8, 0, {plate}),
                              straight(0, thick_mm + 1, pins),
                              {thick_mm + 1, thick_mm + 1 + chamfer_mm, pins,
                               at_places(grown_outline(pin, -chamfer_mm), places)}})};
  pair.moving = layered_mesh(
      {{0, 0.3, with(plate, at_places(grown_outline(hole, 0.3), places)), with(plate, holes)},
       straight(0.3, thick_mm, with(plate, holes))});
  pair.depth_mm = thick_mm + 1 + chamfer_mm;
  return pair;
}

/// The right half of a section, from below to above, and its mirror image.
Outline whole_section(const Outline& right) {
  Outline outline = right;
  for (auto p = right.rbegin(); p != right.rend(); ++p) outline.push_back({-(*p)[0], (*p)[1]});
  return outline;
}

}  // namespace

StrangerPair draw_dowel_plate(Seeded& random, double clearance_mm) {
  const double width = random.uniform(40, 80), height = random.uniform(30, 50),
               thick = random.uniform(5, 10);
  const double radius = random.uniform(2, 4), x = 0.35 * width, y = 0.3 * height;
  const std::uint32_t facets = facets_of(radius, random.uniform(0.01, 0.03));
  std::vector<PlanePoint> places{{-x, -y}, {x, y}, {x, -y}, {-x, y}};
  places.resize(2 + random.below(3));
  return plate_on_pins(rounded_outline(width, height, 4, 6), thick, circle_outline(radius, facets),
                       places, clearance_mm, 0.6);
}

StrangerPair draw_pin_plate(Seeded& random, double clearance_mm) {
  const std::uint32_t columns = 3 + random.below(3), rows = 3 + random.below(2);
  const double pitch = random.uniform(8, 12), radius = random.uniform(1.2, 2.2);
  const Outline pin = circle_outline(radius, 4 * (2 + random.below(3)));
  return plate_on_pins(rectangle_outline(pitch * (columns + 1), pitch * (rows + 1)),
                       random.uniform(3, 6), pin, grid(columns, rows, pitch), clearance_mm, 0.4);
}

StrangerPair connector_of_pins(std::uint32_t pins, double clearance_mm) {
  constexpr double kPitch = 2.54, kPin = 0.64, kLength = 6;
  const std::uint32_t columns = pins / 2;
  const auto places = grid(columns, 2, kPitch);
  const auto squares = [&](double side) {
    return at_places(rectangle_outline(side, side), places);
  };
  const Outline header = rectangle_outline(columns * kPitch, 2 * kPitch);
  const Outline housing = grown_outline(header, 0.5);
  StrangerPair pair;
  pair.moving = layered_mesh({{0, 0.4, squares(0.4 * kPin), squares(kPin)},
                              straight(0.4, kLength, squares(kPin)),
                              straight(kLength, kLength + 2.5, {header})});
  const Outlines holes = with(housing, squares(kPin + 2 * clearance_mm));
  const Outlines rims = with(housing, squares(kPin + 2 * clearance_mm + 0.5));
  pair.fixed = {layered_mesh({straight(-2, -0.1, {housing}),
                              straight(-0.1, kLength - 0.5, holes),
                              {kLength - 0.5, kLength, holes, rims}})};
  pair.depth_mm = kLength;
  return pair;
}

StrangerPair draw_connector(Seeded& random, double clearance_mm) {
  return connector_of_pins(10 + 2 * random.below(6), clearance_mm);
}

StrangerPair draw_card_slot(Seeded& random, double clearance_mm) {
  constexpr double kThick = 1.6;
  const double width = random.uniform(30, 60), depth = random.uniform(5, 8),
               notch = random.uniform(1.5, 2.5);
  const double at = width * random.uniform(0.1, 0.3);
  // Drawn lying: x along the slot, y up, z through the card.
  const double tall = depth + random.uniform(10, 25);
  const Outline card{{-width / 2, 0.5},       {-width / 2 + 0.5, 0},   {at - notch, 0},
                     {at - notch, depth + 1}, {at + notch, depth + 1}, {at + notch, 0},
                     {width / 2 - 0.5, 0},    {width / 2, 0.5},        {width / 2, tall},
                     {-width / 2, tall}};
  StrangerPair pair;
  const Rotation up(Eigen::AngleAxisd(pi / 2, Vector::UnitX()));
  pair.moving = placed_mesh(prism_of(-kThick / 2, kThick / 2, {card}), up, Vector::Zero());
  const double c = clearance_mm;
  const Outline slot = rectangle_outline(width + 2 * c, kThick + 2 * c);
  const Outline housing = rectangle_outline(width + 8, kThick + 6);
  const double key = notch - c;  // half, in the notch
  pair.fixed = {
      layered_mesh({straight(-3, 0, {housing}),
                    straight(0, depth - 0.4, {housing, slot}),
                    {depth - 0.4, depth, {housing, slot}, {housing, grown_outline(slot, 0.4)}}}) +
      block_mesh({at - key, -kThick / 2 - c - 0.5, -0.5},
                 {at + key, kThick / 2 + c + 0.5, depth - 0.5})};
  pair.depth_mm = depth;
  return pair;
}

StrangerPair draw_t_slot(Seeded& random, double clearance_mm) {
  const double neck = random.uniform(2.5, 3.2), wide = random.uniform(5, 6),
               lip = random.uniform(1.5, 2), high = random.uniform(3.5, 5);
  const double c = clearance_mm;
  constexpr double kLength = 40, kNut = 12;
  // Sections with the axis upwards in the plane; they are extruded along z and then laid down.
  const Outline rail{{-10, -12},
                     {10, -12},
                     {10, 0},
                     {neck, 0},
                     {neck, -lip},
                     {wide, -lip},
                     {wide, -lip - high},
                     {-wide, -lip - high},
                     {-wide, -lip},
                     {-neck, -lip},
                     {-neck, 0},
                     {-10, 0}};
  const Outline nut = whole_section(
      {{wide - c, -lip - high + c}, {wide - c, -lip - c}, {neck - c, -lip - c}, {neck - c, 1}});
  StrangerPair pair;
  pair.moving = prism_of(-kNut, 0, {nut});
  pair.fixed = {prism_of(-kLength, 0, {rail})};
  pair.depth_mm = kNut;
  pair.beyond_mm = 2;
  return laid_down(std::move(pair));
}

StrangerPair draw_dovetail(Seeded& random, double clearance_mm) {
  const double top = random.uniform(4, 7), high = random.uniform(4, 6),
               lean = high * std::tan(random.uniform(0.35, 0.55));
  const double c = clearance_mm, length = random.uniform(15, 25);
  // The slider's section; the rail's groove stands off by the clearance.
  const Outline tail = whole_section({{top + lean, -high}, {top, 0}, {top, 2}});
  const Outline groove = grown_outline(whole_section({{top + lean, -high}, {top, 0}}), c);
  const double side = groove[1][0], bottom = groove[0][1], rim = groove[1][1];
  const Outline rail{
      {-top - 12, -high - 8}, {top + 12, -high - 8},   {top + 12, rim}, {side, rim},
      {groove[0][0], bottom}, {-groove[0][0], bottom}, {-side, rim},    {-top - 12, rim}};
  StrangerPair pair;
  pair.moving = prism_of(-length, 0, {tail});
  // A stop at the end of the way.
  pair.fixed = {prism_of(-length - 0.5, 0, {rail}) +
                block_mesh({-top - 12, -high - 8, -length - 4}, {top + 12, 4, -length})};
  pair.depth_mm = length;
  return laid_down(std::move(pair));
}

StrangerPair draw_rail_clip(Seeded& random, double clearance_mm) {
  const double head = random.uniform(4, 7), neck = random.uniform(2, 3),
               cap = random.uniform(1.5, 2.5), length = random.uniform(20, 30);
  const double c = clearance_mm;
  constexpr double kStem = 5;
  const Outline rail = whole_section(
      {{15, -4}, {15, 0}, {neck, 0}, {neck, kStem}, {head, kStem}, {head - 0.5, kStem + cap}});
  const double roof = kStem + cap + c, side = head + c;
  const Outline hollow = whole_section({{side, kStem - c}, {side - 0.5, roof}});
  // The neck of the hollow is open below.
  Outline open{{-neck - c, kStem - c - 2}, {-side - 2, kStem - c - 2}, {-side - 2, roof + 3},
               {side + 2, roof + 3},       {side + 2, kStem - c - 2},  {neck + c, kStem - c - 2},
               {neck + c, kStem - c}};
  open.insert(open.end(), hollow.begin(), hollow.end());
  open.push_back({-neck - c, kStem - c});
  StrangerPair pair;
  pair.moving = prism_of(-length, -length + 10, {open});
  pair.fixed = {prism_of(-length, 0, {rail}),
                block_mesh({-15, -4, -length - 3}, {15, 12, -length})};
  pair.depth_mm = length;
  return laid_down(std::move(pair));
}

StrangerPair draw_drawer(Seeded& random, double clearance_mm) {
  const double width = random.uniform(50, 90), height = random.uniform(25, 40),
               length = random.uniform(50, 80);
  const double c = clearance_mm, rib = 3, at = height / 2;
  // Section of the opening: x across, y up; the ribs reach in. Bodies overlap, as drawn.
  const auto beam = [&](double x0, double x1, double y0, double y1, double z0, double z1) {
    return block_mesh({x0, y0, z0}, {x1, y1, z1});
  };
  const double half = width / 2;
  StrangerPair pair;
  pair.fixed = {beam(-half - 4, half + 4, -4, height + 4, -length - 3, -length) +
                    beam(-half - 4, half + 4, -4, 0, -length - 0.5, 0) +
                    beam(-half - 4, -half, -0.5, height + 4, -length - 0.5, 0) +
                    beam(half, half + 4, -0.5, height + 4, -length - 0.5, 0) +
                    beam(-half - 0.5, half + 0.5, height, height + 4, -length - 0.5, 0),
                beam(-half - 0.2, -half + rib, at - 1.5, at + 1.5, -length - 0.2, 0) +
                    beam(half - rib, half + 0.2, at - 1.5, at + 1.5, -length - 0.2, 0)};
  // Drawer: floor, back, front and two sides with a groove.
  const double x = half - c, in = half - rib - c, top = height - c;
  const double below = at - 1.5 - c, above = at + 1.5 + c;
  const auto side = [&](double sign) {
    const auto mirrored = [&](double x0, double x1, double y0, double y1) {
      return sign > 0 ? beam(x0, x1, y0, y1, -length, 0) : beam(-x1, -x0, y0, y1, -length, 0);
    };
    return mirrored(in - 2, in, c, top) + mirrored(in - 0.5, x, c, below) +
           mirrored(in - 0.5, x, above, top);
  };
  pair.moving = side(1) + side(-1) + beam(-in + 1, in - 1, c, c + 2, -length, 0) +
                beam(-in + 1, in - 1, c, top, -length, -length + 2) +
                beam(-in + 1, in - 1, c, top, -2, 0);
  pair.depth_mm = length;
  return laid_down(std::move(pair));
}

StrangerPair draw_battery_tray(Seeded& random, double clearance_mm) {
  constexpr double kSizes[3][2] = {{7.25, 49}, {5.25, 43}, {9, 62}};
  const auto& size = kSizes[random.below(3)];
  const double radius = size[0], length = size[1];
  const std::uint32_t facets = facets_of(radius, random.uniform(0.02, 0.08));
  const double c = clearance_mm, whole = length + 1.4;
  const Rotation lying(Eigen::AngleAxisd(pi / 2, Vector::UnitY()));
  StrangerPair pair;
  pair.moving = placed_mesh(turned_mesh({{0, 0},
                                         {radius - 0.5, 0},
                                         {radius, 0.5},
                                         {radius, length - 0.5},
                                         {radius - 0.5, length},
                                         {2.6, length},
                                         {2.6, whole},
                                         {0, whole}},
                                        facets),
                            lying, Vector::Zero());
  // A trough along x; section (y, z) drawn in the plane and laid down.
  const double y = radius + c;
  const Outline trough{{-y - 2, -radius - 3}, {y + 2, -radius - 3},  {y + 2, 0.3 * radius},
                       {y, 0.3 * radius},     {y, -radius - c},      {-y, -radius - c},
                       {-y, 0.3 * radius},    {-y - 2, 0.3 * radius}};
  StrangerPair tray;
  tray.moving = prism_of(-4, whole + 4, {trough});
  pair.fixed = {laid_down(std::move(tray)).moving};
  // Bent contacts of sheet metal, whose lead-in opens upwards.
  const auto contact = [&](double x, double side) {
    const Outline bent{{x + side * c, -radius},
                       {x + side * (c + 0.3), -radius},
                       {x + side * (c + 0.3), 0},
                       {x + side * (c + 1.2), 0.4 * radius},
                       {x + side * (c + 1.2), 0.4 * radius + 0.33},
                       {x + side * c, 0.12}};
    const Rotation up(Eigen::AngleAxisd(pi / 2, Vector::UnitX()));
    return placed_mesh(prism_of(-3, 3, {bent}), up, Vector::Zero());
  };
  pair.fixed.push_back(contact(0, -1));
  pair.fixed.push_back(contact(whole, 1));
  pair.depth_mm = 2 * radius;
  return pair;
}

StrangerPair draw_fixture(Seeded& random, double clearance_mm) {
  const double side = random.uniform(10, 20), depth = random.uniform(15, 25),
               thick = random.uniform(20, 30);
  const double c = clearance_mm, long_side = side + 2 * c + thick;
  const bool chamfered = random.below(2) == 1, on_end = random.uniform(0, 1) < 0.7;
  const Outline square = rectangle_outline(side, side);
  StrangerPair pair;
  pair.moving =
      chamfered ? chamfered_peg(square, depth + 10, 1) : prism_of(0, depth + 10, {square});
  // A windmill of equal blocks, their tops flush. Drawn with the face y = 0 to the peg, or standing
  // on another side.
  DrawnMesh block = block_mesh({-long_side / 2, 0, -depth / 2}, {long_side / 2, thick, depth / 2});
  double roll = 0;
  if (on_end) {
    for (auto& triangle : block.triangles)
      for (Vector& p : triangle) p = Vector(p[0], p[2], -p[1]);
    roll = pi / 2;
  }
  const auto digits = [](double value) { return std::round(1e4 * value) / 1e4; };
  for (std::uint32_t k = 0; k < 4; ++k) {
    const double yaw = k * pi / 2, x = thick / 2, y = side / 2 + c;
    PartPlace place;
    place.position_mm = Vector(std::cos(yaw) * x - std::sin(yaw) * y,
                               std::sin(yaw) * x + std::cos(yaw) * y, depth / 2);
    place.rpy_rad = Vector(roll, 0, yaw);
    pair.meant.push_back(place);
    for (int i = 0; i < 3; ++i) {
      place.position_mm[i] = digits(place.position_mm[i]);
      place.rpy_rad[i] = digits(place.rpy_rad[i]);
    }
    pair.places.push_back(place);
    pair.fixed.push_back(block);
  }
  pair.fixed.push_back(block_mesh({-60, -60, -5}, {60, 60, 0}));
  pair.meant.emplace_back();
  pair.depth_mm = depth;
  // Over the tops first, from block to block.
  const double beside = -(side / 2 + c + thick / 2);
  const auto over = [&](double x, double to_go) {
    WayPose at;
    at.across_mm[0] = x;
    at.across_mm[1] = beside;
    at.to_go_mm = to_go;
    return at;
  };
  pair.detour = {over(0, depth + 4), over(0, depth - 1), over(-1.2 * side, depth - 1),
                 over(0, depth - 1), over(0, depth + 4), pair.start()};
  return pair;
}

StrangerPair draw_casting(Seeded& random, double clearance_mm) {
  const double width = random.uniform(30, 50), height = random.uniform(20, 30),
               tall = random.uniform(14, 20), corner = random.uniform(5, 8);
  const std::uint32_t facets = 6 + 4 * random.below(3), chords = 4 + 2 * random.below(3);
  const Outline part = rounded_outline(width, height, corner, facets);
  StrangerPair pair;
  pair.moving = layered_mesh(filleted_layers(part, 0, tall, 2, chords, true, true)) +
                layered_mesh(filleted_layers(circle_outline(0.3 * height, 4 * facets), tall - 0.5,
                                             tall + 8, 1.5, chords, false, true));
  const double depth = 0.6 * tall;
  const Outline outside = rounded_outline(width + 16, height + 16, corner, facets);
  std::vector<Layer> nest{straight(-5, -clearance_mm, {outside})};
  double low = -clearance_mm;
  for (const Layer& layer : filleted_layers(part, 0, depth, 2, chords, true, false)) {
    nest.push_back({low,
                    layer.high_mm,
                    {outside, grown_outline(layer.below[0], clearance_mm)},
                    {outside, grown_outline(layer.above[0], clearance_mm)}});
    low = layer.high_mm;
  }
  pair.fixed = {layered_mesh(nest)};
  pair.depth_mm = depth;
  return pair;
}

StrangerPair draw_clevis(Seeded& random, double clearance_mm) {
  const double width = random.uniform(6, 12), hole = random.uniform(3, 5),
               cheek = random.uniform(4, 6);
  const double radius = 2.2 * hole, half = width / 2 - clearance_mm;
  const double deep = std::max(1.2 * width, radius + 1);
  const std::uint32_t facets = facets_of(hole, random.uniform(0.01, 0.05));
  // Fork: a U in the plane (y, z), extruded along x.
  StrangerPair fork;
  fork.moving = prism_of(-radius, radius,
                         {Outline{{-width / 2 - cheek, -deep - 6},
                                  {width / 2 + cheek, -deep - 6},
                                  {width / 2 + cheek, deep / 2},
                                  {width / 2, deep / 2},
                                  {width / 2, -deep},
                                  {-width / 2, -deep},
                                  {-width / 2, deep / 2},
                                  {-width / 2 - cheek, deep / 2}}});
  StrangerPair pair;
  pair.fixed = {laid_down(std::move(fork)).moving};
  // Eye: a round end with a hole and a shank, in the plane (x, z), as thick as the gap less the
  // play.
  Outline eye{{0.6 * radius, 30}, {-0.6 * radius, 30}};
  append_arc(eye, radius, pi - 0.6, 2 * pi + 0.6, facets_of(radius, 0.05));
  const Rotation up(Eigen::AngleAxisd(pi / 2, Vector::UnitX()));
  pair.moving =
      placed_mesh(prism_of(-half, half, {eye, circle_outline(hole, facets)}), up, Vector::Zero());
  pair.depth_mm = deep / 2 + radius;
  pair.before_mm = 3;
  return pair;
}

StrangerPair draw_scan(Seeded& random, double clearance_mm) {
  const double width = random.uniform(12, 20), height = random.uniform(8, 14),
               depth = random.uniform(6, 10);
  const double noise = clearance_mm * random.uniform(0.1, 0.3);
  const Outline peg = rounded_outline(width, height, 3, 4);
  const Outline bore = grown_outline(peg, clearance_mm),
                outside = rectangle_outline(width + 20, height + 20);
  const std::uint64_t first = random.below(1u << 30), second = random.below(1u << 30);
  StrangerPair pair;
  pair.moving =
      noisy_mesh(finer_mesh(layered_mesh(filleted_layers(peg, 0, depth + 6, 1, 3, true, false)), 1),
                 noise, first);
  pair.fixed = {
      noisy_mesh(finer_mesh(bored_block(bore, outside, depth, 0.8, 3), 2), noise, second)};
  pair.depth_mm = depth;
  return pair;
}

StrangerPair draw_brick(Seeded& random, double clearance_mm) {
  const std::uint32_t columns = 2 + random.below(3);
  constexpr double kPitch = 8, kStud = 2.4, kTall = 1.8, kBrick = 9.6, kWall = 1.6;
  const double x = columns * kPitch, y = 2 * kPitch;
  const std::uint32_t facets = 4 * (3 + random.below(4));
  // The walls hold the studs from outside, with the clearance.
  const Outline body = rectangle_outline(x - 0.2, y - 0.2);
  const Outline hollow = rectangle_outline(x - 2 * kPitch + kPitch + 2 * (kStud + clearance_mm),
                                           y - kPitch + 2 * (kStud + clearance_mm));
  StrangerPair pair;
  const Outlines tubes =
      at_places(circle_outline(0.5 * std::sqrt(2.0) * kPitch - kStud - clearance_mm, facets),
                grid(columns - 1, 1, kPitch));
  Outlines below = with(body, {hollow});
  below.insert(below.end(), tubes.begin(), tubes.end());
  pair.moving =
      layered_mesh({straight(0, kBrick - kWall, below), straight(kBrick - kWall, kBrick, {body}),
                    straight(kBrick, kBrick + kTall,
                             at_places(circle_outline(kStud, facets), grid(columns, 2, kPitch)))});
  const Outlines studs = at_places(circle_outline(kStud, facets), grid(columns, 2, kPitch));
  const Outlines tips = at_places(circle_outline(kStud - 0.2, facets), grid(columns, 2, kPitch));
  pair.fixed = {layered_mesh({straight(-4, 0, {rectangle_outline(x + 16, y + 16)}),
                              straight(0, kTall - 0.2, studs),
                              {kTall - 0.2, kTall, studs, tips}})};
  pair.depth_mm = kTall;
  return pair;
}

}  // namespace haptic::sim
