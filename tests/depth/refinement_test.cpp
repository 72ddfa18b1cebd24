// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <array>
#include <bit>
#include <cmath>

#include "depth/contrast.h"
#include "depth/measurement.h"
#include "depth/stage_testing.h"
#include "depth/sweep_geometry.h"
#include "reference/depth/pyramid_reference.h"
#include "reference/depth/refinement_reference.h"

namespace mono3d {
namespace {

double GainOf(const cv::Mat& reference, const cv::Mat& image) {
  return ContrastGain(ContrastOf(reference), ContrastOf(image));
}

constexpr LevelSize kRefinedSize{41, 30};
constexpr float kStep = 0.01f;

constexpr std::array<std::uint32_t, 5> kEqualGains = {kGainSteps, kGainSteps, kGainSteps,
                                                      kGainSteps, kGainSteps};

// Words of bilinear interpolation of five images, as detail.comp writes them.
std::vector<std::uint32_t> DetailOnDevice(const std::vector<cv::Mat>& images, LevelSize size,
                                          const std::array<std::uint32_t, 5>& gains = kEqualGains) {
  std::vector<cv::Mat> quarter;
  for (const cv::Mat& image : images) {
    quarter.push_back(reference::Halve(reference::Halve(image)));
  }
  const Buffer detail = MakeBuffer<std::uint32_t>(5 * size.num_strided_pixels());
  Buffer gain_buffer = MakeBuffer<std::uint32_t>(gains.size());
  gain_buffer.Upload(std::span<const std::uint32_t>(gains));
  Recorder recorder(TestDevice());
  TestKernels().Detail(recorder, {size.width_px, size.height_px, 0}, 5, ImagesToBuffer(images),
                       ImagesToBuffer(quarter), gain_buffer, detail);
  recorder.Submit();
  return FirstOf<std::uint32_t>(detail, 5 * size.num_strided_pixels());
}

TEST(Detail, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    std::vector<cv::Mat> images;
    for (int i = 0; i < 5; ++i) images.push_back(RandomImage(size, random));
    const std::array<std::uint32_t, 5> gains = {kGainSteps, 700, 1500, 256, 4096};
    const auto words = DetailOnDevice(images, size, gains);
    for (std::size_t i = 0; i < images.size(); ++i) {
      const cv::Mat expected =
          reference::Detail(images[i], reference::Halve(reference::Halve(images[i])),
                            static_cast<double>(gains[i]) / kGainSteps);
      for (int y = 0; y + 1 < expected.rows; ++y) {
        for (int x = 0; x + 1 < expected.cols; ++x) {
          const std::uint32_t word =
              words[i * size.num_strided_pixels() + std::size_t(y) * 4 * size.groups_per_row() +
                    std::size_t(x)];
          const auto byte = [&](int dx, int dy) {
            return std::uint32_t{expected.at<std::uint8_t>(y + dy, x + dx)};
          };
          ASSERT_EQ(word, byte(0, 0) | byte(1, 0) << 8 | byte(0, 1) << 16 | byte(1, 1) << 24)
              << x << " " << y;
        }
      }
    }
  }
}

TEST(Detail, DoesNotSeeBrightness) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat image = RandomImage(kRefinedSize, random) / 2;
  const auto words = DetailOnDevice({image, image + 60, image, image, image}, kRefinedSize);
  const std::size_t plane = kRefinedSize.num_strided_pixels();
  for (std::size_t y = 0; y < kRefinedSize.height_px; ++y) {
    for (std::size_t x = 0; x < kRefinedSize.width_px; ++x) {
      const std::size_t at = y * 4 * kRefinedSize.groups_per_row() + x;
      EXPECT_EQ(words[at] & 0xffu, words[plane + at] & 0xffu);
    }
  }
}

