// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/exif.h"

#include <libexif/exif-data.h>
#include <libexif/exif-utils.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <span>

#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

constexpr double kSensorWidth_mm = 36;
constexpr int kStartHour = 10;
constexpr const char* kStartDate = "2025:06:21";

struct Unref {
  void operator()(ExifData* data) const { exif_data_unref(data); }
};

// Fills the entries of one EXIF directory.
class Directory {
 public:
  Directory(ExifData* data, ExifIfd ifd)
      : content_(data->ifd[ifd]), order_(exif_data_get_byte_order(data)) {}

  void SetAscii(int tag, const std::string& text) {
    const std::size_t size = text.size() + 1;
    std::memcpy(Add(tag, EXIF_FORMAT_ASCII, size, size), text.c_str(), size);
  }
  void SetShort(int tag, int value) {
    exif_set_short(Add(tag, EXIF_FORMAT_SHORT, 1, 2), order_, static_cast<ExifShort>(value));
  }
  void SetLong(int tag, int value) {
    exif_set_long(Add(tag, EXIF_FORMAT_LONG, 1, 4), order_, static_cast<ExifLong>(value));
  }
  void SetBytes(int tag, std::span<const unsigned char> bytes) {
    std::copy(bytes.begin(), bytes.end(), Add(tag, EXIF_FORMAT_BYTE, bytes.size(), bytes.size()));
  }
  void SetRationals(int tag, std::span<const ExifRational> values) {
    unsigned char* bytes = Add(tag, EXIF_FORMAT_RATIONAL, values.size(), 8 * values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      exif_set_rational(bytes + 8 * i, order_, values[i]);
    }
  }
  void SetRational(int tag, double value, std::uint32_t denominator) {
    const auto numerator = static_cast<ExifLong>(std::llround(value * denominator));
    SetRationals(tag, std::array{ExifRational{numerator, denominator}});
  }

 private:
  unsigned char* Add(int tag, ExifFormat format, std::size_t components, std::size_t size) {
    ExifEntry* entry = exif_entry_new();
    // The entry frees its bytes with std::free.
    auto* bytes = static_cast<unsigned char*>(std::calloc(1, size));
    if (entry == nullptr || bytes == nullptr) throw Error("no memory for EXIF");
    entry->tag = static_cast<ExifTag>(tag);
    entry->format = format;
    entry->components = components;
    entry->data = bytes;
    entry->size = static_cast<unsigned int>(size);
    exif_content_add_entry(content_, entry);
    exif_entry_unref(entry);  // the directory holds it
    return bytes;
  }

  ExifContent* content_;
  ExifByteOrder order_;
};

std::string TwoDigits(int value) { return (value < 10 ? "0" : "") + std::to_string(value); }

struct ClockTime {
  int hours;
  int minutes;
  int seconds;
  int milliseconds;
};

