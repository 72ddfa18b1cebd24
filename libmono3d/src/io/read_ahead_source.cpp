// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/read_ahead_source.h"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace mono3d {
namespace {

// Frames that wait: enough to even out a keyframe of the video, which takes some times as long to
// decode as the others, and a keyframe of the tracker; 1080p frames need 6 MB each.
constexpr std::size_t kMaxAhead = 4;

class ReadAheadSource : public FrameSource {
 public:
  explicit ReadAheadSource(std::unique_ptr<FrameSource> source)
      : source_(std::move(source)),
        num_frames_(source_->num_frames()),
        num_skipped_(source_->num_skipped()) {}

  // Waits for the frame in hand.
  ~ReadAheadSource() override {
    {
      const std::lock_guard lock(mutex_);
      is_aborted_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }
  ReadAheadSource(const ReadAheadSource&) = delete;
  ReadAheadSource& operator=(const ReadAheadSource&) = delete;

  std::optional<Frame> Next() override {
    if (has_ended_) return std::nullopt;
    if (!thread_.joinable()) thread_ = std::thread([this] { Run(); });
    Item item = Take();
    num_skipped_ = item.num_skipped;
    num_passed_over_ = item.num_passed_over;
    has_ended_ = !item.frame;
    if (item.error) std::rethrow_exception(item.error);
    return std::move(item.frame);
  }

  std::optional<std::int64_t> num_frames() const override { return num_frames_; }
  std::int64_t num_skipped() const override { return num_skipped_; }
  std::int64_t num_passed_over() const override { return num_passed_over_; }
  const CameraModel& camera() const override { return source_->camera(); }
  cv::Mat hidden() const override { return source_->hidden(); }

 private:
  // What one Next() of the source came to.
  struct Item {
    std::optional<Frame> frame;  // none: the end, or an error
    std::exception_ptr error;
    std::int64_t num_skipped = 0;
    std::int64_t num_passed_over = 0;
  };

  Item Take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return !items_.empty(); });
    Item item = std::move(items_.front());
    items_.pop_front();
    lock.unlock();
    changed_.notify_all();
    return item;
  }

  Item Read() {
    Item item;
    try {
      item.frame = source_->Next();
    } catch (...) {
      item.error = std::current_exception();
    }
    item.num_skipped = source_->num_skipped();
    item.num_passed_over = source_->num_passed_over();
    return item;
  }

  void Run() {
    bool has_more = true;
    while (has_more) {
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return is_aborted_ || items_.size() < kMaxAhead; });
        if (is_aborted_) return;
      }
      Item item = Read();
      has_more = item.frame.has_value();
      {
        const std::lock_guard lock(mutex_);
        items_.push_back(std::move(item));
      }
      changed_.notify_all();
    }
  }

  std::unique_ptr<FrameSource> source_;  // of the thread, once it runs; its camera never changes
  std::optional<std::int64_t> num_frames_;
  std::int64_t num_skipped_ = 0;
  std::int64_t num_passed_over_ = 0;
  bool has_ended_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> items_;
  bool is_aborted_ = false;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<FrameSource> ReadAhead(std::unique_ptr<FrameSource> source) {
  return std::make_unique<ReadAheadSource>(std::move(source));
}

}  // namespace mono3d
