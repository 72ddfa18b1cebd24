// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tools {

// What a camera sees of a model. All images have the camera's size; 0 where it sees nothing.
struct ModelRendering {
  cv::Mat bgr;         // CV_8UC3; black where nothing is
  cv::Mat depth;       // CV_32FC1, z-depth along the optical axis, su
  cv::Mat normal;      // CV_32FC3, unit length, camera frame, towards the camera
  cv::Mat confidence;  // CV_32FC1, 0 to 1; 1 where the model says nothing of it
};

// Draws each surfel as the disc that it is: of its radius, in its tangent plane, from either side;
// of several on the ray of a pixel the nearest is seen. A disc smaller than a pixel fills the pixel
// onto which its centre falls. Colours are grey where the model has none. Throws Error on a cloud
// without normals or radii, with lists of differing lengths or numbers that are not finite, and on
// a camera that is not valid or has distortion.
ModelRendering RenderModel(const PointCloud& surfels, const CameraModel& camera,
                           const Pose& T_world_cam);

// What a picture of a model shows.
enum class ModelAspect { kColour, kNormal, kConfidence, kDepth };

// "colour", "normal", "confidence", "depth". Throws UsageError on any other.
ModelAspect ToModelAspect(const std::string& name);

// The rendering as a picture, CV_8UC3, white where nothing is: colours as they are; normals as
// x, y, z from -1 to 1 in red, green, blue; confidence from dark (0) to light (1); depth from near
// (red) to far (blue), evenly in inverse depth between the nearest and the farthest 1 %.
cv::Mat ToPicture(const ModelRendering& rendering, ModelAspect aspect);

// The cloud with the aspect as its colours, for RenderClouds; normals in the world's axes. Throws
// UsageError on depth, which needs a camera, and on an aspect of which the cloud says nothing.
PointCloud Recoloured(const PointCloud& cloud, ModelAspect aspect);

}  // namespace mono3d::tools
