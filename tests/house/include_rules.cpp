// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "house/include_rules.h"

#include <regex>
#include <sstream>

namespace mono3d::house {
namespace {

// Shared by the shaders of all modules that have some: shaders/common/.
constexpr std::string_view kCommonShaderFolder = "common";
constexpr std::string_view kPublicFolder = "libmono3d/include/";

const std::regex& IncludeLine() {
  static const std::regex include(R"re(^\s*#\s*include\s*(["<])([^">]+)[">].*)re");
  return include;
}

// The first folder of `path` behind `prefix`; empty when `path` does not begin with it.
std::string FolderBehind(std::string_view path, std::string_view prefix) {
  if (!path.starts_with(prefix)) return {};
  path.remove_prefix(prefix.size());
  const std::size_t end = path.find('/');
  return end == std::string_view::npos ? std::string{} : std::string(path.substr(0, end));
}

// Why this include is not allowed; empty when it is.
std::string RejectionReason(const SourceFile& file, const std::string& included, bool quoted,
                            const ModuleTable& table) {
  const bool is_public = included.starts_with("mono3d/");
  if (!quoted) return is_public ? "a header of the library belongs in quotes" : "";
  const std::string target = FolderBehind(included, is_public ? "mono3d/" : "");
  if (included.find("..") != std::string::npos || target.empty()) {
    return "not the full path of a header";
  }
  if (!is_public && file.path.starts_with(kPublicFolder)) {
    return "a public header includes a private one";
  }
  if (file.path == kUmbrellaHeader && table.contains(target)) return "";
  const std::string module = ModuleOf(file.path);
  if (target == module || (target == kCommonShaderFolder && !is_public)) return "";
  if (!table.contains(target)) return "there is no module " + target;
  const auto own = table.find(module);
  if (own == table.end()) return module + " is not in the table of the modules";
  return own->second.contains(target) ? "" : module + " may not use " + target;
}

}  // namespace

ModuleTable ParseModuleTable(std::string_view text) {
  ModuleTable table;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    std::set<std::string>& uses = table[line.substr(0, colon)];
    std::istringstream words(line.substr(colon + 1));
    for (std::string word; words >> word;) uses.insert(word);
  }
  return table;
}

std::string ModuleOf(std::string_view path) {
  for (const std::string_view prefix :
       {"libmono3d/include/mono3d/", "libmono3d/src/", "shaders/"}) {
    std::string module = FolderBehind(path, prefix);
    if (!module.empty()) return module;
  }
  return {};
}

std::vector<std::string> FindIncludeViolations(const SourceFile& file, const ModuleTable& table) {
  std::vector<std::string> violations;
  for (std::size_t i = 0; i < file.lines.size(); ++i) {
    std::smatch match;
    if (!std::regex_match(file.lines[i], match, IncludeLine())) continue;
    const std::string why = RejectionReason(file, match[2], match[1] == "\"", table);
    if (why.empty()) continue;
    violations.push_back(file.path + ":" + std::to_string(i + 1) + ": \"" + match[2].str() +
                         "\": " + why);
  }
  return violations;
}

std::vector<std::string> FindHiddenUses(const std::vector<SourceFile>& files,
                                        const std::set<std::string, std::less<>>& beside) {
  std::set<std::string> paths;
  for (const SourceFile& file : files) paths.insert(file.path);
  std::vector<std::string> uses;
  for (const SourceFile& file : files) {
    if (!beside.contains(ModuleOf(file.path))) continue;
    for (const std::string& line : file.lines) {
      std::smatch match;
      if (!std::regex_match(line, match, IncludeLine())) continue;
      const std::string header = match[2];
      const std::string module = FolderBehind(header, "");
      if (module == "mono3d" || beside.contains(module)) continue;
      const std::string source = "libmono3d/src/" +
                                 header.substr(0, header.size() - std::string_view(".h").size()) +
                                 ".cpp";
      if (header.ends_with(".h") && paths.contains(source)) {
        uses.push_back(file.path + ": \"" + header + "\"");
      }
    }
  }
  return uses;
}

}  // namespace mono3d::house
