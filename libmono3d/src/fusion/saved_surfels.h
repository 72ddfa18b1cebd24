// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "fusion/change_log.h"
#include "fusion/storage.h"
#include "mono3d/core/state_folder.h"

namespace mono3d {

// The surfels of a storage in a StateFolder, in pages of one anchor each. Anchors that have not
// changed since the last save are not looked at, wherever they are, and of the others only pages
// that differ are written.
class SavedSurfels {
 public:
  // `name` begins the names of the parts. `changes` says which anchors have changed.
  void Save(const SurfelStorage& surfels, const ChangeLog& changes, StateFolder& folder,
            const std::string& name);
  // Throws Error where it contradicts itself, is damaged, or larger than the storage may become. Of
  // a model with so many anchors.
  void Restore(const StateFolder& folder, const std::string& name, std::uint32_t num_anchors,
               const ChangeLog& changes, SurfelStorage& surfels);

  // 48 KiB: what a depth map confirms lies together, and a page is the least that is written.
  static constexpr std::uint32_t kSurfelsPerPage = 16 * kSurfelsPerBlock;

 private:
  // A save, and what there was then.
  struct Saved {
    std::uint64_t folder_id = 0;
    std::uint64_t generation = 0;
    std::uint64_t change_version = 0;
    std::uint64_t layout_version = 0;
  };

  std::optional<Saved> last_;
};

// Bytes of any length as parts "name/0", "name/1", ...: of what grows at its end, or changes in
// places, only that is written.
void PutInPieces(StateFolder& folder, const std::string& name, std::string_view bytes);
std::string GetFromPieces(const StateFolder& folder, const std::string& name);

}  // namespace mono3d
