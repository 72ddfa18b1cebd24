// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/yaml_subset.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

std::string_view Trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view WithoutComment(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool begins_word = i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t';
    if (line[i] == '#' && begins_word) return line.substr(0, i);
  }
  return line;
}

std::string_view WithoutTag(std::string_view value) {
  if (!value.starts_with('!')) return value;
  return Trimmed(value.substr(std::min(value.find(' '), value.size())));
}

std::string Unquoted(std::string_view text) {
  const bool is_quoted = text.size() >= 2 && (text.front() == '"' || text.front() == '\'') &&
                         text.back() == text.front();
  return std::string(is_quoted ? text.substr(1, text.size() - 2) : text);
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

class Reader {
 public:
  Reader(const std::filesystem::path& path, const std::vector<std::string>& lines)
      : path_(path), lines_(lines) {}

  std::map<std::string, YamlValue> Read() {
    for (; index_ < lines_.size(); ++index_) TakeLine(WithoutComment(lines_[index_]));
    return std::move(values_);
  }

 private:
  struct OpenKey {
    std::size_t indent = 0;
    std::string name;
  };

  void TakeLine(std::string_view line) {
    const std::string_view text = Trimmed(line);
    if (text.empty() || text.starts_with('%') || text == "---" || text == "...") return;
    if (text.starts_with("- ")) {
      if (!open_keys_.empty()) {
        values_[KeyName()].items.push_back(Unquoted(Trimmed(text.substr(2))));
      }
      return;
    }
    // A colon that ends the key is the last character or stands before a blank.
    std::size_t colon = text.find(':');
    while (colon != std::string_view::npos && colon + 1 < text.size() && text[colon + 1] != ' ') {
      colon = text.find(':', colon + 1);
    }
    if (colon == std::string_view::npos) return;
    const std::size_t indent = line.find_first_not_of(" \t");
    while (!open_keys_.empty() && open_keys_.back().indent >= indent) open_keys_.pop_back();
    open_keys_.push_back({indent, LowerCase(Unquoted(Trimmed(text.substr(0, colon))))});
    YamlValue& value = values_[KeyName()];
    value = {index_ + 1, value.num_times + 1, {}};
    TakeValue(WithoutTag(Trimmed(text.substr(colon + 1))), value);
  }

  void TakeValue(std::string_view text, YamlValue& value) {
    if (!text.starts_with('[')) {
      if (!text.empty()) value.items.push_back(Unquoted(text));
      return;
    }
    std::string list(text.substr(1));
    while (list.find(']') == std::string::npos) {
      if (++index_ == lines_.size()) {
        throw Error(ErrorParts{.what = "list is not closed",
                               .where = AtLine(path_, value.line_number),
                               .expected = "]",
                               .found = "the end of the file"});
      }
      list += ' ' + std::string(WithoutComment(lines_[index_]));
    }
    std::string_view rest = std::string_view(list).substr(0, list.find(']'));
    while (!Trimmed(rest).empty()) {
      const std::size_t comma = std::min(rest.find(','), rest.size());
      value.items.push_back(Unquoted(Trimmed(rest.substr(0, comma))));
      rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
  }

  std::string KeyName() const {
    std::string name;
    for (const OpenKey& key : open_keys_) name += (name.empty() ? "" : ".") + key.name;
    return name;
  }

  const std::filesystem::path& path_;
  const std::vector<std::string>& lines_;
  std::size_t index_ = 0;
  std::vector<OpenKey> open_keys_;
  std::map<std::string, YamlValue> values_;
};

}  // namespace

std::map<std::string, YamlValue> ReadYamlSubset(const std::filesystem::path& path) {
  const std::vector<std::string> lines = ReadLines(path);
  return Reader(path, lines).Read();
}

}  // namespace mono3d
