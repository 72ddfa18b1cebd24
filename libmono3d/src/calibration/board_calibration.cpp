// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/calibration/board_calibration.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/board_adjustment.h"
#include "calibration/board_detection.h"
#include "calibration/board_views.h"
#include "calibration/camera_posterior.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

using calibration::BoardView;

constexpr std::int64_t kMaxSearchedImages = 300;
constexpr std::size_t kMaxViews = 40;
// A focal length and a principal point need three views that differ; more average the noise.
constexpr std::size_t kMinFoundViews = 3;

// Of every image, or of at most kMaxSearchedImages spread evenly over the footage.
std::vector<BoardView> FindBoard(FrameSource& source, const CalibrationBoard& board) {
  const std::unique_ptr<calibration::BoardDetector> detector =
      calibration::CreateBoardDetector(board);
  const std::int64_t num_frames = source.num_frames().value_or(0);
  const std::int64_t step =
      std::max<std::int64_t>(1, (num_frames + kMaxSearchedImages - 1) / kMaxSearchedImages);
  std::vector<BoardView> views;
  std::int64_t position = 0;
  while (const std::optional<Frame> frame = source.Next()) {
    if (position++ % step != 0) continue;
    std::optional<BoardView> view = detector->Find(ToGrey(frame->bgr));
    Log(LogLevel::kDebug,
        frame->name + ": " + std::to_string(view ? view->pixels.size() : 0) + " board corners");
    if (view) views.push_back(*std::move(view));
  }
  return views;
}

// With all parameters of a lens free, the board's shape of pixels as well.
CameraPrior StartingPoint(const CameraPrior& prior) {
  CameraPrior start = calibration::WithoutWeight(prior);
  // Lenses and sensors are square to a tenth of this.
  constexpr double kAspectSigma = 0.01;
  start.aspect_sigma = std::max(start.aspect_sigma, kAspectSigma);
  return start;
}

bool ContradictsPrior(const calibration::CameraAdjustment& adjustment, const CameraPrior& prior) {
  if (prior.source == CameraPriorSource::kDefault) return false;
  if (prior.source == CameraPriorSource::kCalibration) {
    return calibration::Contradicts(adjustment, prior);
  }
  return calibration::IsFarFrom(prior, adjustment.camera);
}

std::string BoardText(const CalibrationBoard& board) {
  return (board.kind == BoardKind::kCharuco ? "ChArUco board of " : "chessboard of ") +
         std::to_string(board.columns) + "x" + std::to_string(board.rows) +
         (board.kind == BoardKind::kCharuco ? " squares" : " inner corners");
}

}  // namespace

CameraCalibration CalibrateFromBoard(const CameraPrior& prior, const FootageOpener& open,
                                     const CalibrationBoard& board) {
  board.Validate();
  Validate(prior, "calibration");
  // The corners are measured in the images as taken.
  const CameraModel as_taken = prior.camera.WithoutDistortion();
  const std::unique_ptr<FrameSource> source = open(as_taken, 0, 0);
  const cv::Size size(source->camera().width, source->camera().height);

  CameraCalibration result;
  result.prior = result.posterior = prior.Resized(size.width, size.height);
  const std::vector<BoardView> found = FindBoard(*source, board);
  if (found.size() < kMinFoundViews) {
    result.reason = "the " + BoardText(board) + " is found in " + std::to_string(found.size()) +
                    " images, and three are needed";
  } else {
    std::vector<BoardView> views;
    for (const std::size_t i : calibration::ChooseViews(found, size, kMaxViews)) {
      views.push_back(found[i]);
    }
    const calibration::CameraAdjustment adjustment =
        calibration::AdjustBoardCamera(StartingPoint(result.prior), views);
    if (adjustment.num_observations == 0) {
      result.reason = "the " + BoardText(board) +
                      " is not seen from enough sides: its views leave the focal length open";
    } else {
      calibration::TakePosterior(adjustment, result);
      result.is_learned = true;
      result.num_rounds = 1;
      result.contradicts_prior = ContradictsPrior(adjustment, result.prior);
      result.change_px = LargestDifference_px(result.prior.camera, adjustment.camera);
      result.posterior.source = CameraPriorSource::kCalibration;
      result.posterior.description =
          BoardText(board) + " in " + std::to_string(adjustment.num_images) + " images";
    }
  }
  calibration::BringToSize(prior, result);
  return result;
}

}  // namespace mono3d
