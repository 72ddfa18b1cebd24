// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/ply_header.h"

#include <array>
#include <cstdint>
#include <cstring>

#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

struct TypeName {
  std::string_view name;
  PlyScalar type;
};

// The original names and those that say the size.
constexpr std::array<TypeName, 16> kTypeNames = {{{"char", PlyScalar::kInt8},
                                                  {"int8", PlyScalar::kInt8},
                                                  {"uchar", PlyScalar::kUint8},
                                                  {"uint8", PlyScalar::kUint8},
                                                  {"short", PlyScalar::kInt16},
                                                  {"int16", PlyScalar::kInt16},
                                                  {"ushort", PlyScalar::kUint16},
                                                  {"uint16", PlyScalar::kUint16},
                                                  {"int", PlyScalar::kInt32},
                                                  {"int32", PlyScalar::kInt32},
                                                  {"uint", PlyScalar::kUint32},
                                                  {"uint32", PlyScalar::kUint32},
                                                  {"float", PlyScalar::kFloat32},
                                                  {"float32", PlyScalar::kFloat32},
                                                  {"double", PlyScalar::kFloat64},
                                                  {"float64", PlyScalar::kFloat64}}};

template <typename T>
double Read(const char* data) {
  T value;
  std::memcpy(&value, data, sizeof value);
  return static_cast<double>(value);
}

[[noreturn]] void ThrowBadHeader(const std::string& where, const std::string& expected,
                                 std::string_view found) {
  throw Error(ErrorParts{.what = "bad PLY header",
                         .where = where,
                         .expected = expected,
                         .found = std::string(found.substr(0, 80))});
}

std::optional<PlyScalar> FindType(std::string_view name) {
  for (const TypeName& known : kTypeNames) {
    if (known.name == name) return known.type;
  }
  return std::nullopt;
}

PlyProperty ParseProperty(const std::vector<std::string_view>& words, std::string_view line,
                          const std::string& where) {
  if (words.size() == 3) {
    if (const auto type = FindType(words[1])) return {std::string(words[2]), *type};
  }
  ThrowBadHeader(where, "a property of a scalar type", line);
}

// A line of the second element. Whatever it holds but the corners of faces is not an error here.
void TakeFaceLine(const std::vector<std::string_view>& words, bool& is_first_property,
                  PlyHeader& header) {
  if (words[0] == "element") {
    const auto count = words.size() == 3 ? ParseInteger(words[2]) : std::nullopt;
    if (count && *count >= 0 && words[1] == "face") {
      header.faces = PlyFaces{.count = static_cast<std::size_t>(*count)};
    }
    is_first_property = true;
    return;
  }
  const bool is_list = words.size() == 5 && words[1] == "list" &&
                       (words[4] == "vertex_indices" || words[4] == "vertex_index");
  const auto count_type = is_list ? FindType(words[2]) : std::nullopt;
  const auto vertex_type = is_list ? FindType(words[3]) : std::nullopt;
  if (header.faces && count_type && vertex_type && is_first_property) {
    header.faces->count_type = *count_type;
    header.faces->vertex_type = *vertex_type;
  } else {
    header.faces.reset();
  }
  is_first_property = false;
}

// How far the header was read.
struct PlyPlace {
  int num_elements = 0;
  bool is_first_property = true;  // of the second element
};

// Takes one line of the header below "format"; false at its end.
bool TakeLine(std::string_view line, const std::string& where, PlyPlace& place, PlyHeader& header) {
  int& num_elements = place.num_elements;
  const std::vector<std::string_view> words = Words(line);
  if (words.empty() || words[0] == "comment" || words[0] == "obj_info") return true;
  if (words[0] == "end_header") return false;
  if (words[0] == "element") {
    ++num_elements;
    if (num_elements == 2) TakeFaceLine(words, place.is_first_property, header);
    if (num_elements > 1) return true;  // comes after the vertices
    const auto count = words.size() == 3 ? ParseInteger(words[2]) : std::nullopt;
    if (!count || *count < 0 || words[1] != "vertex") {
      ThrowBadHeader(where, "element vertex COUNT", line);
    }
    header.num_vertices = static_cast<std::size_t>(*count);
  } else if (words[0] == "property" && num_elements > 0) {
    if (num_elements == 1) header.properties.push_back(ParseProperty(words, line, where));
    if (num_elements == 2) TakeFaceLine(words, place.is_first_property, header);
  } else {
    ThrowBadHeader(where, "element, property or end_header", line);
  }
  return true;
}

}  // namespace

std::optional<std::size_t> PlyHeader::Find(std::string_view name) const {
  for (std::size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == name) return i;
  }
  return std::nullopt;
}

std::size_t PlyHeader::VertexBytes() const {
  std::size_t bytes = 0;
  for (const PlyProperty& property : properties) bytes += PlyScalarBytes(property.type);
  return bytes;
}

PlyHeader ParsePlyHeader(const std::filesystem::path& path, std::string_view bytes) {
  PlyHeader header;
  PlyPlace place;
  for (std::size_t line_number = 1;; ++line_number) {
    const std::string where = AtLine(path, line_number);
    const std::size_t end = bytes.find('\n', header.num_bytes);
    if (end == std::string_view::npos) ThrowBadHeader(where, "a PLY header", "the end of the file");
    std::string_view line = bytes.substr(header.num_bytes, end - header.num_bytes);
    if (line.ends_with('\r')) line.remove_suffix(1);
    header.num_bytes = end + 1;
    if (line_number == 1) {
      if (line != "ply") ThrowBadHeader(where, "ply", line);
    } else if (line_number == 2) {
      if (line != "format binary_little_endian 1.0") {
        ThrowBadHeader(where, "format binary_little_endian 1.0", line);
      }
    } else if (!TakeLine(line, where, place, header)) {
      if (header.properties.empty()) ThrowBadHeader(where, "a vertex with properties", line);
      return header;
    }
  }
}

std::size_t PlyScalarBytes(PlyScalar type) {
  switch (type) {
    case PlyScalar::kInt8:
    case PlyScalar::kUint8:
      return 1;
    case PlyScalar::kInt16:
    case PlyScalar::kUint16:
      return 2;
    case PlyScalar::kInt32:
    case PlyScalar::kUint32:
    case PlyScalar::kFloat32:
      return 4;
    case PlyScalar::kFloat64:
      break;
  }
  return 8;
}

double ReadPlyScalar(PlyScalar type, const char* data) {
  switch (type) {
    case PlyScalar::kInt8:
      return Read<std::int8_t>(data);
    case PlyScalar::kUint8:
      return Read<std::uint8_t>(data);
    case PlyScalar::kInt16:
      return Read<std::int16_t>(data);
    case PlyScalar::kUint16:
      return Read<std::uint16_t>(data);
    case PlyScalar::kInt32:
      return Read<std::int32_t>(data);
    case PlyScalar::kUint32:
      return Read<std::uint32_t>(data);
    case PlyScalar::kFloat32:
      return Read<float>(data);
    case PlyScalar::kFloat64:
      break;
  }
  return Read<double>(data);
}

}  // namespace mono3d
