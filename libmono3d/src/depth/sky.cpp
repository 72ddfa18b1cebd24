// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/sky.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "depth/image_cells.h"

namespace mono3d {
namespace {

// Grey levels over a window of 5x5 cells of means: clouds and gradients have less, and noise is
// averaged.
constexpr int kMaxRange = 12;
constexpr int kMaxStep = 5;         // from one cell to the next, grey levels
constexpr int kMinGrey = 110;       // darker is no daylight sky
constexpr int kMaxRedness = 6;      // red above blue, grey levels
constexpr double kMinShare = 0.01;  // of the image
// Without sun the sky is the light, and nothing that it lights is brighter. A sky with sun is blue,
// and sunlit walls may be brighter. Highlights and lamps are a few hundredths at most.
constexpr double kMinBlueness = 20;         // blue above red, grey levels
constexpr double kMaxBrighterShare = 0.05;  // of what was matched, by more than kMaxRange
// Walls have some texture somewhere. Cells at the edge of the region do not count: there the census
// window gives them the depth of what stands before the sky.
constexpr double kMaxMatchedShare = 0.25;
// Depth at the edge of a region errs, and a wall leans.
constexpr float kMaxDepthRatio = 1.1F;

// 255 where a cell by itself looks like sky.
cv::Mat SkyLikeCells(const cv::Mat& bgr, const cv::Mat& grey) {
  cv::Mat least, most;
  cv::erode(grey, least, cv::Mat::ones(5, 5, CV_8UC1));
  cv::dilate(grey, most, cv::Mat::ones(5, 5, CV_8UC1));
  // One cell beyond the smooth ones, to the edge of the region.
  cv::Mat smooth;
  cv::dilate((most - least) <= kMaxRange, smooth, cv::Mat::ones(3, 3, CV_8UC1));
  cv::Mat like(grey.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const auto& colour = bgr.at<cv::Vec3b>(y, x);
      const bool is_like = smooth.at<std::uint8_t>(y, x) != 0 &&
                           grey.at<std::uint8_t>(y, x) >= kMinGrey &&
                           colour[2] - colour[0] <= kMaxRedness;
      if (is_like) like.at<std::uint8_t>(y, x) = 255;
    }
  }
  return like;
}

// Those of `like` that a path of small steps of grey joins to the first row.
cv::Mat GrownFromAbove(const cv::Mat& like, const cv::Mat& grey) {
  cv::Mat region(like.size(), CV_8UC1, cv::Scalar(0));
  std::vector<cv::Point> front;
  const auto add = [&](int x, int y) {
    region.at<std::uint8_t>(y, x) = 255;
    front.emplace_back(x, y);
  };
  for (int x = 0; x < like.cols; ++x) {
    if (like.at<std::uint8_t>(0, x) != 0) add(x, 0);
  }
  while (!front.empty()) {
    const cv::Point from = front.back();
    front.pop_back();
    for (const cv::Point side :
         {cv::Point(-1, 0), cv::Point(1, 0), cv::Point(0, -1), cv::Point(0, 1)}) {
      const cv::Point to = from + side;
      if (!cv::Rect(0, 0, like.cols, like.rows).contains(to)) continue;
      if (like.at<std::uint8_t>(to) == 0 || region.at<std::uint8_t>(to) != 0) continue;
      const int step = int(grey.at<std::uint8_t>(to)) - int(grey.at<std::uint8_t>(from));
      if (std::abs(step) <= kMaxStep) add(to.x, to.y);
    }
  }
  return region;
}

// The least depth in each cell, 0 where nothing was matched.
cv::Mat NearestOfCells(const cv::Mat& depth, cv::Size cells) {
  cv::Mat nearest(cells, CV_32FC1, cv::Scalar(0));
  for (int y = 0; y < depth.rows; ++y) {
    const auto* row = depth.ptr<float>(y);
    auto* const out = nearest.ptr<float>(y / kImageCell_px);
    for (int x = 0; x < depth.cols; ++x) {
      float& cell = out[x / kImageCell_px];
      if (row[x] > 0 && (cell == 0 || row[x] < cell)) cell = row[x];
    }
  }
  return nearest;
}

// The first depth from row `y` on, in steps of `step`, in column `x`; 0 up to the border.
float FirstDepth(const cv::Mat& nearest, int x, int y, int step) {
  for (; y >= 0 && y < nearest.rows; y += step) {
    const float depth = nearest.at<float>(y, x);
    if (depth > 0) return depth;
  }
  return 0;
}

// Whether most of `part` lies between something below and something that is about as far or farther
// above: a roof or a road seen from above, or a wall. Before the sky it would be the other way
// round, as what hangs into the view is nearer than the ground behind.
bool IsPartOfASurface(const cv::Mat& part, const cv::Mat& nearest) {
  int num_of_surface = 0;
  for (int x = 0; x < part.cols; ++x) {
    for (int y = 0; y < part.rows; ++y) {
      if (part.at<std::uint8_t>(y, x) == 0) continue;
      const int first = y;
      while (y < part.rows && part.at<std::uint8_t>(y, x) != 0) ++y;
      const float above = FirstDepth(nearest, x, first - 1, -1);
      const float below = FirstDepth(nearest, x, y, 1);
      if (above > 0 && below > 0 && below <= kMaxDepthRatio * above) num_of_surface += y - first;
    }
  }
  return 2 * num_of_surface > cv::countNonZero(part);
}

// Whether a part of this colour is darker than it would be if it lit the rest of the image.
bool IsLit(const cv::Scalar& colour, const cv::Mat& grey, const cv::Mat& is_matched) {
  if (colour[0] - colour[2] >= kMinBlueness) return false;
  const double brightness = 0.114 * colour[0] + 0.587 * colour[1] + 0.299 * colour[2];
  const int num_brighter = cv::countNonZero((grey > brightness + kMaxRange) & is_matched);
  return num_brighter > kMaxBrighterShare * cv::countNonZero(is_matched);
}

}  // namespace

