// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/import/import_files.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace haptic::tools::test {
namespace {

std::string number(std::uint32_t value, unsigned bytes) {
  std::string text;
  for (unsigned k = 0; k < bytes; ++k)
    text += static_cast<char>((std::uint64_t{value} >> (8 * k)) & 0xFFU);
  return text;
}

std::uint32_t check_sum(const std::string& text) {
  std::uint32_t sum = 0xFFFFFFFFU;
  for (const char c : text) {
    sum ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) sum = (sum >> 1) ^ ((sum & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~sum;
}

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      word = (word << 8) | (k + i < bytes.size() ? static_cast<unsigned char>(bytes[k + i]) : 0U);
    }
    for (std::size_t i = 0; i < 4; ++i) {
      text += k + i <= bytes.size() ? kDigits[(word >> (18 - 6 * i)) & 63U] : '=';
    }
  }
  return text;
}

/// `nodes`: all of them; `roots`: the indices of those of the scene.
std::string gltf_text(const std::string& nodes, const std::string& roots, const std::string& uri) {
  return "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[" + roots +
         "]}],\"nodes\":[" + nodes +
         "],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}," +
         "\"indices\":1}]}],\"buffers\":[{\"byteLength\":72" + uri + "}]," +
         "\"bufferViews\":[{\"buffer\":0,\"byteOffset\":0,\"byteLength\":48}," +
         "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":24}]," +
         "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"," +
         "\"min\":[0,0,0],\"max\":[1,1,1]},{\"bufferView\":1,\"componentType\":5123," +
         "\"count\":12,\"type\":\"SCALAR\"}]}";
}

const char* const kCorners[4] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
constexpr unsigned kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

}  // namespace

bool has_corner_at(const RawMesh& mesh, const Point3& corner, double within) {
  return std::ranges::any_of(mesh.vertices, [&](const Point3& p) {
    return std::hypot(p[0] - corner[0], p[1] - corner[1], p[2] - corner[2]) < within;
  });
}

std::string amf_object(const std::string& id, int volumes) {
  std::string text = "<object id=\"" + id + "\"><mesh><vertices>";
  for (const char* c : kCorners) {
    text += std::string("<vertex><coordinates><x>") + c[0] + "</x><y>" + c[2] + "</y><z>" + c[4] +
            "</z></coordinates></vertex>";
  }
  text += "</vertices>";
  for (int k = 0; k < volumes; ++k) {
    text += "<volume>";
    for (const auto& f : kFaces) {
      text += "<triangle><v1>" + std::to_string(f[0]) + "</v1><v2>" + std::to_string(f[1]) +
              "</v2><v3>" + std::to_string(f[2]) + "</v3></triangle>";
    }
    text += "</volume>";
  }
  return text + "</mesh></object>";
}

std::string amf_of(const std::string& items, const std::string& root) {
  return "<?xml version=\"1.0\"?>\n<amf " + root + ">" + items + "</amf>\n";
}

std::string tetrahedron_amf(const std::string& root) { return amf_of(amf_object("0"), root); }

std::string tetrahedron_dae(const std::string& asset, const std::string& node) {
  return dae_of_nodes("<node id=\"n\">" + node + "<instance_geometry url=\"#g\"/></node>", asset);
}

std::string dae_of_nodes(const std::string& nodes, const std::string& asset) {
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
         "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">"
         "<asset>" +
         asset +
         "</asset><library_geometries><geometry id=\"g\"><mesh><source id=\"p\">"
         "<float_array id=\"pa\" count=\"12\">0 0 0 1 0 0 0 1 0 0 0 1</float_array>"
         "<technique_common><accessor source=\"#pa\" count=\"4\" stride=\"3\">"
         "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
         "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source>"
         "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>"
         "<triangles count=\"4\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>"
         "<p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles></mesh></geometry></library_geometries>"
         "<library_visual_scenes><visual_scene id=\"s\">" +
         nodes +
         "</visual_scene></library_visual_scenes>"
         "<scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n";
}

std::string object_of_3mf(const std::string& id, const std::string& attributes) {
  std::string text = "<object id=\"" + id + "\" " + attributes + "><mesh><vertices>";
  for (const char* c : kCorners) {
    text += std::string("<vertex x=\"") + c[0] + "\" y=\"" + c[2] + "\" z=\"" + c[4] + "\"/>";
  }
  text += "</vertices><triangles>";
  for (const auto& f : kFaces) {
    text += "<triangle v1=\"" + std::to_string(f[0]) + "\" v2=\"" + std::to_string(f[1]) +
            "\" v3=\"" + std::to_string(f[2]) + "\"/>";
  }
  return text + "</triangles></mesh></object>";
}

std::string metre_model_of_3mf(const std::string& resources, const std::string& build,
                               const std::string& root) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"meter\" " + root +
         " xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources>" +
         resources + "</resources><build>" + build + "</build></model>\n";
}

std::string model_of_3mf(const std::string& root, const std::string& build) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model " + root +
         " xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\"><resources>" +
         object_of_3mf("1", "type=\"model\"") + "</resources><build>" + build +
         "</build></model>\n";
}

