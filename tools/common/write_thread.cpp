// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/write_thread.h"

#include <cstddef>
#include <utility>

#include "mono3d/core/thread_priority.h"

namespace mono3d::tools {
namespace {

constexpr std::size_t kMaxWaiting = 2;

}  // namespace

WriteThread::WriteThread() {
  thread_ = std::thread([this] { Run(); });
}

WriteThread::~WriteThread() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void WriteThread::Add(std::function<void()> write) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waiting_.size() < kMaxWaiting; });
    waiting_.push_back(std::move(write));
  }
  changed_.notify_all();
}

void WriteThread::Wait() const {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_.empty() && !is_busy_; });
}

void WriteThread::Run() {
  LowerThreadPriority(ThreadPriority::kThird);
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return is_ending_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    std::function<void()> write = std::move(waiting_.front());
    waiting_.pop_front();
    is_busy_ = true;
    lock.unlock();
    changed_.notify_all();
    write();
    write = nullptr;  // what it held is free when it is done
    lock.lock();
    is_busy_ = false;
    changed_.notify_all();
  }
}

}  // namespace mono3d::tools
