// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace mono3d {

// The value of one key: a scalar has one item, a list has any number.
struct YamlValue {
  std::size_t line_number = 0;  // of the key, from 1; the last one where there are several
  int num_times = 0;            // that the key is there
  std::vector<std::string> items;
};

// As much of YAML as calibration files use: nested keys, scalars, lists in [] (over several lines)
// or with a dash on each line, comments, tags (which are ignored). The key of a nested value is
// "outer.inner"; keys are in lower case. What it does not know it passes over: whether the keys
// that are needed are there is for the caller to see. Throws Error when a list is not closed or the
// file cannot be read.
std::map<std::string, YamlValue> ReadYamlSubset(const std::filesystem::path& path);

}  // namespace mono3d