TEST(Detail, DoesNotSeeContrast) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat image = RandomImage(kRefinedSize, random) / 2;
  const cv::Mat exposed = image * 1.6 + 20;
  const auto gain = static_cast<std::uint32_t>(std::lround(kGainSteps * GainOf(image, exposed)));
  EXPECT_NEAR(gain, kGainSteps / 1.6, 0.02 * kGainSteps);
  const auto words = DetailOnDevice({image, exposed, image, image, image}, kRefinedSize,
                                    {kGainSteps, gain, kGainSteps, kGainSteps, kGainSteps});
  const std::size_t plane = kRefinedSize.num_strided_pixels();
  for (std::size_t y = 0; y < kRefinedSize.height_px; ++y) {
    for (std::size_t x = 0; x < kRefinedSize.width_px; ++x) {
      const std::size_t at = y * 4 * kRefinedSize.groups_per_row() + x;
      // Rounding of the exposed image, and 2 % of a detail of 60.
      EXPECT_NEAR(words[at] & 0xffu, words[plane + at] & 0xffu, 3);
    }
  }
}

TEST(ContrastGain, IsThatOfGainAndOffsetWhateverIsClipped) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat image = RandomImage({200, 150}, random);
  EXPECT_NEAR(GainOf(image, image), 1, 1e-9);
  EXPECT_NEAR(GainOf(image, image * 0.6 + 10), 1 / 0.6, 0.02);
  EXPECT_NEAR(GainOf(image, image * 1.2 - 20), 1 / 1.2, 0.02);  // a tenth clipped at each end
  const cv::Mat flat(150, 200, CV_8UC1, cv::Scalar(90));
  EXPECT_EQ(GainOf(image, flat), 1);
  EXPECT_EQ(GainOf(flat, image), 1);
}

// Place of pixel i among the measurements, which have a border of zeros.
std::size_t MeasurementIndex(std::size_t i) {
  return (i / kRefinedSize.width_px + kMeasurementBorder) * MeasurementsPerRow(kRefinedSize) +
         i % kRefinedSize.width_px + kMeasurementBorder;
}

// Inverse depth before and after the step, information and support, to the words of
// measurement.glsl and back.
std::array<std::uint32_t, 2> Packed(const Eigen::Vector4f& m) {
  if (m.x() <= 0) return {0, 0};
  const auto step = static_cast<std::int32_t>(std::lround(2047 * (m.y() - m.x()) / kStep));
  const auto support = static_cast<std::uint32_t>(std::lround(255 * m.w()));
  const std::uint32_t information = (std::bit_cast<std::uint32_t>(m.z()) - 0x3f800000u) >> 16;
  return {std::bit_cast<std::uint32_t>(m.x()),
          static_cast<std::uint32_t>(step) << 20 | support << 12 | information};
}

Eigen::Vector4f Unpacked(std::uint32_t inverse_depth, std::uint32_t fields) {
  if (inverse_depth == 0) return Eigen::Vector4f::Zero();
  const auto w = std::bit_cast<float>(inverse_depth);
  const auto step = static_cast<float>(static_cast<std::int32_t>(fields) >> 20) / 2047;
  return {w, w + step * kStep, std::bit_cast<float>(((fields & 0xfffu) << 16) + 0x3f800000u),
          static_cast<float>((fields >> 12) & 0xffu) / 255};
}

Eigen::Vector4f Rounded(const Eigen::Vector4f& m) {
  const auto [inverse_depth, fields] = Packed(m);
  return Unpacked(inverse_depth, fields);
}

// A smooth pattern with slopes in both directions.
double Pattern(double x, double y) { return 128 + 40 * std::sin(0.7 * x) + 30 * std::cos(0.5 * y); }

struct PhotometricScene {
  std::vector<cv::Mat> detail;
  SourceProjections projections;
};

// A plane of inverse depth `w`: each source sees the pattern moved by w b.
PhotometricScene SceneOf(double w, std::size_t num_sources = 4) {
  PhotometricScene scene;
  const int num_per_side = static_cast<int>(num_sources / 2);
  std::vector<Eigen::Vector3d> b;
  for (int i = -num_per_side; i <= num_per_side; ++i) {
    const double place = 100.0 * i / num_per_side;
    if (i != 0) b.emplace_back(place, std::abs(place) < 100 ? -0.2 * place : 0, 0);
  }
  for (std::size_t i = 0; i <= num_sources; ++i) {
    const Eigen::Vector3d moved = i == 0 ? Eigen::Vector3d::Zero() : Eigen::Vector3d(w * b[i - 1]);
    cv::Mat image(int(kRefinedSize.height_px), int(kRefinedSize.width_px), CV_8UC1);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        image.at<std::uint8_t>(y, x) =
            static_cast<std::uint8_t>(std::lround(Pattern(x - moved.x(), y - moved.y())));
      }
    }
    scene.detail.push_back(image);
    if (i > 0) scene.projections.push_back({Eigen::Matrix3d::Identity(), b[i - 1]});
  }
  return scene;
}

