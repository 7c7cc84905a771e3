// SPDX-License-Identifier: Apache-2.0
/// Seeds of the mesh targets: small solids of our own in every format and with everything that a
/// format allows.
#include <bit>

#include "tests/fuzz/fuzz_target.hpp"

namespace haptic::fuzz {
namespace {

constexpr char kObj = '\0';
constexpr char kStl = '\1';
constexpr char kOff = '\2';
constexpr char kPly = '\3';

std::string with_format(char format, const std::string& bytes) {
  return std::string(1, format) + bytes;
}

const char* const kTetrahedron =
    "o t\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1.25\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

/// A box from quads, with every kind of corner, comment, group, blank and joined line.
const char* const kDressedBox =
    "# box\nmtllib a.mtl\ng a b\nv 0 0 0 1.0\nv 1 0 0 1 0 0\nv 0 1 0\nv 1 1 0\n"
    "v 0 0 1e0\nv 1. 0 +1\nv 0 .1e1 1\nv 1 1 1\nvn 0 0 1\nvt 0 0\nusemtl s\ns 1\n"
    "f 1/1 3/1 4/1 2/1\nf 5//1 6//1 8//1 7//1\ng c\nf -8 -7 -3 \\\n -4\n"
    "f 3/1/1 7/1/1 8/1/1 4/1/1\n\nf 1 5 7 3\nf 2 4 8 6 # end\n";

/// Objects with and without groups, groups of no object, and one that is entered again.
const char* const kNodes =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\ng loose\nf 1 2 4\no a\nf 2 3 4\ng x\nf 1 4 3\n"
    "o b\nf 1 3 2\no a\ng x\nf 1 2 4\no \xC3\xA9\ng x:1\nf 2 3 4\n";

/// Two wedges with a common edge in one group, a cavity in a third solid.
const char* const kEdgeAndVoid =
    "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 1 .5 0\nv -1 0 0\nv -1 -.5 0\nv 1 0 1\nv 1 .5 1\nv -1 0 1\n"
    "v -1 -.5 1\nf 1 4 3\nf 2 7 8\nf 1 3 7 2\nf 1 2 8 4\nf 3 4 8 7\nf 1 6 5\nf 2 9 10\n"
    "f 1 5 9 2\nf 1 2 10 6\nf 5 6 10 9\no cube\nv 5 5 5\nv 9 5 5\nv 5 9 5\nv 9 9 5\nv 5 5 9\n"
    "v 9 5 9\nv 5 9 9\nv 9 9 9\nf 11 13 14 12\nf 15 16 18 17\nf 11 12 16 15\nf 13 17 18 14\n"
    "f 11 15 17 13\nf 12 14 18 16\nv 6 6 6\nv 8 6 6\nv 6 8 6\nv 6 6 8\nf 19 20 21\nf 19 22 20\n"
    "f 20 22 21\nf 19 21 22\n";

/// A box whose top is split in two while its side is not: a T-junction, closed by stitching.
const char* const kTJunction =
    "OFF\n10 8 0\n0 0 0\n2 0 0\n2 1 0\n0 1 0\n0 0 1\n2 0 1\n2 1 1\n0 1 1\n1 0 1\n1 1 1\n"
    "4 0 3 2 1\n4 4 8 9 7\n4 8 5 6 9\n4 0 1 5 4\n4 2 3 7 6\n4 0 4 7 3\n4 1 2 6 5\n3 0 1 1\n";

const char* const kColours =
    "COFF 4 4 6 # counts\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n0 1 0 0 0 255 255\n"
    "0 0 1 9 9 9 255\n3 0 2 1\n3 0 1 3 7\n3 1 2 3 0.1 0.2 0.3\n3 0 3 2 1 2 3 4\n";

const char* const kTextPly =
    "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nelement face 4\n"
    "property list uchar int vertex_indices\nend_header\n0 0 0 1\n1 0 0 2\n0 1 0 3\n0 0 1 4\n"
    "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";

/// Corners as bytes, so that they need no swap.
std::string binary_ply(const char* order) {
  std::string bytes = std::string("ply\nformat binary_") + order +
                      "_endian 1.0\nelement vertex 4\nproperty char x\nproperty char y\n"
                      "property char z\nelement face 4\nproperty list uchar uchar vertex_index\n"
                      "end_header\n";
  bytes += std::string(
      "\0\0\0"
      "\1\0\0"
      "\0\1\0"
      "\0\0\1"
      "\3\0\2\1"
      "\3\0\1\3"
      "\3\1\2\3"
      "\3\0\3\2",
      28);
  return bytes;
}

struct Triangle {
  float corner[3][3];
};
constexpr Triangle kTriangles[4] = {{{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}},
                                    {{{0, 0, 0}, {1, 0, 0}, {0, 0, 2}}},
                                    {{{1, 0, 0}, {0, 1, 0}, {0, 0, 2}}},
                                    {{{0, 0, 0}, {0, 0, 2}, {0, 1, 0}}}};

std::string text_stl() {
  std::string text = "solid part one\n";
  for (const Triangle& t : kTriangles) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const auto& p : t.corner) {
      text += "   vertex " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " +
              std::to_string(p[2]) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid part one\n";
}

std::string binary_stl() {
  std::string bytes = "solid only in name";
  bytes.resize(80, ' ');
  const auto append = [&](std::uint32_t word) {
    for (unsigned i = 0; i < 4; ++i) {
      bytes += static_cast<char>((word >> (8 * i)) & 0xFFU);
    }
  };
  append(4);
  for (const Triangle& t : kTriangles) {
    for (int i = 0; i < 3; ++i) {
      append(0);
    }
    for (const auto& p : t.corner) {
      for (const float x : p) {
        append(std::bit_cast<std::uint32_t>(x));
      }
    }
    bytes += std::string(2, '\0');
  }
  return bytes;
}

}  // namespace

std::vector<Seed> seeds() {
  return {{"tetrahedron_obj", with_format(kObj, kTetrahedron)},
          {"dressed_box_obj", with_format(kObj, kDressedBox)},
          {"edge_and_void_obj", with_format(kObj, kEdgeAndVoid)},
          {"nodes_obj", with_format(kObj, kNodes)},
          {"text_stl", with_format(kStl, text_stl())},
          {"solids_stl", with_format(kStl, text_stl() + text_stl())},
          {"binary_stl", with_format(kStl, binary_stl())},
          {"t_junction_off", with_format(kOff, kTJunction)},
          {"text_ply", with_format(kPly, kTextPly)},
          {"little_ply", with_format(kPly, binary_ply("little"))},
          {"big_ply", with_format(kPly, binary_ply("big"))},
          {"colours_coff", with_format(kOff, kColours)}};
}

}  // namespace haptic::fuzz
