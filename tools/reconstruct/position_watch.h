// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "mono3d/geo/position_track.h"

namespace mono3d::tools {

// A file of positions that is written while the drone flies: read again when it has changed, in a
// thread of its own.
class PositionWatch {
 public:
  // `give` is called in that thread, with all positions that the file has. Without a file nothing
  // is done.
  PositionWatch(std::optional<std::filesystem::path> file,
                std::function<void(const PositionTrack&)> give);
  ~PositionWatch() { End(); }
  PositionWatch(const PositionWatch&) = delete;
  PositionWatch& operator=(const PositionWatch&) = delete;

  // `give` is called no more. What the file has at last, where it has changed since the beginning.
  std::optional<PositionTrack> End();

 private:
  using Stamp = std::pair<std::uintmax_t, std::filesystem::file_time_type>;
  std::optional<Stamp> StampOfFile() const;
  void Run();
  bool ReadIfChanged();

  std::optional<std::filesystem::path> file_;
  std::function<void(const PositionTrack&)> give_;
  std::optional<Stamp> stamp_;  // of what was read last
  std::optional<PositionTrack> latest_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_ending_ = false;
  std::thread thread_;
};

}  // namespace mono3d::tools
