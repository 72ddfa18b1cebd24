// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "gpu/host_threads.h"

#include <algorithm>
#include <utility>

namespace mono3d {
namespace {

// More parts than threads, since other work takes its share of the cores: who is late has less to
// do.
constexpr std::uint32_t kPartsPerCore = 6;

unsigned NumCores() { return std::max(1u, std::thread::hardware_concurrency()); }

}  // namespace

HostThreads::HostThreads(bool caller_helps)
    : caller_helps_(caller_helps), num_parts_(kPartsPerCore * NumCores()), next_part_(num_parts_) {
  const unsigned num_threads = NumCores() - (caller_helps ? 1 : 0);
  for (unsigned i = 0; i < num_threads; ++i) threads_.emplace_back([this] { Work(); });
}

HostThreads::~HostThreads() {
  {
    const std::scoped_lock lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void HostThreads::Run(HostKernel kernel, const HostDispatch& dispatch) {
  const std::scoped_lock one_at_a_time(dispatch_mutex_);
  {
    const std::scoped_lock lock(mutex_);
    kernel_ = kernel;
    dispatch_ = &dispatch;
    next_part_ = 0;
  }
  changed_.notify_all();
  if (caller_helps_) DoParts(kernel, dispatch);
  std::unique_lock lock(mutex_);
  finished_.wait(lock, [&] { return IsAllTaken() && num_working_ == 0; });
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void HostThreads::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return ends_ || !IsAllTaken(); });
    if (ends_) return;
    const HostKernel kernel = kernel_;
    const HostDispatch* dispatch = dispatch_;
    ++num_working_;
    lock.unlock();
    DoParts(kernel, *dispatch);
    lock.lock();
    if (--num_working_ == 0) finished_.notify_all();
  }
}

void HostThreads::DoParts(HostKernel kernel, const HostDispatch& dispatch) {
  while (true) {
    const std::uint32_t part = next_part_.fetch_add(1);
    if (part >= num_parts_) return;
    try {
      kernel(dispatch, part, num_parts_);
    } catch (...) {
      const std::scoped_lock lock(mutex_);
      if (!error_) error_ = std::current_exception();
    }
  }
}

}  // namespace mono3d