ClockTime TimeOfDay(double timestamp_s) {
  const long long total_ms = std::llround(1000 * timestamp_s) + 3'600'000LL * kStartHour;
  const auto seconds = static_cast<int>(total_ms / 1000 % 86'400);
  return {seconds / 3600, seconds / 60 % 60, seconds % 60, static_cast<int>(total_ms % 1000)};
}

// Degrees, minutes and seconds; a microsecond of arc is 3e-5 m on the ground.
std::array<ExifRational, 3> Sexagesimal(double degrees) {
  constexpr ExifLong kPerSecond = 1'000'000;
  const auto total =
      static_cast<std::uint64_t>(std::llround(std::abs(degrees) * 3600 * kPerSecond));
  const std::uint64_t per_minute = 60ULL * kPerSecond;
  return {ExifRational{static_cast<ExifLong>(total / (60 * per_minute)), 1},
          ExifRational{static_cast<ExifLong>(total / per_minute % 60), 1},
          ExifRational{static_cast<ExifLong>(total % per_minute), kPerSecond}};
}

void SetPlace(ExifData* data, const Geodetic& place, const ClockTime& time) {
  Directory gps(data, EXIF_IFD_GPS);
  gps.SetBytes(EXIF_TAG_GPS_VERSION_ID, std::array<unsigned char, 4>{2, 3, 0, 0});
  gps.SetAscii(EXIF_TAG_GPS_LATITUDE_REF, place.latitude_deg < 0 ? "S" : "N");
  gps.SetRationals(EXIF_TAG_GPS_LATITUDE, Sexagesimal(place.latitude_deg));
  gps.SetAscii(EXIF_TAG_GPS_LONGITUDE_REF, place.longitude_deg < 0 ? "W" : "E");
  gps.SetRationals(EXIF_TAG_GPS_LONGITUDE, Sexagesimal(place.longitude_deg));
  const unsigned char below = place.altitude_m < 0 ? 1 : 0;
  gps.SetBytes(EXIF_TAG_GPS_ALTITUDE_REF, std::span(&below, 1));
  gps.SetRational(EXIF_TAG_GPS_ALTITUDE, std::abs(place.altitude_m), 10'000);
  const ExifRational seconds{static_cast<ExifLong>(1000 * time.seconds + time.milliseconds), 1000};
  gps.SetRationals(EXIF_TAG_GPS_TIME_STAMP,
                   std::array{ExifRational{static_cast<ExifLong>(time.hours), 1},
                              ExifRational{static_cast<ExifLong>(time.minutes), 1}, seconds});
  gps.SetAscii(EXIF_TAG_GPS_MAP_DATUM, "WGS-84");
  gps.SetAscii(EXIF_TAG_GPS_DATE_STAMP, kStartDate);
}

void SetCamera(ExifData* data, const ExifFacts& facts, const ClockTime& time) {
  const std::string date = std::string(kStartDate) + " " + TwoDigits(time.hours) + ":" +
                           TwoDigits(time.minutes) + ":" + TwoDigits(time.seconds);
  const std::string milliseconds = std::to_string(1000 + time.milliseconds).substr(1);
  Directory image(data, EXIF_IFD_0);
  image.SetAscii(EXIF_TAG_MAKE, "mono3d");
  image.SetAscii(EXIF_TAG_MODEL, "mono3d-simulate");
  image.SetAscii(EXIF_TAG_DATE_TIME, date);
  Directory exif(data, EXIF_IFD_EXIF);
  exif.SetAscii(EXIF_TAG_DATE_TIME_ORIGINAL, date);
  exif.SetAscii(EXIF_TAG_SUB_SEC_TIME_ORIGINAL, milliseconds);
  // Held upright the sensor's width is the height of the image.
  const double focal_mm = facts.focal_px * kSensorWidth_mm / std::max(facts.width, facts.height);
  exif.SetRational(EXIF_TAG_FOCAL_LENGTH, focal_mm, 10'000);
  exif.SetShort(EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM, static_cast<int>(std::lround(focal_mm)));
  exif.SetLong(EXIF_TAG_PIXEL_X_DIMENSION, facts.width);
  exif.SetLong(EXIF_TAG_PIXEL_Y_DIMENSION, facts.height);
}

std::string ExifBlock(const ExifFacts& facts) {
  const std::unique_ptr<ExifData, Unref> data(exif_data_new());
  if (!data) throw Error("no memory for EXIF");
  exif_data_set_byte_order(data.get(), EXIF_BYTE_ORDER_INTEL);
  const ClockTime time = TimeOfDay(facts.timestamp_s);
  SetCamera(data.get(), facts, time);
  if (facts.place) SetPlace(data.get(), *facts.place, time);
  unsigned char* bytes = nullptr;
  unsigned int size = 0;
  exif_data_save_data(data.get(), &bytes, &size);
  const std::unique_ptr<unsigned char, decltype(&std::free)> owner(bytes, &std::free);
  if (bytes == nullptr || size == 0) throw Error("EXIF cannot be written");
  return {bytes, bytes + size};
}

}  // namespace

std::string WithExif(const std::string& jpeg, const ExifFacts& facts) {
  if (jpeg.compare(0, 2, "\xFF\xD8") != 0) throw Error("EXIF goes into JPEG images alone");
  const std::string block = ExifBlock(facts);
  const std::size_t length = block.size() + 2;  // counts itself
  std::string segment = "\xFF\xE1";
  segment += static_cast<char>(length >> 8U);
  segment += static_cast<char>(length & 0xFFU);
  return jpeg.substr(0, 2) + segment + block + jpeg.substr(2);
}

}  // namespace mono3d::tools
