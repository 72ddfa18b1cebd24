// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "image/image_state.h"
#include "mono3d/image/camera_positions.h"

namespace mono3d::tracking {

// The positions of the maps of a tracker, which maps have yet to follow them, and what became of
// those that did.
class MapPositions {
 public:
  void Set(const CameraPositions& positions) { positions_[positions.map_id] = {positions, true}; }
  bool Has(int map_id) const { return positions_.contains(map_id); }
  // All of the map was adjusted without them.
  void SetDue(int map_id) {
    const auto found = positions_.find(map_id);
    if (found != positions_.end()) found->second.is_due = true;
  }
  // Nothing where the map has none, or has followed them.
  std::optional<CameraPositions> TakeDue(int map_id) {
    const auto found = positions_.find(map_id);
    if (found == positions_.end() || !found->second.is_due) return std::nullopt;
    found->second.is_due = false;
    return found->second.positions;
  }
  // The map has followed them, and is elsewhere now.
  void SetFit(const PositionFit& fit, const Similarity& S_metric_map) {
    fits_[fit.map_id] = fit;
    positions_[fit.map_id].positions.S_metric_map = S_metric_map;
  }
  std::vector<PositionFit> Fits() const {
    std::vector<PositionFit> fits;
    for (const auto& [map_id, fit] : fits_) fits.push_back(fit);
    return fits;
  }
  // For the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive) {
    std::vector<OfMap> positions;
    for (const auto& [map_id, of_map] : positions_) positions.push_back(of_map);
    archive.Sections(positions, 1, [&](OfMap& of_map) {
      mono3d::ExchangeState(archive, of_map.positions);
      archive.Number(of_map.is_due);
    });
    std::vector<PositionFit> fits = Fits();
    archive.List(fits, [&](PositionFit& fit) { mono3d::ExchangeState(archive, fit); });
    for (OfMap& of_map : positions) {
      const int map_id = of_map.positions.map_id;
      positions_[map_id] = std::move(of_map);
    }
    for (const PositionFit& fit : fits) fits_[fit.map_id] = fit;
  }

 private:
  struct OfMap {
    CameraPositions positions;
    bool is_due = false;
  };
  std::map<int, OfMap> positions_;  // by the id of the map
  std::map<int, PositionFit> fits_;
};

}  // namespace mono3d::tracking
