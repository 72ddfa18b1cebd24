// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/stored_depth_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#include "fusion/state_archive.h"

namespace mono3d {
namespace {

constexpr float kDepthSteps = 65534;  // 1 to 65535; 0 is no estimate
constexpr float kNormalSteps = 127;

bool IsEstimate(float z) { return std::isfinite(z) && z > 0; }

// Octahedral: the sphere unfolded onto a square. Straight away from the camera, which no surface
// that is seen faces, is (0, 0) and stands for no normal.
cv::Vec<schar, 2> PackNormal(const cv::Vec3f& n) {
  const float sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
  if (!(sum > 0)) return {0, 0};
  float x = n[0] / sum;
  float y = n[1] / sum;
  if (n[2] < 0) {
    const float folded = (1 - std::abs(y)) * std::copysign(1.0F, x);
    y = (1 - std::abs(x)) * std::copysign(1.0F, y);
    x = folded;
  }
  return {static_cast<schar>(cvRound(kNormalSteps * x)),
          static_cast<schar>(cvRound(kNormalSteps * y))};
}

cv::Vec3f UnpackNormal(const cv::Vec<schar, 2>& packed) {
  if (packed[0] == 0 && packed[1] == 0) return {0, 0, 0};
  float x = static_cast<float>(packed[0]) / kNormalSteps;
  float y = static_cast<float>(packed[1]) / kNormalSteps;
  const float z = 1 - std::abs(x) - std::abs(y);
  if (z < 0) {
    const float unfolded = (1 - std::abs(y)) * std::copysign(1.0F, x);
    y = (1 - std::abs(x)) * std::copysign(1.0F, y);
    x = unfolded;
  }
  return cv::normalize(cv::Vec3f(x, y, z));
}

}  // namespace

StoredDepthMap::StoredDepthMap(const DepthMap& map) : frame(map) {
  frame.depth.release();
  frame.normal.release();
  frame.confidence.release();
  float nearest = std::numeric_limits<float>::max();
  float farthest = 0;
  for (int y = 0; y < map.depth.rows; ++y) {
    const auto* depth = map.depth.ptr<float>(y);
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!IsEstimate(depth[x])) continue;
      nearest = std::min(nearest, depth[x]);
      farthest = std::max(farthest, depth[x]);
    }
  }
  depth_ = cv::Mat::zeros(map.depth.size(), CV_16UC1);
  if (farthest > 0) {
    log_nearest_ = std::log(nearest);
    log_step_ = std::max((std::log(farthest) - log_nearest_) / kDepthSteps, 1e-9F);
  }
  if (!map.normal.empty()) normal_ = cv::Mat::zeros(map.depth.size(), CV_8SC2);
  if (!map.confidence.empty()) map.confidence.convertTo(confidence_, CV_8U, 255);
  cv::Mat log_depth;
  cv::log(map.depth, log_depth);
  for (int y = 0; y < map.depth.rows; ++y) {
    const auto* depth = map.depth.ptr<float>(y);
    const auto* logarithm = log_depth.ptr<float>(y);
    const auto* normals = normal_.empty() ? nullptr : map.normal.ptr<cv::Vec3f>(y);
    auto* steps = depth_.ptr<ushort>(y);
    auto* packed_normals = normal_.empty() ? nullptr : normal_.ptr<cv::Vec<schar, 2>>(y);
    for (int x = 0; x < map.depth.cols; ++x) {
      if (!IsEstimate(depth[x])) continue;
      const float step = (logarithm[x] - log_nearest_) / log_step_;
      steps[x] = static_cast<ushort>(1.5F + std::clamp(step, 0.0F, kDepthSteps));
      if (normals != nullptr) packed_normals[x] = PackNormal(normals[x]);
    }
  }
}

DepthMap StoredDepthMap::Restore() const {
  DepthMap map = frame;
  map.depth = cv::Mat::zeros(depth_.size(), CV_32FC1);
  if (!normal_.empty()) map.normal = cv::Mat::zeros(depth_.size(), CV_32FC3);
  if (!confidence_.empty()) confidence_.convertTo(map.confidence, CV_32F, 1.0 / 255);
  for (int y = 0; y < depth_.rows; ++y) {
    for (int x = 0; x < depth_.cols; ++x) {
      const ushort step = depth_.at<ushort>(y, x);
      if (step == 0) continue;
      map.depth.at<float>(y, x) = std::exp(log_nearest_ + static_cast<float>(step - 1) * log_step_);
      if (normal_.empty()) continue;
      map.normal.at<cv::Vec3f>(y, x) = UnpackNormal(normal_.at<cv::Vec<schar, 2>>(y, x));
    }
  }
  return map;
}

std::size_t StoredDepthMap::num_bytes() const {
  const auto bytes = [](const cv::Mat& image) {
    return image.empty() ? 0 : image.total() * image.elemSize();
  };
  return bytes(depth_) + bytes(normal_) + bytes(confidence_) + bytes(frame.bgr) +
         bytes(frame.inferred);
}

template <typename Archive>
void StoredDepthMap::Exchange(Archive& archive) {
  ExchangeFrameOf(archive, frame);
  archive.Number(log_nearest_);
  archive.Number(log_step_);
  ExchangeImage(archive, depth_, CV_16UC1, frame.camera);
  ExchangeImage(archive, normal_, CV_8SC2, frame.camera);
  ExchangeImage(archive, confidence_, CV_8UC1, frame.camera);
  ExchangeImage(archive, frame.bgr, CV_8UC3, frame.camera);
  ExchangeImage(archive, frame.inferred, CV_8UC1, frame.camera);
  RequireSound(archive, !depth_.empty());
}

template void StoredDepthMap::Exchange(ByteWriter& archive);
template void StoredDepthMap::Exchange(ByteReader& archive);

}  // namespace mono3d
