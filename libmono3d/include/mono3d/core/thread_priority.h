// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// How much of a core a thread gets that others want as well.
enum class ThreadPriority {
  kThird,  // a third of the share of a thread that was not lowered
  kTenth,
};

// The calling thread, and those that it starts from now on, yield to others of the process where
// there are too few cores. For good. Does nothing where the system has no such priority.
void LowerThreadPriority(ThreadPriority priority);

}  // namespace mono3d
