// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/write_thread.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <thread>
#include <vector>

namespace mono3d::tools {
namespace {

using testing::ElementsAre;

TEST(WriteThread, WritesInTheOrderInWhichFilesCome) {
  std::vector<int> written;
  const std::thread::id caller = std::this_thread::get_id();
  WriteThread thread;
  for (int i = 0; i < 5; ++i) {
    thread.Add([&written, caller, i] {
      if (std::this_thread::get_id() != caller) written.push_back(i);
    });
  }
  thread.Wait();
  EXPECT_THAT(written, ElementsAre(0, 1, 2, 3, 4));
}

TEST(WriteThread, EndsWhenAllIsWritten) {
  int num_written = 0;
  {
    WriteThread thread;
    thread.Add([] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); });
    thread.Add([&] { ++num_written; });
  }
  EXPECT_EQ(num_written, 1);
}

TEST(WriteThread, WaitsWhereTwoWaitAlready) {
  std::promise<void> disk_is_free;
  std::shared_future<void> is_free = disk_is_free.get_future().share();
  std::promise<void> is_begun;
  WriteThread thread;
  thread.Add([&is_begun, is_free] {
    is_begun.set_value();
    is_free.wait();
  });
  is_begun.get_future().wait();
  thread.Add([] {});
  thread.Add([] {});
  std::atomic<bool> is_added = false;
  const std::future<void> fourth = std::async(std::launch::async, [&] {
    thread.Add([] {});
    is_added = true;
  });
  EXPECT_EQ(fourth.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  EXPECT_FALSE(is_added);
  disk_is_free.set_value();
  fourth.wait();
  thread.Wait();
  EXPECT_TRUE(is_added);
}

}  // namespace
}  // namespace mono3d::tools
