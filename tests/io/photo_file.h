// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mono3d {

// Writes the EXIF of a photo, byte by byte: what reads it is another library.
class ExifWriter {
 public:
  enum class ByteOrder { kLittleEndian, kBigEndian };
  enum class Directory { kImage, kExif, kGps };

  explicit ExifWriter(ByteOrder order = ByteOrder::kLittleEndian) : order_(order) {}

  ExifWriter& Ascii(Directory directory, int tag, const std::string& text);
  ExifWriter& Short(Directory directory, int tag, std::uint32_t value);
  ExifWriter& Long(Directory directory, int tag, std::uint32_t value);
  ExifWriter& Rational(Directory directory, int tag, std::uint32_t numerator,
                       std::uint32_t denominator);
  ExifWriter& Angle(int tag, double degrees);
  ExifWriter& Bytes(Directory directory, int tag, const std::string& bytes);

  ExifWriter& Camera(const std::string& make, const std::string& model);
  ExifWriter& Serial(const std::string& serial);
  ExifWriter& Size(int width, int height);  // PixelXDimension, PixelYDimension
  ExifWriter& FocalLength(double focal_mm);
  ExifWriter& FocalLength35(int focal_mm);
  // FocalPlaneXResolution and FocalPlaneYResolution; unit 2: per inch, 3: per cm.
  ExifWriter& FocalPlane(double resolution, int unit);

  // GPSLatitude, GPSLongitude (degrees, minutes, seconds to 1e-4) and their references;
  // GPSAltitude.
  ExifWriter& Place(double latitude_deg, double longitude_deg, double altitude_m);

  std::string Tiff() const;
  std::string Block() const;  // as in a JPEG file, with the header "Exif\0\0"

 private:
  struct Entry {
    int tag = 0;
    int type = 0;
    std::uint32_t count = 0;
    std::string value;
  };

  ExifWriter& Add(Directory directory, const Entry& entry);
  std::string Number(std::uint32_t value, int num_bytes) const;
  std::string DirectoryBytes(std::vector<Entry> entries, std::uint32_t values_begin,
                             std::string& values) const;

  ByteOrder order_;
  std::vector<Entry> image_;
  std::vector<Entry> exif_;
  std::vector<Entry> gps_;
};

// The bytes of a JPEG file of this size with an EXIF block and an XMP packet, where not empty.
std::string JpegPhoto(int width, int height, const std::string& exif, const std::string& xmp = {});

// An XMP packet with these attributes of DJI's namespace: `drone-dji:DewarpFlag="0"`.
std::string DjiPacket(const std::string& attributes);

}  // namespace mono3d
