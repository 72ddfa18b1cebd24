// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "mono3d/core/atomic_file.h"
#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// What one save has cost.
struct StateSaveCost {
  std::uint64_t num_parts = 0;
  std::uint64_t num_bytes = 0;     // of all parts
  std::uint64_t bytes_new = 0;     // parts that were not there before
  std::uint64_t bytes_moved = 0;   // parts that left a file most of which was of no use any more
  std::uint64_t bytes_listed = 0;  // of the manifest
  std::uint64_t bytes_on_disk = 0;
};

// The state of a computation, saved again and again: bytes under names ("parts"), of which a save
// writes only those that are new. A crash or power cut at any moment leaves the state of the last
// finished save whole.
//
// What is new in a save is one file, "parts-N", in the order in which it came. "manifest" names
// each part, where it lies, and its checksum; it takes the place of the one before when all parts
// are on the disk. After that, files without a part in use are removed. Parts that are left in a
// file of which they are the smaller half move into the next one, so that the folder takes at most
// about twice what the parts do.
//
// One thread at a time, one process at a time; another thread may do the Commit, which waits for
// the disk, while the next parts are not yet being put.
class StateFolder {
 public:
  // Of a folder that need not exist yet: it is made by the first Put. Throws Error where the
  // manifest is damaged or of another version, or a file of parts is missing or cut off.
  explicit StateFolder(std::filesystem::path folder);

  const std::filesystem::path& path() const { return path_; }
  // Nothing has been saved.
  bool empty() const { return generation_ == 0; }
  // Tells apart the saves of this folder: that which there is, from 1 on, and that which is being
  // made. One that fails leaves a gap in the numbers.
  std::uint64_t generation() const { return generation_; }
  std::uint64_t next_generation() const { return next_generation_; }
  // Tells apart the objects of this class in this process.
  std::uint64_t id() const { return id_; }

  // Of the last finished save.
  bool Has(const std::string& name) const { return parts_.contains(name); }
  // Those that begin so, in their order.
  std::vector<std::string> Names(std::string_view prefix) const;
  // Throws Error where there is no such part, and where its bytes are not those that were saved.
  std::string Get(const std::string& name) const;

  // A part of the save that is being made; a second one of the name takes the place of the first.
  // Bytes that the last save has under any name are not written again. Throws Error (kIo) as
  // AtomicFile does; then the save that is being made is given up.
  void Put(const std::string& name, std::string_view bytes);
  // The part is as in the last save. False, and nothing is done, where that has none of this name.
  bool Keep(const std::string& name);
  // All whose names begin so are. Returns their number.
  std::uint64_t KeepAll(std::string_view prefix);
  // Finishes the save: what was neither put nor kept is in it no more. Throws Error (kIo); then
  // there is still the save before, and what was put is forgotten.
  StateSaveCost Commit();
  // Gives up the save that is being made.
  void Discard();

 private:
  struct Hash {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
    auto operator<=>(const Hash&) const = default;
  };
  struct Part {
    std::uint64_t file = 0;  // its number
    std::uint64_t offset = 0;
    std::uint64_t size = 0;
    Hash hash;
  };
  using Parts = std::map<std::string, Part>;
  using Content = std::pair<Hash, std::uint64_t>;  // and its size

  static Hash HashOf(std::string_view bytes);
  static Parts ReadManifest(const std::filesystem::path& path, std::uint64_t& generation,
                            std::uint64_t& next_file);
  template <typename Archive>
  static void Exchange(Archive& archive, Part& part);

  std::filesystem::path FileOf(std::uint64_t number) const;
  std::string Read(const Part& part) const;
  Part Append(std::string_view bytes, const Hash& hash);
  void MoveOutOfSparseFiles();
  void MoveOutOf(std::uint64_t file);
  std::string ManifestBytes() const;
  void TakeOver();
  void RemoveUnused() const;

  std::filesystem::path path_;
  std::uint64_t id_;
  std::uint64_t generation_ = 0;
  std::uint64_t next_generation_ = 1;
  std::uint64_t next_file_ = 0;
  Parts parts_;  // of the last finished save
  Parts next_;   // of the one that is being made
  // Of both: where bytes are that were put before.
  std::map<Content, Part> known_;
  std::map<std::uint64_t, std::uint64_t> file_bytes_;  // of the files of the last finished save
  std::unique_ptr<AtomicFile> file_;                   // of the one that is being made
  std::uint64_t file_size_ = 0;
  StateSaveCost cost_;
};

}  // namespace mono3d
