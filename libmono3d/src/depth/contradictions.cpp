// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/contradictions.h"

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

namespace mono3d {
namespace {

// Edge of a place: neighbours on a surface that a source shows somewhat larger are in one, or in
// places next to each other.
constexpr float kPlace_px = 2;

// Of a pixel of the reference without depth, or whose point the source does not see.
constexpr std::int32_t kNowhere = -1;

// The places in one source, by number, row by row.
class Places {
 public:
  explicit Places(const SourceProjection& source)
      : A_(source.A.cast<float>()),
        b_(source.b.cast<float>()),
        first_(source.bounds.first.cast<float>()),
        last_(source.bounds.last.cast<float>()),
        num_columns_(1 + static_cast<std::int32_t>(last_.x() / kPlace_px)),
        num_rows_(1 + static_cast<std::int32_t>(last_.y() / kPlace_px)) {}

  std::size_t size() const {
    return static_cast<std::size_t>(num_columns_) * static_cast<std::size_t>(num_rows_);
  }

  // Of the pixels of row y with these inverse depths, 0: none.
  void OfRow(int y, const float* inverse_depths, std::span<std::int32_t> places) {
    const auto num_pixels = static_cast<Eigen::Index>(places.size());
    const Eigen::Map<const Eigen::ArrayXf> w(inverse_depths, num_pixels);
    const Eigen::Vector3f start = A_ * Eigen::Vector3f(0, float(y), 1);
    const Eigen::Vector3f step = A_.col(0);
    if (x_.size() != num_pixels) {
      x_ = Eigen::ArrayXf::LinSpaced(num_pixels, 0, float(num_pixels - 1));
    }
    z_ = start.z() + step.z() * x_ + b_.z() * w;
    u_ = (start.x() + step.x() * x_ + b_.x() * w) / z_;
    v_ = (start.y() + step.y() * x_ + b_.y() * w) / z_;
    for (Eigen::Index x = 0; x < num_pixels; ++x) {
      const bool is_seen = w[x] > 0 && z_[x] > 0 && u_[x] >= first_.x() && u_[x] <= last_.x() &&
                           v_[x] >= first_.y() && v_[x] <= last_.y();
      places[static_cast<std::size_t>(x)] =
          is_seen ? static_cast<std::int32_t>(v_[x] / kPlace_px) * num_columns_ +
                        static_cast<std::int32_t>(u_[x] / kPlace_px)
                  : kNowhere;
    }
  }

 private:
  Eigen::Matrix3f A_;
  Eigen::Vector3f b_;
  Eigen::Vector2f first_;
  Eigen::Vector2f last_;
  std::int32_t num_columns_;
  std::int32_t num_rows_;
  Eigen::ArrayXf x_;  // of a row
  Eigen::ArrayXf u_;
  Eigen::ArrayXf v_;
  Eigen::ArrayXf z_;
};

// The pixel to which a place belongs.
struct Owner {
  float confidence = 0;
  float inverse_depth = 0;
};

// One that fills up a side of the bundle, or stands where the reference does.
bool ShowsNoDepth(const SourceProjection& source) { return source.b.isZero(); }

}  // namespace

cv::Mat FindContradicted(const SweepGeometry& geometry, const cv::Mat& depth,
                         const cv::Mat& confidence, double tolerance) {
  cv::Mat inverse_depth(depth.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    const auto* from = depth.ptr<float>(y);
    auto* to = inverse_depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) to[x] = from[x] > 0 ? 1 / from[x] : 0;
  }
  constexpr std::uint8_t kContradicted = 255;
  constexpr std::uint8_t kBorneOut = 1;  // in one source at least
  cv::Mat verdicts(depth.size(), CV_8UC1, cv::Scalar(0));
  cv::Mat places_of_pixels(depth.size(), CV_32SC1);
  std::vector<Owner> owners;
  for (const SourceProjection& source : geometry.Projections(0)) {
    if (ShowsNoDepth(source)) continue;
    Places places(source);
    owners.assign(places.size(), {});
    for (int y = 0; y < depth.rows; ++y) {
      const auto* w = inverse_depth.ptr<float>(y);
      const auto* confidences = confidence.ptr<float>(y);
      auto* place = places_of_pixels.ptr<std::int32_t>(y);
      places.OfRow(y, w, {place, static_cast<std::size_t>(depth.cols)});
      for (int x = 0; x < depth.cols; ++x) {
        if (place[x] == kNowhere) continue;
        Owner& owner = owners[static_cast<std::size_t>(place[x])];
        if (confidences[x] > owner.confidence) owner = {confidences[x], w[x]};
      }
    }
    for (int y = 0; y < depth.rows; ++y) {
      const auto* w = inverse_depth.ptr<float>(y);
      const auto* place = places_of_pixels.ptr<std::int32_t>(y);
      auto* verdict = verdicts.ptr<std::uint8_t>(y);
      for (int x = 0; x < depth.cols; ++x) {
        if (place[x] == kNowhere) continue;
        const Owner& owner = owners[static_cast<std::size_t>(place[x])];
        const bool is_borne_out =
            !(owner.confidence > 0) || std::abs(owner.inverse_depth - w[x]) <= float(tolerance);
        if (is_borne_out) {
          verdict[x] = kBorneOut;
        } else if (verdict[x] != kBorneOut) {
          verdict[x] = kContradicted;
        }
      }
    }
  }
  return verdicts == kContradicted;
}

}  // namespace mono3d
