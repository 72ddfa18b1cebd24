// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace mono3d::tools {

// Writes files while the run goes on, one after the other, in a thread of its own.
class WriteThread {
 public:
  WriteThread();
  ~WriteThread();  // when all is written
  WriteThread(const WriteThread&) = delete;
  WriteThread& operator=(const WriteThread&) = delete;

  // Any thread. `write` must not throw. Where two wait already, returns when one of them is begun:
  // a slow disk slows down the run and does not fill the memory.
  void Add(std::function<void()> write);
  // Until all that was added is written.
  void Wait() const;

 private:
  void Run();

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::deque<std::function<void()>> waiting_;
  bool is_busy_ = false;
  bool is_ending_ = false;
  std::thread thread_;  // uses the rest
};

}  // namespace mono3d::tools
