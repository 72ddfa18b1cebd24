// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/las_file.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "io/binary_block.h"
#include "mono3d/core/version.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

constexpr std::uint16_t kHeaderBytes = 375;
constexpr std::uint16_t kRecordHeaderBytes = 54;
constexpr std::uint16_t kPointBytes = 36;  // of format 7

template <typename T>
void Put(std::string& bytes, T value) {
  AppendBytes(bytes, &value, 1);
}

// Text in a field of so many bytes, zeros behind it.
void PutText(std::string& bytes, std::string_view text, std::size_t size) {
  text = text.substr(0, size);
  bytes += text;
  bytes.append(size - text.size(), '\0');
}

// A property that the format has not by itself.
struct ExtraProperty {
  std::string_view name;
  std::string_view description;
};

struct LasLayout {
  std::array<double, 3> scale{};
  Eigen::Vector3d offset;
  bool has_confidence = false;
  bool has_radius = false;
  bool has_normal = false;

  std::vector<ExtraProperty> ExtraProperties() const {
    std::vector<ExtraProperty> extra;
    if (has_confidence) extra.push_back({"confidence", "0 to 1"});
    if (has_radius) extra.push_back({"radius", "of the surfel"});
    if (has_normal) {
      extra.push_back({"NormalX", "outwards"});
      extra.push_back({"NormalY", "outwards"});
      extra.push_back({"NormalZ", "outwards"});
    }
    return extra;
  }

  std::int32_t Step(const Eigen::Vector3d& point, int k) const {
    const double steps = std::round((point[k] - offset[k]) / scale[static_cast<std::size_t>(k)]);
    return static_cast<std::int32_t>(steps);
  }
  double Value(const Eigen::Vector3d& point, int k) const {
    return Step(point, k) * scale[static_cast<std::size_t>(k)] + offset[k];
  }
};

// A power of ten, as people expect it, that is below a tenth of the radius and lets the model fit
// into 32 bits.
double LasScale(double radius, double extent) {
  const double wanted = radius > 0 ? radius / 10 : extent / 1e7;
  double scale = std::pow(10, std::floor(std::log10(std::max(wanted, 1e-9))));
  while (extent / scale > 0.99 * std::numeric_limits<std::int32_t>::max()) scale *= 10;
  return scale;
}

LasLayout LayoutOf(MapSurfels& surfels, const MapAxes& axes) {
  LasLayout layout;
  const Eigen::Vector3d extent = surfels.bounds().sizes();
  const double radius = surfels.median_radius();
  layout.scale = {LasScale(radius / axes.ModelUnitsPerUnit(), extent.x()),
                  LasScale(radius / axes.ModelUnitsPerUnit(), extent.y()),
                  LasScale(radius, extent.z())};
  layout.offset = surfels.bounds().center().array().round();
  MapSurfelBlock first;
  surfels.Read(0, first);
  layout.has_confidence = !first.cloud.confidences.empty();
  layout.has_radius = !first.cloud.radii.empty();
  layout.has_normal = !first.cloud.normals.empty();
  return layout;
}

void PutRecordHeader(std::string& bytes, std::string_view user, std::uint16_t id, std::size_t size,
                     std::string_view description) {
  Put<std::uint16_t>(bytes, 0);
  PutText(bytes, user, 16);
  Put(bytes, id);
  Put(bytes, static_cast<std::uint16_t>(size));
  PutText(bytes, description, 32);
}

// The variable length records: the coordinate system, and what the extra bytes are.
std::string RecordsOf(const LasLayout& layout, const MapAxes& axes, std::uint32_t& num_records) {
  std::string bytes;
  num_records = 0;
  if (axes.system() != nullptr) {
    const std::string wkt = axes.system()->wkt1() + '\0';
    PutRecordHeader(bytes, "LASF_Projection", 2112, wkt.size(), "OGC Coordinate System WKT");
    bytes += wkt;
    ++num_records;
  }
  const std::vector<ExtraProperty> extra = layout.ExtraProperties();
  if (extra.empty()) return bytes;
  constexpr std::size_t kDescriptorBytes = 192;
  PutRecordHeader(bytes, "LASF_Spec", 4, extra.size() * kDescriptorBytes, "Extra Bytes");
  for (const ExtraProperty& property : extra) {
    constexpr std::uint8_t kFloat = 9;
    const std::size_t end = bytes.size() + kDescriptorBytes;
    Put<std::uint16_t>(bytes, 0);
    Put(bytes, kFloat);
    Put<std::uint8_t>(bytes, 0);  // no range, scale or value for "none" is told
    PutText(bytes, property.name, 32);
    bytes.append(end - bytes.size() - 32, '\0');
    PutText(bytes, property.description, 32);
  }
  ++num_records;
  return bytes;
}

