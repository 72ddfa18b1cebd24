// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/depth_map.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

void RequireImage(const cv::Mat& image, int type, const CameraModel& camera, const char* name) {
  if (image.type() == type && image.cols == camera.width && image.rows == camera.height) return;
  const auto describe = [](int cols, int rows, int of_type) {
    return std::to_string(cols) + "x" + std::to_string(rows) + " " + cv::typeToString(of_type);
  };
  throw Error(ErrorParts{.what = std::string("wrong size or type of ") + name,
                         .where = "depth map",
                         .expected = describe(camera.width, camera.height, type),
                         .found = describe(image.cols, image.rows, image.type())});
}

bool HasInferred(const DepthMap& map) {
  return !map.inferred.empty() && cv::countNonZero(map.inferred) > 0;
}

// `values` where the estimate is not inferred; 0 elsewhere.
cv::Mat WhereNot(const cv::Mat& inferred, const cv::Mat& values) {
  if (values.empty()) return {};
  cv::Mat chosen(values.size(), CV_32FC1);
  for (int y = 0; y < values.rows; ++y) {
    const auto* from = values.ptr<float>(y);
    const auto* is_inferred = inferred.ptr<std::uint8_t>(y);
    auto* to = chosen.ptr<float>(y);
    for (int x = 0; x < values.cols; ++x) to[x] = is_inferred[x] != 0 ? 0.0F : from[x];
  }
  return chosen;
}

}  // namespace

std::int64_t CountEstimates(const DepthMap& map) { return cv::countNonZero(map.depth); }

DepthMap WithoutInferred(const DepthMap& map) {
  DepthMap matched = map;
  matched.inferred.release();
  if (!HasInferred(map)) return matched;
  matched.depth = WhereNot(map.inferred, map.depth);
  matched.confidence = WhereNot(map.inferred, map.confidence);
  return matched;
}

DepthMap AtSizeOf(const Frame& frame, const DepthMap& map) {
  if (frame.camera.width == map.camera.width && frame.camera.height == map.camera.height) {
    return map;
  }
  DepthMap sized = map;
  sized.camera = frame.camera;
  sized.bgr = frame.bgr;
  for (cv::Mat* image : {&sized.depth, &sized.normal, &sized.confidence, &sized.inferred}) {
    if (image->empty()) continue;
    cv::Mat larger;
    cv::resize(*image, larger, {frame.camera.width, frame.camera.height}, 0, 0, cv::INTER_NEAREST);
    *image = larger;
  }
  return sized;
}

PointCloud ToPointCloud(const DepthMap& map, const Similarity& S_world_kf) {
  PointCloud cloud;
  const Eigen::Matrix3f R_world_cam = S_world_kf.pose().rotation().toRotationMatrix().cast<float>();
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const float depth = map.depth.at<float>(y, x);
      if (depth <= 0) continue;
      const Eigen::Vector3d p_cam = depth * map.camera.Unproject({x, y});
      cloud.points.emplace_back((S_world_kf * p_cam).cast<float>());
      if (!map.normal.empty()) {
        const auto& n = map.normal.at<cv::Vec3f>(y, x);
        cloud.normals.emplace_back(R_world_cam * Eigen::Vector3f(n[0], n[1], n[2]));
      }
      if (!map.confidence.empty()) cloud.confidences.push_back(map.confidence.at<float>(y, x));
      if (!map.bgr.empty()) {
        const auto& bgr = map.bgr.at<cv::Vec3b>(y, x);
        cloud.colours.push_back({bgr[2], bgr[1], bgr[0]});
      }
    }
  }
  return cloud;
}

void Validate(const DepthMap& map) {
  Validate(map.camera, "depth map");
  RequireImage(map.depth, CV_32FC1, map.camera, "depth");
  if (!map.normal.empty()) RequireImage(map.normal, CV_32FC3, map.camera, "normal");
  if (!map.confidence.empty()) RequireImage(map.confidence, CV_32FC1, map.camera, "confidence");
  if (!map.bgr.empty()) RequireImage(map.bgr, CV_8UC3, map.camera, "bgr");
  if (!map.inferred.empty()) RequireImage(map.inferred, CV_8UC1, map.camera, "inferred");
}

}  // namespace mono3d
