// SPDX-License-Identifier: Apache-2.0
// hosted_drive SCENE POSES RESULTS: the drive of an image (linker/pose_drive.hpp) in an ordinary
// program, on this machine or another one with an operating system. Exit codes: 0 done, 1 a tick or
// the scene was refused, 2 usage, 3 a file cannot be read, 4 the results cannot be written.

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "linker/pose_drive.hpp"
#include "rt_core/base/status.hpp"

namespace {

using namespace haptic;

struct alignas(64) Chunk {
  std::byte bytes[64];
};
static_assert(kSceneAlignment <= 64 && kStateAlignment <= 64);

/// The whole file, aligned; false when it cannot be read.
bool read_file(const char* path, std::vector<Chunk>& chunks, std::size_t& size) {
  std::FILE* file = std::fopen(path, "rb");
  if (file == nullptr) return false;
  size = 0;
  for (;;) {
    Chunk chunk{};
    const std::size_t count = std::fread(&chunk, 1, sizeof(chunk), file);
    size += count;
    if (count > 0) chunks.push_back(chunk);
    if (count < sizeof(chunk)) break;
  }
  const bool whole = std::ferror(file) == 0;
  std::fclose(file);
  return whole;
}

template <typename T>
bool put(std::FILE* file, const T& element) {
  return std::fwrite(&element, sizeof(element), 1, file) == 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: hosted_drive SCENE POSES RESULTS\n", stderr);
    return 2;
  }
  std::vector<Chunk> scene, poses;
  std::size_t scene_bytes = 0, pose_bytes = 0;
  if (!read_file(argv[1], scene, scene_bytes) || !read_file(argv[2], poses, pose_bytes)) {
    std::perror("hosted_drive: scene or poses");
    return 3;
  }
  // What the header states is checked by the core itself.
  SceneHeader header{};
  if (scene_bytes >= sizeof(header)) std::memcpy(&header, scene.data(), sizeof(header));
  constexpr std::uint64_t kMostState_bytes = std::uint64_t{1} << 30;
  std::vector<Chunk> state(static_cast<std::size_t>(
      std::min(header.capacity.state_bytes, kMostState_bytes) / sizeof(Chunk) + 1));
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> results(std::fopen(argv[3], "wb"),
                                                                &std::fclose);
  if (results == nullptr) {
    std::perror("hosted_drive: results");
    return 4;
  }
  PoseDrive drive;
  const RtStatus opened = drive.open(std::as_bytes(std::span(scene)).first(scene_bytes),
                                     std::as_writable_bytes(std::span(state)));
  bool written = true;
  if (opened == RtStatus::kOk) {
    for (std::size_t k = 0; k < pose_bytes / sizeof(DrivePose) && written; ++k) {
      const auto pose = std::bit_cast<DrivePose>(poses[k]);
      written = put(results.get(), drive.tick_of(drive.core().step(drive.input_of(pose))));
    }
  }
  const DriveSummary summary = drive.summary();
  if (!written || !put(results.get(), summary) || std::fflush(results.get()) != 0) {
    std::perror("hosted_drive: results");
    return 4;
  }
  if (summary.status == static_cast<std::uint32_t>(RtStatus::kOk)) return 0;
  std::fprintf(stderr, "hosted_drive: %s\n", to_text(static_cast<RtStatus>(summary.status)));
  return 1;
}
