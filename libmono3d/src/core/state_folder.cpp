// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/state_folder.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <optional>
#include <set>
#include <system_error>

#include "core/byte_archive.h"
#include "core/content_hash.h"
#include "core/file_access.h"
#include "core/system_error.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::string_view kManifestMagic = "mono3d state\n";
constexpr std::uint32_t kManifestVersion = 1;
constexpr const char* kSavedState = "saved state";  // in messages
constexpr std::string_view kPartsPrefix = "parts-";

// What a part and a manifest take at most: a file that says more, or is, is not read into memory.
constexpr std::uint64_t kMaxPartBytes = std::uint64_t{1} << 30U;
constexpr std::uint64_t kMaxManifestBytes = std::uint64_t{1} << 28U;

// Of saves and files: more than any run comes to. The next ones must not begin anew at 0.
constexpr std::uint64_t kMaxNumber = std::uint64_t{1} << 62U;

// A folder with more files than this has its smallest ones joined: opening it looks at each.
constexpr std::size_t kMaxFiles = 256;

std::uint64_t NextFolderId() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

std::optional<std::uint64_t> NumberOfPartsFile(std::string_view name) {
  if (!name.starts_with(kPartsPrefix)) return std::nullopt;
  name.remove_prefix(kPartsPrefix.size());
  constexpr std::size_t kMaxDigits = 19;
  if (name.empty() || name.size() > kMaxDigits) return std::nullopt;
  std::uint64_t number = 0;
  for (const char digit : name) {
    if (digit < '0' || digit > '9') return std::nullopt;
    number = number * 10 + static_cast<std::uint64_t>(digit - '0');
  }
  return number;
}

[[noreturn]] void ThrowDamaged(const std::string& what, const std::filesystem::path& where) {
  throw Error(ErrorParts{.what = std::string(kSavedState) + ": " + what +
                                 "; it cannot be gone on from: remove its folder",
                         .where = where,
                         .expected = {},
                         .found = {}});
}

}  // namespace

StateFolder::Hash StateFolder::HashOf(std::string_view bytes) {
  const auto [low, high] = ContentHash(bytes);
  return {low, high};
}

template <typename Archive>
void StateFolder::Exchange(Archive& archive, Part& part) {
  for (std::uint64_t* number :
       {&part.file, &part.offset, &part.size, &part.hash.low, &part.hash.high}) {
    archive.Number(*number);
  }
}

StateFolder::StateFolder(std::filesystem::path folder)
    : path_(std::move(folder)), id_(NextFolderId()) {
  const std::filesystem::path manifest = path_ / "manifest";
  std::error_code ignored;
  if (!std::filesystem::exists(manifest, ignored)) return;
  parts_ = ReadManifest(manifest, generation_, next_file_);
  next_generation_ = generation_ + 1;
  for (const auto& [name, part] : parts_) {
    constexpr std::uint64_t kMaxOffset = std::uint64_t{1} << 62U;
    if (part.size > kMaxPartBytes || part.offset > kMaxOffset || part.file >= next_file_) {
      ThrowDamaged("contradicts itself", manifest);
    }
    std::uint64_t& bytes = file_bytes_[part.file];
    bytes = std::max(bytes, part.offset + part.size);
    known_.try_emplace({part.hash, part.size}, part);
  }
  for (const auto& [number, bytes] : file_bytes_) {
    std::error_code error;
    const std::uint64_t found = std::filesystem::file_size(FileOf(number), error);
    if (error) ThrowDamaged("a file is missing", FileOf(number));
    if (found < bytes) ThrowDamaged("a file is cut off", FileOf(number));
  }
}

