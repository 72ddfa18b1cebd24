// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/log.h"

#include <mutex>
#include <utility>

namespace mono3d {
namespace {

struct SinkHolder {
  std::mutex mutex;
  LogSink sink;
};

SinkHolder& Holder() {
  static SinkHolder holder;
  return holder;
}

}  // namespace

void SetLogSink(LogSink sink) {
  SinkHolder& holder = Holder();
  const std::lock_guard lock(holder.mutex);
  holder.sink = std::move(sink);
}

void Log(LogLevel level, std::string_view message) {
  SinkHolder& holder = Holder();
  const std::lock_guard lock(holder.mutex);
  if (holder.sink) holder.sink(level, message);
}

}  // namespace mono3d
