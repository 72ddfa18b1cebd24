// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mono3d::tools {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

// A model of so many depth maps, of which so many were compared with what was there before.
Reconstruction ModelOf(int num_fused, int num_registrations) {
  Reconstruction result;
  result.counts.num_fused = num_fused;
  MapReconstruction& map = result.maps.emplace_back();
  map.model.points.resize(1);
  map.health.num_registrations = num_registrations;
  return result;
}

TEST(WhyNotConfirmed, IsToldWhereNoDepthMapWasComparedWithAnother) {
  EXPECT_THAT(WhyNotConfirmed({}), IsEmpty());
  EXPECT_THAT(WhyNotConfirmed(ModelOf(2, 1)), IsEmpty());
  EXPECT_THAT(WhyNotConfirmed(ModelOf(1, 0)), HasSubstr("of one depth map"));
  EXPECT_THAT(WhyNotConfirmed(ModelOf(2, 0)), HasSubstr("do not overlap"));
  Reconstruction without = ModelOf(1, 0);
  without.maps[0].model = {};
  EXPECT_THAT(WhyNotConfirmed(without), IsEmpty());
}

}  // namespace
}  // namespace mono3d::tools