cv::Mat FindSky(const cv::Mat& bgr, const cv::Mat& depth) {
  const cv::Mat colours = MeansOfCells(bgr);
  cv::Mat grey;
  cv::cvtColor(colours, grey, cv::COLOR_BGR2GRAY);
  const cv::Mat sky = GrownFromAbove(SkyLikeCells(colours, grey), grey);
  cv::Mat labels, stats, centres;
  const int num = cv::connectedComponentsWithStats(sky, labels, stats, centres, 4, CV_32S);
  const cv::Mat matched = MeansOfCells((depth > 0) & 255);
  const cv::Mat nearest = NearestOfCells(depth, sky.size());
  cv::Mat inner;
  cv::erode(sky, inner, cv::Mat::ones(5, 5, CV_8UC1), cv::Point(-1, -1), 1, cv::BORDER_REPLICATE);
  cv::Mat found(sky.size(), CV_8UC1, cv::Scalar(0));
  for (int i = 1; i < num; ++i) {
    const cv::Mat part = labels == i;
    const cv::Mat inside = part & inner;
    const bool is_large =
        stats.at<int>(i, cv::CC_STAT_AREA) >= kMinShare * static_cast<double>(sky.total());
    if (!is_large || cv::countNonZero(inside) == 0) continue;
    const bool is_bare = cv::mean(matched, inside)[0] <= 255 * kMaxMatchedShare;
    if (is_bare && !IsPartOfASurface(part, nearest) &&
        !IsLit(cv::mean(colours, inside), grey, matched > 127)) {
      found |= part;
    }
  }
  // Cells that the region's border crosses.
  cv::dilate(found, found, cv::Mat::ones(3, 3, CV_8UC1));
  return found;
}

}  // namespace mono3d
