// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "house/include_cycles.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string_view>

namespace mono3d::house {
namespace {

using Graph = std::map<std::string, std::set<std::string>>;

std::string WithoutExtension(const std::string& path) {
  return std::filesystem::path(path).replace_extension().generic_string();
}

// The unit that a file belongs to; a public header as it is included.
std::string UnitOf(const std::string& path) {
  for (const std::string_view prefix : {"libmono3d/include/", "libmono3d/src/"}) {
    if (path.starts_with(prefix)) return WithoutExtension(path.substr(prefix.size()));
  }
  return WithoutExtension(path);
}

Graph ReadGraph(const std::vector<SourceFile>& files) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s*"([^"]+)".*)re");
  Graph graph;
  for (const SourceFile& file : files) graph[UnitOf(file.path)];
  for (const SourceFile& file : files) {
    const std::string unit = UnitOf(file.path);
    for (const std::string& line : file.lines) {
      std::smatch match;
      if (!std::regex_match(line, match, kInclude)) continue;
      const std::string included = WithoutExtension(match[1]);
      // Sources of the tools include each other without the name of their folder.
      for (const std::string& candidate : {included, "tools/" + included}) {
        if (candidate != unit && graph.contains(candidate)) graph[unit].insert(candidate);
      }
    }
  }
  return graph;
}

// All units that `unit` includes, directly or through others.
std::set<std::string> ReachableFrom(const Graph& graph, const std::string& unit) {
  std::set<std::string> reached;
  std::vector<std::string> open = {unit};
  while (!open.empty()) {
    const std::string next = open.back();
    open.pop_back();
    for (const std::string& included : graph.at(next)) {
      if (reached.insert(included).second) open.push_back(included);
    }
  }
  return reached;
}

}  // namespace

std::vector<std::string> FindIncludeCycles(const std::vector<SourceFile>& files) {
  const Graph graph = ReadGraph(files);
  std::map<std::string, std::set<std::string>> reachable;
  for (const auto& [unit, included] : graph) reachable[unit] = ReachableFrom(graph, unit);
  std::set<std::string> cycles;
  for (const auto& [unit, reached] : reachable) {
    if (!reached.contains(unit)) continue;
    std::string cycle;
    for (const std::string& other : reached) {
      if (!reachable.at(other).contains(unit)) continue;
      cycle += (cycle.empty() ? "" : ", ") + other;
    }
    cycles.insert(cycle);
  }
  return {cycles.begin(), cycles.end()};
}

}  // namespace mono3d::house
