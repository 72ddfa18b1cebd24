// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/capture_buffer.h"

#include <algorithm>
#include <utility>

#include "mono3d/core/error.h"
#include "pipeline/captured_frame.h"

namespace mono3d {
namespace {

std::size_t BytesOf(const CapturedFrame& frame) { return frame.bgr.total() * frame.bgr.elemSize(); }

class CapturedFootage final : public FrameSource {
 public:
  CapturedFootage(std::shared_ptr<const std::vector<CapturedFrame>> frames,
                  const CameraModel& camera, std::size_t start, std::size_t max_frames,
                  const std::atomic<bool>& is_stopped)
      : frames_(std::move(frames)), lens_(camera), next_(start), is_stopped_(is_stopped) {
    end_ = frames_->size();
    if (max_frames > 0) end_ = std::min(end_, next_ + max_frames);
  }

  std::optional<Frame> Next() override {
    if (next_ >= end_ || is_stopped_) return std::nullopt;
    return lens_.Undistort((*frames_)[next_++]);
  }
  std::optional<std::int64_t> num_frames() const override {
    return end_ > next_ ? static_cast<std::int64_t>(end_ - next_) : 0;
  }
  std::int64_t num_skipped() const override { return 0; }
  const CameraModel& camera() const override { return lens_.undistorted(); }

 private:
  std::shared_ptr<const std::vector<CapturedFrame>> frames_;
  CapturedFrameUndistorter lens_;
  std::size_t next_;
  std::size_t end_ = 0;
  const std::atomic<bool>& is_stopped_;
};

}  // namespace

void CaptureBuffer::Add(const CapturedFrame& frame) {
  const std::size_t num_bytes = num_bytes_ + BytesOf(frame);
  has_overflowed_ = has_overflowed_ || static_cast<double>(num_bytes) > 1e6 * max_mb_;
  if (has_overflowed_) return;
  num_bytes_ = num_bytes;
  frames_.push_back(frame);
}

std::optional<CapturedFrame> CaptureBuffer::TakeFirst() {
  if (frames_.empty()) return std::nullopt;
  CapturedFrame first = std::move(frames_.front());
  frames_.pop_front();
  num_bytes_ -= BytesOf(first);
  return first;
}

void CaptureBuffer::Clear() {
  frames_.clear();
  num_bytes_ = 0;
}

bool CaptureBuffer::IsTooSmallFor(double factor) const {
  return factor * static_cast<double>(num_bytes_) > 1e6 * max_mb_;
}

std::vector<CapturedFrame> CaptureBuffer::FramesFrom(std::int64_t first_index) const {
  const auto first = std::ranges::lower_bound(frames_, first_index, {}, &CapturedFrame::index);
  return {first, frames_.end()};
}

FootageOpener OpenerOf(std::shared_ptr<const std::vector<CapturedFrame>> frames,
                       const std::atomic<bool>& is_stopped) {
  return [frames = std::move(frames), &is_stopped](const CameraModel& camera, int start,
                                                   int max_frames) {
    if (is_stopped) throw Error("the run has ended");
    return std::make_unique<CapturedFootage>(frames, camera, static_cast<std::size_t>(start),
                                             static_cast<std::size_t>(max_frames), is_stopped);
  };
}

}  // namespace mono3d
