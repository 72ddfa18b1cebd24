// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/depth_governor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

namespace mono3d {
namespace {

constexpr std::size_t kMaxWaiting = 8;

// One bundle every `interval_s`, worked at by a machine that takes `full_s` for one with full
// effort; what each effort takes is what it does.
class BusyMachine {
 public:
  void Run(int num_bundles, double interval_s, double full_s) {
    for (int i = 0; i < num_bundles; ++i) {
      arrival_s_ += interval_s;
      WorkUntil(arrival_s_, full_s);
      governor_.NoteArrival(arrival_s_);
      if (waiting_.size() == kMaxWaiting) {
        waiting_.pop_front();
        ++num_dropped_;
      }
      waiting_.push_back(arrival_s_);
      most_effort_ = std::min(most_effort_, governor_.effort());
      least_effort_ = std::max(least_effort_, governor_.effort());
    }
  }

  const DepthGovernor& governor() const { return governor_; }
  int num_dropped() const { return num_dropped_; }
  void Forget() {
    num_dropped_ = 0;
    most_effort_ = least_effort_ = governor_.effort();
  }
  DepthEffort most_effort() const { return most_effort_; }
  DepthEffort least_effort() const { return least_effort_; }

 private:
  void WorkUntil(double now_s, double full_s) {
    constexpr double kShare[] = {1, 0.95, 0.9, 0.3};
    while (true) {
      if (work_s_ == 0) {
        if (waiting_.empty()) return;
        work_s_ = full_s * kShare[static_cast<int>(governor_.effort())];
        free_s_ = std::max(free_s_, waiting_.front()) + work_s_;
        waiting_.pop_front();
      }
      if (free_s_ > now_s) return;
      const auto num_waiting =
          std::ranges::count_if(waiting_, [&](double since_s) { return since_s < free_s_; });
      governor_.NoteWork(work_s_, static_cast<std::size_t>(num_waiting), kMaxWaiting);
      work_s_ = 0;
    }
  }

  DepthGovernor governor_;
  std::deque<double> waiting_;  // since when
  double arrival_s_ = 0;
  double free_s_ = 0;  // when the work in hand ends
  double work_s_ = 0;  // that it takes; 0: none
  int num_dropped_ = 0;
  DepthEffort most_effort_ = DepthEffort::kFull;
  DepthEffort least_effort_ = DepthEffort::kFull;
};

TEST(DepthGovernor, LeavesAMachineThatKeepsUpAlone) {
  BusyMachine machine;
  machine.Run(100, 0.25, 0.2);
  EXPECT_EQ(machine.least_effort(), DepthEffort::kFull);
  EXPECT_EQ(machine.num_dropped(), 0);
}

TEST(DepthGovernor, DropsNothingWhereLessWorkIsEnough) {
  BusyMachine machine;
  machine.Run(200, 0.25, 0.27);
  EXPECT_EQ(machine.num_dropped(), 0);
  EXPECT_GT(machine.governor().effort(), DepthEffort::kFull);
}

TEST(DepthGovernor, HoldsABurst) {
  BusyMachine machine;
  machine.Run(20, 0.25, 0.2);
  machine.Run(7, 0.01, 0.2);  // after a second in which none came
  machine.Run(50, 0.25, 0.2);
  EXPECT_EQ(machine.num_dropped(), 0);
  EXPECT_EQ(machine.governor().effort(), DepthEffort::kFull) << "it has time again";
}

TEST(DepthGovernor, DoesWithTheLeastWhereNothingIsEnough) {
  BusyMachine machine;
  machine.Run(200, 0.25, 3);
  EXPECT_EQ(machine.governor().effort(), DepthEffort::kHalfSize);
  EXPECT_GT(machine.num_dropped(), 0);
}

TEST(DepthGovernor, DropsThreeOfFourBeforeImagesAreSmaller) {
  BusyMachine machine;
  machine.Run(200, 0.25, 1);
  EXPECT_EQ(machine.least_effort(), DepthEffort::kRefinedOnce);
  EXPECT_GT(machine.num_dropped(), 0);
}

TEST(DepthGovernor, TakesItBackWhenThereIsTimeAgain) {
  BusyMachine machine;
  machine.Run(50, 0.25, 3);
  ASSERT_GT(machine.governor().effort(), DepthEffort::kFull);
  machine.Run(50, 0.25, 0.15);
  EXPECT_EQ(machine.governor().effort(), DepthEffort::kFull);
}

// Between two efforts, one of which is too much, it does not go up and down with each bundle.
TEST(DepthGovernor, StaysWhereTheNextEffortWouldBeTooMuch) {
  BusyMachine machine;
  machine.Run(100, 0.25, 0.258);
  machine.Forget();
  machine.Run(100, 0.25, 0.258);
  EXPECT_EQ(machine.num_dropped(), 0);
  EXPECT_LE(static_cast<int>(machine.least_effort()) - static_cast<int>(machine.most_effort()), 1);
}

}  // namespace
}  // namespace mono3d
