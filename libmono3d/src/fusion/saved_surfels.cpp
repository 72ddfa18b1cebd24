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

Surfels PageOf(std::string_view bytes, std::uint32_t num_slots, std::uint32_t anchor,
               const std::string& where) {
  ByteReader reader(bytes, kSavedModel, where);
  RequireSound(reader, bytes.size() == num_slots * kBytesPerSurfel);
  Surfels surfels;
  surfels.resize(num_slots);
  const std::size_t num_bytes = num_slots * sizeof(Surfels::Float4);
  reader.Bytes(surfels.position_radius.data(), num_bytes);
  reader.Bytes(surfels.normal_weight.data(), num_bytes);
  reader.Bytes(surfels.history.data(), num_bytes);
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    RequireSound(reader, AnchorOf(surfels, i) == anchor);
  }
  return surfels;
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
  const bool is_continued = last_ && last_->folder_id == folder.id() &&
                            last_->generation == folder.generation() &&
                            last_->num_uploads == surfels.num_uploads();
  const SurfelStorage::Layout layout = surfels.GetLayout();
  ByteWriter writer;
  for (std::uint32_t number :
       {layout.max_size, layout.size, layout.num_removed, layout.num_unused, layout.num_bounded}) {
    writer.Number(number);
  }
  folder.Put(name + "/sizes", writer.TakeBytes());
  PutInPieces(folder, name + "/anchors", BytesOf(layout.anchors));
  PutInPieces(folder, name + "/observations", BytesOf(layout.observations));
  PutInPieces(folder, name + "/bounds", BytesOf(layout.bounds));

  for (std::uint32_t first = 0; first < layout.size;) {
    const std::uint32_t anchor = layout.anchors[first / kSurfelsPerBlock];
    const std::uint32_t end = surfels.FirstSlotOf(anchor + 1);
    bool is_kept = is_continued && changes.VersionOf(anchor) <= last_->change_version;
    for (std::uint32_t page = 0; is_kept && page < NumPages(end - first); ++page) {
      is_kept = folder.Keep(PageName(name, anchor, page));
    }
    if (!is_kept) {
      const Surfels changed = surfels.Download(first, end);
      for (std::uint32_t page = 0; page < NumPages(end - first); ++page) {
        const std::size_t from = std::size_t{page} * kSurfelsPerPage;
        const std::size_t to = std::min(from + kSurfelsPerPage, changed.size());
        folder.Put(PageName(name, anchor, page), PageBytes(changed, from, to));
      }
    }
    first = end;
  }
  last_ = {folder.id(), folder.next_generation(), changes.version(), surfels.num_uploads()};
}

void SavedSurfels::Restore(const StateFolder& folder, const std::string& name,
                           std::uint32_t num_anchors, Recorder& recorder, const ChangeLog& changes,
                           SurfelStorage& surfels) {
  const std::string where = folder.path().string();
  SurfelStorage::Layout layout;
  const std::string sizes = folder.Get(name + "/sizes");
  ByteReader reader(sizes, kSavedModel, where);
  for (std::uint32_t* number : {&layout.max_size, &layout.size, &layout.num_removed,
                                &layout.num_unused, &layout.num_bounded}) {
    reader.Number(*number);
  }
  layout.anchors = ValuesOf<std::uint32_t>(GetFromPieces(folder, name + "/anchors"));
  layout.observations = ValuesOf<float>(GetFromPieces(folder, name + "/observations"));
  layout.bounds = ValuesOf<Surfels::Float4>(GetFromPieces(folder, name + "/bounds"));
  if (layout.size > surfels.max_size()) {
    throw Error(ErrorParts{.what = "saved surfel model: too large for this device; go on where it "
                                   "was made",
                           .where = where,
                           .expected = std::to_string(surfels.max_size()) + " surfels at most",
                           .found = std::to_string(layout.size),
                           .code = ErrorCode::kUnsupported});
  }
  RequireSound(reader, layout.anchors.empty() || layout.anchors.back() < num_anchors);
  if (!surfels.Restore(recorder, layout)) RequireSound(reader, false);
  for (std::uint32_t first = 0; first < layout.size;) {
    const std::uint32_t anchor = layout.anchors[first / kSurfelsPerBlock];
    const std::uint32_t end = surfels.FirstSlotOf(anchor + 1);
    for (std::uint32_t page = 0; page < NumPages(end - first); ++page) {
      const std::uint32_t from = first + page * kSurfelsPerPage;
      const std::uint32_t num_slots = std::min(kSurfelsPerPage, end - from);
      const std::string bytes = folder.Get(PageName(name, anchor, page));
      surfels.UploadSlots(from, PageOf(bytes, num_slots, anchor, where));
    }
    first = end;
  }
  last_ = {folder.id(), folder.generation(), changes.version(), surfels.num_uploads()};
}

}  // namespace mono3d
