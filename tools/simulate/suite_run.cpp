// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "simulate/suite_run.h"

#include <fnmatch.h>

#include <array>
#include <cstdio>

#include "common/json_file.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

using synthetic::FlightStatistics;
using synthetic::Spread;
using synthetic::SuiteSequence;

template <typename... Values>
std::string Format(const char* format, Values... values) {
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), format, values...);
  return line.data();
}

std::string Row(const char* name, const FlightStatistics& s, double Spread::*part) {
  return Format("  %-6s %8.2f %10.4f %8.2f %8.2f", name, s.height_m.*part,
                s.angular_velocity_rad_per_s.*part, s.frames_per_s.*part, s.speed_m_per_s.*part);
}

}  // namespace

std::vector<SuiteSequence> SelectSequences(std::vector<SuiteSequence> suite,
                                           const std::string& pattern) {
  if (pattern.empty()) return suite;
  std::erase_if(suite, [&](const SuiteSequence& sequence) {
    return fnmatch(pattern.c_str(), sequence.name.c_str(), 0) != 0;
  });
  if (suite.empty()) {
    throw UsageError(ErrorParts{.what = "no sequence of the suite has such a name",
                                .where = "--only",
                                .expected = "a pattern like \"*_town_*\"",
                                .found = pattern});
  }
  return suite;
}

std::string FlightTable(const synthetic::FlightSamples& samples, double mean_depth_m) {
  const FlightStatistics paper = synthetic::PaperFlights();
  const FlightStatistics ours = synthetic::Summarise(samples);
  std::string text = Format("%-47s    %s\n", "  the paper, Table 1", "  these sequences");
  const char* head = "            height   angular      fps    speed";
  text += Format("%s   %s\n", head, head);
  const char* units = "                 m     rad/s      1/s      m/s";
  text += Format("%s   %s\n", units, units);
  const std::array<std::pair<const char*, double Spread::*>, 4> rows = {{{"mean", &Spread::mean},
                                                                         {"sigma", &Spread::sigma},
                                                                         {"min", &Spread::min},
                                                                         {"max", &Spread::max}}};
  for (const auto& [name, part] : rows) {
    text += Row(name, paper, part) + "   " + Row(name, ours, part) + "\n";
  }
  text += Format("  images %-39s    images %zu\n", "about 24000", samples.height_m.size());
  if (mean_depth_m > 0) {
    text += Format("  mean depth %.1f m %28s   mean depth %.1f m\n", synthetic::kPaperMeanDepth_m,
                   "", mean_depth_m);
  }
  return text;
}

std::string PlanTable(const std::vector<SuiteSequence>& suite) {
  std::string text = Format("%-46s %6s %8s %8s %8s %6s\n", "sequence", "images", "height", "speed",
                            "angular", "fps");
  for (const SuiteSequence& sequence : suite) {
    const synthetic::FlightSamples samples = synthetic::PlanFlights({sequence});
    const FlightStatistics statistics = synthetic::Summarise(samples);
    text += Format("%-46s %6zu %8.1f %8.2f %8.4f %6.2f\n", sequence.name.c_str(),
                   samples.height_m.size(), statistics.height_m.mean, statistics.speed_m_per_s.mean,
                   statistics.angular_velocity_rad_per_s.mean, statistics.frames_per_s.mean);
  }
  return text;
}

std::string FolderTable(const std::vector<SuiteSequence>& suite,
                        const std::filesystem::path& folder) {
  synthetic::FlightSamples samples;
  double depth_sum_m = 0;
  for (const SuiteSequence& sequence : suite) {
    const auto record = ReadJsonFile<SequenceRecord>(folder / sequence.name / "sequence.json");
    if (!record.is_object() || !record.contains("complete") || !IsComplete(record)) continue;
    const synthetic::FlightSamples own = ReadSamples(folder / sequence.name, record);
    samples.Append(own);
    depth_sum_m +=
        static_cast<double>(own.height_m.size()) * record.at("mean_depth_m").get<double>();
  }
  if (samples.height_m.empty()) return "no sequence is complete\n";
  return FlightTable(samples, depth_sum_m / static_cast<double>(samples.height_m.size()));
}

}  // namespace mono3d::tools
