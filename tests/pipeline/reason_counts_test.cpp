// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>

#include "pipeline/model_counts.h"

namespace mono3d {
namespace {

using Reasons = std::map<std::string, std::int64_t>;

TEST(CountReason, FiguresOfOneReasonBecomeRanges) {
  Reasons reasons;
  CountReason("62 matches, 100 needed", 1, reasons);
  EXPECT_EQ(reasons, (Reasons{{"62 matches, 100 needed", 1}}));
  CountReason("9 matches, 100 needed", 1, reasons);
  CountReason("70 matches, 100 needed", 2, reasons);
  EXPECT_EQ(reasons, (Reasons{{"9 to 70 matches, 100 needed", 4}}));
  CountReason("40 matches, 100 needed", 1, reasons);
  EXPECT_EQ(reasons, (Reasons{{"9 to 70 matches, 100 needed", 5}}));
}

TEST(CountReason, OtherWordsAreAnotherReason) {
  Reasons reasons;
  CountReason("no texture", 1, reasons);
  CountReason("overlap 0.25, too little", 1, reasons);
  CountReason("overlap 0.30, too little.", 1, reasons);  // the last point is of the sentence
  CountReason("", 1, reasons);
  EXPECT_EQ(reasons, (Reasons{{"no reason given", 1},
                              {"no texture", 1},
                              {"overlap 0.25, too little", 1},
                              {"overlap 0.30, too little.", 1}}));
  CountReason("overlap 0.5, too little", 1, reasons);
  EXPECT_EQ(reasons.at("overlap 0.25 to 0.5, too little"), 2);
}

TEST(CountReason, AddsTheCountsOfTwoModels) {
  PipelineCounts one;
  PipelineCounts other;
  one.rejected_bundles["texture 3 to 5"] = 2;
  other.rejected_bundles["texture 4 to 9"] = 3;
  AddModelCounts(one, other);
  EXPECT_EQ(other.rejected_bundles, (Reasons{{"texture 3 to 9", 5}}));
}

}  // namespace
}  // namespace mono3d
