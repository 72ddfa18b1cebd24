// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/ply_vertices.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <sstream>
#include <string_view>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

[[noreturn]] void ThrowNotAModel(const std::filesystem::path& path, const std::string& found) {
  throw Error(ErrorParts{.what = "not a model of surfels",
                         .where = path.string(),
                         .expected = "model.ply of mono3d-reconstruct",
                         .found = found});
}

struct Property {
  std::string type;
  std::string name;
  std::size_t offset = 0;
};

// Where the first one of these stands, of one type and one behind the other; nothing otherwise.
std::optional<std::size_t> Find(const std::vector<Property>& properties, const std::string& type,
                                const std::vector<std::string>& names) {
  const auto is_it = [&](const Property& property, const std::string& name) {
    return property.type == type && property.name == name;
  };
  const auto found =
      std::search(properties.begin(), properties.end(), names.begin(), names.end(), is_it);
  if (found == properties.end()) return std::nullopt;
  return found->offset;
}

}  // namespace

PlyVertices::PlyVertices(const std::filesystem::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status = {};
  if (file < 0 || fstat(file, &status) != 0) {
    if (file >= 0) close(file);
    ThrowNotAModel(path, "no such file");
  }
  num_bytes_ = static_cast<std::size_t>(status.st_size);
  void* mapped =
      num_bytes_ > 0 ? mmap(nullptr, num_bytes_, PROT_READ, MAP_PRIVATE, file, 0) : MAP_FAILED;
  close(file);
  if (mapped == MAP_FAILED) ThrowNotAModel(path, "an empty file, or one that cannot be read");
  bytes_ = static_cast<const char*>(mapped);
  try {
    constexpr std::string_view kEnd = "end_header\n";
    const std::string_view head(bytes_, std::min<std::size_t>(num_bytes_, 64 * 1024));
    const std::size_t end = head.find(kEnd);
    if (end == std::string_view::npos) ThrowNotAModel(path, "no header of a PLY file");
    vertices_at_ = end + kEnd.size();
    ReadHeader(std::string(head.substr(0, end)), path);
  } catch (...) {
    munmap(mapped, num_bytes_);
    throw;
  }
}

PlyVertices::~PlyVertices() { munmap(const_cast<char*>(bytes_), num_bytes_); }

void PlyVertices::ReadHeader(const std::string& header, const std::filesystem::path& path) {
  const std::map<std::string, std::size_t> sizes = {{"float", 4}, {"uchar", 1}, {"uint", 4}};
  std::vector<Property> properties;
  std::istringstream lines(header);
  bool is_vertex = false, is_binary = false;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first, second, third;
    words >> first >> second >> third;
    if (first == "format") is_binary = second == "binary_little_endian";
    if (first == "element") {
      if (stride_ == 0 && second != "vertex") ThrowNotAModel(path, "element " + second);
      is_vertex = second == "vertex";
      if (is_vertex) num_vertices_ = std::strtoll(third.c_str(), nullptr, 10);
    }
    if (first != "property" || !is_vertex) continue;
    const auto size = sizes.find(second);
    if (size == sizes.end()) ThrowNotAModel(path, "property " + second + " " + third);
    properties.push_back({second, third, stride_});
    stride_ += size->second;
  }
  const std::optional<std::size_t> x = Find(properties, "float", {"x", "y", "z"});
  if (!is_binary || !x || num_vertices_ <= 0) ThrowNotAModel(path, "another kind of PLY file");
  if (static_cast<std::size_t>(num_vertices_) > (num_bytes_ - vertices_at_) / stride_) {
    ThrowNotAModel(path, "a file that ends too early");
  }
  point_at_ = *x;
  normal_at_ = Find(properties, "float", {"nx", "ny", "nz"});
  colour_at_ = Find(properties, "uchar", {"red", "green", "blue"});
  radius_at_ = Find(properties, "float", {"radius"});
  confidence_at_ = Find(properties, "float", {"confidence"});
  observations_at_ = Find(properties, "uint", {"observations"});
  first_frame_at_ = Find(properties, "uint", {"first_frame"});
  error_at_ = Find(properties, "float", {"error"});
}

template <typename T>
T PlyVertices::Read(std::int64_t i, std::size_t offset) const {
  T value;
  std::memcpy(&value, bytes_ + vertices_at_ + static_cast<std::size_t>(i) * stride_ + offset,
              sizeof value);
  return value;
}

Eigen::Vector3f PlyVertices::Point(std::int64_t i) const {
  const auto point = Read<std::array<float, 3>>(i, point_at_);
  return {point[0], point[1], point[2]};
}

float PlyVertices::Error(std::int64_t i) const { return Read<float>(i, *error_at_); }

ViewSurfel PlyVertices::At(std::int64_t i) const {
  ViewSurfel surfel;
  surfel.point = Point(i);
  if (normal_at_) {
    const auto normal = Read<std::array<float, 3>>(i, *normal_at_);
    surfel.normal = {normal[0], normal[1], normal[2]};
  }
  if (colour_at_) surfel.colour = Read<std::array<std::uint8_t, 3>>(i, *colour_at_);
  if (radius_at_) surfel.radius = Read<float>(i, *radius_at_);
  if (confidence_at_) surfel.confidence = Read<float>(i, *confidence_at_);
  if (observations_at_) surfel.observations = Read<std::uint32_t>(i, *observations_at_);
  if (first_frame_at_) surfel.first_frame = Read<std::uint32_t>(i, *first_frame_at_);
  return surfel;
}

}  // namespace mono3d::tools
