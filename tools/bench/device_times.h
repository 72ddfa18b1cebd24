// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <map>
#include <string>
#include <vector>

#include "bench/sequence_result.h"
#include "mono3d/core/timing.h"
#include "report/table.h"

namespace mono3d::tools {

struct Spread {
  double least = 0;
  double median = 0;
};

// Both 0 when there are no values.
Spread SpreadOf(std::vector<double> values);
Json ToJson(const Spread& ms);

struct StageSpread {
  std::string name;
  Spread device_ms;  // by the device's clock, which runs on while other programs compute
};

// Device times of the stages from one call to the next.
class StageDifferences {
 public:
  // What each stage has taken since the call before.
  void Add(const std::vector<StageTime>& times);
  // The same, forgotten.
  void Skip(const std::vector<StageTime>& times);

  // Those that ran, in the order in which they first did.
  std::vector<StageSpread> Stages() const;

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::vector<double>> values_;
  std::map<std::string, double> last_;
};

}  // namespace mono3d::tools