namespace {

std::vector<std::pair<std::string, std::string>> files_of_3mf(const std::string& model) {
  return {
      {"[Content_Types].xml",
       "<?xml version=\"1.0\"?><Types "
       "xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\"><Default "
       "Extension=\"rels\" "
       "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/><Default "
       "Extension=\"model\" "
       "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>"},
      {"_rels/.rels",
       "<?xml version=\"1.0\"?><Relationships "
       "xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship "
       "Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
       "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>"},
      {"3D/3dmodel.model", model}};
}

}  // namespace

std::string archive_of_3mf(const std::string& model, Packing packing) {
  return zip_of(files_of_3mf(model), packing);
}

std::string archive_of_3mf(const std::string& model,
                           const std::vector<std::pair<std::string, std::string>>& further) {
  auto files = files_of_3mf(model);
  files.insert(files.end(), further.begin(), further.end());
  return zip_of(files);
}

std::string gltf_buffer() {
  std::string bytes;
  for (const char* c : kCorners) {
    for (const int at : {0, 2, 4}) {
      bytes += number(std::bit_cast<std::uint32_t>(static_cast<float>(c[at] - '0')), 4);
    }
  }
  for (const auto& f : kFaces) {
    for (const unsigned v : f) bytes += number(v, 2);
  }
  return bytes;
}

namespace {

std::string gltf_data_uri() {
  return ",\"uri\":\"data:application/octet-stream;base64," + base64(gltf_buffer()) + "\"";
}

}  // namespace

std::string tetrahedron_gltf(const std::string& node, const std::string& buffer) {
  return gltf_text("{" + node + "\"mesh\":0}", "0",
                   buffer.empty() ? gltf_data_uri() : ",\"uri\":\"" + buffer + ".bin\"");
}

std::string gltf_of_nodes(const std::string& nodes, const std::string& roots) {
  return gltf_text(nodes, roots, gltf_data_uri());
}

std::string tetrahedron_glb() {
  std::string json = gltf_text("{\"mesh\":0}", "0", "");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string buffer = gltf_buffer();
  const auto size = [](const std::string& text) { return static_cast<std::uint32_t>(text.size()); };
  return "glTF" + number(2, 4) + number(28 + size(json) + size(buffer), 4) + number(size(json), 4) +
         "JSON" + json + number(size(buffer), 4) + std::string("BIN\0", 4) + buffer;
}

std::string zip_of(const std::vector<std::pair<std::string, std::string>>& files, Packing packing) {
  std::string archive, index;
  const bool is_deflated = packing == Packing::kDeflated, is_wide = packing == Packing::kWide;
  const std::uint32_t elsewhere = 0xFFFFFFFF;
  for (const auto& file : files) {  // clang 14 captures no structured binding
    const std::string &name = file.first, &text = file.second;
    const auto size = static_cast<std::uint32_t>(text.size());
    // The last block, without compression: its length, and that inverted.
    const std::string content =
        is_deflated ? "\1" + number(size, 2) + number(~size, 2) + text : text;
    const auto packed = static_cast<std::uint32_t>(content.size());
    const auto at = static_cast<std::uint32_t>(archive.size());
    // Version, flags, method, time, date, check sum, sizes, lengths of name and extra field.
    const auto common = [&](std::uint32_t extra) {
      return number(is_wide ? 45 : 20, 2) + number(0, 2) + number(is_deflated ? 8 : 0, 2) +
             number(0, 4) + number(check_sum(text), 4) + number(is_wide ? elsewhere : packed, 4) +
             number(is_wide ? elsewhere : size, 4) +
             number(static_cast<std::uint32_t>(name.size()), 2) + number(extra, 2);
    };
    const std::string sizes = number(size, 8) + number(packed, 8);
    // Another extra field stands before that of ZIP64.
    const std::string other = number(0x5455, 2) + number(1, 2) + "x";
    const std::string wide = other + number(1, 2) + number(24, 2) + sizes + number(at, 8);
    index += "PK\1\2" + number(20, 2) +
             common(is_wide ? static_cast<std::uint32_t>(wide.size()) : 0) + number(0, 6) +
             number(0, 4) + number(is_wide ? elsewhere : at, 4) + name + (is_wide ? wide : "");
    archive += "PK\3\4" + common(is_wide ? 20 : 0) + name +
               (is_wide ? number(1, 2) + number(16, 2) + sizes : "") + content;
  }
  const auto count = static_cast<std::uint32_t>(files.size());
  const auto index_size = static_cast<std::uint32_t>(index.size()),
             index_at = static_cast<std::uint32_t>(archive.size());
  if (is_wide) {
    index += "PK\6\6" + number(44, 8) + number(45, 2) + number(45, 2) + number(0, 8) +
             number(count, 8) + number(count, 8) + number(index_size, 8) + number(index_at, 8) +
             "PK\6\7" + number(0, 4) + number(index_at + index_size, 8) + number(1, 4) + "PK\5\6" +
             number(0, 4) + number(0xFFFF, 2) + number(0xFFFF, 2) + number(elsewhere, 4) +
             number(elsewhere, 4) + number(0, 2);
    return archive + index;
  }
  return archive + index + "PK\5\6" + number(0, 4) + number(count, 2) + number(count, 2) +
         number(index_size, 4) + number(index_at, 4) + number(0, 2);
}

}  // namespace haptic::tools::test
