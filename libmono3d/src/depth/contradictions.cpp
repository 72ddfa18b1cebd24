// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/contradictions.h"

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>
#include <span>
#include <vector>

namespace mono3d {
namespace {

// Edge of a place: neighbours on a surface that a source shows somewhat larger are in one, or in
// places next to each other.
constexpr float kPlace_px = 2;

// Of a pixel of the reference without depth, or whose point the source does not see.
constexpr std::int32_t kNowhere = -1;

// Pixels that are worked on together.
constexpr int kLanes = cv::v_float32x4::nlanes;

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

  // Of the pixels of row y with these inverse depths, 0: none. Their number is a multiple of
  // kLanes.
  void OfRow(int y, const float* inverse_depths, std::span<std::int32_t> places) const {
    const Eigen::Vector3f start = A_ * Eigen::Vector3f(0, float(y), 1);
    const Eigen::Vector3f step = A_.col(0);
    const auto all = [](float value) { return cv::v_setall_f32(value); };
    const cv::v_float32x4 zero = all(0);
    const cv::v_float32x4 per_px = all(1 / kPlace_px);
    const cv::v_int32x4 num_columns = cv::v_setall_s32(num_columns_);
    const cv::v_int32x4 nowhere = cv::v_setall_s32(kNowhere);
    cv::v_float32x4 x(0, 1, 2, 3);
    for (std::size_t i = 0; i < places.size(); i += kLanes, x += all(kLanes)) {
      const cv::v_float32x4 w = cv::v_load(inverse_depths + i);
      const auto along = [&](int axis) {
        return all(start[axis]) + all(step[axis]) * x + all(b_[axis]) * w;
      };
      const cv::v_float32x4 z = along(2);
      const cv::v_float32x4 u = along(0) / z;
      const cv::v_float32x4 v = along(1) / z;
      const cv::v_float32x4 is_seen = (w > zero) & (z > zero) & (u >= all(first_.x())) &
                                      (u <= all(last_.x())) & (v >= all(first_.y())) &
                                      (v <= all(last_.y()));
      const cv::v_int32x4 place = cv::v_trunc(v * per_px) * num_columns + cv::v_trunc(u * per_px);
      cv::v_store(places.data() + i,
                  cv::v_select(cv::v_reinterpret_as_s32(is_seen), place, nowhere));
    }
  }

 private:
  Eigen::Matrix3f A_;
  Eigen::Vector3f b_;
  Eigen::Vector2f first_;
  Eigen::Vector2f last_;
  std::int32_t num_columns_;
  std::int32_t num_rows_;
};

// The pixel to which a place belongs: in the upper half the bits of its confidence, which as those
// of floats from 0 on are in the same order, and in the lower half those of its inverse depth. As
// one word, since which of two pixels is surer is a matter of chance, which no processor predicts.
using Owner = std::uint64_t;
constexpr Owner kNobody = 0;

Owner OwnerOf(float confidence, float inverse_depth) {
  return Owner{std::bit_cast<std::uint32_t>(confidence)} << 32U |
         std::bit_cast<std::uint32_t>(inverse_depth);
}

// The first of equals.
Owner SurerOf(Owner first, Owner second) { return second >> 32U > first >> 32U ? second : first; }

float InverseDepthOf(Owner owner) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(owner));
}

// One that fills up a side of the bundle, or stands where the reference does.
bool ShowsNoDepth(const SourceProjection& source) { return source.b.isZero(); }

// 1/su, 0: no depth, in rows of a multiple of kLanes.
cv::Mat InverseDepths(const cv::Mat& depth) {
  cv::Mat inverse_depth(depth.rows, (depth.cols + kLanes - 1) / kLanes * kLanes, CV_32FC1,
                        cv::Scalar(0));
  for (int y = 0; y < depth.rows; ++y) {
    const auto* from = depth.ptr<float>(y);
    auto* to = inverse_depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) to[x] = from[x] > 0 ? 1 / from[x] : 0;
  }
  return inverse_depth;
}

}  // namespace

cv::Mat FindContradicted(const SweepGeometry& geometry, const cv::Mat& depth,
                         const cv::Mat& confidence, double tolerance) {
  const cv::Mat inverse_depth = InverseDepths(depth);
  constexpr std::uint8_t kContradicted = 255;
  cv::Mat contradicted(depth.size(), CV_8UC1, cv::Scalar(0));
  cv::Mat places_of_pixels(inverse_depth.size(), CV_32SC1);
  std::vector<Owner> owners;
  // Nearly all pixels are borne out by the first source: of the others only the places of those few
  // matter that are not, which are `open`.
  std::vector<std::uint8_t> is_asked_for;
  std::vector<cv::Point> open;
  bool is_first = true;
  for (const SourceProjection& source : geometry.Projections(0)) {
    if (ShowsNoDepth(source)) continue;
    const Places places(source);
    for (int y = 0; y < depth.rows; ++y) {
      places.OfRow(
          y, inverse_depth.ptr<float>(y),
          {places_of_pixels.ptr<std::int32_t>(y), static_cast<std::size_t>(inverse_depth.cols)});
    }
    is_asked_for.assign(places.size(), is_first ? 1 : 0);
    for (const cv::Point& pixel : open) {
      const std::int32_t place = places_of_pixels.at<std::int32_t>(pixel);
      if (place != kNowhere) is_asked_for[static_cast<std::size_t>(place)] = 1;
    }
    owners.assign(places.size(), kNobody);
    for (int y = 0; y < depth.rows; ++y) {
      const auto* w = inverse_depth.ptr<float>(y);
      const auto* confidences = confidence.ptr<float>(y);
      const auto* place = places_of_pixels.ptr<std::int32_t>(y);
      for (int x = 0; x < depth.cols; ++x) {
        if (place[x] == kNowhere || is_asked_for[static_cast<std::size_t>(place[x])] == 0) continue;
        Owner& owner = owners[static_cast<std::size_t>(place[x])];
        owner = SurerOf(owner, OwnerOf(confidences[x], w[x]));
      }
    }
    const auto is_borne_out = [&](const cv::Point& pixel) {
      const std::int32_t place = places_of_pixels.at<std::int32_t>(pixel);
      if (place == kNowhere) return false;
      const Owner owner = owners[static_cast<std::size_t>(place)];
      const float difference = std::abs(InverseDepthOf(owner) - inverse_depth.at<float>(pixel));
      const bool agrees = owner == kNobody || difference <= float(tolerance);
      contradicted.at<std::uint8_t>(pixel) = agrees ? 0 : kContradicted;
      return agrees;
    };
    if (is_first) {
      for (int y = 0; y < depth.rows; ++y) {
        for (int x = 0; x < depth.cols; ++x) {
          if (depth.at<float>(y, x) > 0 && !is_borne_out({x, y})) open.emplace_back(x, y);
        }
      }
    } else {
      std::erase_if(open, is_borne_out);
    }
    is_first = false;
  }
  return contradicted;
}

}  // namespace mono3d
