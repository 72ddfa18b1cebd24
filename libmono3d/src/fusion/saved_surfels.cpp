// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/saved_surfels.h"

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

#include "fusion/state_archive.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{64} << 10U;

std::string PageName(const std::string& name, std::uint32_t anchor, std::uint32_t page) {
  return name + "/" + std::to_string(anchor) + "/" + std::to_string(page);
}

std::string BlocksName(const std::string& name, std::uint32_t anchor) {
  return name + "/" + std::to_string(anchor) + "/blocks";
}

std::uint32_t NumPages(std::uint32_t num_slots) {
  return DivideRoundingUp(num_slots, SavedSurfels::kSurfelsPerPage);
}

// The fields one after the other.
std::string PageBytes(const Surfels& surfels, std::size_t first, std::size_t end) {
  ByteWriter writer;
  const std::size_t num_bytes = (end - first) * sizeof(Surfels::Float4);
  writer.Bytes(surfels.position_radius.data() + first, num_bytes);
  writer.Bytes(surfels.normal_weight.data() + first, num_bytes);
  writer.Bytes(surfels.history.data() + first, num_bytes);
  return writer.TakeBytes();
}

void AddPage(std::string_view bytes, std::uint32_t num_slots, std::uint32_t anchor,
             const std::string& where, Surfels& surfels) {
  ByteReader reader(bytes, kSavedModel, where);
  RequireSound(reader, bytes.size() == num_slots * kBytesPerSurfel);
  const std::size_t first = surfels.size();
  surfels.resize(first + num_slots);
  const std::size_t num_bytes = num_slots * sizeof(Surfels::Float4);
  reader.Bytes(surfels.position_radius.data() + first, num_bytes);
  reader.Bytes(surfels.normal_weight.data() + first, num_bytes);
  reader.Bytes(surfels.history.data() + first, num_bytes);
  for (std::size_t i = first; i < surfels.size(); ++i) {
    RequireSound(reader, AnchorOf(surfels, i) == anchor && FirstMapOf(surfels, i) <= anchor);
  }
}

// All of an anchor but its surfels.
template <typename Archive>
void ExchangeBlocks(Archive& archive, SurfelStorage::BlocksOfAnchor& blocks) {
  archive.Number(blocks.num_slots);
  archive.Array(blocks.observations);
  archive.Array(blocks.num_there);
  archive.List(blocks.bounds, [&](Surfels::Float4& sphere) {
    for (float& number : sphere) archive.Number(number);
  });
  const std::size_t num_blocks = blocks.num_slots / kSurfelsPerBlock;
  const auto is_count = [](std::uint8_t count) { return count <= kSurfelsPerBlock; };
  RequireSound(archive, blocks.num_slots % kSurfelsPerBlock == 0 &&
                            blocks.observations.size() == num_blocks &&
                            blocks.num_there.size() == num_blocks &&
                            std::ranges::all_of(blocks.num_there, is_count) &&
                            (blocks.bounds.empty() || blocks.bounds.size() == num_blocks));
}

template <typename T>
std::string_view BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

template <typename T>
std::vector<T> ValuesOf(const std::string& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::copy_n(bytes.data(), values.size() * sizeof(T), reinterpret_cast<char*>(values.data()));
  return values;
}

}  // namespace

void PutInPieces(StateFolder& folder, const std::string& name, std::string_view bytes) {
  for (std::size_t piece = 0; !bytes.empty(); ++piece) {
    const std::size_t size = std::min(bytes.size(), kPieceBytes);
    folder.Put(name + "/" + std::to_string(piece), bytes.substr(0, size));
    bytes.remove_prefix(size);
  }
}

std::string GetFromPieces(const StateFolder& folder, const std::string& name) {
  std::string bytes;
  for (std::size_t piece = 0;; ++piece) {
    const std::string part = name + "/" + std::to_string(piece);
    if (!folder.Has(part)) return bytes;
    bytes += folder.Get(part);
  }
}

