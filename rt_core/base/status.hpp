// SPDX-License-Identifier: Apache-2.0
#pragma once
/// Result codes of the core. Every function that can refuse its input returns one; none throws.

#include <cstddef>
#include <cstdint>

namespace haptic {

enum class RtStatus : std::uint8_t {
  kOk = 0,
  // Input of HapticCore::step
  kPoseNotFinite,  ///< a component of the pose is NaN or infinite: state unchanged, wrench zero
  kPoseNotUnit,    ///< | |q| - 1 | > 1e-3: state unchanged, wrench zero
  // SceneView::open
  kBlobTooSmall,         ///< fewer bytes than the header or than byte_count says
  kBlobMisaligned,       ///< first byte not aligned to kSceneAlignment
  kBlobBadMagic,         ///< not a compiled scene
  kBlobBadVersion,       ///< compiled for another format version: recompile the scene
  kBlobWrongScalar,      ///< compiled for the other scalar (double or float)
  kBlobBadHash,          ///< content does not match the stored hash
  kBlobBadSectionTable,  ///< a section lies outside the blob, overlaps or repeats
  kBlobMissingSection,   ///< a required table is absent
  kBlobBadCount,         ///< a count exceeds the format's limit or disagrees with another
  kBlobBadIndex,         ///< an index points outside its table
  kBlobBadNumber,        ///< a number is not finite, not unit or out of its range
  kBlobBadTopology,      ///< vertices, edges and faces of a piece do not fit together
  kBlobBadGraph,         ///< nodes or arcs of a pair are not those of its two pieces
  kBlobBadCapacity,      ///< capacities or state bytes are not those that the tables need
  // HapticCore::create
  kMemoryTooSmall,    ///< the caller's memory holds fewer bytes than the header states
  kMemoryMisaligned,  ///< the caller's memory is not aligned to kStateAlignment
  // Images of one scene (scene/scene_traits.hpp)
  kBlobNotOfImage,  ///< the image was compiled for another scene, or without what this one needs
  // PartHand (part_hand.hpp)
  kNotGraspable,  ///< the part may not be held, or the hand holds one still
  kCount
};

/// Text of a code, for people. Never null; static storage.
[[nodiscard]] const char* to_text(RtStatus status) noexcept;

}  // namespace haptic
