// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/ply_file.h"

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "io/binary_block.h"
#include "io/ply_header.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

void RequireEqualLengths(const std::filesystem::path& path, const PointCloud& cloud) {
  const auto require = [&](const char* name, std::size_t size) {
    if (size == 0 || size == cloud.size()) return;
    throw Error(ErrorParts{.what = std::string("wrong number of ") + name + " in the cloud",
                           .where = path,
                           .expected = std::to_string(cloud.size()),
                           .found = std::to_string(size)});
  };
  require("normals", cloud.normals.size());
  require("colours", cloud.colours.size());
  require("radii", cloud.radii.size());
  require("confidences", cloud.confidences.size());
  require("observations", cloud.observations.size());
  require("inferred", cloud.inferred.size());
}

std::string HeaderOf(const PointCloud& cloud) {
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                       std::to_string(cloud.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!cloud.normals.empty()) {
    header += "property float nx\nproperty float ny\nproperty float nz\n";
  }
  if (!cloud.colours.empty()) {
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  if (!cloud.radii.empty()) header += "property float radius\n";
  if (!cloud.confidences.empty()) header += "property float confidence\n";
  if (!cloud.observations.empty()) header += "property uint observations\n";
  if (!cloud.inferred.empty()) header += "property uchar inferred\n";
  return header + "end_header\n";
}

void AppendVertex(std::string& bytes, const PointCloud& cloud, std::size_t i) {
  AppendBytes(bytes, cloud.points[i].data(), 3);
  if (!cloud.normals.empty()) AppendBytes(bytes, cloud.normals[i].data(), 3);
  if (!cloud.colours.empty()) AppendBytes(bytes, cloud.colours[i].data(), 3);
  if (!cloud.radii.empty()) AppendBytes(bytes, &cloud.radii[i], 1);
  if (!cloud.confidences.empty()) AppendBytes(bytes, &cloud.confidences[i], 1);
  if (!cloud.observations.empty()) AppendBytes(bytes, &cloud.observations[i], 1);
  if (!cloud.inferred.empty()) AppendBytes(bytes, &cloud.inferred[i], 1);
}

// Where the values of one vertex go: `values` is in the order of the header's properties.
class VertexSink {
 public:
  VertexSink(const PlyHeader& header, PointCloud& cloud)
      : cloud_(cloud),
        position_{header.Find("x"), header.Find("y"), header.Find("z")},
        normal_{header.Find("nx"), header.Find("ny"), header.Find("nz")},
        colour_{header.Find("red"), header.Find("green"), header.Find("blue")},
        radius_(header.Find("radius")),
        confidence_(header.Find("confidence")),
        observations_(header.Find("observations")),
        inferred_(header.Find("inferred")) {}

  bool HasPosition() const { return Has(position_); }

  void Take(const std::vector<double>& values) {
    cloud_.points.push_back(Vector(values, position_));
    if (Has(normal_)) cloud_.normals.push_back(Vector(values, normal_));
    if (Has(colour_)) {
      std::array<std::uint8_t, 3> rgb{};
      for (std::size_t k = 0; k < 3; ++k) rgb[k] = ToUnsigned<std::uint8_t>(values[*colour_[k]]);
      cloud_.colours.push_back(rgb);
    }
    if (radius_) cloud_.radii.push_back(static_cast<float>(values[*radius_]));
    if (confidence_) cloud_.confidences.push_back(static_cast<float>(values[*confidence_]));
    if (observations_) {
      cloud_.observations.push_back(ToUnsigned<std::uint32_t>(values[*observations_]));
    }
    if (inferred_) cloud_.inferred.push_back(ToUnsigned<std::uint8_t>(values[*inferred_]));
  }

 private:
  using Index = std::optional<std::size_t>;
  using Triple = std::array<Index, 3>;

  static bool Has(const Triple& triple) { return triple[0] && triple[1] && triple[2]; }
  static Eigen::Vector3f Vector(const std::vector<double>& values, const Triple& triple) {
    return Eigen::Vector3d(values[*triple[0]], values[*triple[1]], values[*triple[2]])
        .cast<float>();
  }
  // A property of another type may hold what does not fit.
  template <typename T>
  static T ToUnsigned(double value) {
    if (!(value > 0)) return 0;
    constexpr T kMax = std::numeric_limits<T>::max();
    return value >= kMax ? kMax : static_cast<T>(value);
  }

  PointCloud& cloud_;
  Triple position_;
  Triple normal_;
  Triple colour_;
  Index radius_;
  Index confidence_;
  Index observations_;
  Index inferred_;
};

}  // namespace

void WritePly(const std::filesystem::path& path, const PointCloud& cloud) {
  RequireEqualLengths(path, cloud);
  AtomicFile file(path);
  std::string block = HeaderOf(cloud);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    AppendVertex(block, cloud, i);
    WriteWhenFull(file, block);
  }
  file.Write(block);
  file.Commit();
}

PointCloud ReadPly(const std::filesystem::path& path) {
  const std::string bytes = ReadBytes(path);
  const PlyHeader header = ParsePlyHeader(path, bytes);
  PointCloud cloud;
  VertexSink sink(header, cloud);
  if (!sink.HasPosition()) {
    throw Error(ErrorParts{.what = "no positions in the file",
                           .where = path,
                           .expected = "properties x, y and z of a vertex",
                           .found = {}});
  }
  const std::size_t available = (bytes.size() - header.num_bytes) / header.VertexBytes();
  if (available < header.num_vertices) {
    throw Error(ErrorParts{.what = "file ends too early",
                           .where = path,
                           .expected = std::to_string(header.num_vertices) + " vertices",
                           .found = std::to_string(available)});
  }
  std::vector<double> values(header.properties.size());
  const char* data = bytes.data() + header.num_bytes;
  for (std::size_t i = 0; i < header.num_vertices; ++i) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = ReadPlyScalar(header.properties[k].type, data);
      data += PlyScalarBytes(header.properties[k].type);
    }
    sink.Take(values);
  }
  return cloud;
}

}  // namespace mono3d
