// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/stage_testing.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>

namespace mono3d {
namespace {

std::unique_ptr<DepthKernels>& KernelsSlot() {
  static std::unique_ptr<DepthKernels> kernels;
  return kernels;
}

// Gives the kernels back before test_device.cpp closes the device.
class KernelsEnd : public ::testing::EmptyTestEventListener {
  void OnEnvironmentsTearDownStart(const ::testing::UnitTest&) override { KernelsSlot().reset(); }
};

[[maybe_unused]] const bool kKernelsEnd = [] {
  ::testing::UnitTest::GetInstance()->listeners().Append(new KernelsEnd);
  return true;
}();

}  // namespace

DepthKernels& TestKernels() {
  std::unique_ptr<DepthKernels>& kernels = KernelsSlot();
  if (!kernels) kernels = std::make_unique<DepthKernels>(TestDevice());
  return *kernels;
}

void SetBounds(LevelSize size, SourceProjections& projections) {
  const double right = size.width_px - 1.;
  const double bottom = size.height_px - 1.;
  const auto share_of = [](double share, double all) { return std::floor(share * all); };
  projections.front().bounds = {{share_of(0.2, right), 0}, {share_of(0.9, right), bottom}};
  for (SourceProjection& projection : projections) {
    projection.reference = {{0, share_of(0.3, bottom)}, {share_of(0.8, right), bottom}};
  }
}

std::mt19937 SeededByTestName() {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  const std::string name = std::string(info->test_suite_name()) + "." + info->name();
  std::seed_seq seed(name.begin(), name.end());
  return std::mt19937(seed);
}

cv::Mat RandomImage(LevelSize size, std::mt19937& random) {
  cv::Mat image(static_cast<int>(size.height_px), static_cast<int>(size.width_px), CV_8UC1);
  std::uniform_int_distribution<int> grey(0, 255);
  for (auto& pixel : cv::Mat_<std::uint8_t>(image)) pixel = static_cast<std::uint8_t>(grey(random));
  return image;
}

std::vector<float> RandomValues(std::size_t count, float low, float high, double share_missing,
                                std::mt19937& random) {
  std::uniform_real_distribution<float> value(low, high);
  std::bernoulli_distribution missing(share_missing);
  std::vector<float> values(count);
  for (float& v : values) v = missing(random) ? 0.f : value(random);
  return values;
}

Buffer ImagesToBuffer(const std::vector<cv::Mat>& images) {
  std::vector<std::uint32_t> words;
  for (const cv::Mat& image : images) {
    const std::vector<std::uint32_t> padded = PackPadded(image);
    words.insert(words.end(), padded.begin(), padded.end());
  }
  return ToBuffer(words);
}

cv::Mat ImageOf(const Buffer& buffer, LevelSize size, std::size_t index) {
  std::vector<std::uint32_t> words(PaddedWords(size));
  buffer.Download(std::span<std::uint32_t>(words), 4 * index * PaddedWords(size));
  cv::Mat image(static_cast<int>(size.height_px), static_cast<int>(size.width_px), CV_8UC1);
  for (std::uint32_t y = 0; y < size.height_px; ++y) {
    for (std::uint32_t x = 0; x < size.width_px; ++x) {
      const std::size_t byte =
          4 * std::size_t{PaddedWordsPerRow(size)} * (y + kImagePadding) + x + kImagePadding;
      image.at<std::uint8_t>(static_cast<int>(y), static_cast<int>(x)) =
          static_cast<std::uint8_t>(words[byte / 4] >> (8 * (byte % 4)));
    }
  }
  return image;
}

std::vector<std::uint32_t> WithoutStride(const std::vector<std::uint32_t>& strided,
                                         LevelSize size) {
  std::vector<std::uint32_t> values;
  for (std::uint32_t y = 0; y < size.height_px; ++y) {
    const auto row = strided.begin() + std::ptrdiff_t{4} * size.groups_per_row() * y;
    values.insert(values.end(), row, row + size.width_px);
  }
  return values;
}

::testing::AssertionResult SameImage(const cv::Mat& found, const cv::Mat& expected) {
  if (found.size() != expected.size() || found.type() != expected.type()) {
    return ::testing::AssertionFailure() << "size or type differ";
  }
  const int num_different = cv::countNonZero(found != expected);
  if (num_different == 0) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << num_different << " pixels differ";
}

}  // namespace mono3d
