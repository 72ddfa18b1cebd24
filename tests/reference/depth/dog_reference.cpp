// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/dog_reference.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mono3d::reference {

std::vector<std::uint32_t> DogResponse(const cv::Mat& grey) {
  constexpr std::array<double, 9> kWide = {1, 8, 28, 56, 70, 56, 28, 8, 1};
  constexpr std::array<double, 9> kNarrow = {0, 0, 1, 4, 6, 4, 1, 0, 0};
  std::vector<std::uint32_t> response;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      double difference = 0;  // exact: all weights are fractions of powers of two
      for (int dy = -4; dy <= 4; ++dy) {
        for (int dx = -4; dx <= 4; ++dx) {
          const auto i = static_cast<std::size_t>(dx + 4);
          const auto j = static_cast<std::size_t>(dy + 4);
          const double weight = kNarrow[i] * kNarrow[j] / 256 - kWide[i] * kWide[j] / 65536;
          difference += weight * grey.at<std::uint8_t>(std::clamp(y + dy, 0, grey.rows - 1),
                                                       std::clamp(x + dx, 0, grey.cols - 1));
        }
      }
      response.push_back(static_cast<std::uint32_t>(std::floor(256 * std::abs(difference))));
    }
  }
  return response;
}

std::vector<std::uint32_t> TextureSum(const std::vector<std::uint32_t>& response, int width,
                                      int height) {
  std::vector<std::uint32_t> sums;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      std::uint32_t sum = 0;
      for (int dy = -3; dy <= 3; ++dy) {
        for (int dx = -4; dx <= 4; ++dx) {
          const int row = std::clamp(y + dy, 0, height - 1);
          sum += response[static_cast<std::size_t>(row * width + std::clamp(x + dx, 0, width - 1))];
        }
      }
      sums.push_back(sum);
    }
  }
  return sums;
}

}  // namespace mono3d::reference
