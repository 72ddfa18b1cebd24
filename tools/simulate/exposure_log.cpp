// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/exposure_log.h"

#include <array>
#include <cstdio>
#include <fstream>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

std::string FormatNumber(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

}  // namespace

ExposureLog::ExposureLog(std::filesystem::path path, const std::vector<double>& timestamps_s)
    : path_(std::move(path)) {
  for (const double t_s : timestamps_s) keys_.push_back(FormatNumber("%.6f", t_s));
  std::ifstream file(path_);
  std::string line;
  // A line without its end was cut off: getline meets the end of the file within it.
  while (std::getline(file, line) && !file.eof()) {
    const std::size_t space = line.find(' ');
    if (line.starts_with('#') || space == std::string::npos) continue;
    values_[line.substr(0, space)] = line.substr(space + 1);
  }
  if (!line.empty()) WriteFileAtomically(path_, Text());
}

void ExposureLog::Add(int frame, double exposure) {
  std::string& value = values_[Key(frame)];
  value = FormatNumber("%.9g", exposure);
  std::ofstream file(path_, std::ios::app);
  file << Key(frame) << ' ' << value << '\n';
  file.flush();
  if (!file) {
    throw Error(ErrorParts{.what = "cannot write the file",
                           .where = path_,
                           .expected = {},
                           .found = {},
                           .code = ErrorCode::kIo});
  }
}

void ExposureLog::Finish() const { WriteFileAtomically(path_, Text()); }

std::string ExposureLog::Text() const {
  std::string text =
      "# timestamp exposure: seconds, and the factor on the scene's light of this frame, before\n"
      "# vignetting, noise and tone curve\n";
  for (const std::string& key : keys_) {
    if (values_.contains(key)) text += key + " " + values_.at(key) + "\n";
  }
  return text;
}

}  // namespace mono3d::tools
