// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel_depot.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <string_view>
#include <utility>

#include "core/content_hash.h"
#include "core/system_error.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

std::size_t NumBytes(const Surfels& surfels) { return surfels.size() * kBytesPerSurfel; }

// The fields one after the other.
std::string BytesOfParts(const Surfels& surfels) {
  std::string bytes(NumBytes(surfels), '\0');
  const std::size_t size = surfels.size() * sizeof(Surfels::Float4);
  std::memcpy(bytes.data(), surfels.position_radius.data(), size);
  std::memcpy(bytes.data() + size, surfels.normal_weight.data(), size);
  std::memcpy(bytes.data() + 2 * size, surfels.history.data(), size);
  return bytes;
}

Surfels SurfelsOf(std::string_view bytes) {
  Surfels surfels;
  surfels.resize(bytes.size() / kBytesPerSurfel);
  const std::size_t size = surfels.size() * sizeof(Surfels::Float4);
  std::memcpy(surfels.position_radius.data(), bytes.data(), size);
  std::memcpy(surfels.normal_weight.data(), bytes.data() + size, size);
  std::memcpy(surfels.history.data(), bytes.data() + 2 * size, size);
  return surfels;
}

void WriteAt(int file, std::string_view bytes, std::uint64_t offset,
             const std::filesystem::path& folder) {
  while (!bytes.empty()) {
    const ssize_t written = pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) ThrowSystemError("cannot write surfels", folder, written < 0 ? errno : EIO);
    bytes.remove_prefix(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
}

}  // namespace

SurfelDepot::~SurfelDepot() {
  if (file_ >= 0) close(file_);
}

SurfelDepot::Ticket SurfelDepot::Put(Surfels surfels) {
  host_bytes_ += NumBytes(surfels);
  const Ticket ticket = next_++;
  in_memory_.emplace(ticket, std::move(surfels));
  if (host_bytes_ <= max_host_bytes_) return ticket;
  try {
    MoveToFile();
    has_failed_ = false;
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kIo) throw;
    if (!has_failed_) {
      Log(LogLevel::kWarning,
          std::string("surfels that are out of view stay in memory: ") + error.what());
    }
    has_failed_ = true;
  }
  return ticket;
}

void SurfelDepot::MoveToFile() {
  Open();
  while (host_bytes_ > max_host_bytes_) {
    const auto oldest = in_memory_.begin();
    const std::string bytes = BytesOfParts(oldest->second);
    const std::uint64_t offset = Allocate(bytes.size());
    try {
      WriteAt(file_, bytes, offset, folder_);
    } catch (...) {
      Free(offset, bytes.size());
      throw;
    }
    in_file_[oldest->first] = {offset, oldest->second.size(), ContentHash(bytes)};
    host_bytes_ -= bytes.size();
    in_memory_.erase(oldest);
  }
}

void SurfelDepot::Open() {
  if (file_ >= 0) return;
  file_ = open(folder_.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file_ >= 0) return;
  // File systems without files that have no name.
  std::string name = (folder_ / ".surfels-XXXXXX").string();
  file_ = mkostemp(name.data(), O_CLOEXEC);
  if (file_ < 0) ThrowSystemError("cannot make a file for surfels", folder_, errno);
  unlink(name.c_str());
}

Surfels SurfelDepot::Get(Ticket ticket) const {
  const auto here = in_memory_.find(ticket);
  return here != in_memory_.end() ? here->second : Read(in_file_.at(ticket));
}

Surfels SurfelDepot::Take(Ticket ticket) {
  const auto here = in_memory_.find(ticket);
  Surfels surfels = here != in_memory_.end() ? std::move(here->second) : Read(in_file_.at(ticket));
  if (here != in_memory_.end()) {
    host_bytes_ -= NumBytes(surfels);
    in_memory_.erase(here);
  } else {
    Remove(ticket);
  }
  return surfels;
}

void SurfelDepot::Remove(Ticket ticket) {
  const auto here = in_memory_.find(ticket);
  if (here != in_memory_.end()) {
    host_bytes_ -= NumBytes(here->second);
    in_memory_.erase(here);
    return;
  }
  const auto there = in_file_.find(ticket);
  Free(there->second.offset, there->second.num_surfels * kBytesPerSurfel);
  in_file_.erase(there);
}

Surfels SurfelDepot::Read(const Extent& extent) const {
  std::string bytes(extent.num_surfels * kBytesPerSurfel, '\0');
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t got = pread(file_, bytes.data() + done, bytes.size() - done,
                              static_cast<off_t>(extent.offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) ThrowSystemError("cannot read surfels", folder_, got < 0 ? errno : EIO);
    done += static_cast<std::size_t>(got);
  }
  if (ContentHash(bytes) != extent.hash) {
    throw Error(ErrorParts{.what = "the file of surfels out of view was changed",
                           .where = folder_,
                           .expected = {},
                           .found = {},
                           .code = ErrorCode::kIo});
  }
  return SurfelsOf(bytes);
}

// The first gap that is large enough, else behind all.
std::uint64_t SurfelDepot::Allocate(std::uint64_t size) {
  file_bytes_ += size;
  const auto gap = std::ranges::find_if(gaps_, [&](const auto& of) { return of.second >= size; });
  if (gap == gaps_.end()) {
    file_end_ += size;
    return file_end_ - size;
  }
  const auto [offset, gap_size] = *gap;
  gaps_.erase(gap);
  if (gap_size > size) gaps_[offset + size] = gap_size - size;
  return offset;
}

void SurfelDepot::Free(std::uint64_t offset, std::uint64_t size) {
  file_bytes_ -= size;
  const auto next = gaps_.lower_bound(offset);
  if (next != gaps_.end() && next->first == offset + size) {
    size += next->second;
    gaps_.erase(next);
  }
  const auto after = gaps_.lower_bound(offset);
  if (after != gaps_.begin()) {
    const auto before = std::prev(after);
    if (before->first + before->second == offset) {
      offset = before->first;
      size += before->second;
      gaps_.erase(before);
    }
  }
  if (offset + size == file_end_) {
    file_end_ = offset;
  } else {
    gaps_[offset] = size;
  }
}

}  // namespace mono3d
