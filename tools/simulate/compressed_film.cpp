// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/compressed_film.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/io/image_file.h"
#include "mono3d/io/output_file.h"
#include "simulate/image_file.h"
#include "simulate/video_file.h"

namespace mono3d::tools {
namespace {

// Returns the bits of the images. The video appears when it is complete.
std::int64_t EncodeFilm(const FilmFiles& files, double frames_per_s,
                        const synthetic::VideoOptions& options) {
  std::filesystem::path partial = files.video;
  partial += ".partial";
  std::int64_t num_bits = 0;
  try {
    VideoFile video(
        partial,
        {.size = ReadImage(files.raw(0)).size(), .frames_per_s = frames_per_s, .options = options});
    for (int frame = 0; frame < files.num_frames; ++frame) video.Add(ReadImage(files.raw(frame)));
    num_bits = video.Finish();
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw;
  }
  std::filesystem::rename(partial, files.video);
  return num_bits;
}

// Returns the mean square of the error of a grey value.
double DecodeFilm(const FilmFiles& files) {
  cv::VideoCapture capture(files.video.string(), cv::CAP_FFMPEG);
  double square_sum = 0;
  for (int frame = 0; frame < files.num_frames; ++frame) {
    cv::Mat bgr;
    if (!capture.read(bgr)) {
      throw Error(ErrorParts{.what = "cannot read the video back",
                             .where = files.video,
                             .expected = std::to_string(files.num_frames) + " images",
                             .found = std::to_string(frame)});
    }
    const cv::Mat raw = ReadImage(files.raw(frame));
    square_sum += cv::norm(bgr, raw, cv::NORM_L2SQR) /
                  static_cast<double>(3 * raw.total() * static_cast<std::size_t>(files.num_frames));
    WriteFileAtomically(files.decoded(frame), EncodePng(bgr));
  }
  return square_sum;
}

}  // namespace

FilmQuality CompressFilm(const FilmFiles& files, double frames_per_s,
                         const synthetic::VideoOptions& options) {
  const auto num_bits = static_cast<double>(EncodeFilm(files, frames_per_s, options));
  constexpr double kWhite = 255;
  return {.bit_rate_mbit_per_s = 1e-6 * num_bits * frames_per_s / files.num_frames,
          .psnr_db = 10 * std::log10(kWhite * kWhite / DecodeFilm(files))};
}

}  // namespace mono3d::tools
