// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d {

// The keys of a calibration in YAML, JSON or the XML of cv::FileStorage, with the messages that go
// with it. Keys count in any case of letters; those of a map within are "outer.inner".
class CalibrationYaml {
 public:
  explicit CalibrationYaml(const std::filesystem::path& path);

  bool Has(const std::string& key) const { return keys_.contains(key); }
  // The first of the names that is there, and the last one where none is.
  std::string FirstOf(const std::vector<std::string>& names) const;

  // A positive whole number.
  int Size(const std::string& key) const;
  // The numbers of a matrix: a list, or rows, cols and a list named data.
  std::vector<double> Matrix(const std::string& key) const;
  double Number(const std::string& key) const;
  // The number of an optional key.
  std::optional<double> FindNumber(const std::string& key) const;
  // The text of an optional key.
  std::optional<std::string> Find(const std::string& key) const;

  // "camera.yaml:12"
  std::string Line(const std::string& key) const { return LineAt(keys_.at(key).mark); }

  [[noreturn]] static void Throw(const std::string& where, const std::string& what,
                                 const std::string& expected, const std::string& found,
                                 ErrorCode code = ErrorCode::kInvalidInput);

 private:
  struct Key {
    YAML::Mark mark;    // of the key itself, the last one where there are several
    int num_times = 0;  // that the key is there
    YAML::Node value;
  };

  void AddKeys(const YAML::Node& map, const std::string& prefix);
  const Key& Require(const std::string& key) const;
  std::string LineAt(const YAML::Mark& mark) const;
  static std::string Text(const YAML::Node& value);
  std::vector<double> Numbers(const std::string& key, const YAML::Node& value) const;

  const std::filesystem::path path_;
  std::map<std::string, Key> keys_;
};

}  // namespace mono3d