StateFolder::Parts StateFolder::ReadManifest(const std::filesystem::path& path,
                                             std::uint64_t& generation, std::uint64_t& next_file) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) ThrowSystemError("cannot read the file", path, error.value());
  if (size > kMaxManifestBytes) ThrowDamaged("damaged: too long", path);
  const std::string bytes = ReadFileRange(path, 0, size);
  if (!bytes.starts_with(kManifestMagic)) ThrowDamaged("not one of mono3d", path);
  std::uint32_t version = 0;
  Hash hash;
  const std::size_t num_around = kManifestMagic.size() + sizeof(version) + sizeof(hash);
  if (bytes.size() < num_around) ThrowDamaged("damaged: cut off or changed", path);
  const std::string_view checked = std::string_view(bytes).substr(0, bytes.size() - sizeof(hash));
  std::memcpy(&hash, bytes.data() + checked.size(), sizeof(hash));
  if (hash != HashOf(checked)) ThrowDamaged("damaged: cut off or changed", path);
  ByteReader reader(checked.substr(kManifestMagic.size()), kSavedState, path);
  reader.Number(version);
  if (version != kManifestVersion) {
    throw Error(ErrorParts{.what = "saved state: of another version; go on with the mono3d that "
                                   "wrote it, or remove its folder",
                           .where = path,
                           .expected = "version " + std::to_string(kManifestVersion),
                           .found = "version " + std::to_string(version)});
  }
  reader.Number(generation);
  reader.Number(next_file);
  std::vector<std::pair<std::string, Part>> list;
  reader.List(list, [&](std::pair<std::string, Part>& entry) {
    reader.Text(entry.first);
    Exchange(reader, entry.second);
  });
  if (!reader.IsAtEnd() || generation == 0 || generation > kMaxNumber || next_file > kMaxNumber) {
    reader.Refuse("contradicts itself");
  }
  return {list.begin(), list.end()};
}

std::filesystem::path StateFolder::FileOf(std::uint64_t number) const {
  return path_ / (std::string(kPartsPrefix) + std::to_string(number));
}

std::string StateFolder::Read(const Part& part) const {
  std::string bytes = ReadFileRange(FileOf(part.file), part.offset, part.size);
  if (HashOf(bytes) != part.hash) ThrowDamaged("damaged: cut off or changed", FileOf(part.file));
  return bytes;
}

std::string StateFolder::Get(const std::string& name) const {
  const auto found = parts_.find(name);
  if (found == parts_.end()) ThrowDamaged("has no part " + name, path_);
  return Read(found->second);
}

std::vector<std::string> StateFolder::Names(std::string_view prefix) const {
  std::vector<std::string> names;
  for (auto entry = parts_.lower_bound(std::string(prefix));
       entry != parts_.end() && entry->first.starts_with(prefix); ++entry) {
    names.push_back(entry->first);
  }
  return names;
}

StateFolder::Part StateFolder::Append(std::string_view bytes, const Hash& hash) {
  if (file_ == nullptr) {
    CreateFolder(path_);
    file_ = std::make_unique<AtomicFile>(FileOf(next_file_));
    file_size_ = 0;
  }
  file_->Write(bytes);
  const Part part{next_file_, file_size_, bytes.size(), hash};
  file_size_ += bytes.size();
  known_[{hash, part.size}] = part;
  return part;
}

void StateFolder::Put(const std::string& name, std::string_view bytes) {
  const Hash hash = HashOf(bytes);
  const auto known = known_.find({hash, bytes.size()});
  if (known != known_.end()) {
    next_[name] = known->second;
    return;
  }
  try {
    next_[name] = Append(bytes, hash);
    cost_.bytes_new += bytes.size();
  } catch (...) {
    Discard();
    throw;
  }
}

bool StateFolder::Keep(const std::string& name) {
  const auto found = parts_.find(name);
  if (found == parts_.end()) return false;
  next_[name] = found->second;
  return true;
}

std::uint64_t StateFolder::KeepAll(std::string_view prefix) {
  std::uint64_t num_kept = 0;
  for (auto entry = parts_.lower_bound(std::string(prefix));
       entry != parts_.end() && entry->first.starts_with(prefix); ++entry, ++num_kept) {
    next_[entry->first] = entry->second;
  }
  return num_kept;
}

// The smallest shares first, until no more is of no use than of use, and the files are few.
void StateFolder::MoveOutOfSparseFiles() {
  std::map<std::uint64_t, std::uint64_t> used;  // bytes, per file of the last finished save
  std::set<Content> counted;
  std::uint64_t num_used = 0;
  for (const auto& [name, part] : next_) {
    if (!counted.insert({part.hash, part.size}).second) continue;
    if (part.file != next_file_) used[part.file] += part.size;
    num_used += part.size;
  }
  std::uint64_t num_there = file_ == nullptr ? 0 : file_size_;
  for (const auto& [file, bytes] : used) num_there += file_bytes_.at(file);
  while (!used.empty() && (num_there > 2 * num_used || used.size() > kMaxFiles)) {
    const bool are_many = num_there <= 2 * num_used;
    const auto sparsest = std::ranges::min_element(used, {}, [&](const auto& entry) {
      const auto bytes = static_cast<double>(entry.second);
      return are_many ? bytes : bytes / static_cast<double>(file_bytes_.at(entry.first));
    });
    num_there -= file_bytes_.at(sparsest->first) - sparsest->second;
    MoveOutOf(sparsest->first);
    used.erase(sparsest);
  }
}