std::vector<Eigen::Vector4f> StepOnDevice(const PhotometricScene& scene,
                                          const std::vector<float>& inverse_depth,
                                          float min_views = 0) {
  std::vector<std::uint32_t> words;
  for (const cv::Mat& image : scene.detail) {
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < 4 * int(kRefinedSize.groups_per_row()); ++x) {
        const auto byte = [&](int dx, int dy) {
          return std::uint32_t{image.at<std::uint8_t>(std::min(y + dy, image.rows - 1),
                                                      std::min(x + dx, image.cols - 1))};
        };
        words.push_back(byte(0, 0) | byte(1, 0) << 8 | byte(0, 1) << 16 | byte(1, 1) << 24);
      }
    }
  }
  const std::size_t num_sources = scene.projections.size();
  const auto detail_of = [&](std::size_t first_image, std::size_t num_images) {
    const auto first =
        words.begin() + std::ptrdiff_t(first_image * kRefinedSize.num_strided_pixels());
    return ToBuffer(std::vector<std::uint32_t>(
        first, first + std::ptrdiff_t(num_images * kRefinedSize.num_strided_pixels())));
  };
  const Buffer measurements = MakeBuffer<std::uint32_t>(2 * NumMeasurements(kRefinedSize));
  Recorder recorder(TestDevice());
  TestKernels().Photometric(recorder, num_sources,
                            {kRefinedSize.width_px, kRefinedSize.height_px, kStep, 1.5f, min_views},
                            {detail_of(0, 1), detail_of(1, num_sources / 2),
                             detail_of(1 + num_sources / 2, num_sources / 2)},
                            ToBuffer(Pack(scene.projections, kRefinedSize)),
                            ToBuffer(inverse_depth), measurements);
  recorder.Submit();
  const auto fields = FirstOf<std::uint32_t>(measurements, 2 * NumMeasurements(kRefinedSize));
  std::vector<Eigen::Vector4f> result;
  for (std::size_t i = 0; i < kRefinedSize.num_pixels(); ++i) {
    const std::size_t at = 2 * MeasurementIndex(i);
    result.push_back(Unpacked(fields[at], fields[at + 1]));
  }
  // The border, above and to the left.
  EXPECT_EQ(fields[0], 0);
  EXPECT_EQ(fields[2 * MeasurementIndex(0) - 1], 0);
  return result;
}

TEST(Photometric, StepsToTheTrueDepth) {
  // From 0.4 planes off. What is left is the pattern's curvature and the rounding of grey values;
  // in the middle of the image, where all four sources see the point.
  const double truth = 0.033;
  const std::vector<float> start(kRefinedSize.num_pixels(), float(truth) + 0.4f * kStep);
  const auto found = StepOnDevice(SceneOf(truth), start);
  std::vector<double> errors;
  for (std::size_t y = 6; y < 24; ++y) {
    for (std::size_t x = 8; x < 33; ++x) {
      const Eigen::Vector4f& m = found[y * kRefinedSize.width_px + x];
      EXPECT_EQ(m.x(), start[0]);
      errors.push_back(std::abs(double(m.y()) - truth) / double(kStep));
    }
  }
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  EXPECT_LT(errors[errors.size() * 3 / 4], 0.2);
}

