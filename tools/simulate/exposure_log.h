// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace mono3d::tools {

// The file exposures.txt: "timestamp exposure", a line for each frame. The factor of a frame is
// known once it is rendered; the log keeps those of an earlier run that was broken off.
class ExposureLog {
 public:
  ExposureLog(std::filesystem::path path, const std::vector<double>& timestamps_s);

  bool Has(int frame) const { return values_.contains(Key(frame)); }
  // The line is in the file when it returns. Throws Error when it cannot be written.
  void Add(int frame, double exposure);
  // Puts the lines in order.
  void Finish() const;

 private:
  std::string Text() const;
  const std::string& Key(int frame) const { return keys_.at(static_cast<std::size_t>(frame)); }

  std::filesystem::path path_;
  std::vector<std::string> keys_;              // the timestamp of each frame, as in the file
  std::map<std::string, std::string> values_;  // of those frames that are known
};

}  // namespace mono3d::tools
