// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "house/definitions.h"

#include <array>
#include <cctype>
#include <map>
#include <regex>
#include <utility>

#include "house/include_rules.h"

namespace mono3d::house {
namespace {

// The sources that are compiled into one target: those of a module, of its tests or of a folder of
// the tools; a tool itself is a target of its own.
std::string TargetOf(const std::string& path) {
  const std::string module = ModuleOf(path);
  if (!module.empty()) return module;
  static const std::regex kTests("tests/(?:reference/)?([^/]+)/.*");
  static const std::regex kTools("tools/([^/]+)/.*");
  std::smatch match;
  if (std::regex_match(path, match, kTests)) return "tests of " + match[1].str();
  if (std::regex_match(path, match, kTools)) return "tools, " + match[1].str();
  return path;
}

bool BeginsDeclaration(const std::string& line) {
  if (line.empty()) return false;
  return line[0] == '[' || std::isalpha(static_cast<unsigned char>(line[0])) != 0;
}

// "<target>/<name>" with the sources that have it; `names_of` reads one source.
template <typename NamesOf>
std::map<std::pair<std::string, std::string>, std::set<std::string>> SourcesByName(
    const std::vector<SourceFile>& sources, const NamesOf& names_of) {
  std::map<std::pair<std::string, std::string>, std::set<std::string>> found;
  for (const SourceFile& source : sources) {
    for (const std::string& name : names_of(source)) {
      found[{TargetOf(source.path), name}].insert(source.path);
    }
  }
  return found;
}

std::string Described(const std::string& name, const std::set<std::string>& sources) {
  std::string text = name + ":";
  for (const std::string& source : sources) text += " " + source;
  return text;
}

// The name that a line of an unnamed namespace declares; empty when it declares none.
std::string DeclaredName(const std::string& line) {
  static const std::regex kType(R"(^(?:struct|class|enum class|enum|union)\s+(\w+)\b(?!::).*)");
  static const std::regex kAlias(R"(^using\s+(\w+)\s*=.*)");
  static const std::regex kMatcher(R"(^MATCHER\w*\((\w+).*)");
  static const std::regex kArguments("<[^<>]*>");  // of the innermost templates
  static const std::regex kAttribute(R"(^\[\[\w+\]\]\s*)");
  static const std::regex kValue(R"(^[\w:&*\s]*?\b(\w+)\s*(?:\(|=|\{|\[|;).*)");
  static const std::regex kNoName(
      R"(^(?:using|template|return|namespace|static_assert|public|private|TEST|TEST_F|TEST_P|)"
      R"(INSTANTIATE_\w+|MATCHER\w*)\b.*)");
  std::smatch match;
  for (const std::regex* form : {&kType, &kAlias, &kMatcher}) {
    if (std::regex_match(line, match, *form)) return match[1];
  }
  if (std::regex_match(line, kNoName)) return {};
  std::string value = std::regex_replace(line, kAttribute, "");
  for (std::string before; before != value;) {
    before = value;
    value = std::regex_replace(before, kArguments, "");
  }
  return std::regex_match(value, match, kValue) ? match[1].str() : std::string();
}

}  // namespace

std::set<std::string> ClassesDefinedIn(const SourceFile& source) {
  static const std::regex kMember(R"(^[^=]*?\b([A-Z]\w*)::(?:\w+::)*(?:~?\w+|operator\W+)\(.*)");
  std::set<std::string> classes;
  for (const std::string& line : CodeOnly(source.lines)) {
    std::smatch match;
    if (BeginsDeclaration(line) && std::regex_match(line, match, kMember)) classes.insert(match[1]);
  }
  return classes;
}

std::vector<std::string> FindSplitClasses(const std::vector<SourceFile>& sources) {
  // Return types and arguments are read as classes too: those of libraries.
  static const std::set<std::string> kOutside = {"Eigen"};
  std::vector<std::string> split;
  for (const auto& [name, paths] : SourcesByName(sources, ClassesDefinedIn)) {
    if (paths.size() > 1 && !kOutside.contains(name.second)) {
      split.push_back(Described(name.second, paths));
    }
  }
  return split;
}

std::set<std::string> UnnamedNames(const SourceFile& source) {
  std::set<std::string> names;
  bool is_unnamed = false;
  const std::vector<std::string> code = CodeOnly(source.lines);
  for (std::size_t i = 0; i < code.size(); ++i) {
    if (source.lines[i] == "namespace {") is_unnamed = true;
    if (source.lines[i] == "}  // namespace") is_unnamed = false;
    if (!is_unnamed || !BeginsDeclaration(code[i])) continue;
    const std::string name = DeclaredName(code[i]);
    if (!name.empty()) names.insert(name);
  }
  return names;
}

std::vector<std::string> FindSharedNames(const std::vector<SourceFile>& sources) {
  std::vector<std::string> shared;
  for (const auto& [name, paths] : SourcesByName(sources, UnnamedNames)) {
    if (paths.size() > 1 && name.second != "ToJson") {
      shared.push_back(Described(name.second, paths));
    }
  }
  return shared;
}

}  // namespace mono3d::house
