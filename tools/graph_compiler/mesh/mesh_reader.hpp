// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Reads polygon meshes: Wavefront OBJ, STL and PLY (text and binary), OFF (others: import/).
/// Strict, locale-free, in double: what cannot be read for certain is refused with its place
/// instead of being guessed. Nothing is merged or dropped here; see cleaning.hpp for that.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "tools/graph_compiler/mesh/surface.hpp"

namespace haptic::tools {

enum class MeshFormat : std::uint8_t { kObj, kStl, kOff, kPly };

/// Largest file that is read [bytes] and largest number of faces: beyond any part that can be
/// decomposed, small enough that a hostile count cannot exhaust the memory of a workstation.
inline constexpr std::uintmax_t kMaxMeshBytes = std::uintmax_t{1} << 30;
inline constexpr std::size_t kMaxMeshFaces = 20'000'000;
inline constexpr std::size_t kMaxMeshVertices = 3 * kMaxMeshFaces;

/// Format by the extension of the file name (any case); nothing where it is none of these.
std::optional<MeshFormat> mesh_format_named(const std::filesystem::path& path);
/// The same. @throws InputError if the extension is none of .obj, .stl, .off, .ply.
MeshFormat mesh_format_of(const std::filesystem::path& path);

/// Reads a whole file. The format comes from the extension and is checked against the content.
/// @throws InputError (missing, unreadable, too large, or anything parse_mesh refuses).
/// Cost: linear in the size of the file; the file is held in memory once.
RawMesh read_mesh(const std::filesystem::path& path);

/// Parses the bytes of a file; pure, so that a fuzzer can drive it.
/// OBJ: `v`, `f` (all forms of corners, n-gons, negative indices, continuation lines), `o` and `g`
/// as groups and nodes; anything else is skipped, except free-form surfaces and lines without a
/// keyword, which are refused; keywords that OBJ does not have are noted. STL, with its solids as
/// nodes: binary where 84 + 50 n == size, with any header, and where bytes stand behind the last
/// triangle and the header is no text: further binary STL there is read as parts of its own, other
/// bytes are noted. OFF: OFF and COFF, colours skipped. PLY: positions and faces, all else skipped.
/// Text may have LF, CRLF or CR line ends and a UTF-8 byte order mark.
/// @param file  name used in messages and stored in the result.
/// Packed files (packed_file.hpp) are refused.
/// @throws InputError with file:line or "file: byte N", the defect and how to fix it.
RawMesh parse_mesh(std::span<const char> bytes, MeshFormat format, const std::string& file);

}  // namespace haptic::tools
