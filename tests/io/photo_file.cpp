// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/photo_file.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

namespace mono3d {
namespace {

using namespace std::string_literals;

// Types of TIFF 6.0.
constexpr int kAsciiType = 2;
constexpr int kShortType = 3;
constexpr int kLongType = 4;
constexpr int kRationalType = 5;
constexpr int kByteType = 1;
constexpr int kExifPointerTag = 0x8769;
constexpr int kGpsPointerTag = 0x8825;

std::string App1(const std::string& content) {
  const std::size_t length = content.size() + 2;  // counts itself
  return "\xFF\xE1"s + static_cast<char>(length >> 8U) + static_cast<char>(length & 0xFFU) +
         content;
}

}  // namespace

ExifWriter& ExifWriter::Add(Directory directory, const Entry& entry) {
  switch (directory) {
    case Directory::kImage:
      image_.push_back(entry);
      break;
    case Directory::kExif:
      exif_.push_back(entry);
      break;
    case Directory::kGps:
      gps_.push_back(entry);
      break;
  }
  return *this;
}

std::string ExifWriter::Number(std::uint32_t value, int num_bytes) const {
  std::string bytes;
  for (int i = 0; i < num_bytes; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  if (order_ == ByteOrder::kBigEndian) std::ranges::reverse(bytes);
  return bytes;
}

ExifWriter& ExifWriter::Ascii(Directory directory, int tag, const std::string& text) {
  return Add(directory,
             {tag, kAsciiType, static_cast<std::uint32_t>(text.size() + 1), text + '\0'});
}
ExifWriter& ExifWriter::Short(Directory directory, int tag, std::uint32_t value) {
  return Add(directory, {tag, kShortType, 1, Number(value, 2)});
}
ExifWriter& ExifWriter::Long(Directory directory, int tag, std::uint32_t value) {
  return Add(directory, {tag, kLongType, 1, Number(value, 4)});
}
ExifWriter& ExifWriter::Rational(Directory directory, int tag, std::uint32_t numerator,
                                 std::uint32_t denominator) {
  return Add(directory, {tag, kRationalType, 1, Number(numerator, 4) + Number(denominator, 4)});
}
ExifWriter& ExifWriter::Bytes(Directory directory, int tag, const std::string& bytes) {
  return Add(directory, {tag, kByteType, static_cast<std::uint32_t>(bytes.size()), bytes});
}

ExifWriter& ExifWriter::Camera(const std::string& make, const std::string& model) {
  return Ascii(Directory::kImage, 0x010F, make).Ascii(Directory::kImage, 0x0110, model);
}
ExifWriter& ExifWriter::Serial(const std::string& serial) {
  return Ascii(Directory::kExif, 0xA431, serial);
}
ExifWriter& ExifWriter::Size(int width, int height) {
  return Long(Directory::kExif, 0xA002, static_cast<std::uint32_t>(width))
      .Long(Directory::kExif, 0xA003, static_cast<std::uint32_t>(height));
}
ExifWriter& ExifWriter::FocalLength(double focal_mm) {
  return Rational(Directory::kExif, 0x920A,
                  static_cast<std::uint32_t>(std::llround(100 * focal_mm)), 100);
}
ExifWriter& ExifWriter::FocalLength35(int focal_mm) {
  return Short(Directory::kExif, 0xA405, static_cast<std::uint32_t>(focal_mm));
}
ExifWriter& ExifWriter::FocalPlane(double resolution, int unit) {
  const auto numerator = static_cast<std::uint32_t>(std::llround(1000 * resolution));
  return Rational(Directory::kExif, 0xA20E, numerator, 1000)
      .Rational(Directory::kExif, 0xA20F, numerator, 1000)
      .Short(Directory::kExif, 0xA210, static_cast<std::uint32_t>(unit));
}

ExifWriter& ExifWriter::Angle(int tag, double degrees) {
  constexpr std::uint32_t kPerSecond = 10'000;
  const auto parts = static_cast<std::uint64_t>(std::llround(degrees * 3600 * kPerSecond));
  const auto seconds = static_cast<std::uint32_t>(parts % (60 * kPerSecond));
  const auto minutes = static_cast<std::uint32_t>(parts / (60 * kPerSecond));
  return Add(Directory::kGps, {tag, kRationalType, 3,
                               Number(minutes / 60, 4) + Number(1, 4) + Number(minutes % 60, 4) +
                                   Number(1, 4) + Number(seconds, 4) + Number(kPerSecond, 4)});
}
ExifWriter& ExifWriter::Place(double latitude_deg, double longitude_deg, double altitude_m) {
  return Ascii(Directory::kGps, 1, latitude_deg < 0 ? "S" : "N")
      .Angle(2, std::abs(latitude_deg))
      .Ascii(Directory::kGps, 3, longitude_deg < 0 ? "W" : "E")
      .Angle(4, std::abs(longitude_deg))
      .Bytes(Directory::kGps, 5, altitude_m < 0 ? "\x01"s : "\0"s)
      .Rational(Directory::kGps, 6,
                static_cast<std::uint32_t>(std::llround(1000 * std::abs(altitude_m))), 1000);
}

// Values of more than 4 bytes go to the end of `values`, which begin at `values_begin`.
std::string ExifWriter::DirectoryBytes(std::vector<Entry> entries, std::uint32_t values_begin,
                                       std::string& values) const {
  std::ranges::stable_sort(entries, {}, &Entry::tag);
  std::string bytes = Number(static_cast<std::uint32_t>(entries.size()), 2);
  for (const Entry& entry : entries) {
    bytes += Number(static_cast<std::uint32_t>(entry.tag), 2) +
             Number(static_cast<std::uint32_t>(entry.type), 2) + Number(entry.count, 4);
    if (entry.value.size() <= 4) {
      bytes += entry.value + std::string(4 - entry.value.size(), '\0');
    } else {
      bytes += Number(values_begin + static_cast<std::uint32_t>(values.size()), 4);
      values += entry.value;
      if (values.size() % 2 == 1) values += '\0';
    }
  }
  return bytes + Number(0, 4);  // no further directory
}

std::string ExifWriter::Tiff() const {
  constexpr std::size_t kHeader = 8;
  const auto size = [](std::size_t num_entries) { return 2 + 12 * num_entries + 4; };
  const std::size_t num_pointers = gps_.empty() ? 1 : 2;
  const std::size_t exif_begin = kHeader + size(image_.size() + num_pointers);
  const std::size_t gps_begin = exif_begin + size(exif_.size());
  const auto values_begin =
      static_cast<std::uint32_t>(gps_begin + (gps_.empty() ? 0 : size(gps_.size())));
  std::vector<Entry> image = image_;
  const auto point_to = [&](int tag, std::size_t begin) {
    image.push_back({tag, kLongType, 1, Number(static_cast<std::uint32_t>(begin), 4)});
  };
  point_to(kExifPointerTag, exif_begin);
  if (!gps_.empty()) point_to(kGpsPointerTag, gps_begin);
  std::string values;
  std::string bytes = order_ == ByteOrder::kBigEndian ? "MM" : "II";
  bytes += Number(42, 2) + Number(kHeader, 4);
  bytes += DirectoryBytes(image, values_begin, values);
  bytes += DirectoryBytes(exif_, values_begin, values);
  if (!gps_.empty()) bytes += DirectoryBytes(gps_, values_begin, values);
  return bytes + values;
}

std::string ExifWriter::Block() const { return "Exif\0\0"s + Tiff(); }

std::string JpegPhoto(int width, int height, const std::string& exif, const std::string& xmp) {
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", cv::Mat(height, width, CV_8UC3, cv::Scalar::all(90)), jpeg);
  std::string bytes(jpeg.begin(), jpeg.begin() + 2);
  if (!exif.empty()) bytes += App1(exif);
  if (!xmp.empty()) bytes += App1("http://ns.adobe.com/xap/1.0/\0"s + xmp);
  return bytes + std::string(jpeg.begin() + 2, jpeg.end());
}

std::string DjiPacket(const std::string& attributes) {
  return "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n"
         "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n"
         " <rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n"
         "  <rdf:Description rdf:about=\"DJI Meta Data\"\n"
         "    xmlns:drone-dji=\"http://www.dji.com/drone-dji/1.0/\"\n    " +
         attributes + "/>\n </rdf:RDF>\n</x:xmpmeta>\n<?xpacket end=\"w\"?>";
}

}  // namespace mono3d
