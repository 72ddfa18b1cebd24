// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "mono3d/io/frame_source.h"

namespace mono3d {

// The frames of another source, read by a thread of its own a few frames ahead: decoding and
// undistortion go on while the frames before are worked at. The same frames in the same order; what
// reading one throws comes out of the Next() that would have had it, after which there are no more
// frames; num_skipped() and num_passed_over() are those of the frames
// handed out so far. The thread begins with the first
// Next(), so that a source that is opened for its camera or its number of frames alone decodes
// nothing. Calls from one thread at a time.
std::unique_ptr<FrameSource> ReadAhead(std::unique_ptr<FrameSource> source);

}  // namespace mono3d
