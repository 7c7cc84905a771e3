// SPDX-License-Identifier: Apache-2.0
/// Files that say they are scenes: the large ones are refused before any room is made for them.
#include <doctest/doctest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string>

#include "tests/support/program_run.hpp"
#include "tests/support/shapes.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::tools {
namespace {

constexpr std::uint64_t kSparseBytes = std::uint64_t{6} << 30;

// No room for the file while it lives. A sanitizer reserves more than any limit.
class LittleMemory {
 public:
  LittleMemory() {
    getrlimit(RLIMIT_AS, &before_);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    const rlimit small{std::min<rlim_t>(before_.rlim_max, rlim_t{2} << 30), before_.rlim_max};
    setrlimit(RLIMIT_AS, &small);
#endif
  }
  ~LittleMemory() { setrlimit(RLIMIT_AS, &before_); }
  LittleMemory(const LittleMemory&) = delete;
  LittleMemory& operator=(const LittleMemory&) = delete;

 private:
  rlimit before_{};
};

SceneBytes small_scene() {
  return SceneBytes(write_scene(
      test::scene_of(test::box({0, 0, 0}, {1, 1, 1}), {test::box({0, 0, 0}, {2, 2, 2})})));
}

void write_sparse(const std::string& path, std::span<const std::byte> front) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(front.data()),
             static_cast<std::streamsize>(front.size()));
  REQUIRE(truncate(path.c_str(), static_cast<off_t>(kSparseBytes)) == 0);
}

void check_refused(const std::string& path, const std::string& part) {
  const LittleMemory little;
  CHECK_THROWS_WITH_AS((void)read_scene_bytes(path), doctest::Contains(part.c_str()), InputError);
  CHECK_THROWS_WITH_AS((void)read_scene_bytes(path), doctest::Contains(path.c_str()), InputError);
}

}  // namespace

TEST_SUITE("tools.scene_file") {
  TEST_CASE("read_scene_bytes: a sparse file of 6 GiB is refused by what its first bytes say") {
    const sim::test::ScratchFolder folder("scene_file");
    const std::string path = folder.file("sparse.rtscene");
    SceneBytes scene = small_scene();
    write_sparse(path, {});
    check_refused(path, to_text(RtStatus::kBlobBadMagic));
    write_sparse(path, scene.span());
    check_refused(path, "the file has 6442450944 bytes, its header states " +
                            std::to_string(scene.span().size()));

    // A header that goes with the size, over the sections of a small scene.
    auto* const header = reinterpret_cast<SceneHeader*>(scene.span().data());
    header->byte_count = kSparseBytes;
    write_sparse(path, scene.span());
    check_refused(path, to_text(RtStatus::kBlobBadSectionTable));
  }

  TEST_CASE("read_scene_bytes: a scene is read whole; a small damaged one too, for who explains") {
    const sim::test::ScratchFolder folder("scene_file");
    const std::string path = folder.file("small.rtscene");
    const SceneBytes scene = small_scene();
    write_files({{path, scene.span()}});
    const SceneBytes read = read_scene_bytes(path);
    REQUIRE(read.span().size() == scene.span().size());
    CHECK(std::memcmp(read.span().data(), scene.span().data(), scene.span().size()) == 0);
    const std::string damaged = folder.file("damaged.rtscene");
    write_files({{damaged, scene.span().first(100)}});
    CHECK(read_scene_bytes(damaged).span().size() == 100);
  }

  TEST_CASE("check_front: passes what open passes, from the first bytes alone") {
    const SceneBytes scene = small_scene();
    const std::span<const std::byte> all = scene.span();
    const SceneBytes front{all.first(std::min(all.size(), kSceneFrontBytes))};
    CHECK(SceneView::check_front(front.span(), all.size()) == RtStatus::kOk);
    CHECK(SceneView::check_front(front.span(), all.size() + 1) == RtStatus::kBlobTooSmall);
    CHECK(SceneView::check_front(front.span().first(8), all.size()) == RtStatus::kBlobTooSmall);
  }
}

}  // namespace haptic::tools