void ExpectStepsEqualReference(std::size_t num_sources, bool with_bounds, std::mt19937& random) {
  constexpr float min_views = 2;
  PhotometricScene scene = SceneOf(0.033, num_sources);
  if (with_bounds) SetBounds(kRefinedSize, scene.projections);
  const auto depth = RandomValues(kRefinedSize.num_pixels(), 0.02f, 0.05f, 0.2, random);
  const auto found = StepOnDevice(scene, depth, min_views);
  const auto expected = reference::PhotometricStep(
      scene.detail, scene.projections, depth,
      {kRefinedSize.width_px, kRefinedSize.height_px, kStep, 1.5f, min_views});
  std::size_t num_different = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    // Half a unit of the fields, and float against double; information is a sum of squares of
    // some hundreds.
    const bool same = std::abs(found[i].y() - expected[i].y()) <= 1e-3f * kStep &&
                      std::abs(found[i].z() - expected[i].z()) <= 5e-3f * expected[i].z() &&
                      std::abs(found[i].w() - expected[i].w()) <= 3e-3f;
    num_different += same ? 0 : 1;
    ASSERT_EQ(found[i].x(), expected[i].x());
  }
  // At a border between pixels either gradient is right, and rounding decides.
  EXPECT_LE(double(num_different), 0.005 * double(found.size()));
}

TEST(Photometric, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const std::size_t num_sources : {2, 4, 6, 8}) {
    ExpectStepsEqualReference(num_sources, false, random);
    ExpectStepsEqualReference(num_sources, true, random);
  }
}

TEST(Photometric, DropsWhatTooFewSourcesSee) {
  // At inverse depth 0.033 the sources see the point 3.3 and 1.65 px to either side: of the first
  // column two of them, of the second three, of the fourth on all four; one row at the top and
  // bottom none.
  const std::vector<float> start(kRefinedSize.num_pixels(), 0.033f);
  const auto kept = [&](std::size_t x, float min_views) {
    return StepOnDevice(SceneOf(0.033), start, min_views)[15 * kRefinedSize.width_px + x].x() > 0;
  };
  EXPECT_TRUE(kept(0, 2));
  EXPECT_FALSE(kept(0, 3));
  EXPECT_TRUE(kept(2, 3));
  EXPECT_FALSE(kept(2, 4));
  EXPECT_TRUE(kept(4, 4));
}

TEST(Photometric, StaysWhereThereIsNoTexture) {
  PhotometricScene scene = SceneOf(0.033);
  for (cv::Mat& image : scene.detail) image.setTo(128);
  const std::vector<float> start(kRefinedSize.num_pixels(), 0.04f);
  for (const Eigen::Vector4f& m : StepOnDevice(scene, start)) {
    EXPECT_EQ(m.y(), 0.04f);
    EXPECT_EQ(m.z(), 1);
  }
}

reference::Surface SurfaceOnDevice(const std::vector<Eigen::Vector4f>& measurements,
                                   const std::vector<float>& uniqueness) {
  const Buffer inverse_depth = MakeBuffer<float>(measurements.size());
  const Buffer confidence = MakeBuffer<float>(measurements.size());
  std::vector<std::uint32_t> words(2 * NumMeasurements(kRefinedSize), 0);
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const auto packed = Packed(measurements[i]);
    std::copy(packed.begin(), packed.end(),
              words.begin() + std::ptrdiff_t(2 * MeasurementIndex(i)));
  }
  Recorder recorder(TestDevice());
  TestKernels().Surface(recorder, true, {kRefinedSize.width_px, kRefinedSize.height_px, kStep},
                        ToBuffer(words), ToBuffer(uniqueness), {inverse_depth, confidence});
  recorder.Submit();
  return {FirstOf<float>(inverse_depth, measurements.size()),
          FirstOf<float>(confidence, measurements.size())};
}

TEST(Surface, OfAPlaneIsThePlane) {
  // Steps that lead from a rounded plane back to the plane.
  std::vector<Eigen::Vector4f> measurements;
  for (std::size_t i = 0; i < kRefinedSize.num_pixels(); ++i) {
    const float w = 1 + kStep * (0.3f * float(i % kRefinedSize.width_px) -
                                 0.2f * float(i / kRefinedSize.width_px));
    measurements.emplace_back(kStep * std::round(w / kStep), w, 20.f, 1.f);
  }
  const auto surface = SurfaceOnDevice(measurements, std::vector<float>(measurements.size(), 0.5f));
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    // A thousandth of a plane: float, of differences of values near 1.
    EXPECT_NEAR(surface.inverse_depth[i], measurements[i].y(), 1e-3 * double(kStep));
  }
}

