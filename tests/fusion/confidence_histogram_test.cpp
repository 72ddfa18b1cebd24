// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/fusion/confidence_histogram.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <tuple>

namespace mono3d {
namespace {

ConfidenceHistogram HistogramOf(std::initializer_list<float> confidences) {
  PointCloud cloud;
  for (const float confidence : confidences) {
    cloud.points.emplace_back(0, 0, 0);
    cloud.confidences.push_back(confidence);
  }
  ConfidenceHistogram histogram;
  histogram.Add(cloud);
  return histogram;
}

TEST(ConfidenceHistogram, LeavesTheLimitWhereEnoughIsSure) {
  const SurfelExportOptions options;
  EXPECT_EQ(ConfidenceHistogram().LimitFor(options), options.min_confidence) << "nothing is there";
  EXPECT_EQ(HistogramOf({0.5F, 0.01F, 0.01F, 0.01F}).LimitFor(options), options.min_confidence);
  EXPECT_EQ(HistogramOf({0.01F}).LimitFor({.min_share = 0}), options.min_confidence);
  EXPECT_EQ(HistogramOf({0.01F}).LimitFor({.min_confidence = 0}), 0);
}

TEST(ConfidenceHistogram, LowersItToTheSurestShare) {
  const ConfidenceHistogram histogram = HistogramOf({0.08F, 0.04F, 0.02F, 0.01F, 0});
  for (const auto& [share, surest, next] :
       {std::tuple(0.2, 0.08, 0.04), std::tuple(0.3, 0.04, 0.02), std::tuple(0.8, 0.01, 0.0)}) {
    const double limit = histogram.LimitFor({.min_share = share});
    EXPECT_LE(limit, surest) << share;
    EXPECT_GT(limit, surest / 1.1) << share;
    EXPECT_GT(limit, next) << share;
  }
  EXPECT_GT(histogram.LimitFor({.min_share = 1}), 0) << "0 would ask for what is disputed too";
}

TEST(ConfidenceHistogram, CountsWhatWasMatched) {
  PointCloud cloud;
  cloud.points = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  cloud.confidences = {0.5F, 0.01F, 0.01F, 0.01F, 0.01F};
  cloud.inferred = {0, 0, 0, 0, 1};
  ConfidenceHistogram histogram;
  histogram.Add(cloud);
  EXPECT_EQ(histogram.LimitFor({}), SurfelExportOptions().min_confidence);
}

TEST(ConfidenceHistogram, AddsUp) {
  ConfidenceHistogram sum = HistogramOf({0.01F, 0.01F, 0.01F, 0.01F, 0.01F, 0.01F});
  EXPECT_LT(sum.LimitFor({}), 0.02);
  const ConfidenceHistogram sure = HistogramOf({0.3F, 0.6F});
  sum.Add(sure);
  EXPECT_EQ(sum.LimitFor({}), SurfelExportOptions().min_confidence);
}

}  // namespace
}  // namespace mono3d
