// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/video_options.h"

#include <cmath>

#include "synthetic/words.h"

namespace mono3d::synthetic {

void VideoOptions::Visit(OptionVisitor& visit) {
  visit("codec", codec, "compress as a video: h264 or h265; none: each image for itself");
  visit("bit_rate_mbit_per_s", bit_rate_mbit_per_s, "of the video");
  visit("keyframe_interval", keyframe_interval, "images from one key frame to the next");
  visit("b_frames", b_frames, "images in a row that are predicted from both sides, at most");
  visit("keep", keep, "images (decoded from the stream), video (video.mp4) or both");
}

void VideoOptions::Validate() const {
  RequireOneOf("video.codec", codec, kVideoCodecs);
  RequireOption(std::isfinite(bit_rate_mbit_per_s) && bit_rate_mbit_per_s >= 0.01 &&
                    bit_rate_mbit_per_s <= 1000,
                "video.bit_rate_mbit_per_s", "0.01 to 1000", bit_rate_mbit_per_s);
  RequireOption(keyframe_interval >= 1 && keyframe_interval <= 1000, "video.keyframe_interval",
                "1 to 1000", keyframe_interval);
  RequireOption(b_frames >= 0 && b_frames <= 16, "video.b_frames", "0 to 16", b_frames);
  RequireOneOf("video.keep", keep, kVideoOutputs);
}

}  // namespace mono3d::synthetic