std::string LasHeader(const LasLayout& layout, const MapSurfels& surfels, std::size_t record_bytes,
                      std::uint32_t num_records) {
  std::string bytes = "LASF";
  Put<std::uint16_t>(bytes, 0);       // file source
  Put<std::uint16_t>(bytes, 1 << 4);  // coordinate systems are WKT
  bytes.append(16, '\0');             // GUID
  bytes += '\1';
  bytes += '\4';
  PutText(bytes, "photogrammetry", 32);
  PutText(bytes, std::string("mono3d ") + Version(), 32);
  const auto today = std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
  const std::chrono::year_month_day date(today);
  const std::chrono::sys_days new_year = date.year() / std::chrono::January / 1;
  Put(bytes, static_cast<std::uint16_t>((today - new_year).count() + 1));
  Put(bytes, static_cast<std::uint16_t>(static_cast<int>(date.year())));
  Put(bytes, kHeaderBytes);
  Put(bytes, static_cast<std::uint32_t>(kHeaderBytes + record_bytes));
  Put(bytes, num_records);
  Put<std::uint8_t>(bytes, 7);
  const std::size_t num_extra = layout.ExtraProperties().size();
  Put(bytes, static_cast<std::uint16_t>(kPointBytes + num_extra * sizeof(float)));
  bytes.append(std::size_t{6} * 4, '\0');  // numbers of points, for formats before 6
  for (const double scale : layout.scale) Put(bytes, scale);
  for (int k = 0; k < 3; ++k) Put(bytes, layout.offset[k]);
  for (int k = 0; k < 3; ++k) {
    Put(bytes, layout.Value(surfels.bounds().max(), k));
    Put(bytes, layout.Value(surfels.bounds().min(), k));
  }
  bytes.append(std::size_t{8} + 8 + 4, '\0');  // no waveforms, no records behind the points
  Put(bytes, static_cast<std::uint64_t>(surfels.size()));
  Put(bytes, static_cast<std::uint64_t>(surfels.size()));  // first returns
  bytes.append(std::size_t{14} * 8, '\0');
  return bytes;
}

void PutPoint(std::string& bytes, const LasLayout& layout, const MapSurfelBlock& surfels,
              std::size_t i, double radius_scale) {
  for (int k = 0; k < 3; ++k) Put(bytes, layout.Step(surfels.points[i], k));
  Put<std::uint16_t>(bytes, 0);    // intensity
  Put<std::uint8_t>(bytes, 0x11);  // the first of one return
  bytes.append(5, '\0');           // flags, class (never classified), user data, scan angle
  Put<std::uint16_t>(bytes, 0);    // point source
  Put<double>(bytes, 0);           // GPS time
  const PointCloud& cloud = surfels.cloud;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint8_t level = cloud.colours.empty() ? 0 : cloud.colours[i][k];
    Put(bytes, static_cast<std::uint16_t>(257 * level));  // 255 is 65535
  }
  if (layout.has_confidence) Put(bytes, cloud.confidences[i]);
  if (layout.has_radius) Put(bytes, static_cast<float>(cloud.radii[i] * radius_scale));
  if (layout.has_normal) AppendBytes(bytes, surfels.normals[i].data(), 3);
}

}  // namespace

void WriteLas(const std::filesystem::path& path, MapSurfels& surfels, const MapAxes& axes) {
  const LasLayout layout = LayoutOf(surfels, axes);
  std::uint32_t num_records = 0;
  const std::string records = RecordsOf(layout, axes, num_records);
  AtomicFile file(path);
  std::string bytes = LasHeader(layout, surfels, records.size(), num_records) + records;
  MapSurfelBlock block;
  for (std::size_t index = 0; index < surfels.num_blocks(); ++index) {
    surfels.Read(index, block);
    for (std::size_t i = 0; i < block.points.size(); ++i) {
      PutPoint(bytes, layout, block, i, 1 / axes.ModelUnitsPerUnit());
      WriteWhenFull(file, bytes);
    }
  }
  file.Write(bytes);
  file.Commit();
}

}  // namespace mono3d
