// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <deque>

namespace mono3d {

// How far the tracker's poses miss the best ones where nothing is wrong. What bends a depth map,
// errors of the poses behind it or surfaces of hardly any texture, is common to its pixels, and no
// depth map tells how much of that there is: it is measured by the registrations themselves.
class MisfitHistory {
 public:
  // A depth map was accepted whose expected pose missed the best one by so many sigmas.
  void Add(double misfit);
  // Up to here a misfit contradicts nothing: `least`, of clear images, and more where those of the
  // depth map, or the latest misfits, tell of more, up to what can be a depth map's own error.
  // `patch_noise`: of the depth map.
  double Limit(double least, double patch_noise) const;

  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

 private:
  std::deque<double> misfits_;
};

}  // namespace mono3d
