// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "fusion/surfel.h"

namespace mono3d {

// Surfels that are not on the device: in host memory up to a limit, beyond it in a file, those that
// came first going there first. The file is made when it is needed and has no name, so that nothing
// of it is left however the process ends. One thread at a time.
class SurfelDepot {
 public:
  // Nothing is looked for in the folder before it is needed.
  SurfelDepot(std::filesystem::path folder, std::size_t max_host_bytes)
      : folder_(std::move(folder)), max_host_bytes_(max_host_bytes) {}
  ~SurfelDepot();
  SurfelDepot(const SurfelDepot&) = delete;
  SurfelDepot& operator=(const SurfelDepot&) = delete;

  using Ticket = std::uint64_t;

  // Where nothing can be written (disk full, folder missing), surfels stay in host memory beyond
  // the limit, with a warning; it is tried again with the next ones.
  Ticket Put(Surfels surfels);
  // Bit for bit what was put. Throws Error (kIo) where the file cannot be read or was changed.
  Surfels Get(Ticket ticket) const;
  // The same, and keeps them no longer.
  Surfels Take(Ticket ticket);
  void Remove(Ticket ticket);

  std::size_t host_bytes() const { return host_bytes_; }
  std::uint64_t file_bytes() const { return file_bytes_; }  // in use

 private:
  // Of the file.
  struct Extent {
    std::uint64_t offset = 0;
    std::size_t num_surfels = 0;
    std::array<std::uint64_t, 2> hash{};
  };

  void MoveToFile();
  void Open();
  std::uint64_t Allocate(std::uint64_t size);
  void Free(std::uint64_t offset, std::uint64_t size);
  Surfels Read(const Extent& extent) const;

  std::filesystem::path folder_;
  std::size_t max_host_bytes_;
  std::size_t host_bytes_ = 0;
  std::uint64_t file_bytes_ = 0;
  std::uint64_t file_end_ = 0;
  int file_ = -1;
  bool has_failed_ = false;  // the latest attempt to write
  Ticket next_ = 0;
  std::map<Ticket, Surfels> in_memory_;
  std::map<Ticket, Extent> in_file_;
  std::map<std::uint64_t, std::uint64_t> gaps_;  // of the file: offset, size; none touch
};

}  // namespace mono3d
