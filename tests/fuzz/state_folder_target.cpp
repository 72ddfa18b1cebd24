// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/content_hash.h"
#include "fuzz/edits.h"
#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/core/state_folder.h"

namespace mono3d::fuzz {
namespace {

constexpr std::size_t kHashBytes = 16;

// What a journal's folder holds after two saves.
struct SavedFiles {
  std::string manifest;  // without its checksum
  std::string first;
  std::string second;
};

SavedFiles MakeSavedFiles(const std::filesystem::path& path) {
  StateFolder folder(path);
  folder.Put("a", std::string(300, 'a'));
  folder.Put("b/0", "a short one");
  folder.Put("b/1", "");
  static_cast<void>(folder.Commit());
  static_cast<void>(folder.KeepAll(""));
  folder.Put("c", std::string(200, 'c'));
  static_cast<void>(folder.Commit());
  const auto read = [&](const char* name) {
    std::string bytes(std::filesystem::file_size(path / name), '\0');
    std::ifstream(path / name, std::ios::binary)
        .read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return bytes;
  };
  SavedFiles files{read("manifest"), read("parts-0"), read("parts-1")};
  files.manifest.resize(files.manifest.size() - kHashBytes);
  return files;
}

}  // namespace

// What is in the way of a journal that can be gone on with is an Error when it is opened or read.
void StateFolders(std::string_view input) {
  static const InputFolder folder("state_folder");
  static const SavedFiles saved = MakeSavedFiles(folder.path() / "made");
  const std::filesystem::path path = folder.path() / "journal";
  std::filesystem::remove_all(path);
  std::vector<std::string> files = {saved.manifest, saved.first, saved.second};
  Edit(input, files);
  files.resize(3);
  const auto [low, high] = ContentHash(files[0]);
  files[0].append(reinterpret_cast<const char*>(&low), sizeof low);
  files[0].append(reinterpret_cast<const char*>(&high), sizeof high);
  static_cast<void>(folder.Write("journal/manifest", files[0]));
  static_cast<void>(folder.Write("journal/parts-0", files[1]));
  static_cast<void>(folder.Write("journal/parts-1", files[2]));
  const auto contents = ReadOrRefuse([&] {
    const StateFolder states(path);
    std::vector<std::string> parts;
    for (const std::string& name : states.Names("")) parts.push_back(states.Get(name));
    return parts;
  });
  if (!contents) return;
  // What can be read whole can be gone on with, but for the largest numbers, and is then the same.
  static_cast<void>(ReadOrRefuse([&] {
    StateFolder states(path);
    static_cast<void>(states.KeepAll(""));
    states.Put("new", "d");
    return states.Commit();
  }));
  const StateFolder states(path);
  std::vector<std::string> parts;
  for (const std::string& name : states.Names("")) {
    if (name != "new") parts.push_back(states.Get(name));
  }
  const bool had_new = parts.size() + 1 == contents->size();
  if (!had_new && parts != *contents) throw std::logic_error("a kept part has changed");
}

}  // namespace mono3d::fuzz
