// SPDX-License-Identifier: Apache-2.0
#include "tools/graph_compiler/mesh/packed_file.hpp"

#include <string_view>

#include "tools/graph_compiler/mesh/text_scan.hpp"

namespace haptic::tools {
namespace {

struct Packer {
  std::string_view first_bytes, extension, name, command;
};

constexpr Packer kPackers[] = {
    {"\x1F\x8B", ".gz", "gzip", "gunzip"},
    {"BZh", ".bz2", "bzip2", "bunzip2"},
    {{"\xFD\x37\x7A\x58\x5A\x00", 6}, ".xz", "xz", "unxz"},
    {"\x28\xB5\x2F\xFD", ".zst", "Zstandard", "unzstd"},
};

/// Refuses a packed file that may have any name: the commands by themselves go by the extension.
[[noreturn]] void refuse(const Packer& packer, const std::filesystem::path& path) {
  std::filesystem::path name = path;
  const bool says_so = equals_lower(name.extension().string(), packer.extension);
  if (says_so) {
    name.replace_extension();
  } else {
    name.replace_filename("unpacked_" + name.filename().string());
  }
  refuse_file(path.string(), "the file is " + std::string(packer.name) + "-compressed",
              "unpack it: " + std::string(packer.command) + " < '" + path.string() + "' > '" +
                  name.string() + "', and name the unpacked file");
}

}  // namespace

void refuse_packed(std::span<const char> bytes, const std::string& file) {
  const std::string_view all(bytes.data(), bytes.size());
  for (const Packer& packer : kPackers) {
    if (all.starts_with(packer.first_bytes)) refuse(packer, file);
  }
  if (all.starts_with("version https://git-lfs.github.com/")) {
    refuse_file(file, "the file is a pointer of Git LFS, not the mesh",
                "fetch the mesh with git lfs pull, or download it");
  }
  if (equals_lower(all.substr(0, 5), "<html") || equals_lower(all.substr(0, 9), "<!doctype")) {
    refuse_file(file, "the file is a web page, not a mesh", "download the file itself again");
  }
}

void refuse_archive(std::span<const char> bytes, const std::string& file) {
  if (std::string_view(bytes.data(), bytes.size()).starts_with("PK\x03\x04")) {
    refuse_file(file, "the file is a ZIP archive",
                "unpack it with unzip and name the mesh in it; a 3MF file is named .3mf");
  }
}

void refuse_packed_name(const std::filesystem::path& path) {
  for (const Packer& packer : kPackers) {
    if (equals_lower(path.extension().string(), packer.extension)) refuse(packer, path);
  }
}

}  // namespace haptic::tools
