// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <exception>
#include <mutex>

namespace mono3d {

// The first exception of several threads, on its way to the caller. From any thread.
class FirstError {
 public:
  // Later ones are forgotten.
  void Set(const std::exception_ptr& error);
  bool IsSet() const;

  void NoteThrown();  // by another way

  void Throw();       // where it is set
  void ThrowIfNew();  // where it is set and was not thrown before

 private:
  mutable std::mutex mutex_;
  std::exception_ptr error_;  // stays here, so that no thread destroys it while another reads it
  bool is_known_ = false;
};

}  // namespace mono3d
