// SPDX-License-Identifier: Apache-2.0
#include "host_sim/view/gallery.hpp"

#include <algorithm>
#include <filesystem>

#include "host_sim/report/part_report.hpp"
#include "host_sim/session/child_run.hpp"
#include "tools/common/error.hpp"
#include "tools/common/files.hpp"

namespace haptic::sim {
namespace {

struct GalleryFile {
  std::string_view path;  ///< below host_sim/scenes
  std::string_view text;
};
constexpr GalleryFile kGalleryFiles[] = {
#include <generated/gallery_files.inc>
};

constexpr GalleryScene kGallery[] = {
    {"tetrahedron_on_box", "Tetrahedron on a box",
     "The pair of the paper: a vertex, an edge and a whole face come to rest on the box. In "
     "C-space "
     "the part is a point, and the box is one polyhedron whose faces are the basic contacts."},
    {"square_peg_five", "Square peg in its hole",
     "The block with the hole is cut into five convex pieces, so C-space has five obstacles. The "
     "free space between them is a narrow channel, and the peg is in when the point is at its "
     "end."},
    {"round_peg", "Round peg in its hole",
     "Round parts are facets here, 24 around, and the clearance must be larger than their error. "
     "Press the peg on the wall and turn it: it goes round from one edge of the channel to the "
     "next."},
    {"ell_insert", "L into its fixture",
     "Both parts have an inner corner and are made of several convex pieces. The seams between the "
     "pieces are drawn dashed in C-space: they never carry a force."},
    {"dovetail", "Dovetail slide",
     "The slider enters the rail from its end and can then only go along it. Pull it upwards: the "
     "two flanks hold it, each by a plane of its own."},
    {"gear_on_shaft", "Gear on a square shaft",
     "The gear goes down on the shaft at four of all the angles around. Rest it on the end of the "
     "shaft and turn until it falls."},
    {"nut_on_bolt", "Nut on a bolt",
     "Threads are surfaces of thousands of flat facets, which are felt without any simplification. "
     "Play the recording, or turn the nut on by hand: right-hand, 1.5 mm for each turn."},
    {"two_pins", "Two pins in two sockets",
     "A plug with two pins meets two parts at once. One pin over its socket waits until the other "
     "is "
     "over its own: both go in only when the plug is straight."}};

}  // namespace

std::span<const GalleryScene> gallery() { return kGallery; }

std::optional<unsigned> gallery_number(const std::string& word) {
  const bool digits = !word.empty() && word.size() < 4 &&
                      std::ranges::all_of(word, [](char c) { return c >= '0' && c <= '9'; });
  if (!digits || std::filesystem::exists(word)) return std::nullopt;
  return static_cast<unsigned>(std::stoul(word));
}

std::string gallery_list() {
  std::string text;
  for (std::size_t k = 0; k < std::size(kGallery); ++k) {
    text += "  " + std::to_string(k + 1) + "  " + std::string(kGallery[k].title) + ". " +
            std::string(kGallery[k].about) + "\n";
  }
  return text;
}

const GalleryScene& gallery_scene(unsigned number) {
  if (number < 1 || number > std::size(kGallery)) {
    throw tools::UsageError("the gallery has no scene " + std::to_string(number) +
                            "; its scenes are\n" + gallery_list());
  }
  return kGallery[number - 1];
}

std::string_view gallery_file(std::string_view name, std::string_view file) {
  for (const GalleryFile& entry : kGalleryFiles) {
    if (entry.path == std::string(name) + "/" + std::string(file)) return entry.text;
  }
  return {};
}

CompiledGalleryScene compile_gallery_scene(const GalleryScene& scene) {
  const std::string compiler = program_beside("graph_compiler");
  const TemporaryFolder folder;
  const std::string prefix = std::string(scene.name) + "/";
  for (const GalleryFile& entry : kGalleryFiles) {
    if (!entry.path.starts_with(prefix)) continue;
    write_whole_file(folder.file(std::string(entry.path.substr(prefix.size()))),
                     std::string(entry.text));
  }
  const std::string out = folder.file("out"), err = folder.file("err");
  const int status = run_to_end(
      {compiler, folder.file("scene.toml"), "-o", folder.file("scene.rtscene"), "--quiet"}, out,
      err);
  if (status != 0)
    throw tools::InputError("graph_compiler: " + std::string(scene.name) + ": " +
                            last_line(file_text(err)));
  return {tools::read_scene_bytes(folder.file("scene.rtscene")),
          make_motion(read_motion_script(folder.file("motion.toml")))};
}

}  // namespace haptic::sim
