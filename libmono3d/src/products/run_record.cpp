// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/run_record.h"

#include <string>

#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {

nlohmann::json ReadRunRecord(const std::filesystem::path& file) {
  constexpr int kMaxDepth = 64;  // values are destroyed by recursion
  std::string text;
  try {
    text = ReadBytes(file);
  } catch (const Error&) {
    return nlohmann::json::object();
  }
  nlohmann::json record = nlohmann::json::parse(
      text, [](int depth, auto /*event*/, nlohmann::json& /*value*/) { return depth <= kMaxDepth; },
      /*allow_exceptions=*/false);
  return record.is_object() ? record : nlohmann::json::object();
}

}  // namespace mono3d
