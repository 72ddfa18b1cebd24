// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/position_watch.h"

#include <chrono>
#include <string>
#include <system_error>

#include "common/tool.h"
#include "mono3d/core/log.h"
#include "mono3d/geo/position_file.h"

namespace mono3d::tools {
namespace {

constexpr auto kWatchInterval = std::chrono::seconds(1);

}  // namespace

PositionWatch::PositionWatch(std::optional<std::filesystem::path> file,
                             std::function<void(const PositionTrack&)> give)
    : file_(std::move(file)), give_(std::move(give)) {
  if (!file_) return;
  stamp_ = StampOfFile();
  thread_ = std::thread([this] { Run(); });
}

std::optional<PositionWatch::Stamp> PositionWatch::StampOfFile() const {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(*file_, error);
  if (error) return std::nullopt;
  const auto written = std::filesystem::last_write_time(*file_, error);
  if (error) return std::nullopt;
  return Stamp{size, written};
}

// A file that cannot be read now, as half of an entry is there, may be the next time.
bool PositionWatch::ReadIfChanged() {
  const std::optional<Stamp> stamp = StampOfFile();
  if (!stamp || stamp == stamp_) return false;
  try {
    latest_ = ReadPositionFile(*file_);
  } catch (const std::exception& error) {
    Log(LogLevel::kDebug, "positions so far: " + WordsOf(error));
    return false;
  }
  stamp_ = stamp;
  return true;
}

void PositionWatch::Run() {
  std::unique_lock lock(mutex_);
  while (!changed_.wait_for(lock, kWatchInterval, [&] { return is_ending_; })) {
    if (ReadIfChanged()) give_(*latest_);
  }
}

std::optional<PositionTrack> PositionWatch::End() {
  if (!file_) return std::nullopt;
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) {
    thread_.join();
    (void)ReadIfChanged();
  }
  return latest_;
}

}  // namespace mono3d::tools
