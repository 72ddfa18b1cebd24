// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mono3d/geometry/similarity.h"

namespace mono3d {

// A part of the model that hangs together with the others by the tracker's poses alone: no depth
// map has shown it together with another one yet, or it came from another map of the tracker. Its
// anchors, by their numbers in the model, and where they are in its frame. Moving it moves its pose
// alone.
class Submap {
 public:
  explicit Submap(int id) : id_(id) {}

  int id() const { return id_; }
  const Similarity& S_world_submap() const { return S_world_submap_; }
  bool empty() const { return anchors_.empty(); }
  // By ascending number.
  std::span<const std::uint32_t> anchors() const { return anchors_; }

  // `anchor` is greater than those that are there.
  void Add(std::uint32_t anchor, const Similarity& S_world_kf);
  Similarity S_world_kf(std::uint32_t anchor) const;
  void Place(std::uint32_t anchor, const Similarity& S_world_kf);
  // By a motion of the world.
  void Move(const Similarity& motion) { S_world_submap_ = motion * S_world_submap_; }
  // All anchors of the other one, where they are.
  void TakeOver(const Submap& other);
  // Forgets the anchors from this one on.
  void RemoveFrom(std::uint32_t first_anchor);
  // In a model in which so many anchors, and submaps, come before it.
  void Renumber(std::uint32_t first_anchor, int first_id);
  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

 private:
  std::size_t IndexOf(std::uint32_t anchor) const;

  int id_;
  Similarity S_world_submap_;
  std::vector<std::uint32_t> anchors_;
  std::vector<Similarity> S_submap_kf_;
};

}  // namespace mono3d
