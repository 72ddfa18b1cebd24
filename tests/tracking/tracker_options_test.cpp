// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>

#include <set>

#include "mono3d/core/error.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(TrackerOptions, DefaultsAreValid) { EXPECT_NO_THROW(TrackerOptions().Validate()); }

TEST(TrackerOptions, ListsEachFieldOnceUnderItsGroup) {
  TrackerOptions options;
  std::set<std::string> names;
  for (const OptionField& field : ListOptions(options)) {
    EXPECT_TRUE(names.insert(field.name).second) << field.name;
    EXPECT_FALSE(field.help.empty()) << field.name;
  }
  EXPECT_EQ(names.count("features.num_levels"), 1U);
  EXPECT_EQ(names.count("mapping.num_fixed_keyframes"), 1U);
  EXPECT_EQ(names.count("seed"), 1U);
}

TEST(TrackerOptions, RefusalNamesTheOption) {
  TrackerOptions options;
  options.features.scale_factor = 1;
  EXPECT_THAT([&] { options.Validate(); },
              ThrowsMessage<UsageError>(HasSubstr("tracking.features.scale_factor")));
  EXPECT_THROW(static_cast<void>(CreateTracker(options)), UsageError);
}

}  // namespace
}  // namespace mono3d
