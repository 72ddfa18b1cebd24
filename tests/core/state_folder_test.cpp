// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/state_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "core/content_hash.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

class StateFolderTest : public TemporaryFolderTest {
 protected:
  std::filesystem::path State() const { return folder_ / "state"; }

  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(State())) {
      names.push_back(entry.path().filename().string());
    }
    std::ranges::sort(names);
    return names;
  }
};

std::string Noise(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::string bytes;
  while (bytes.size() < size) bytes += static_cast<char>(random() & 0xFFU);
  return bytes;
}

std::string MessageOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(StateFolderTest, HasNothingAtFirstAndMakesNoFolderForReading) {
  const StateFolder folder(State());
  EXPECT_TRUE(folder.empty());
  EXPECT_FALSE(folder.Has("a"));
  EXPECT_FALSE(std::filesystem::exists(State()));
  EXPECT_NE(MessageOf([&] { (void)folder.Get("a"); }).find("has no part a"), std::string::npos);
}

TEST_F(StateFolderTest, GivesBackWhatWasSavedToAnotherObject) {
  {
    StateFolder folder(State());
    folder.Put("a", "first");
    folder.Put("b", Noise(10'000, 1));
    folder.Put("empty", "");
    folder.Put("after", "x");
    (void)folder.Commit();
  }
  const StateFolder folder(State());
  EXPECT_EQ(folder.generation(), 1U);
  EXPECT_EQ(folder.Get("a"), "first");
  EXPECT_EQ(folder.Get("b"), Noise(10'000, 1));
  EXPECT_EQ(folder.Get("empty"), "");
  EXPECT_EQ(folder.Get("after"), "x");
}

TEST_F(StateFolderTest, WritesOnlyWhatIsNew) {
  StateFolder folder(State());
  folder.Put("a", Noise(1000, 1));
  folder.Put("b", Noise(1000, 2));
  (void)folder.Commit();
  EXPECT_TRUE(folder.Keep("a"));
  EXPECT_FALSE(folder.Keep("c"));
  folder.Put("b", Noise(500, 3));
  folder.Put("d", Noise(1000, 2));  // what b was
  const StateSaveCost cost = folder.Commit();
  EXPECT_EQ(cost.bytes_new, 500U);
  EXPECT_EQ(cost.num_parts, 3U);
  EXPECT_EQ(folder.Get("a"), Noise(1000, 1));
  EXPECT_EQ(folder.Get("b"), Noise(500, 3));
  EXPECT_EQ(folder.Get("d"), Noise(1000, 2));
  EXPECT_EQ(folder.KeepAll("a"), 1U);
  (void)folder.Commit();
  EXPECT_FALSE(folder.Has("b"));
}

// The crash: whatever was written since, without its manifest.
TEST_F(StateFolderTest, ASaveThatDidNotEndLeavesTheOneBefore) {
  StateFolder folder(State());
  folder.Put("a", "old");
  folder.Put("b", "old b");
  (void)folder.Commit();
  const std::string manifest = ReadText(State() / "manifest");
  folder.Put("a", "new");
  folder.Put("b", "new b");
  {
    const StateFolder meanwhile(State());
    EXPECT_EQ(meanwhile.Get("a"), "old");
  }
  // All parts there, and the manifest not: as if it had not been written, and nothing removed.
  const std::filesystem::path copy = folder_ / "copy";
  std::filesystem::copy(State(), copy);
  (void)folder.Commit();
  for (const auto& entry : std::filesystem::directory_iterator(State())) {
    std::filesystem::copy(entry, copy, std::filesystem::copy_options::overwrite_existing);
  }
  WriteText("copy/manifest", manifest);
  StateFolder after_crash(copy);
  EXPECT_EQ(after_crash.Get("a"), "old");
  EXPECT_EQ(after_crash.Get("b"), "old b");
  // And it goes on.
  after_crash.Put("a", "third");
  after_crash.Put("b", Noise(100, 7));
  (void)after_crash.Commit();
  EXPECT_EQ(StateFolder(copy).Get("a"), "third");
  std::size_t num_partial = 0;
  for (const auto& entry : std::filesystem::directory_iterator(copy)) {
    num_partial += entry.path().extension() == ".partial" ? 1 : 0;
  }
  EXPECT_EQ(num_partial, 0U);
}

TEST_F(StateFolderTest, WhatIsGivenUpIsForgotten) {
  StateFolder folder(State());
  folder.Put("a", "one");
  (void)folder.Commit();
  const std::uint64_t next = folder.next_generation();
  folder.Put("a", "two");
  folder.Discard();
  EXPECT_GT(folder.next_generation(), next);
  EXPECT_EQ(folder.Get("a"), "one");
  EXPECT_TRUE(folder.Keep("a"));
  (void)folder.Commit();
  EXPECT_EQ(StateFolder(State()).Get("a"), "one");
}

TEST_F(StateFolderTest, TakesAtMostTwiceWhatIsInUse) {
  constexpr int kNumParts = 20;
  constexpr std::size_t kPartBytes = 1000;
  StateFolder folder(State());
  std::vector<unsigned> seeds(kNumParts);
  std::uint64_t moved = 0;
  for (unsigned save = 0; save < 60; ++save) {
    for (int i = 0; i < kNumParts; ++i) {
      const std::string name = "part" + std::to_string(i);
      const bool changes = save == 0 || static_cast<unsigned>(i) % 7 == save % 7 || i < 2;
      unsigned& seed = seeds.at(static_cast<std::size_t>(i));
      if (changes) {
        seed = 1000 * save + static_cast<unsigned>(i) + 1;
        folder.Put(name, Noise(kPartBytes, seed));
      } else {
        ASSERT_TRUE(folder.Keep(name));
      }
    }
    const StateSaveCost cost = folder.Commit();
    moved += cost.bytes_moved;
    EXPECT_LE(cost.bytes_on_disk - cost.bytes_listed, 2 * kNumParts * kPartBytes);
  }
  EXPECT_GT(moved, 0U);
  const StateFolder again(State());
  for (int i = 0; i < kNumParts; ++i) {
    EXPECT_EQ(again.Get("part" + std::to_string(i)),
              Noise(kPartBytes, seeds.at(static_cast<std::size_t>(i))));
  }
  std::uintmax_t on_disk = 0;
  for (const std::string& name : Files()) on_disk += std::filesystem::file_size(State() / name);
  EXPECT_LE(on_disk, 3 * kNumParts * kPartBytes);
}

TEST_F(StateFolderTest, DamageIsOneLineThatNamesTheFile) {
  {
    StateFolder folder(State());
    folder.Put("a", Noise(1000, 1));
    (void)folder.Commit();
  }
  const std::string manifest = ReadText(State() / "manifest");
  const std::string parts = ReadText(State() / "parts-0");
  const auto expect = [&](const std::string& file, const std::string& what) {
    const std::string message = MessageOf([&] { (void)StateFolder(State()).Get("a"); });
    EXPECT_NE(message.find(file), std::string::npos) << message;
    EXPECT_NE(message.find(what), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  };
  std::string changed = parts;
  changed[500] ^= 1;
  WriteText("state/parts-0", changed);
  expect("parts-0", "damaged");
  WriteText("state/parts-0", parts.substr(0, 999));
  expect("parts-0", "cut off");
  std::filesystem::remove(State() / "parts-0");
  expect("parts-0", "missing");
  WriteText("state/parts-0", parts);
  for (std::size_t i = 0; i < manifest.size(); ++i) {
    std::string wrong = manifest;
    wrong[i] ^= 4;
    WriteText("state/manifest", wrong);
    expect("manifest", "saved state");
    WriteText("state/manifest", manifest.substr(0, i));
    expect("manifest", "saved state");
  }
}

// The largest number of a save that can be read: with the next one it could not be.
TEST_F(StateFolderTest, AManifestThatCannotBeGoneOnWithStays) {
  {
    StateFolder folder(State());
    folder.Put("a", "one");
    (void)folder.Commit();
  }
  std::string manifest = ReadText(State() / "manifest");
  const std::size_t at = std::string("mono3d state\n").size() + sizeof(std::uint32_t);
  const std::uint64_t largest = std::uint64_t{1} << 62U;
  std::memcpy(manifest.data() + at, &largest, sizeof largest);
  manifest.resize(manifest.size() - 16);
  const auto [low, high] = ContentHash(manifest);
  manifest.append(reinterpret_cast<const char*>(&low), sizeof low);
  manifest.append(reinterpret_cast<const char*>(&high), sizeof high);
  WriteText("state/manifest", manifest);
  StateFolder folder(State());
  EXPECT_EQ(folder.Get("a"), "one");
  folder.Put("a", "two");
  EXPECT_NE(MessageOf([&] { (void)folder.Commit(); }).find("contradicts itself"),
            std::string::npos);
  EXPECT_EQ(StateFolder(State()).Get("a"), "one");
}

// Of a file with a hole, of which nothing is on the disk.
TEST_F(StateFolderTest, AManifestThatIsTooLongIsNotReadIntoMemory) {
  {
    StateFolder folder(State());
    folder.Put("a", "one");
    (void)folder.Commit();
  }
  std::filesystem::resize_file(State() / "manifest", std::uintmax_t{1} << 40U);
  EXPECT_NE(MessageOf([&] { (void)StateFolder(State()); }).find("too long"), std::string::npos);
}

TEST_F(StateFolderTest, WhatCannotBeWrittenIsToldAndTheStateStays) {
  StateFolder folder(State());
  folder.Put("a", "one");
  (void)folder.Commit();
  std::filesystem::create_directory(State() / "parts-1.partial");  // in the way of the next file
  EXPECT_NE(MessageOf([&] { folder.Put("a", "two"); }).find("parts-1"), std::string::npos);
  std::filesystem::remove(State() / "parts-1.partial");
  EXPECT_EQ(folder.Get("a"), "one");
  folder.Put("a", "three");
  (void)folder.Commit();
  EXPECT_EQ(StateFolder(State()).Get("a"), "three");
}

}  // namespace
}  // namespace mono3d
