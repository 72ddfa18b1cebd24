// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/backlog.h"

#include <utility>

#include "image/image_state.h"
#include "image/state_archive.h"

namespace mono3d::tracking {
namespace {

std::size_t NumBytes(const Frame& frame) { return frame.bgr.total() * frame.bgr.elemSize(); }

}  // namespace

void Backlog::Add(const Frame& frame) {
  num_bytes_ += NumBytes(frame);
  frames_.push_back(frame);
  while (num_bytes_ > max_bytes_ && !frames_.empty()) {
    num_bytes_ -= NumBytes(frames_.front());
    frames_.pop_front();
  }
}

std::vector<Frame> Backlog::Take(std::int64_t begin, std::int64_t end) {
  std::vector<Frame> taken;
  std::deque<Frame> left;
  for (Frame& frame : frames_) {
    if (frame.index > begin && frame.index < end) {
      num_bytes_ -= NumBytes(frame);
      taken.push_back(std::move(frame));
    } else {
      left.push_back(std::move(frame));
    }
  }
  frames_ = std::move(left);
  return taken;
}

void Backlog::Clear() {
  frames_.clear();
  num_bytes_ = 0;
}

template <typename Archive>
void Backlog::ExchangeState(Archive& archive) {
  archive.Sections(frames_, 1, [&](Frame& frame) { mono3d::ExchangeState(archive, frame); });
  if constexpr (Archive::kReads) {
    num_bytes_ = 0;
    for (const Frame& frame : frames_) {
      if (frame.bgr.empty()) archive.Refuse("contradicts itself");
      num_bytes_ += NumBytes(frame);
    }
  }
}

template void Backlog::ExchangeState(StateWriter&);
template void Backlog::ExchangeState(StateReader&);

}  // namespace mono3d::tracking
