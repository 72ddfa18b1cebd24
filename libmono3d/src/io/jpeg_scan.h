// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string_view>

namespace mono3d {

// Whether the coded pixels of a JPEG file contradict themselves in a way that libjpeg does not tell
// of: it takes bits that are no code for zeros, and lets a block have too many coefficients. Codes
// find back into step behind damage, mostly with some blocks less than there were, which are then
// over behind the last row; they are told from what cameras leave there by that they are coded like
// all others and end with the scan: in whole units, filled up to a byte with ones (ITU-T T.81,
// F.1.2.3). Of files with one sequential scan; of others false. It decodes all codes bit by bit.
bool IsScanDamaged(std::string_view jpeg);

}  // namespace mono3d
