// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/tracker.h"

#include "mono3d/core/error.h"

namespace mono3d {

SparseModel Tracker::Sparse(int /*map_id*/) const { return {}; }

std::string Tracker::SaveMap() const { throw Error("this tracker cannot save maps"); }

void Tracker::LoadMap(std::string_view /*bytes*/, const std::string& where) {
  throw Error(ErrorParts{
      .what = "this tracker cannot load maps", .where = where, .expected = {}, .found = {}});
}

}  // namespace mono3d
