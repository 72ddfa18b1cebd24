// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/exif_camera.h"

#include <libexif/exif-data.h>
#include <libexif/exif-log.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <string_view>

namespace mono3d {
namespace {

struct UnrefExif {
  void operator()(ExifData* data) const { exif_data_unref(data); }
  void operator()(ExifLog* log) const { exif_log_unref(log); }
};

// The printable characters of a text, without blanks at its ends: it goes into messages.
std::string PrintableText(std::string_view bytes) {
  std::string text;
  for (const char c : bytes.substr(0, bytes.find('\0'))) {
    if (static_cast<unsigned char>(c) >= ' ' && c != '\x7F') text += c;
  }
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

// Reads the entries of the EXIF directories. libexif checks that the bytes of an entry are as many
// as its format and number of components need.
class ExifReader {
 public:
  explicit ExifReader(ExifData* data) : data_(data), order_(exif_data_get_byte_order(data)) {}

  bool IsEmpty() const {
    for (const ExifContent* content : data_->ifd) {
      if (content != nullptr && content->count > 0) return false;
    }
    return true;
  }

  std::string Bytes(ExifIfd ifd, int tag) const {
    const ExifEntry* entry = Find(ifd, tag);
    if (entry == nullptr) return {};
    return {reinterpret_cast<const char*>(entry->data), entry->size};
  }
  std::string Text(ExifIfd ifd, int tag) const { return PrintableText(Bytes(ifd, tag)); }

  // The first number of the entry where it is finite and positive, otherwise 0.
  double Positive(ExifIfd ifd, int tag) const {
    const ExifEntry* entry = Find(ifd, tag);
    const double number = entry == nullptr ? 0 : Number(*entry);
    return std::isfinite(number) && number > 0 ? number : 0;
  }
  // Degrees, minutes and seconds as degrees; the finest step that they are written in comes with
  // them.
  std::optional<double> Degrees(ExifIfd ifd, int tag, double& step_deg) const {
    const ExifEntry* entry = Find(ifd, tag);
    constexpr std::size_t kSize = 8;  // bytes of a rational number
    if (entry == nullptr || entry->format != EXIF_FORMAT_RATIONAL || entry->components != 3 ||
        entry->size < 3 * kSize) {
      return std::nullopt;
    }
    double degrees = 0;
    double unit = 1;
    for (std::size_t i = 0; i < 3; ++i, unit /= 60) {
      const ExifRational part = exif_get_rational(entry->data + i * kSize, order_);
      if (part.denominator == 0) {
        if (part.numerator != 0) return std::nullopt;
        continue;  // 0/0: minutes and seconds that are not used
      }
      degrees += unit * part.numerator / part.denominator;
      step_deg = std::min(step_deg, unit / part.denominator);
    }
    return degrees;
  }

  // Finite, 0 or more; nothing where it is not told.
  std::optional<double> NotNegative(ExifIfd ifd, int tag) const {
    const ExifEntry* entry = Find(ifd, tag);
    if (entry == nullptr) return std::nullopt;
    const double number = Number(*entry);
    return std::isfinite(number) && number >= 0 ? std::optional(number) : std::nullopt;
  }

  int Size(ExifIfd ifd, int tag) const {
    constexpr double kMaxSize = 1e6;  // px; more than any picture has
    const double size = Positive(ifd, tag);
    return size <= kMaxSize ? static_cast<int>(size) : 0;
  }

 private:
  const ExifEntry* Find(ExifIfd ifd, int tag) const {
    const ExifEntry* entry = exif_content_get_entry(data_->ifd[ifd], static_cast<ExifTag>(tag));
    return entry == nullptr || entry->data == nullptr ? nullptr : entry;
  }

  double Number(const ExifEntry& entry) const {
    if (entry.components == 0 || entry.size < exif_format_get_size(entry.format)) return 0;
    switch (entry.format) {
      case EXIF_FORMAT_SHORT:
        return exif_get_short(entry.data, order_);
      case EXIF_FORMAT_LONG:
        return exif_get_long(entry.data, order_);
      case EXIF_FORMAT_RATIONAL: {
        const ExifRational value = exif_get_rational(entry.data, order_);
        return value.denominator == 0 ? 0
                                      : static_cast<double>(value.numerator) / value.denominator;
      }
      case EXIF_FORMAT_SRATIONAL: {
        const ExifSRational value = exif_get_srational(entry.data, order_);
        return value.denominator == 0 ? 0
                                      : static_cast<double>(value.numerator) / value.denominator;
      }
      default:
        return 0;
    }
  }

  ExifData* data_;
  ExifByteOrder order_;
};

// Pixels per mm of the sensor; 0 where the two directions disagree or one is not told.
double PixelsPerMm(const ExifReader& exif) {
  constexpr double kMaxDisagreement = 0.1;  // of pixels that are all but square
  constexpr double kMmPerInch = 25.4;
  const double x = exif.Positive(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_X_RESOLUTION);
  const double y = exif.Positive(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_Y_RESOLUTION);
  if (x == 0 || y == 0 || std::abs(x / y - 1) > kMaxDisagreement) return 0;
  const double mean = (x + y) / 2;
  switch (exif.Size(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_PLANE_RESOLUTION_UNIT)) {
    case 0:  // EXIF: inches where no unit is told
    case 2:
      return mean / kMmPerInch;
    case 3:
      return mean / 10;  // cm
    case 4:
      return mean;  // mm and um are no EXIF, but TIFF/EP and used
    case 5:
      return mean * 1000;
    default:
      return 0;
  }
}

constexpr int kGpsLatitudeRef = 1;
constexpr int kGpsLatitude = 2;
constexpr int kGpsLongitudeRef = 3;
constexpr int kGpsLongitude = 4;
constexpr int kGpsAltitudeRef = 5;
constexpr int kGpsAltitude = 6;
constexpr int kGpsHorizontalError = 0x1F;

std::optional<ExifPosition> PositionOf(const ExifReader& exif) {
  double step_deg = 1;
  const std::optional<double> latitude = exif.Degrees(EXIF_IFD_GPS, kGpsLatitude, step_deg);
  const std::optional<double> longitude = exif.Degrees(EXIF_IFD_GPS, kGpsLongitude, step_deg);
  if (!latitude || !longitude || *latitude > 90 || *longitude > 180) return std::nullopt;
  if (*latitude == 0 && *longitude == 0) return std::nullopt;  // no fix
  ExifPosition position;
  position.latitude_deg =
      exif.Text(EXIF_IFD_GPS, kGpsLatitudeRef).starts_with('S') ? -*latitude : *latitude;
  position.longitude_deg =
      exif.Text(EXIF_IFD_GPS, kGpsLongitudeRef).starts_with('W') ? -*longitude : *longitude;
  position.num_decimals = static_cast<int>(std::lround(std::max(0.0, -std::log10(step_deg))));
  position.altitude_m = exif.NotNegative(EXIF_IFD_GPS, kGpsAltitude);
  const bool is_below_sea = exif.Bytes(EXIF_IFD_GPS, kGpsAltitudeRef).starts_with('\x01');
  if (position.altitude_m && is_below_sea) *position.altitude_m *= -1;
  position.sigma_horizontal_m = exif.NotNegative(EXIF_IFD_GPS, kGpsHorizontalError).value_or(0);
  return position;
}

// EXIF 2.31: OffsetTimeOriginal; libexif's names for it are newer than some of its versions.
constexpr int kOffsetTime = 0x9010;
constexpr int kOffsetTimeOriginal = 0x9011;

// The first of two entries that has a text.
std::string TextOfEither(const ExifReader& exif, int tag, int other_tag) {
  const std::string text = exif.Text(EXIF_IFD_EXIF, tag);
  return text.empty() ? exif.Text(EXIF_IFD_EXIF, other_tag) : text;
}

void ReadTime(const ExifReader& exif, ExifCamera& camera) {
  camera.taken = exif.Text(EXIF_IFD_EXIF, EXIF_TAG_DATE_TIME_ORIGINAL);
  if (camera.taken.empty()) return;
  // Its digits are behind the point of the seconds; what is no number counts for nothing.
  const std::string fraction =
      TextOfEither(exif, EXIF_TAG_SUB_SEC_TIME_ORIGINAL, EXIF_TAG_SUB_SEC_TIME);
  const bool has_fraction =
      !fraction.empty() && fraction.find_first_not_of("0123456789") == std::string::npos;
  if (has_fraction) camera.taken += "." + fraction;
  camera.taken_zone = TextOfEither(exif, kOffsetTimeOriginal, kOffsetTime);
}

void NoteDamage(ExifLog*, ExifLogCode code, const char*, const char*, va_list, void* is_damaged) {
  if (code == EXIF_LOG_CODE_CORRUPT_DATA) *static_cast<bool*>(is_damaged) = true;
}

}  // namespace

ExifCamera ParseExif(const std::string& block) {
  ExifCamera camera;
  const std::unique_ptr<ExifData, UnrefExif> data(exif_data_new());
  const std::unique_ptr<ExifLog, UnrefExif> log(exif_log_new());
  if (!data || !log) throw std::bad_alloc();
  exif_log_set_func(log.get(), NoteDamage, &camera.is_damaged);
  exif_data_log(data.get(), log.get());
  // Otherwise libexif adds the tags that EXIF asks for and are not there.
  exif_data_unset_option(data.get(), EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);
  exif_data_load_data(data.get(), reinterpret_cast<const unsigned char*>(block.data()),
                      static_cast<unsigned int>(block.size()));
  const ExifReader exif(data.get());
  camera.is_damaged |= exif.IsEmpty();
  camera.make = exif.Text(EXIF_IFD_0, EXIF_TAG_MAKE);
  camera.model = exif.Text(EXIF_IFD_0, EXIF_TAG_MODEL);
  camera.serial = exif.Text(EXIF_IFD_EXIF, EXIF_TAG_BODY_SERIAL_NUMBER);
  camera.lens = exif.Text(EXIF_IFD_EXIF, EXIF_TAG_LENS_MODEL);
  camera.width = exif.Size(EXIF_IFD_EXIF, EXIF_TAG_PIXEL_X_DIMENSION);
  camera.height = exif.Size(EXIF_IFD_EXIF, EXIF_TAG_PIXEL_Y_DIMENSION);
  camera.focal_mm = exif.Positive(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH);
  camera.focal_35mm = exif.Positive(EXIF_IFD_EXIF, EXIF_TAG_FOCAL_LENGTH_IN_35MM_FILM);
  camera.pixels_per_mm = PixelsPerMm(exif);
  const double zoom = exif.Positive(EXIF_IFD_EXIF, EXIF_TAG_DIGITAL_ZOOM_RATIO);
  camera.digital_zoom = zoom > 1 ? zoom : 1;  // 0: not used
  const int orientation = exif.Size(EXIF_IFD_0, EXIF_TAG_ORIENTATION);
  if (orientation >= 1 && orientation <= 8) camera.orientation = orientation;
  camera.position = PositionOf(exif);
  ReadTime(exif, camera);
  camera.stored_width = exif.Size(EXIF_IFD_0, EXIF_TAG_IMAGE_WIDTH);
  camera.stored_height = exif.Size(EXIF_IFD_0, EXIF_TAG_IMAGE_LENGTH);
  camera.xmp = exif.Bytes(EXIF_IFD_0, EXIF_TAG_XML_PACKET);
  return camera;
}

}  // namespace mono3d
