// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/first_error.h"

namespace mono3d {

void FirstError::Set(const std::exception_ptr& error) {
  const std::lock_guard lock(mutex_);
  if (!error_) error_ = error;
}

bool FirstError::IsSet() const {
  const std::lock_guard lock(mutex_);
  return error_ != nullptr;
}

void FirstError::NoteThrown() {
  const std::lock_guard lock(mutex_);
  is_known_ = true;
}

void FirstError::Throw() {
  const std::lock_guard lock(mutex_);
  if (!error_) return;
  is_known_ = true;
  std::rethrow_exception(error_);
}

void FirstError::ThrowIfNew() {
  const std::lock_guard lock(mutex_);
  if (!error_ || is_known_) return;
  is_known_ = true;
  std::rethrow_exception(error_);
}

}  // namespace mono3d
