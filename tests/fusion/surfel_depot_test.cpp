// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel_depot.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class SurfelDepotTest : public TemporaryFolderTest {};

constexpr std::size_t kNumSurfels = 640;
constexpr std::size_t kBytes = kNumSurfels * kBytesPerSurfel;

Surfels Numbered(std::uint32_t number, std::size_t count = kNumSurfels) {
  Surfels surfels;
  surfels.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto value = static_cast<float>(1000 * number + i);
    surfels.position_radius[i] = {value, -value, 1 / (value + 1), 1};
    surfels.normal_weight[i] = {0, 0, -1, value};
    surfels.history[i] = {number, i, number ^ i, ~i};
  }
  return surfels;
}

void ExpectSame(const Surfels& found, const Surfels& expected) {
  EXPECT_EQ(found.position_radius, expected.position_radius);
  EXPECT_EQ(found.normal_weight, expected.normal_weight);
  EXPECT_EQ(found.history, expected.history);
}

// The file of a process that has no name.
std::filesystem::path NamelessFile(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code ignored;
    const std::string target = std::filesystem::read_symlink(entry.path(), ignored).string();
    if (target.starts_with(folder.string()) && target.ends_with("(deleted)")) return entry.path();
  }
  return {};
}

TEST_F(SurfelDepotTest, GivesBackWhatItWasGivenFromMemoryAndFromTheFile) {
  SurfelDepot depot(folder_, 2 * kBytes);
  std::vector<SurfelDepot::Ticket> tickets;
  for (std::uint32_t i = 0; i < 5; ++i) tickets.push_back(depot.Put(Numbered(i)));
  EXPECT_EQ(depot.host_bytes(), 2 * kBytes);
  EXPECT_EQ(depot.file_bytes(), 3 * kBytes);
  for (std::uint32_t i = 0; i < 5; ++i) ExpectSame(depot.Get(tickets[i]), Numbered(i));
  for (const std::uint32_t i : {3U, 0U, 4U, 2U, 1U}) {
    ExpectSame(depot.Take(tickets[i]), Numbered(i));
  }
  EXPECT_EQ(depot.host_bytes(), 0U);
  EXPECT_EQ(depot.file_bytes(), 0U);
}

TEST_F(SurfelDepotTest, HasAFileWithoutANameAndOnlyWhereItIsNeeded) {
  {
    SurfelDepot depot(folder_, kBytes);
    (void)depot.Put(Numbered(0));
    EXPECT_TRUE(NamelessFile(folder_).empty());
    (void)depot.Put(Numbered(1));
    EXPECT_FALSE(NamelessFile(folder_).empty());
    EXPECT_TRUE(std::filesystem::is_empty(folder_));
  }
  EXPECT_TRUE(NamelessFile(folder_).empty());
}

TEST_F(SurfelDepotTest, UsesThePlacesInItsFileAgain) {
  SurfelDepot depot(folder_, 0);
  std::vector<SurfelDepot::Ticket> tickets;
  for (std::uint32_t i = 0; i < 6; ++i) tickets.push_back(depot.Put(Numbered(i)));
  const std::uint64_t size = std::filesystem::file_size(NamelessFile(folder_));
  EXPECT_EQ(size, 6 * kBytes);
  for (std::uint32_t i = 6; i < 60; ++i) {
    std::uint32_t place = i * 7 % 6;
    (void)depot.Take(tickets[place]);
    tickets[place] = depot.Put(Numbered(i));
  }
  // Of two gaps side by side one.
  depot.Remove(tickets[1]);
  depot.Remove(tickets[2]);
  (void)depot.Put(Numbered(0, 2 * kNumSurfels));
  EXPECT_EQ(std::filesystem::file_size(NamelessFile(folder_)), size);
}

TEST_F(SurfelDepotTest, KeepsInMemoryWhatTheDiskHasNoRoomFor) {
  SurfelDepot depot(folder_, 0);
  const SurfelDepot::Ticket first = depot.Put(Numbered(0));
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{kBytes + 100, before.rlim_max};
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  const SurfelDepot::Ticket second = depot.Put(Numbered(1));
  const SurfelDepot::Ticket third = depot.Put(Numbered(2));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(depot.host_bytes(), 2 * kBytes);
  ExpectSame(depot.Get(first), Numbered(0));
  ExpectSame(depot.Get(second), Numbered(1));
  ExpectSame(depot.Get(third), Numbered(2));
  // There is room again.
  (void)depot.Put(Numbered(3));
  EXPECT_EQ(depot.host_bytes(), 0U);
  ExpectSame(depot.Get(second), Numbered(1));
}

TEST_F(SurfelDepotTest, KeepsInMemoryWhatHasNoFolder) {
  SurfelDepot depot(folder_ / "none", 0);
  const SurfelDepot::Ticket ticket = depot.Put(Numbered(0));
  ExpectSame(depot.Get(ticket), Numbered(0));
  EXPECT_EQ(depot.host_bytes(), kBytes);
}

TEST_F(SurfelDepotTest, SaysThatItsFileWasChangedOrCannotBeRead) {
  SurfelDepot depot(folder_, 0);
  const SurfelDepot::Ticket first = depot.Put(Numbered(0));
  const SurfelDepot::Ticket second = depot.Put(Numbered(1));
  const int file = open(NamelessFile(folder_).c_str(), O_RDWR);
  ASSERT_GE(file, 0);
  ASSERT_EQ(pwrite(file, "x", 1, 17), 1);
  ASSERT_EQ(ftruncate(file, kBytes + 5), 0);
  close(file);
  EXPECT_THAT([&] { (void)depot.Get(first); }, ThrowsMessage<Error>(HasSubstr("was changed")));
  EXPECT_THAT([&] { (void)depot.Take(second); }, ThrowsMessage<Error>(HasSubstr("cannot read")));
}

}  // namespace
}  // namespace mono3d
