// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tools {

// Values of a saved state, as JSON that is written as CBOR: numbers come back to the bit. What
// reads them throws nlohmann::json::exception on anything else.

// Of bytes of CBOR. Values are read, copied and destroyed by recursion: what is deeper than any of
// ours is refused.
nlohmann::json StateFromCbor(const std::string& bytes);

// Rotation (x, y, z, w) and translation.
using SavedPose = std::array<double, 7>;
SavedPose ToSaved(const Pose& pose);
Pose FromSaved(const SavedPose& numbers);

// Rows of numbers, which become one value (nlohmann::json::binary) and cost their bytes alone: a
// long run has a hundred thousand frames, and is saved every few seconds.
template <typename... Numbers>
void AddRow(std::vector<std::uint8_t>& rows, const Numbers&... numbers) {
  const auto add = [&](const auto& number) {
    const std::size_t at = rows.size();
    rows.resize(at + sizeof(number));
    std::memcpy(rows.data() + at, &number, sizeof(number));
  };
  (add(numbers), ...);
}

// Calls `take` with the numbers of each row. Throws Error where the last one is cut off.
template <typename... Numbers, typename Take>
void ForEachRow(const nlohmann::json& rows, const Take& take) {
  const std::vector<std::uint8_t>& bytes = rows.get_binary();
  constexpr std::size_t kRowBytes = (sizeof(Numbers) + ...);
  if (bytes.size() % kRowBytes != 0) throw Error("the journal is damaged: a list is not whole");
  for (std::size_t at = 0; at < bytes.size();) {
    std::tuple<Numbers...> row;
    const auto read = [&](auto& number) {
      std::memcpy(&number, bytes.data() + at, sizeof(number));
      at += sizeof(number);
    };
    std::apply([&](auto&... numbers) { (read(numbers), ...); }, row);
    std::apply(take, row);
  }
}

nlohmann::json CameraToJson(const CameraModel& camera);
CameraModel CameraFromJson(const nlohmann::json& json);

// The pixels as they are.
nlohmann::json ImageToJson(const cv::Mat& image);
cv::Mat ImageFromJson(const nlohmann::json& json);

}  // namespace mono3d::tools
