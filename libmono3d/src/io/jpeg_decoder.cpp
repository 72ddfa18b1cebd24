// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/jpeg_decoder.h"

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

// clang-format off: each needs what stands before it
#include <jerror.h>
#include <jpeglib.h>
// clang-format on

#include "io/image_metadata.h"
#include "io/jpeg_scan.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

#ifndef JCS_EXTENSIONS
#error "libjpeg is not libjpeg-turbo, which writes pixels as BGR"
#endif

// Each scan of a progressive file makes the whole image once more. Ten are usual; with one for each
// bit of each coefficient there would be some thousand, which nothing writes.
constexpr int kMaxScans = 500;

// Encoders in hardware write whole words: some bytes of a word may be left before a marker.
constexpr int kMaxLeftBytes = 7;

// Where libjpeg goes to in place of ending the process. `manager` is what it knows of it.
struct JpegErrors {
  jpeg_error_mgr manager;
  std::jmp_buf leave;
  bool has_damage;
  bool has_other_bytes;  // between segments
  bool is_in_scans;
  bool has_too_many_scans;
};

JpegErrors& ErrorsOf(j_common_ptr info) {
  static_assert(offsetof(JpegErrors, manager) == 0);
  return *reinterpret_cast<JpegErrors*>(info->err);
}

[[noreturn]] void LeaveJpeg(j_common_ptr info) { std::longjmp(ErrorsOf(info).leave, 1); }

// Does the warning say that pixels are not what was coded?
bool IsOfDamage(j_common_ptr info) {
  switch (info->err->msg_code) {
    case JWRN_ADOBE_XFORM:     // of tags
    case JWRN_JFIF_MAJOR:      //
    case JWRN_NOT_SEQUENTIAL:  // numbers without a meaning in such a file, as some phones write
                               // them
      return false;
    case JWRN_EXTRANEOUS_DATA: {
      const auto* parameters = info->err->msg_parm.i;
      const int num_bytes = parameters[0];
      const int marker = parameters[1];
      const bool is_restart = marker >= JPEG_RST0 && marker <= JPEG_RST0 + 7;
      ErrorsOf(info).has_other_bytes = true;
      if (is_restart) return num_bytes > kMaxLeftBytes;
      // Between two scans nothing else is left; before the end, see below.
      return ErrorsOf(info).is_in_scans && marker != JPEG_EOI;
    }
    default:
      return true;
  }
}

void OnJpegMessage(j_common_ptr info, int level) {
  if (level >= 0 || !IsOfDamage(info)) return;
  ErrorsOf(info).has_damage = true;
  LeaveJpeg(info);
}

void PrintNoJpegMessage(j_common_ptr /*info*/) {}

void OnJpegProgress(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= kMaxScans) return;
  ErrorsOf(info).has_too_many_scans = true;
  LeaveJpeg(info);
}