void SavedSurfels::Save(const SurfelStorage& surfels, const ChangeLog& changes, StateFolder& folder,
                        const std::string& name) {
  const bool is_continued =
      last_ && last_->folder_id == folder.id() && last_->generation == folder.generation();
  std::vector<std::uint32_t> num_slots;
  for (std::uint32_t i = 0; i < surfels.num_anchors(); ++i) {
    num_slots.push_back(surfels.NumSlotsOf(i));
  }
  ByteWriter writer;
  for (const std::uint32_t number : {surfels.num_surfels(), surfels.num_anchors()}) {
    writer.Number(number);
  }
  folder.Put(name + "/sizes", writer.TakeBytes());
  PutInPieces(folder, name + "/slots", BytesOf(num_slots));

  for (std::uint32_t anchor = 0; anchor < surfels.num_anchors(); ++anchor) {
    if (num_slots[anchor] == 0) continue;
    const std::uint32_t num_pages = NumPages(num_slots[anchor]);
    bool is_kept = is_continued && changes.VersionOf(anchor) <= last_->change_version &&
                   surfels.LayoutVersionOf(anchor) <= last_->layout_version &&
                   folder.Keep(BlocksName(name, anchor));
    for (std::uint32_t page = 0; is_kept && page < num_pages; ++page) {
      is_kept = folder.Keep(PageName(name, anchor, page));
    }
    if (is_kept) continue;
    SurfelStorage::BlocksOfAnchor blocks = surfels.BlocksOf(anchor);
    ExchangeBlocks(writer, blocks);
    folder.Put(BlocksName(name, anchor), writer.TakeBytes());
    const Surfels changed = surfels.Download(anchor);
    for (std::uint32_t page = 0; page < num_pages; ++page) {
      const std::size_t from = std::size_t{page} * kSurfelsPerPage;
      const std::size_t to = std::min(from + kSurfelsPerPage, changed.size());
      folder.Put(PageName(name, anchor, page), PageBytes(changed, from, to));
    }
  }
  last_ = {folder.id(), folder.next_generation(), changes.version(), surfels.layout_version()};
}

void SavedSurfels::Restore(const StateFolder& folder, const std::string& name,
                           std::uint32_t num_anchors, const ChangeLog& changes,
                           SurfelStorage& surfels) {
  const std::string where = folder.path().string();
  const std::string sizes = folder.Get(name + "/sizes");
  ByteReader reader(sizes, kSavedModel, where);
  std::uint32_t num_surfels = 0;
  std::uint32_t num_with_slots = 0;
  reader.Number(num_surfels);
  reader.Number(num_with_slots);
  const std::vector<std::uint32_t> num_slots =
      ValuesOf<std::uint32_t>(GetFromPieces(folder, name + "/slots"));
  RequireSound(reader, num_slots.size() == num_with_slots && num_with_slots <= num_anchors);
  std::uint64_t num_all_slots = 0;
  for (const std::uint32_t number : num_slots) num_all_slots += number;
  RequireSound(reader, num_surfels <= num_all_slots);
  if (num_all_slots > surfels.max_slots()) {
    throw Error(ErrorParts{.what = "saved surfel model: larger than this one may become",
                           .where = where,
                           .expected = std::to_string(surfels.max_slots()) + " surfels at most",
                           .found = std::to_string(num_all_slots),
                           .code = ErrorCode::kUnsupported});
  }
  for (std::uint32_t anchor = 0; anchor < num_with_slots; ++anchor) {
    if (num_slots[anchor] == 0) continue;
    const std::string bytes = folder.Get(BlocksName(name, anchor));
    ByteReader of_blocks(bytes, kSavedModel, where);
    SurfelStorage::BlocksOfAnchor blocks;
    ExchangeBlocks(of_blocks, blocks);
    RequireSound(of_blocks, of_blocks.IsAtEnd() && blocks.num_slots == num_slots[anchor]);
    Surfels all;
    for (std::uint32_t page = 0; page < NumPages(blocks.num_slots); ++page) {
      const std::uint32_t from = page * kSurfelsPerPage;
      const std::uint32_t num = std::min(kSurfelsPerPage, blocks.num_slots - from);
      AddPage(folder.Get(PageName(name, anchor, page)), num, anchor, where, all);
    }
    surfels.Restore(anchor, std::move(blocks), std::move(all));
  }
  surfels.SetNumSurfels(num_surfels);
  last_ = {folder.id(), folder.generation(), changes.version(), surfels.layout_version()};
}

}  // namespace mono3d
