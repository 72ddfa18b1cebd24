// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/options.h"

namespace mono3d {

// "seed 1": a number so that it comes back to the bit.
std::string NameAndValue(const OptionField& option);

// For the archives of image/state_archive.h: under other options a run would not go on as the one
// that was saved. Throws UsageError on the first option that differs; names begin with `prefix`.
template <typename Archive>
void ExchangeOptions(Archive& archive, const std::vector<OptionField>& options,
                     const std::string& prefix) {
  for (const OptionField& option : options) {
    const std::string own = NameAndValue(option);
    std::string saved = own;
    archive.Text(saved);
    if (saved == own) continue;
    throw UsageError(ErrorParts{.what = "the run was begun with another option, and goes on only "
                                        "with the same",
                                .where = {},
                                .expected = prefix + saved,
                                .found = prefix + own});
  }
}

}  // namespace mono3d
