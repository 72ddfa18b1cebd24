// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/thread_priority.h"

#ifdef __linux__
#include <sys/resource.h>
#endif

namespace mono3d {

void LowerThreadPriority() {
#ifdef __linux__
  // On Linux the nice value is the thread's own. 10: about a tenth of the share of a thread at 0.
  constexpr int kNice = 10;
  (void)setpriority(PRIO_PROCESS, 0, kNice);
#endif
}

}  // namespace mono3d
