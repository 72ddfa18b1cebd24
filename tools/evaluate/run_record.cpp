// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/run_record.h"

#include "common/json_file.h"
#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

double NumberAt(const Json& json, const std::string& pointer) {
  const Json::json_pointer at("/" + pointer);
  return json.contains(at) && json.at(at).is_number() ? json.at(at).get<double>() : 0;
}

std::string Count(const Json& json, const std::string& pointer) {
  return FormatFixed(NumberAt(json, pointer), 0);
}

Table CountTable(const Json& record) {
  Table table;
  table.title = "From frames to the model";
  table.columns = {"", "number"};
  table.rows = {{"frames", Count(record, "counts/frames")},
                {"tracked when they came", Count(record, "counts/tracked")},
                {"keyframes", Count(record, "counts/keyframes")},
                {"bundles", Count(record, "counts/bundles")},
                {"depth maps", Count(record, "counts/depth_maps")},
                {"depth maps fused", Count(record, "counts/fused")}};
  for (const char* kind : {"untracked_frames", "rejected_bundles", "rejected_depth_maps"}) {
    const Json::json_pointer at("/counts/" + std::string(kind));
    if (!record.contains(at) || !record.at(at).is_object()) continue;
    for (const auto& [reason, count] : record.at(at).items()) {
      std::string words = kind;
      words.replace(words.find('_'), 1, " ");
      for (char& c : words) c = c == '_' ? ' ' : c;
      table.rows.push_back({words + ": " + reason, count.dump()});
    }
  }
  return table;
}

Table TimeTable(const Json& record) {
  const double frames = NumberAt(record, "counts/frames");
  const double wall_s = NumberAt(record, "times/wall_s");
  const double cpu_s = NumberAt(record, "times/cpu_s");
  Table table;
  table.title = "Time and memory";
  table.columns = {"", "whole run", "per frame"};
  const auto per_frame = [&](double seconds) {
    return frames > 0 ? FormatNumber(1e3 * seconds / frames, 3) + " ms" : "-";
  };
  table.rows = {
      {"wall clock", FormatNumber(wall_s, 3) + " s", per_frame(wall_s)},
      {"processor, all threads", FormatNumber(cpu_s, 3) + " s", per_frame(cpu_s)},
      {"peak memory", FormatNumber(1e-6 * NumberAt(record, "peak_memory_bytes"), 3) + " MB", "-"}};
  const Json::json_pointer device("/device/name");
  if (record.contains(device) && record.at(device).is_string()) {
    table.notes = {"Device: " + record.at(device).get<std::string>()};
  }
  return table;
}

Table StageTable(const Json& record) {
  Table table;
  table.title = "Times of the stages";
  table.columns = {"stage", "calls", "wall ms", "device ms", "ms per call"};
  const Json stages = record.value("stages", Json::object());
  for (const auto& [stage, times] : stages.items()) {
    const double calls = NumberAt(times, "calls");
    const double wall_ms = NumberAt(times, "wall_ms");
    const double gpu_ms = NumberAt(times, "gpu_ms");
    table.rows.push_back(
        {stage, FormatFixed(calls, 0), FormatFixed(wall_ms, 0), FormatFixed(gpu_ms, 0),
         calls > 0 ? FormatNumber((wall_ms > 0 ? wall_ms : gpu_ms) / calls, 3) : "-"});
  }
  table.notes = {
      "Device time of a stage that runs in another's call is part of that call's wall "
      "time."};
  return table;
}

Table OptionTable(const Json& record) {
  Table table;
  table.title = "Options";
  table.columns = {"option", "value"};
  const Json options = record.value("options", Json::object());
  for (const auto& [name, value] : options.items()) {
    table.rows.push_back({name, value.is_string()
                                    ? value.get<std::string>()
                                    : value.dump(-1, ' ', false, Json::error_handler_t::replace)});
  }
  return table;
}

}  // namespace

Json ReadRecord(const std::filesystem::path& path) {
  const Json json = ReadJsonFile<Json>(path);
  if (json.is_discarded() || !json.is_object()) {
    throw Error(ErrorParts{.what = "not the record of a run",
                           .where = path.string(),
                           .expected = "a JSON object",
                           .found = "something else"});
  }
  return json;
}

Section RecordSection(const Json& record) {
  Section section;
  section.title = kRecordTitle;
  section.tables = {CountTable(record), TimeTable(record)};
  section.folded_tables = {StageTable(record), OptionTable(record)};
  return section;
}

}  // namespace mono3d::tools