TEST(Surface, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  std::uniform_real_distribution<float> unit(0, 1);
  for (const double share_missing : {0.0, 0.3}) {
    const auto depth =
        RandomValues(kRefinedSize.num_pixels(), 0.5f, 0.5f + 4 * kStep, share_missing, random);
    std::vector<Eigen::Vector4f> measurements;
    for (const float w : depth) {
      const float moved = w + kStep * (2 * unit(random) - 1);
      const float information = 1 + 50 * unit(random);
      measurements.push_back(Rounded({w, moved, information, unit(random)}));
    }
    const auto uniqueness = RandomValues(kRefinedSize.num_pixels(), 0.1f, 0.9f, 0, random);
    const auto found = SurfaceOnDevice(measurements, uniqueness);
    const auto expected = reference::FitSurface(
        measurements, uniqueness, {kRefinedSize.width_px, kRefinedSize.height_px, kStep});
    std::size_t num_different = 0;
    for (std::size_t i = 0; i < depth.size(); ++i) {
      const bool same =
          std::abs(found.inverse_depth[i] - expected.inverse_depth[i]) <= 0.01f * kStep &&
          std::abs(found.confidence[i] - expected.confidence[i]) <= 1e-3f;
      num_different += same ? 0 : 1;
    }
    // A neighbour within rounding of the border of the surface is in or out.
    EXPECT_LE(double(num_different), 0.005 * double(depth.size()));
  }
}

TEST(Surface, IsLessSureOfWhatTheSweepDoubtsAndOfBends) {
  const std::vector<Eigen::Vector4f> flat(kRefinedSize.num_pixels(), {0.5f, 0.5f, 20.f, 1.f});
  std::vector<Eigen::Vector4f> bent = flat;  // a ridge of less than a plane, which the fit crosses
  for (std::size_t i = 0; i < bent.size(); ++i) {
    const float distance = std::abs(float(i % kRefinedSize.width_px) - 20);
    bent[i].x() = bent[i].y() = 0.5f - 0.2f * kStep * distance;
  }
  const std::size_t pixel = 15 * kRefinedSize.width_px + 20;
  const std::vector<float> half(flat.size(), 0.5f);
  const std::vector<float> tenth(flat.size(), 0.1f);
  const float sure = SurfaceOnDevice(flat, half).confidence[pixel];
  EXPECT_LT(SurfaceOnDevice(flat, tenth).confidence[pixel], 0.7f * sure);
  EXPECT_LT(SurfaceOnDevice(bent, half).confidence[pixel], 0.7f * sure);
}

TEST(Surface, ConfidenceIsTheExpectedError) {
  // Worked by hand: a plane without misfit, all evidence there. n is 20 times the sum of the
  // falloffs, 13.6686; the deviation is step / sqrt(n) of 0.5, or 0.121 %; 2 e = (1 + s) / 0.7071
  // - 1.
  const std::vector<Eigen::Vector4f> flat(kRefinedSize.num_pixels(), {0.5f, 0.5f, 20.f, 1.f});
  const auto surface = SurfaceOnDevice(flat, std::vector<float>(flat.size(), 0.5f));
  const double deviation = 100 * double(kStep) / std::sqrt(20 * 13.6686) / 0.5;
  const double error = 0.5 * ((1 + deviation) / std::sqrt(0.5) - 1);
  EXPECT_NEAR(surface.confidence[15 * kRefinedSize.width_px + 20], 1 / (1 + error), 1e-3);
}

TEST(Surface, KeepsStepsAndIsLessSureAtThem) {
  std::vector<Eigen::Vector4f> measurements;
  for (std::size_t i = 0; i < kRefinedSize.num_pixels(); ++i) {
    const float w = i % kRefinedSize.width_px < 20 ? 0.5f : 0.7f;
    measurements.emplace_back(w, w, 20.f, 1.f);
  }
  const auto surface = SurfaceOnDevice(measurements, std::vector<float>(measurements.size(), 0.5f));
  const std::size_t row = 15 * kRefinedSize.width_px;
  for (std::size_t x = 0; x < kRefinedSize.width_px; ++x) {
    EXPECT_NEAR(surface.inverse_depth[row + x], x < 20 ? 0.5f : 0.7f, 1e-3 * double(kStep));
  }
  EXPECT_LT(surface.confidence[row + 19], 0.8f * surface.confidence[row + 10]);
}

}  // namespace
}  // namespace mono3d
