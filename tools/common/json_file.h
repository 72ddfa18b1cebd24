// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "nlohmann/json.hpp"

namespace mono3d::tools {

// As our JSON files are written. Names of files are bytes: what is no UTF-8 becomes U+FFFD.
template <typename AnyJson>
std::string JsonText(const AnyJson& json) {
  return json.dump(2, ' ', false, AnyJson::error_handler_t::replace) + "\n";
}

// What a file holds; discarded where it is no JSON, or no regular file: a pipe may never end.
// Values are copied and destroyed by recursion: what lies deeper than any of our files is left out.
template <typename AnyJson>
AnyJson ReadJsonFile(const std::filesystem::path& path) {
  constexpr int kMaxDepth = 64;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    return AnyJson(AnyJson::value_t::discarded);
  }
  std::ifstream file(path);
  return AnyJson::parse(
      file, [](int depth, auto /*event*/, AnyJson& /*value*/) { return depth <= kMaxDepth; },
      /*allow_exceptions=*/false);
}

}  // namespace mono3d::tools
