// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_prior.h"
#include "mono3d/pipeline/pipeline.h"

namespace MONO3D_EXPORT mono3d {

// One image of the video as the camera took it, with the distortion of its lens.
struct CapturedFrame {
  std::int64_t index = 0;  // position in the video; names output files
  double timestamp_s = 0;
  std::string name;  // for messages
  cv::Mat bgr;       // CV_8UC3, of the size of the prior's camera
};

struct SelfCalibrationOptions {
  CalibrationOptions calibration;
  // Tracked frames after which the camera is first learned; then after twice as many each time,
  // until it is known well enough.
  int first_frames = 80;
  // Images that are kept since the first one, so that they can be tracked again: 2,000 of 768x448,
  // 330 of 1920x1080. When they need more, no other camera can be adopted any more.
  double max_buffer_mb = 2048;

  void Visit(OptionVisitor& visit);  // without those of `calibration`
  void Validate() const;             // throws UsageError
};

// What a SelfCalibratingPipeline is made of.
struct SelfCalibrationSetup {
  CameraPrior prior;
  // The stages of a pipeline; called again when a camera is adopted. Live trackers, as CreateStages
  // makes them of options with is_live.
  std::function<PipelineStages()> create_stages;
  // Who observes the pipeline that takes images of this camera; may be empty. on_frame is called
  // while that pipeline is the one in use, the others from its first frame on.
  std::function<PipelineObserver(const CameraModel&)> create_observer = {};
  // A camera was adopted: nothing comes from the pipeline before any more. May be empty.
  std::function<void(const SelfCalibration&)> on_adoption = {};
  // Instead of CalibrateCamera; may be empty. Throws Error where the opener does.
  std::function<CameraCalibration(const CameraPrior&, const FootageOpener&)> calibrate = {};
};

// A live run whose camera is not known, or not for certain. It begins with the camera of the prior;
// once the images have told a better one beyond doubt, a second pipeline takes all images with it,
// three times as fast as they came or faster, while the first one goes on, but makes no more depth
// maps. When the second has caught up it replaces the first, and what is shown goes on in the same
// world: that of the second is moved there by the poses of the frames that both have tracked.
// Where the images agree with the prior, or do not tell the camera in time, nothing changes.
//
// Used as a live Pipeline: Start; Push, Push, ...; Stop. Threads of its own: those of one or two
// pipelines, one that waits, and one, of low priority, that learns the camera. What goes wrong
// in learning or adopting a camera is a reason in SelfCalibration, and the first pipeline goes on.
class SelfCalibratingPipeline {
 public:
  // Throws Error on an invalid prior, UsageError on invalid options, and what `create_stages`
  // throws. Is live whatever `options.is_live` says.
  explicit SelfCalibratingPipeline(SelfCalibrationSetup setup, const PipelineOptions& options = {},
                                   const SelfCalibrationOptions& calibration = {});
  // Ends after the work in hand. What waits is left undone.
  ~SelfCalibratingPipeline();

  // As those of Pipeline. Push takes the distortion out of the image before it returns (some
  // milliseconds) and throws Error as well where the image is not CV_8UC3 or of another size than
  // the prior's camera.
  void Start();
  PushResult Push(CapturedFrame frame);
  void GivePositions(PositionTrack track);

  // As Pipeline::Snapshot, also across an adoption: versions go on, and the chunks that are in use
  // then have other numbers.
  [[nodiscard]] PipelineSnapshot Snapshot(std::uint64_t since_version = 0) const;

  // No more frames. Completes what is under way: where the images have not told the camera yet, it
  // is learned from those that there are, and a camera that is proven is adopted. So that a short
  // video has a model with its own camera too, this may take some seconds and as long as the
  // video.
  [[nodiscard]] Reconstruction Stop();

  // Of the pipeline in use, after Stop. Its world is the tracker's own.
  const Tracker& tracker() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d
