// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <functional>
#include <string_view>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

enum class LogLevel { kDebug, kInfo, kWarning };

using LogSink = std::function<void(LogLevel, std::string_view message)>;

// Where the library's messages go, for the whole process. Without a sink they are dropped: the
// library itself never prints. Thread-safe; the sink is called by one thread at a time.
void SetLogSink(LogSink sink);

// Hands one line to the sink.
void Log(LogLevel level, std::string_view message);

}  // namespace mono3d
