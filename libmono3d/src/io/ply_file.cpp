// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/ply_file.h"

#include <cstddef>
#include <string>

#include "io/binary_block.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_reader.h"

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
  require("first frames", cloud.first_frames.size());
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
  if (!cloud.first_frames.empty()) header += "property uint first_frame\n";
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
  if (!cloud.first_frames.empty()) AppendBytes(bytes, &cloud.first_frames[i], 1);
}

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
  PlyReader reader(path);
  PointCloud cloud;
  reader.Read(reader.size(), cloud);
  return cloud;
}

}  // namespace mono3d
