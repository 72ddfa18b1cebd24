// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <string>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tools {

// Values of a saved state, as JSON that is written as CBOR: numbers come back to the bit. What
// reads them throws nlohmann::json::exception on anything else.

// Of bytes of CBOR. Values are read, copied and destroyed by recursion: what is deeper than any of
// ours is refused.
nlohmann::json StateFromCbor(const std::string& bytes);

nlohmann::json PoseToJson(const Pose& pose);
Pose PoseFromJson(const nlohmann::json& json);

nlohmann::json CameraToJson(const CameraModel& camera);
CameraModel CameraFromJson(const nlohmann::json& json);

// The pixels as they are.
nlohmann::json ImageToJson(const cv::Mat& image);
cv::Mat ImageFromJson(const nlohmann::json& json);

}  // namespace mono3d::tools
