// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/depth_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/pfm_file.h"
#include "simulate/image_file.h"

namespace mono3d::tools {
namespace {

constexpr double kMaxValue = 65535;
constexpr double kMaxRounding = 1e-4;  // share of the depth

// To three digits, so that scale.txt is short and exact.
double RoundDown(double value) {
  const double unit = std::pow(10, std::floor(std::log10(value)) - 2);
  return std::floor(value / unit) * unit;
}

}  // namespace

DepthForm ChooseDepthForm(const std::string& wanted, const synthetic::SequenceSurvey& survey) {
  if (wanted != "auto" && wanted != "png" && wanted != "pfm") {
    throw UsageError(ErrorParts{.what = "unknown form of depth",
                                .where = "--depth-form",
                                .expected = "auto, png or pfm",
                                .found = wanted});
  }
  if (wanted == "pfm") return {.is_pfm = true};
  const double widest_scale = RoundDown(kMaxValue / (1.1 * survey.farthest_m));
  const double exact_scale = 0.5 / (kMaxRounding * 0.8 * survey.nearest_m);
  if (widest_scale >= exact_scale) return {.png_scale = widest_scale};
  if (wanted == "auto") return {.is_pfm = true};
  return {.png_scale = std::ceil(exact_scale)};
}

void WriteDepthScale(const std::filesystem::path& folder, const DepthForm& form) {
  if (form.is_pfm) return;
  std::string text = std::to_string(form.png_scale);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  WriteFileAtomically(folder / "scale.txt", text + "\n");
}

std::filesystem::path DepthPath(const std::filesystem::path& folder, const std::string& frame_name,
                                const DepthForm& form) {
  return folder / (frame_name + (form.is_pfm ? ".pfm" : ".png"));
}

void WriteDepth(const std::filesystem::path& path, const cv::Mat& depth, const DepthForm& form) {
  if (form.is_pfm) {
    WritePfm(path, depth);
    return;
  }
  cv::Mat values(depth.size(), CV_16UC1);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const double value = std::round(form.png_scale * depth.at<float>(y, x));
      values.at<std::uint16_t>(y, x) =
          value <= kMaxValue ? static_cast<std::uint16_t>(value) : std::uint16_t{0};
    }
  }
  WriteFileAtomically(path, EncodePng(values));
}

}  // namespace mono3d::tools
