// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "gpu/host_kernel.h"

namespace mono3d {

// The threads that run host kernels, with the priority of the thread that makes them. Thread-safe;
// one dispatch at a time, in the order in which they come.
class HostThreads {
 public:
  // `caller_helps`: the thread that waits for a dispatch works on it, too, and so one thread less
  // than there are cores is made. False where its priority is not that of these threads.
  explicit HostThreads(bool caller_helps);
  ~HostThreads();
  HostThreads(const HostThreads&) = delete;
  HostThreads& operator=(const HostThreads&) = delete;

  // Returns when all of it is done. What a share throws is thrown here.
  void Run(HostKernel kernel, const HostDispatch& dispatch);

 private:
  void Work();
  void DoParts(HostKernel kernel, const HostDispatch& dispatch);
  bool IsAllTaken() const { return next_part_ >= num_parts_; }

  const bool caller_helps_;
  const std::uint32_t num_parts_;  // of each dispatch
  std::mutex dispatch_mutex_;      // held as long as a dispatch runs
  std::atomic<std::uint32_t> next_part_;

  std::mutex mutex_;
  std::condition_variable changed_;   // there is a dispatch, or no more will come
  std::condition_variable finished_;  // no thread works on it any more
  HostKernel kernel_ = nullptr;
  const HostDispatch* dispatch_ = nullptr;
  int num_working_ = 0;
  std::exception_ptr error_;  // the first
  bool ends_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace mono3d
