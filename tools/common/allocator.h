// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d::tools {

// Blocks of 8 MB and more come from the system and go back to it when they are freed. By default
// glibc keeps ever larger ones, up to 32 MB, in its heaps, where small ones that stay on top of
// them hold all of the memory below: a long flight takes more and more of it (docs/benchmarks.md).
// Smaller ones are images, several for each frame: from 4 MB on, a run at 1080p takes 6 % more
// processor time. Before there are threads. Does nothing with other allocators.
void ReturnLargeBlocks();

}  // namespace mono3d::tools
