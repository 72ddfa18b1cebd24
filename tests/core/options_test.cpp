// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

struct Inner {
  int radius = 4;
  void Visit(OptionVisitor& visit) { visit("radius", radius, "half the window"); }
};

struct Outer {
  bool enabled = true;
  Inner inner;
  double ratio = 0.5;
  void Visit(OptionVisitor& visit) {
    visit("enabled", enabled, "whether to run");
    visit.Group("inner", inner);
    visit("ratio", ratio, "a share");
  }
};

TEST(ListOptions, NamesNestedFieldsByTheirPathInOrder) {
  Outer options;
  std::vector<std::string> names;
  for (const OptionField& field : ListOptions(options)) names.push_back(field.name);
  EXPECT_THAT(names, testing::ElementsAre("enabled", "inner.radius", "ratio"));
}

TEST(ListOptions, RefersToTheVariablesThemselves) {
  Outer options;
  const std::vector<OptionField> fields = ListOptions(options);
  *std::get<int*>(fields[1].value) = 7;
  *std::get<double*>(fields[2].value) = 0.25;
  EXPECT_EQ(options.inner.radius, 7);
  EXPECT_EQ(options.ratio, 0.25);
}

struct WithWord {
  int stride = 1;
  double ratio = -1;
  void Visit(OptionVisitor& visit) {
    visit("stride", stride, "every n-th, or auto", {{"auto", -1}, {"none", 0}});
    visit("ratio", ratio, "a share");
  }
};

TEST(WordOf, IsThatOfTheValueWhereThereIsOne) {
  WithWord options;
  const std::vector<OptionField> fields = ListOptions(options);
  EXPECT_FALSE(WordOf(fields[0]).has_value());
  options.stride = -1;
  EXPECT_EQ(WordOf(fields[0]), "auto");
  options.stride = 0;
  EXPECT_EQ(WordOf(fields[0]), "none");
  EXPECT_FALSE(WordOf(fields[1]).has_value());  // has no words
}

TEST(RequireOption, NamesTheOptionAndBothValues) {
  RequireOption(true, "depth.sgm.p1", "more than 0", -3);
  try {
    RequireOption(false, "depth.sgm.p1", "more than 0", -3);
    FAIL() << "nothing thrown";
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(),
                 "--depth.sgm.p1: option out of range (expected more than 0, found -3)");
  }
}

}  // namespace
}  // namespace mono3d
