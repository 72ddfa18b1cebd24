// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/run_state.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr const char* kKind = "part of a state";

template <typename T>
bool IsTaken(T value, T into) {
  StateWriter writer(kKind, 1, SavedImages::kByIndex);
  ExchangeState(writer, value);
  const std::string state = writer.TakeState();
  try {
    StateReader reader(state, kKind, 1, "test", {});
    ExchangeState(reader, into);
    reader.CheckEnd();
  } catch (const Error&) {
    return false;
  }
  return true;
}

TEST(RunState, RefusesACloudWhoseListsDifferInLength) {
  PointCloud cloud;
  cloud.points = {{0, 0, 1}, {0, 0, 2}};
  EXPECT_TRUE(IsTaken(cloud, {}));
  cloud.normals = {{0, 0, -1}};
  EXPECT_FALSE(IsTaken(cloud, {}));
}

TEST(RunState, RefusesCountsThatCannotBeCountedFurther) {
  PipelineCounts counts;
  counts.num_frames = 1000;
  EXPECT_TRUE(IsTaken(counts, {}));
  counts.num_frames = std::numeric_limits<std::int64_t>::max();
  EXPECT_FALSE(IsTaken(counts, {}));
  counts.num_frames = -1;
  EXPECT_FALSE(IsTaken(counts, {}));
}

}  // namespace
}  // namespace mono3d
