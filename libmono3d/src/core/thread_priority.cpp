// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/thread_priority.h"

#ifdef __linux__
#include <sys/resource.h>

#include <algorithm>
#endif

namespace mono3d {

void LowerThreadPriority() {
#ifdef __linux__
  // On Linux the nice value is the thread's own. 5 lower: a third of the share where the cores are
  // busy, all that is left where not.
  constexpr int kLower = 5;
  constexpr int kLowest = 19;
  (void)setpriority(PRIO_PROCESS, 0, std::min(getpriority(PRIO_PROCESS, 0) + kLower, kLowest));
#endif
}

}  // namespace mono3d
