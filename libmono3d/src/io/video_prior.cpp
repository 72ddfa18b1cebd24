// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/video_prior.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <system_error>

#include "io/image_source.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

// Drones write the focal length of one camera for another: 24 mm where the lens has 22 (Air 2S),
// and videos show a part of the sensor: stabilisation takes 10 %, the sharper modes up to 30 %.
constexpr double kTelemetryFocalSigma = 0.15;
constexpr double kMinFocalMm = 5;  // in 35 mm film; below are fisheyes
constexpr double kMaxFocalMm = 1000;

// The number behind `label`, blanks and a colon at the front of `text`; 0 where there is none.
double FocalBehindLabel(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" :"), text.size()));
  const std::string_view digits = text.substr(0, text.find_first_not_of("0123456789."));
  const double number = ParseNumber(digits).value_or(0);
  const bool is_tenths = digits.find('.') == std::string_view::npos;
  return is_tenths ? number / 10 : number;
}

// The telemetry beside a video: of the same name, whatever the case of its ending.
std::filesystem::path FindTelemetry(const std::filesystem::path& video) {
  std::error_code ignored;
  for (const char* extension : {".SRT", ".srt", ".Srt"}) {
    std::filesystem::path file = video;
    file.replace_extension(extension);
    if (std::filesystem::is_regular_file(file, ignored)) return file;
  }
  return {};
}

std::optional<TelemetryFocal> ReadTelemetryFocal(const std::filesystem::path& video) {
  const std::filesystem::path file = FindTelemetry(video);
  if (file.empty()) return std::nullopt;
  try {
    return ParseTelemetryFocal(ReadBytes(file));
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string("telemetry is not used: ") + error.what());
    return std::nullopt;
  }
}

}  // namespace

std::optional<TelemetryFocal> ParseTelemetryFocal(std::string_view text) {
  constexpr std::string_view kLabel = "focal_len";
  constexpr double kSameFocal = 0.01;  // relative
  std::optional<TelemetryFocal> focal;
  for (std::size_t at = text.find(kLabel); at != std::string_view::npos;
       at = text.find(kLabel, at + 1)) {
    const double focal_mm = FocalBehindLabel(text.substr(at + kLabel.size()));
    if (focal_mm < kMinFocalMm || focal_mm > kMaxFocalMm) continue;
    if (!focal) focal = TelemetryFocal{focal_mm, false};
    focal->is_changing |= std::abs(focal_mm / focal->focal_35mm - 1) > kSameFocal;
  }
  return focal;
}

CameraPrior ReadVideoPrior(const std::filesystem::path& video) {
  constexpr double kFilmWidthMm = 36;
  const std::optional<SourceImage> frame = OpenVideo(video.string(), {.max_frames = 1})->Next();
  if (!frame) {
    throw Error(
        ErrorParts{.what = "the video has no frame", .where = video, .expected = {}, .found = {}});
  }
  CameraPrior prior = DefaultCameraPrior(frame->bgr.cols, frame->bgr.rows);
  const std::optional<TelemetryFocal> focal = ReadTelemetryFocal(video);
  if (!focal) return prior;
  const std::string name = video.filename().string();
  if (focal->is_changing) {
    Log(LogLevel::kWarning, name + ": the focal length changes in the video (telemetry beside it)");
  }
  // The whole width of a sensor of 3:2; of one of 4:3 it would be 4 % more, and 5 % less where the
  // equivalent is of the diagonal of the frames.
  const double focal_px =
      focal->focal_35mm / kFilmWidthMm * std::max(prior.camera.width, prior.camera.height);
  prior.camera.fx = focal_px;
  prior.camera.fy = focal_px;
  prior.focal_sigma = kTelemetryFocalSigma;
  prior.source = CameraPriorSource::kVideo;
  prior.description = ToText(focal->focal_35mm) + " mm (35 mm equivalent) in the telemetry";
  return prior;
}

}  // namespace mono3d
