// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d {

// The calling thread, and those that it starts from now on, yield to others of the process where
// there are too few cores. For good. Does nothing where the system has no such priority.
void LowerThreadPriority();

}  // namespace mono3d
