// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/live_input.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "io/image_source.h"
#include "io/live_address.h"
#include "io/live_connection.h"
#include "io/live_reader.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

LiveConnector ConnectorOf(const LiveAddress& address) {
  if (address.kind == LiveKind::kDevice) {
    return [address](double, const std::atomic<bool>&) { return OpenCameraDevice(address); };
  }
  return [address](double timeout_s, const std::atomic<bool>& is_cancelled) {
    return ConnectToStream(address, timeout_s, is_cancelled);
  };
}

// What FrameSourceOptions take of the images of a reader.
class LiveSource : public ImageSource {
 public:
  LiveSource(LiveReader& reader, const FrameSourceOptions& options, const std::atomic<bool>* stop)
      : reader_(reader), options_(options), stop_(stop) {}

  std::optional<SourceImage> Next() override {
    // What came while the pipeline was made is old, and not missed by anyone.
    if (!std::exchange(has_begun_, true)) reader_.Begin();
    const bool is_at_end = options_.max_frames > 0 && num_taken_ == options_.max_frames;
    std::optional<SourceImage> image;
    if (!is_at_end) image = reader_.Next(stop_);
    // Where images were dropped, the next one after the stride is as good.
    while (image && image->index < wanted_) image = reader_.Next(stop_);
    if (!image) {
      reader_.End();
      return std::nullopt;
    }
    // A camera that sends now is not held up, and nothing is won by leaving out what costs little.
    wanted_ = image->index + std::max(1, options_.stride);
    ++num_taken_;
    return image;
  }

  std::optional<std::int64_t> num_frames() const override { return std::nullopt; }
  std::int64_t num_skipped() const override { return reader_.Report().num_damaged; }

 private:
  LiveReader& reader_;
  FrameSourceOptions options_;
  const std::atomic<bool>* stop_;
  bool has_begun_ = false;
  std::int64_t wanted_ = options_.start;
  std::int64_t num_taken_ = 0;
};

}  // namespace

void LiveInputOptions::Visit(OptionVisitor& visit) {
  visit("open_timeout_s", open_timeout_s, "live inputs: wait so long for the first image");
  visit("read_timeout_s", read_timeout_s,
        "live inputs: without an image for so long, the connection is broken and made again");
  visit("reconnect_s", reconnect_s,
        "live inputs: without an image for so long, the run ends; 0: as soon as the connection "
        "breaks");
}

void LiveInputOptions::Validate() const {
  const auto is_time = [](double seconds) { return std::isfinite(seconds) && seconds <= 1e6; };
  RequireOption(is_time(open_timeout_s) && open_timeout_s > 0, "open_timeout_s", "above 0",
                open_timeout_s);
  RequireOption(is_time(read_timeout_s) && read_timeout_s > 0, "read_timeout_s", "above 0",
                read_timeout_s);
  RequireOption(is_time(reconnect_s) && reconnect_s >= 0, "reconnect_s", "0 or more", reconnect_s);
}

class LiveInput::Impl {
 public:
  Impl(const LiveAddress& address, const LiveInputOptions& options)
      : reader_(ConnectorOf(address), address.name, address.shown, options) {}

  LiveReader& reader() { return reader_; }

 private:
  LiveReader reader_;
};

LiveInput::LiveInput(const std::string& address, const LiveInputOptions& options) {
  options.Validate();
  impl_ = std::make_unique<Impl>(ParseLiveAddress(address), options);
}

LiveInput::~LiveInput() = default;

int LiveInput::width() const { return impl_->reader().size().width; }
int LiveInput::height() const { return impl_->reader().size().height; }
LiveInputReport LiveInput::Report() const { return impl_->reader().Report(); }

std::unique_ptr<FrameSource> LiveInput::Frames(const CameraModel& camera,
                                               const FrameSourceOptions& options,
                                               const std::atomic<bool>* stop) {
  options.Validate();
  if (options.fps > 0) {
    throw UsageError(ErrorParts{.what = "images of a live input have times of their own",
                                .where = "--fps",
                                .expected = "none",
                                .found = {}});
  }
  return PrepareFrames(std::make_unique<LiveSource>(impl_->reader(), options, stop), camera,
                       options, /*skips_other_sizes=*/true);
}

}  // namespace mono3d
