// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/misfit_history.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "fusion/state_archive.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

constexpr std::size_t kMaxMisfits = 16;  // what a tracker does a minute ago tells little of it now
constexpr std::size_t kMinMisfits = 5;
// What is common to the pixels of a depth map is at most its own error, one sigma.
constexpr double kLargestOwn = 1;
// Of the absolute value of a normal variable: twice its sigma, which 95 % stay below.
constexpr double kMedians = 3;

}  // namespace

void MisfitHistory::Add(double misfit) {
  misfits_.push_back(misfit);
  if (misfits_.size() > kMaxMisfits) misfits_.pop_front();
}

double MisfitHistory::Limit(double least, double patch_noise) const {
  // The poses behind a depth map err in proportion to what is measured in the images.
  const double expected = std::max(least, std::min(kLargestOwn, patch_noise * least));
  std::vector<double> own;
  std::ranges::copy_if(misfits_, std::back_inserter(own),
                       [](double misfit) { return misfit <= kLargestOwn; });
  // Too few, or most are too large to be the depth maps' own.
  if (own.size() < kMinMisfits || 2 * own.size() < misfits_.size()) return expected;
  return std::max(expected, std::min(kLargestOwn, kMedians * UpperMedianOrZero(std::move(own))));
}

template <typename Archive>
void MisfitHistory::Exchange(Archive& archive) {
  ExchangeDeque(archive, misfits_, [&](double& misfit) { archive.Number(misfit); });
}

template void MisfitHistory::Exchange(ByteWriter& archive);
template void MisfitHistory::Exchange(ByteReader& archive);

}  // namespace mono3d
