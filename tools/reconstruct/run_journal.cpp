// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/run_journal.h"

#include <chrono>
#include <exception>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#include "common/state_json.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/timing.h"
#include "mono3d/core/version.h"
#include "mono3d/pipeline/run_folder.h"

namespace mono3d::tools {
namespace {

namespace fs = std::filesystem;

// So much of a run is done again when it is killed, and what passed while the save was on its way
// to the disk, some tenths of a second: of the video, or of the run where that is slower. More
// where states take long to put together, see below.
constexpr double kSaveEvery_s = 4;
constexpr double kSaveEveryWall_s = 20;
// A run stands still while its state is put together: for no more than a tenth of the time.
constexpr double kMaxShareOfSaving = 0.1;

constexpr const char* kToolPart = "tool";
constexpr const char* kManifest = "manifest";

double JournalClock_s() { return 1e-3 * WallClockMs(); }

// By what the result of a run is determined. Where its surfels are makes no difference.
nlohmann::json IdentityOf(const RunRecord& record) {
  nlohmann::json identity = {
      {"version of mono3d", Version()}, {"input", record.input}, {"camera", record.camera}};
  for (const OptionField& option : record.options) {
    if (option.name.starts_with("fusion.storage.")) continue;
    nlohmann::json& value = identity["--" + option.name];
    std::visit([&](const auto* of_option) { value = *of_option; }, option.value);
    if (const auto word = WordOf(option)) value = *word;
  }
  return identity;
}

std::string Text(const nlohmann::json& identity, const std::string& name) {
  if (!identity.contains(name)) return "none";
  const nlohmann::json& value = identity.at(name);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

}  // namespace

RunJournal::RunJournal(const fs::path& run_folder, const RunRecord& record)
    : folder_(run_folder / kJournalFolder),
      identity_(IdentityOf(record)),
      states_(folder_),
      ended_wall_s_(JournalClock_s()) {}

nlohmann::json RunJournal::ReadState() {
  const std::string where = folder_.string();
  nlohmann::json state;
  try {
    const std::string bytes = states_.Get(kToolPart);
    state = StateFromCbor(bytes);
    const nlohmann::json& saved = state.at("identity");
    for (const auto& [name, value] : identity_.items()) {
      if (saved.contains(name) && saved.at(name) == value) continue;
      throw UsageError(ErrorParts{.what = "the run to resume had another " + name +
                                          ": give what it had, or start anew without --resume",
                                  .where = where,
                                  .expected = Text(saved, name),
                                  .found = Text(identity_, name)});
    }
    last_frame_ = state.at("last_frame").get<std::int64_t>();
    saved_video_s_ = state.at("timestamp_s").get<double>();
    return state.at("own");
  } catch (const nlohmann::json::exception& error) {
    throw Error(ErrorParts{.what = "the journal is damaged: start anew without --resume",
                           .where = where,
                           .expected = {},
                           .found = error.what()});
  }
}

RunJournal::~RunJournal() { Wait(); }

void RunJournal::SaveIfDue(std::int64_t frame_index, double timestamp_s, const PutState& put) {
  if (!saved_video_s_) saved_video_s_ = timestamp_s;
  const double waited_s = JournalClock_s() - ended_wall_s_;
  const bool is_due = timestamp_s >= *saved_video_s_ + kSaveEvery_s || waited_s >= kSaveEveryWall_s;
  if (!is_due || frame_index == last_frame_ || waited_s < duration_s_ / kMaxShareOfSaving) return;
  const bool is_disk_slow = on_its_way_.valid() && on_its_way_.wait_for(std::chrono::seconds(0)) !=
                                                       std::future_status::ready;
  if (is_disk_slow) return;
  saved_video_s_ = timestamp_s;
  Begin(frame_index, put);
}

void RunJournal::Save(std::int64_t frame_index, const PutState& put) {
  Wait();
  if (frame_index == last_frame_) return;
  Begin(frame_index, put);
  Wait();
}

void RunJournal::Begin(std::int64_t frame_index, const PutState& put) {
  Wait();
  const double start_s = JournalClock_s();
  try {
    const nlohmann::json state = {{"identity", identity_},
                                  {"last_frame", frame_index},
                                  {"timestamp_s", saved_video_s_.value_or(0)},
                                  {"own", put(states_)}};
    std::string bytes;
    nlohmann::json::to_cbor(state, bytes);
    states_.Put(kToolPart, bytes);
    frame_on_its_way_ = frame_index;
    on_its_way_ = std::async(std::launch::async, [this] { return states_.Commit(); });
  } catch (const std::exception& error) {
    states_.Discard();
    Warn(error);
  }
  ended_wall_s_ = JournalClock_s();
  duration_s_ = ended_wall_s_ - start_s;
}

void RunJournal::Wait() {
  if (!on_its_way_.valid()) return;
  try {
    const StateSaveCost cost = on_its_way_.get();
    last_frame_ = frame_on_its_way_;
    Log(LogLevel::kDebug, "journal: frame " + std::to_string(last_frame_) + ", " +
                              std::to_string(cost.bytes_new) + " bytes new of " +
                              std::to_string(cost.num_bytes) + ", the run stood still for " +
                              std::to_string(1e3 * duration_s_) + " ms");
  } catch (const std::exception& error) {
    Warn(error);  // Commit has given the save up
  }
}

void RunJournal::Warn(const std::exception& error) {
  if (!has_warned_) {
    Log(LogLevel::kWarning, "the journal cannot be written, the run goes on: " + WordsOf(error));
  }
  has_warned_ = true;
}

void RunJournal::Remove() {
  Wait();
  std::error_code failure;
  // Without its manifest the rest is none.
  fs::remove(folder_ / kManifest, failure);
  if (!failure) fs::remove_all(folder_, failure);
  if (failure) {
    throw Error(ErrorParts{.what = "cannot remove the journal of the run",
                           .where = folder_,
                           .expected = {},
                           .found = failure.message(),
                           .code = ErrorCode::kIo});
  }
}

std::optional<fs::path> FolderToResume(const fs::path& output) {
  std::vector<fs::path> folders = {output};
  std::error_code error;
  for (fs::directory_iterator it(output, error), end; !error && it != end; it.increment(error)) {
    if (it->path().filename().string().starts_with(kUnfinishedStem)) folders.push_back(it->path());
  }
  std::optional<fs::path> newest;
  fs::file_time_type newest_time;
  for (const fs::path& folder : folders) {
    const fs::file_time_type time = fs::last_write_time(folder / kJournalFolder / kManifest, error);
    if (error || (newest && time <= newest_time)) continue;
    newest = folder;
    newest_time = time;
  }
  return newest;
}

}  // namespace mono3d::tools
