// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/ply_reader.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "io/ply_header.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

[[noreturn]] void RefusePly(const std::filesystem::path& path, const char* what, ErrorCode code) {
  throw Error(ErrorParts{.what = what, .where = path, .expected = {}, .found = {}, .code = code});
}

std::ifstream OpenPly(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    RefusePly(path, "there is no such file", ErrorCode::kNotFound);
  }
  // A pipe may never end, nor a device.
  if (!std::filesystem::is_regular_file(path, ignored)) {
    RefusePly(path,
              std::filesystem::exists(path / "model.ply", ignored)
                  ? "cannot read the file: it is a folder; name the model.ply in it"
              : std::filesystem::is_directory(path, ignored)
                  ? "cannot read the file: it is a folder"
                  : "cannot read the file: not a regular one",
              ErrorCode::kIo);
  }
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open()) RefusePly(path, "cannot read the file", ErrorCode::kIo);
  return file;
}

PlyHeader ReadPlyHeader(const std::filesystem::path& path, std::ifstream& file) {
  // Comments may be long, but not longer than a header that somebody reads.
  constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20;
  std::string bytes(kMaxHeaderBytes, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  if (file.bad()) RefusePly(path, "cannot read the file", ErrorCode::kIo);
  file.clear();
  return ParsePlyHeader(path, bytes);
}

}  // namespace

// Where the values of one vertex go: `values` is in the order of the header's properties.
class PlyReader::Sink {
 public:
  Sink(const PlyHeader& header, PointCloud& cloud)
      : cloud_(cloud),
        position_{header.Find("x"), header.Find("y"), header.Find("z")},
        normal_{header.Find("nx"), header.Find("ny"), header.Find("nz")},
        colour_{header.Find("red"), header.Find("green"), header.Find("blue")},
        radius_(header.Find("radius")),
        confidence_(header.Find("confidence")),
        observations_(header.Find("observations")),
        inferred_(header.Find("inferred")),
        first_frame_(header.Find("first_frame")) {}

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
    if (first_frame_) {
      cloud_.first_frames.push_back(ToUnsigned<std::uint32_t>(values[*first_frame_]));
    }
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
  Index first_frame_;
};

struct PlyReader::Form {
  PlyHeader header;
  std::size_t vertex_bytes = 0;
};

PlyReader::PlyReader(const std::filesystem::path& path)
    : path_(path), file_(OpenPly(path)), form_(std::make_unique<Form>()) {
  form_->header = ReadPlyHeader(path_, file_);
  form_->vertex_bytes = form_->header.VertexBytes();
  PointCloud none;
  if (!Sink(form_->header, none).HasPosition()) {
    throw Error(ErrorParts{.what = "no positions in the file",
                           .where = path_,
                           .expected = "properties x, y and z of a vertex",
                           .found = {}});
  }
  std::error_code error;
  const std::uintmax_t num_bytes = std::filesystem::file_size(path_, error);
  if (error) RefusePly(path_, "cannot read the file", ErrorCode::kIo);
  const std::size_t available =
      num_bytes < form_->header.num_bytes
          ? 0
          : static_cast<std::size_t>(num_bytes - form_->header.num_bytes) / form_->vertex_bytes;
  if (available < form_->header.num_vertices) {
    throw Error(ErrorParts{.what = "file ends too early",
                           .where = path_,
                           .expected = std::to_string(form_->header.num_vertices) + " vertices",
                           .found = std::to_string(available)});
  }
  Seek(0);
}

PlyReader::~PlyReader() = default;

std::size_t PlyReader::size() const { return form_->header.num_vertices; }

void PlyReader::Seek(std::size_t index) {
  next_ = std::min(index, size());
  file_.clear();
  file_.seekg(static_cast<std::streamoff>(form_->header.num_bytes + next_ * form_->vertex_bytes));
}

std::size_t PlyReader::Read(std::size_t max_count, PointCloud& cloud) {
  constexpr std::size_t kVerticesAtOnce = std::size_t{1} << 14;
  cloud = PointCloud();
  Sink sink(form_->header, cloud);
  const std::vector<PlyProperty>& properties = form_->header.properties;
  std::vector<double> values(properties.size());
  std::string bytes;
  const std::size_t end = std::min(size(), next_ + std::min(max_count, size()));
  while (next_ < end) {
    const std::size_t count = std::min(kVerticesAtOnce, end - next_);
    bytes.resize(count * form_->vertex_bytes);
    if (!file_.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
      RefusePly(path_, "cannot read the file", ErrorCode::kIo);
    }
    const char* data = bytes.data();
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < values.size(); ++k) {
        values[k] = ReadPlyScalar(properties[k].type, data);
        data += PlyScalarBytes(properties[k].type);
      }
      sink.Take(values);
    }
    next_ += count;
  }
  return cloud.size();
}

}  // namespace mono3d