void StateFolder::MoveOutOf(std::uint64_t file) {
  // By offset and size: a part may have several names.
  std::map<std::pair<std::uint64_t, std::uint64_t>, Part> moved;
  for (auto& [name, part] : next_) {
    if (part.file != file) continue;
    const auto [entry, is_new] = moved.try_emplace({part.offset, part.size});
    if (is_new) {
      entry->second = Append(Read(part), part.hash);
      cost_.bytes_moved += part.size;
    }
    part = entry->second;
  }
}

std::string StateFolder::ManifestBytes() const {
  ByteWriter writer;
  std::uint32_t version = kManifestVersion;
  std::uint64_t generation = next_generation_;
  std::uint64_t next_file = next_file_ + (file_ == nullptr ? 0 : 1);
  writer.Number(version);
  writer.Number(generation);
  writer.Number(next_file);
  std::vector<std::pair<std::string, Part>> list(next_.begin(), next_.end());
  writer.List(list, [&](std::pair<std::string, Part>& entry) {
    writer.Text(entry.first);
    Exchange(writer, entry.second);
  });
  std::string bytes = std::string(kManifestMagic) + writer.TakeBytes();
  const Hash hash = HashOf(bytes);
  return bytes.append(reinterpret_cast<const char*>(&hash), sizeof(hash));
}

StateSaveCost StateFolder::Commit() {
  try {
    // Of a manifest that was made up: what is written must be read again.
    if (next_generation_ > kMaxNumber || next_file_ >= kMaxNumber) {
      ThrowDamaged("contradicts itself", path_ / "manifest");
    }
    MoveOutOfSparseFiles();
    if (file_ == nullptr) CreateFolder(path_);
    const std::string manifest = ManifestBytes();
    if (file_ != nullptr) file_->Commit();
    SynchroniseFolder(path_);  // or the manifest might be there without the parts that it names
    WriteFileAtomically(path_ / "manifest", manifest);
    cost_.bytes_listed = manifest.size();
  } catch (...) {
    Discard();
    throw;
  }
  TakeOver();
  SynchroniseFolder(
      path_);  // or a power cut might bring back the manifest before, without its files
  RemoveUnused();
  StateSaveCost cost = std::exchange(cost_, {});
  cost.num_parts = parts_.size();
  for (const auto& [name, part] : parts_) cost.num_bytes += part.size;
  for (const auto& [file, bytes] : file_bytes_) cost.bytes_on_disk += bytes;
  cost.bytes_on_disk += cost.bytes_listed;
  return cost;
}

void StateFolder::TakeOver() {
  if (file_ != nullptr) {
    file_bytes_[next_file_] = file_size_;
    file_.reset();
    ++next_file_;
  }
  parts_ = std::exchange(next_, {});
  known_.clear();
  std::set<std::uint64_t> used;
  for (const auto& [name, part] : parts_) {
    used.insert(part.file);
    known_.try_emplace({part.hash, part.size}, part);
  }
  std::erase_if(file_bytes_, [&](const auto& entry) { return !used.contains(entry.first); });
  generation_ = next_generation_++;
}

// Also what a save that was cut off has left. What cannot be removed is in nobody's way.
void StateFolder::RemoveUnused() const {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(path_, ignored)) {
    const std::filesystem::path name = entry.path().filename();
    const bool is_partial = name.extension() == ".partial";
    const auto number = NumberOfPartsFile((is_partial ? name.stem() : name).string());
    if (!number || (!is_partial && file_bytes_.contains(*number))) continue;
    std::error_code remains;
    std::filesystem::remove(entry.path(), remains);
  }
}

void StateFolder::Discard() {
  file_.reset();
  next_.clear();
  known_.clear();
  for (const auto& [name, part] : parts_) known_.try_emplace({part.hash, part.size}, part);
  cost_ = {};
  ++next_generation_;
}

}  // namespace mono3d
