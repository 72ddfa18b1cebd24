// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/run_record.h"

#include <fstream>
#include <system_error>

namespace mono3d {

nlohmann::json ReadRunRecord(const std::filesystem::path& file) {
  constexpr int kMaxDepth = 64;  // values are destroyed by recursion
  std::error_code ignored;
  // A pipe may never end.
  if (!std::filesystem::is_regular_file(file, ignored)) return nlohmann::json::object();
  std::ifstream stream(file, std::ios::binary);
  nlohmann::json record = nlohmann::json::parse(
      stream,
      [](int depth, auto /*event*/, nlohmann::json& /*value*/) { return depth <= kMaxDepth; },
      /*allow_exceptions=*/false);
  return record.is_object() ? record : nlohmann::json::object();
}

}  // namespace mono3d