// libjpeg leaves by longjmp, past all destructors: its functions are called by members alone that
// have nothing to destroy.
class JpegReader {
 public:
  JpegReader() {
    info_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = LeaveJpeg;
    errors_.manager.emit_message = OnJpegMessage;
    errors_.manager.output_message = PrintNoJpegMessage;
    progress_.progress_monitor = OnJpegProgress;
  }
  ~JpegReader() { jpeg_destroy_decompress(&info_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  // To the coded pixels; false: it failed.
  bool ReadHead(const char* bytes, std::size_t num_bytes, int reduction) {
    if (setjmp(errors_.leave) != 0) return false;
    jpeg_create_decompress(&info_);
    info_.progress = &progress_;
    jpeg_mem_src(&info_, reinterpret_cast<const unsigned char*>(bytes), num_bytes);
    jpeg_read_header(&info_, TRUE);
    info_.scale_num = 1;
    info_.scale_denom = static_cast<unsigned>(reduction);
    info_.out_color_space = is_cmyk() ? JCS_CMYK : JCS_EXT_BGR;
    jpeg_calc_output_dimensions(&info_);
    return true;
  }

  bool is_cmyk() const { return info_.num_components == 4; }
  std::int64_t width() const { return info_.image_width; }
  std::int64_t height() const { return info_.image_height; }
  cv::Size output_size() const {
    return {static_cast<int>(info_.output_width), static_cast<int>(info_.output_height)};
  }

  // Before the rows.
  bool Start() {
    errors_.is_in_scans = true;
    if (setjmp(errors_.leave) != 0) return false;
    return jpeg_start_decompress(&info_) == TRUE;
  }

  // So many more rows, `step` bytes apart.
  bool ReadRows(std::uint8_t* first, std::size_t step, JDIMENSION num_rows) {
    if (setjmp(errors_.leave) != 0) return false;
    const JDIMENSION begin = info_.output_scanline;
    while (info_.output_scanline < begin + num_rows) {
      constexpr JDIMENSION kMostAtOnce = 16;  // of the largest blocks
      std::array<JSAMPROW, kMostAtOnce> rows;
      const JDIMENSION num_read = info_.output_scanline - begin;
      const JDIMENSION num_wanted = std::min(kMostAtOnce, num_rows - num_read);
      for (JDIMENSION i = 0; i < num_wanted; ++i) rows[i] = first + (num_read + i) * step;
      if (jpeg_read_scanlines(&info_, rows.data(), num_wanted) == 0) return false;
    }
    return true;
  }

  // Behind the last row: does anything follow before the image's end? Whatever it is, the rows are
  // read. Of a progressive file it would be of no scan.
  bool HasBytesBehindLastRow() {
    if (jpeg_has_multiple_scans(&info_) == TRUE) return false;
    errors_.has_other_bytes = false;
    if (setjmp(errors_.leave) == 0) jpeg_finish_decompress(&info_);
    return errors_.has_other_bytes;
  }

  [[noreturn]] void ThrowError(const std::filesystem::path& path) {
    ErrorParts parts;
    parts.where = path;
    if (errors_.has_too_many_scans) {
      parts.what = "a progressive image with too many scans";
      parts.expected = "at most " + std::to_string(kMaxScans);
      throw Error(parts);
    }
    std::array<char, JMSG_LENGTH_MAX> text{};
    errors_.manager.format_message(reinterpret_cast<j_common_ptr>(&info_), text.data());
    parts.what =
        errors_.has_damage ? "the image is damaged: copy it again" : "cannot decode the image";
    parts.found = text.data();
    if (errors_.manager.msg_code == JERR_OUT_OF_MEMORY) parts.code = ErrorCode::kOutOfMemory;
    throw Error(parts);
  }

 private:
  jpeg_decompress_struct info_{};
  jpeg_progress_mgr progress_{};
  JpegErrors errors_{};
};

// Inks as Adobe's programs store them, 255 for none, to their light.
void CmykToBgr(const std::vector<std::uint8_t>& row, cv::Mat image, int y) {
  for (int x = 0; x < image.cols; ++x) {
    const std::uint8_t* cmyk = &row[4 * static_cast<std::size_t>(x)];
    const int black = cmyk[3];
    const auto light = [&](int ink) {
      return static_cast<std::uint8_t>(black - ((255 - cmyk[ink]) * black >> 8));
    };
    image.at<cv::Vec3b>(y, x) = {light(2), light(1), light(0)};
  }
}

// Pixels of a head that has been read.
cv::Mat ReadPixels(JpegReader& reader, const std::filesystem::path& path) {
  cv::Mat image(reader.output_size(), CV_8UC3);
  if (!reader.Start()) reader.ThrowError(path);
  if (!reader.is_cmyk()) {
    const auto num_rows = static_cast<JDIMENSION>(image.rows);
    if (!reader.ReadRows(image.data, image.step, num_rows)) reader.ThrowError(path);
    return image;
  }
  std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(image.cols));
  for (int y = 0; y < image.rows; ++y) {
    if (!reader.ReadRows(row.data(), row.size(), 1)) reader.ThrowError(path);
    CmykToBgr(row, image, y);
  }
  return image;
}

}  // namespace

cv::Mat DecodeJpeg(std::string_view bytes, const std::filesystem::path& path, int reduction) {
  JpegReader reader;
  if (!reader.ReadHead(bytes.data(), bytes.size(), reduction)) reader.ThrowError(path);
  RequireDecodableSize(reader.width(), reader.height(), path);
  cv::Mat image = ReadPixels(reader, path);
  if (reader.HasBytesBehindLastRow() && IsScanDamaged(bytes)) {
    throw Error(ErrorParts{.what = "the image is damaged: copy it again",
                           .where = path,
                           .expected = {},
                           .found = "coded pixels that contradict themselves"});
  }
  return image;
}

}  // namespace mono3d
