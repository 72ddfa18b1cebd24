// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/image/frame.h"

namespace MONO3D_EXPORT mono3d {

// For FrameSourceOptions::stride: the images that the motion of the camera calls for, whatever
// their rate. The first, and each that has moved by a two-hundredth of its longer side against the
// one taken before, or for which that cannot be told; of a camera that stands still, fewer and
// fewer. The same input gives the same images. Of live inputs, of images named one by one and of
// several cameras, all are taken.
inline constexpr int kStrideByMotion = -1;

struct FrameSourceOptions {
  double fps = 0;  // of the input; 0: the container's own, or timestamps.txt, or 30
  int stride = 1;  // take every stride-th image, or kStrideByMotion
  int start = 0;   // first image
  // A video is entered at the last place before `start` where that can be done, instead of decoding
  // all that comes before: frames may be some further on or back than counting tells, and where the
  // times in the file begin late, theirs begin late as well. The same file gives the same frames.
  // Not among the listed options.
  bool seeks = false;
  int max_frames = 0;  // 0: all
  // "WIDTHxHEIGHT": resize images and intrinsics; "calibration": resize images to the calibration's
  // size; empty: refuse images of another size.
  std::string resize = {};
  // Without `resize`: larger images are made smaller, so that their longer side has so many pixels,
  // and the intrinsics with them; 0: no limit. Not among the listed options.
  int max_side_px = 0;
  // CV_8UC1 of the shape of the images, not 0 where they do not show the scene (StaticPartsDetector
  // finds such parts): filled with what is around, so that nothing is found there. Empty: none. Of
  // images of several cameras it is passed over. Not among the listed options.
  cv::Mat hidden = {};
  // Called with each image that is taken and its index, before anything is done to it, by the
  // thread that reads: of a video, some frames before Next gives it. May be empty.
  std::function<void(std::int64_t, const cv::Mat&)> on_image = {};

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// A sequence of images, one at a time, free of distortion.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // The next frame, or nothing at the end. An image that cannot be decoded, or of another size, is
  // skipped with a warning and counted; Error where all are so, or the first ten of another size.
  [[nodiscard]] virtual std::optional<Frame> Next() = 0;

  // To come in all, where known; with kStrideByMotion, at most.
  virtual std::optional<std::int64_t> num_frames() const = 0;
  virtual std::int64_t num_skipped() const = 0;  // so far
  // Images that kStrideByMotion has left out so far.
  virtual std::int64_t num_passed_over() const { return 0; }
  virtual const CameraModel& camera() const = 0;  // of the frames that come out
  // CV_8UC1 of the size of the frames, 255 where FrameSourceOptions::hidden was filled; empty where
  // nothing was.
  virtual cv::Mat hidden() const { return {}; }
};

// Hands on the frames of another source, and says of them what that one says: the base of sources
// that watch or delay frames on their way.
class ForwardingSource : public FrameSource {
 public:
  explicit ForwardingSource(std::unique_ptr<FrameSource> source) : source_(std::move(source)) {}

  [[nodiscard]] std::optional<Frame> Next() override { return source_->Next(); }
  std::optional<std::int64_t> num_frames() const override { return source_->num_frames(); }
  std::int64_t num_skipped() const override { return source_->num_skipped(); }
  std::int64_t num_passed_over() const override { return source_->num_passed_over(); }
  const CameraModel& camera() const override { return source_->camera(); }
  cv::Mat hidden() const override { return source_->hidden(); }

 private:
  std::unique_ptr<FrameSource> source_;
};

// The images of a folder (of a sequence's folder: those in images/) or of a glob, in natural order:
// img2 before img10. Throws Error when there are none.
std::vector<std::string> ListImages(const std::string& input);

// The cameras that took the images of an input.
struct CamerasOfImages {
  std::vector<CameraModel> cameras;
  // Of each image of ListImages, position in `cameras`; empty: all are of the first.
  std::vector<std::size_t> camera_of_image = {};

  std::size_t Of(std::int64_t image) const;
};

// `input` is a folder (its images in natural order; the folder of a sequence, with images/ in it,
// will do as well), a glob ("flight/*.jpg") or a video file. Throws Error when there is nothing to
// read.
std::unique_ptr<FrameSource> OpenFrameSource(const std::string& input, const CameraModel& camera,
                                             const FrameSourceOptions& options = {});
// The images of a folder or a glob that several cameras took. The frames are those of one camera,
// CommonCamera of all, and show what each camera saw of it (Frame::content); the width and height
// of FrameSourceOptions::resize, or its max_side_px, are the largest that they may have. Rolling
// shutters are passed over: how photos moved is not known.
std::unique_ptr<FrameSource> OpenFrameSource(const std::string& input,
                                             const CamerasOfImages& cameras,
                                             const FrameSourceOptions& options = {});
// Just these images, in this order. As each was asked for by name, one that cannot be decoded, or
// is of another size, is an Error, thrown by Next().
std::unique_ptr<FrameSource> OpenFrameSource(const std::vector<std::string>& images,
                                             const CameraModel& camera,
                                             const FrameSourceOptions& options = {});

}  // namespace mono3d
