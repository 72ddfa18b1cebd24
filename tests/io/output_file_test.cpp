// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/output_file.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

using OutputFile = TemporaryFolderTest;

TEST_F(OutputFile, HasItsNameOnlyWhenComplete) {
  const auto path = WriteText("a.txt", "old");
  AtomicFile file(path);
  file.Write("new");
  EXPECT_EQ(ReadText(path), "old");
  file.Commit();
  EXPECT_EQ(ReadText(path), "new");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.txt.partial"));
}

TEST_F(OutputFile, LeavesNothingWhenNotCommitted) {
  { AtomicFile(folder_ / "a.txt").Write("half"); }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

// /dev/full takes no byte: "No space left on device". What is written beside goes there.
TEST_F(OutputFile, NamesTheFileWhenTheDiskIsFull) {
  const auto path = WriteText("model.ply", "old");
  std::filesystem::create_symlink("/dev/full", folder_ / "model.ply.partial");
  // A small file shows the error when its buffer is flushed, a large one while it is written.
  EXPECT_THAT(
      [&] { WriteFileAtomically(path, "new"); },
      ThrowsMessage<Error>(AllOf(HasSubstr("model.ply: "), HasSubstr("No space left on device"))));
  std::filesystem::create_symlink("/dev/full", folder_ / "model.ply.partial");
  EXPECT_THAT(
      [&] { WriteFileAtomically(path, std::string(1 << 20, 'x')); },
      ThrowsMessage<Error>(AllOf(HasSubstr("model.ply: "), HasSubstr("No space left on device"))));
  EXPECT_EQ(ReadText(path), "old");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "model.ply.partial"));
}

TEST_F(OutputFile, NamesTheFileWhenItGrowsBeyondTheQuota) {
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{4096, before.rlim_max};
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  std::string message;
  try {
    WriteFileAtomically(folder_ / "big.pfm", std::string(1 << 20, 'x'));
  } catch (const Error& error) {
    message = error.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(message, AllOf(HasSubstr("big.pfm: cannot write"), HasSubstr("File too large")));
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(OutputFile, FailsAsInputOrOutput) {
  try {
    WriteFileAtomically(folder_ / "none" / "a.txt", "x");
    FAIL() << "wrote into a folder that is not there";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kIo);
  }
}

// Two processes that write the same file, each beside the other's.
TEST_F(OutputFile, MayBeWrittenTwiceAtOnceWithSuffixesOfTheirOwn) {
  AtomicFile first(folder_ / "cache.bin", ".1.partial");
  AtomicFile second(folder_ / "cache.bin", ".2.partial");
  first.Write("first");
  second.Write("the second");
  second.Commit();
  EXPECT_EQ(ReadText(folder_ / "cache.bin"), "the second");
  first.Commit();
  EXPECT_EQ(ReadText(folder_ / "cache.bin"), "first");
}

TEST_F(OutputFile, RefusesAFolderThatIsNotThere) {
  EXPECT_THAT([&] { WriteFileAtomically(folder_ / "none" / "a.txt", "x"); },
              ThrowsMessage<Error>(HasSubstr("cannot create the file: No such file")));
}

TEST_F(OutputFile, CreatesTheFolderAndThoseAboveIt) {
  CreateOutputFolder(folder_ / "a" / "b");
  CreateOutputFolder(folder_ / "a" / "b");
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "a" / "b"));
}

TEST_F(OutputFile, RefusesAFolderThatCannotBeWritten) {
  WriteText("file", "");
  EXPECT_THAT([&] { CreateOutputFolder(folder_ / "file" / "out"); },
              ThrowsMessage<Error>(
                  AllOf(HasSubstr("file/out"), HasSubstr("cannot create the folder: Not a dir"))));
  EXPECT_THAT([&] { CreateOutputFolder(folder_ / "file"); },
              ThrowsMessage<Error>(AllOf(HasSubstr("/file: "), HasSubstr("folder"))));
  // No process may create files there, root included.
  EXPECT_THAT([] { CreateOutputFolder("/proc/self"); },
              ThrowsMessage<Error>(HasSubstr("/proc/self: cannot write into the folder")));
}

}  // namespace
}  // namespace mono3d
