// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/output_file.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <csignal>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::SizeIs;
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

// Where others may write into the folder, a link would lead what is written to a file elsewhere.
TEST_F(OutputFile, FollowsNoLink) {
  const auto elsewhere = WriteText("elsewhere.txt", "precious");
  std::filesystem::create_directory(folder_ / "out");
  const auto path = WriteText("out/model.ply", "old");
  std::filesystem::create_symlink(elsewhere, folder_ / "out/model.ply.partial");
  std::filesystem::create_symlink(elsewhere, folder_ / "out/.mono3d_probe");
  CreateOutputFolder(folder_ / "out");
  WriteFileAtomically(path, "new");
  EXPECT_EQ(ReadText(elsewhere), "precious");
  EXPECT_EQ(ReadText(path), "new");
  EXPECT_FALSE(std::filesystem::is_symlink(path));
}

TEST_F(OutputFile, TakesThePlaceOfWhatWasLeftHalfWritten) {
  WriteText("model.ply.partial", "half");
  WriteFileAtomically(folder_ / "model.ply", "new");
  EXPECT_EQ(ReadText(folder_ / "model.ply"), "new");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "model.ply.partial"));
}

TEST_F(OutputFile, TellsBeforehandWhatCannotBeWritten) {
  RequireWritableFile(folder_ / "a.txt");
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
  const auto path = WriteText("b.txt", "old");
  RequireWritableFile(path);
  EXPECT_EQ(ReadText(path), "old");
  EXPECT_THAT([&] { RequireWritableFile(folder_); },
              ThrowsMessage<Error>(HasSubstr("cannot write the file: Is a directory")));
  EXPECT_THAT([&] { RequireWritableFile(folder_ / "none" / "a.txt"); },
              ThrowsMessage<Error>(HasSubstr("none/a.txt: cannot create the file")));
}

// As a full disk: a small file shows the error when its buffer is flushed, a large one while it is
// written.
TEST_F(OutputFile, NamesTheFileWhenItGrowsBeyondTheQuota) {
  const auto path = WriteText("big.pfm", "old");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{512, before.rlim_max};
  auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  std::vector<std::string> messages;
  for (const std::size_t num_bytes : {1000, 1 << 20}) {
    try {
      WriteFileAtomically(path, std::string(num_bytes, 'x'));
    } catch (const Error& error) {
      messages.emplace_back(error.what());
    }
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(messages, SizeIs(2));
  EXPECT_THAT(messages, Each(AllOf(HasSubstr("big.pfm: cannot write"), HasSubstr("too large"))));
  EXPECT_EQ(ReadText(path), "old");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "big.pfm.partial"));
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
