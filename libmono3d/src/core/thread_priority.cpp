// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/thread_priority.h"

#ifdef __linux__
#include <sys/resource.h>

#include <algorithm>
#endif

namespace mono3d {

void LowerThreadPriority([[maybe_unused]] ThreadPriority priority) {
#ifdef __linux__
  // On Linux the nice value is the thread's own; each step takes a fifth of the share where the
  // cores are busy, and nothing where they are not.
  const int steps = priority == ThreadPriority::kThird ? 5 : 10;
  constexpr int kLowest = 19;
  (void)setpriority(PRIO_PROCESS, 0, std::min(getpriority(PRIO_PROCESS, 0) + steps, kLowest));
#endif
}

}  // namespace mono3d
