// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Signals at any moment of a run. MONO3D_SIGNAL_MOMENTS: at so many moments for each signal,
// instead of a few; MONO3D_SIGNAL_SEED: at others.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "faults/result_files.h"
#include "faults/small_reconstruction.h"
#include "io/temporary_folder.h"

namespace mono3d::faults {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

int NumMoments(int usual) {
  const char* text = std::getenv("MONO3D_SIGNAL_MOMENTS");
  return text == nullptr ? usual : std::atoi(text);
}

unsigned Seed() {
  const char* text = std::getenv("MONO3D_SIGNAL_SEED");
  return text == nullptr ? 20261123U : static_cast<unsigned>(std::atoi(text));
}

const std::vector<std::string> kInOrder = {"--max-frames", "16"};
const std::vector<std::string> kPhotographs = {"--max-frames", "16", "--photos"};
const std::vector<std::string> kLive = {"--max-frames", "30", "--live", "--fps", "12"};

// Any moment is right: whatever it finds, the outcome is checked. So time may be wrong as long as
// the moments lie everywhere.
class Signals : public TemporaryFolderTest {
 protected:
  // The moments are those of one kind of run, which takes `duration_s`.
  void Begin(const std::vector<std::string>& extra) {
    run_.emplace(folder_, extra);
    run_->MakeEarlierRun();
    const Clock::time_point begin = Clock::now();
    const EndedRun run = run_->Run({});
    duration_s_ = SecondsSince(begin);
    ASSERT_TRUE(run.exit_status == 0 || HasTooFewImages(run)) << run.errors;
    model_ = ReadText(run_->output() / "model.ply");
  }

  // Sends `signal` at a random moment, and `then` (if any) half a second later.
  EndedRun RunWith(int signal, int then = 0) {
    constexpr double kPause_s = 0.5;
    const double moment_s = std::uniform_real_distribution<>(0, duration_s_)(random_);
    const Clock::time_point begin = Clock::now();
    int num_sent = 0;
    return run_->Run({}, [&](pid_t process) {
      const double now_s = SecondsSince(begin);
      if (num_sent == 0 && now_s >= moment_s) {
        kill(process, signal);
        ++num_sent;
      }
      if (num_sent == 1 && then != 0 && now_s >= moment_s + kPause_s) {
        kill(process, then);
        ++num_sent;
      }
    });
  }

  // A live run drops images where the machine is busy.
  static bool HasTooFewImages(const EndedRun& run) {
    return run.exit_status == 1 && run.errors.find("no model") != std::string::npos;
  }

  // The earlier result is there, or the new one in its place.
  void ExpectWholeFiles(RunState state) const {
    EXPECT_EQ(FaultsOfFiles(run_->output(), state), "");
    const bool is_mended = state == RunState::kKilled && !run_->ChangeOfEarlierRun().empty();
    // A run that fails at once mends it all the same.
    if (is_mended) (void)SmallReconstruction(folder_, {"--max-frames", "3"}).Run({});
    EXPECT_TRUE(run_->ChangeOfEarlierRun().empty() || run_->IsEarlierRunGone())
        << run_->ChangeOfEarlierRun();
  }

  // The files of a killed run are whole, and the next run into its folder works.
  void TryToKill(int num_moments) {
    std::map<std::string, int> num;
    for (int i = 0; i < num_moments; ++i) {
      run_->MakeEarlierRun();
      const EndedRun run = RunWith(SIGKILL);
      ++num[run.signal == SIGKILL ? "killed" : "ended before"];
      ASSERT_TRUE(run.signal == SIGKILL || run.exit_status == 0 || HasTooFewImages(run))
          << run.errors;
      ASSERT_NO_FATAL_FAILURE(ExpectWholeFiles(RunState::kKilled));
      if (i % 10 != 0) continue;
      const EndedRun next = SmallReconstruction(folder_, kInOrder).Run({});
      ASSERT_EQ(next.exit_status, 0) << next.errors;
      EXPECT_TRUE(run_->IsEarlierRunGone());
    }
    Print("SIGKILL", num);
  }

  // What asks for an end ends in order: with what there was, or as before the first image.
  void TryToStop(int signal, const std::string& name, int num_moments) {
    std::map<std::string, int> num;
    for (int i = 0; i < num_moments; ++i) {
      run_->MakeEarlierRun();
      const EndedRun run = RunWith(signal);
      ASSERT_FALSE(run.has_hung);
      ASSERT_NO_FATAL_FAILURE(
          ExpectWholeFiles(run.signal != 0 ? RunState::kKilled : RunState::kFailed));
      if (run.signal != 0) {  // before it reads images
        ASSERT_EQ(run.signal, signal);
        EXPECT_EQ(run_->ChangeOfEarlierRun(), "");
        EXPECT_FALSE(std::filesystem::exists(run_->output() / "unfinished_1/trajectory.txt"));
        ++num["ended before the first image"];
      } else if (run_->IsEarlierRunGone()) {
        ASSERT_EQ(run.exit_status, 0) << run.errors;
        ++num["ended before"];
      } else {
        const std::filesystem::path record = run_->output() / "unfinished_1/run.json";
        const std::string end = nlohmann::json::parse(std::ifstream(record))["end"];
        EXPECT_TRUE(end == "stopped" || HasTooFewImages(run)) << end;
        const bool has_model = std::filesystem::exists(run_->output() / "unfinished_1/model.ply");
        EXPECT_EQ(run.exit_status, has_model ? 0 : 1) << run.errors;
        ++num[has_model ? "stopped with a model" : "stopped before the model"];
      }
    }
    Print(name, num);
  }

  // What a run leaves, but for that which tells when it was.
  static std::map<std::string, std::string> ResultsIn(const std::filesystem::path& folder) {
    std::map<std::string, std::string> results;
    for (const std::string& name : NamesOfFiles(folder)) {
      if (name != "run.json" && name != "report.html") results[name] = ReadText(folder / name);
    }
    return results;
  }

  static void Print(const std::string& name, const std::map<std::string, int>& num) {
    std::cout << "| " << name << " |";
    for (const auto& [what, count] : num) std::cout << " " << what << ": " << count << ";";
    std::cout << std::endl;
  }

  const std::string& model() const { return model_; }

  std::optional<SmallReconstruction> run_;

 private:
  std::mt19937 random_{Seed()};
  double duration_s_ = 0;
  std::string model_;
};

TEST_F(Signals, KillLeavesWholeFilesAndTheEarlierResult) {
  ASSERT_NO_FATAL_FAILURE(Begin(kInOrder));
  TryToKill(NumMoments(3));
}

TEST_F(Signals, KillOfALiveRunLeavesWholeFilesAndTheEarlierResult) {
  ASSERT_NO_FATAL_FAILURE(Begin(kLive));
  TryToKill(NumMoments(1));
}

TEST_F(Signals, StopEndsInOrder) {
  ASSERT_NO_FATAL_FAILURE(Begin(kInOrder));
  TryToStop(SIGTERM, "SIGTERM", NumMoments(1));
  TryToStop(SIGINT, "SIGINT", NumMoments(1));
  TryToStop(SIGHUP, "SIGHUP", NumMoments(1));
}

TEST_F(Signals, StopOfALiveRunEndsInOrder) {
  ASSERT_NO_FATAL_FAILURE(Begin(kLive));
  TryToStop(SIGTERM, "SIGTERM, live", NumMoments(1));
  TryToStop(SIGINT, "SIGINT, live", NumMoments(0));
  TryToStop(SIGHUP, "SIGHUP, live", NumMoments(0));
}

TEST_F(Signals, StopOfPhotographsEndsInOrder) {
  ASSERT_NO_FATAL_FAILURE(Begin(kPhotographs));
  TryToStop(SIGTERM, "SIGTERM, photographs", NumMoments(2));
  TryToStop(SIGINT, "SIGINT, photographs", NumMoments(0));
}

TEST_F(Signals, APauseChangesNothing) {
  ASSERT_NO_FATAL_FAILURE(Begin(kInOrder));
  std::map<std::string, int> num;
  for (int i = 0; i < NumMoments(1); ++i) {
    run_->MakeEarlierRun();
    const EndedRun run = RunWith(SIGSTOP, SIGCONT);
    ASSERT_EQ(run.exit_status, 0) << run.errors;
    ASSERT_NO_FATAL_FAILURE(ExpectWholeFiles(RunState::kFailed));
    EXPECT_TRUE(ReadText(run_->output() / "model.ply") == model());
    ++num["same model"];
  }
  Print("SIGSTOP", num);
}

TEST_F(Signals, APauseOfALiveRunIsSurvived) {
  ASSERT_NO_FATAL_FAILURE(Begin(kLive));
  std::map<std::string, int> num;
  for (int i = 0; i < NumMoments(1); ++i) {
    run_->MakeEarlierRun();
    const EndedRun run = RunWith(SIGSTOP, SIGCONT);
    // Frames are dropped: there may be too few for a model.
    ASSERT_TRUE(run.exit_status == 0 || HasTooFewImages(run)) << run.exit_status << run.errors;
    ASSERT_NO_FATAL_FAILURE(ExpectWholeFiles(RunState::kFailed));
    ++num[run.exit_status == 0 ? "model" : "no model"];
  }
  Print("SIGSTOP, live", num);
}

// Which of the images of a folder of its own a run has opened: in its last pass, those of the
// frames that it has come to.
class OpenedImages {
 public:
  explicit OpenedImages(const std::filesystem::path& folder)
      : events_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
    inotify_add_watch(events_, folder.c_str(), IN_OPEN);
  }
  ~OpenedImages() { close(events_); }
  OpenedImages(const OpenedImages&) = delete;
  OpenedImages& operator=(const OpenedImages&) = delete;

  // To be called again and again: the system keeps a limited number of events.
  void Look() {
    alignas(inotify_event) std::array<char, 4096> bytes{};
    ssize_t num_bytes = 0;
    while ((num_bytes = read(events_, bytes.data(), bytes.size())) > 0) {
      for (ssize_t at = 0; at < num_bytes;) {
        const auto* event = reinterpret_cast<const inotify_event*>(bytes.data() + at);
        if (event->len > 0) Opened(std::atoi(event->name));
        at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      }
    }
  }
  // How often they were gone through: what is beside the images is looked for first.
  int num_passes() const { return num_passes_; }
  int latest() const { return latest_; }  // the number in its name

 private:
  void Opened(int number) {
    if (number < latest_) ++num_passes_;
    latest_ = number;
  }

  int events_;
  int num_passes_ = 1;
  int latest_ = -1;
};

// Two images a second: 5 s of video pass between two saves, and no run is so fast that it may not
// save as often.
TEST_F(Signals, AKilledRunThatIsResumedComesToTheResultOfOneThatWasNot) {
  constexpr double kRate_hz = 2;
  const std::filesystem::path images = folder_ / "images";
  std::filesystem::copy(std::filesystem::path(MONO3D_EXAMPLE) / "images", images);
  const SmallReconstruction run(folder_, {"--fps", std::to_string(kRate_hz)}, images);
  const Clock::time_point begin = Clock::now();
  OpenedImages all_opened(images);
  ASSERT_EQ(run.Run({}, [&](pid_t) { all_opened.Look(); }).exit_status, 0);
  all_opened.Look();
  const double duration_s = SecondsSince(begin);
  const std::map<std::string, std::string> whole = ResultsIn(run.output());

  std::mt19937 random(Seed());
  std::map<std::string, int> num;
  int num_frames_again = 0;
  for (int i = 0; i < NumMoments(2); ++i) {
    std::filesystem::remove_all(run.output());
    const double moment_s = std::uniform_real_distribution<>(0, duration_s)(random);
    const Clock::time_point start = Clock::now();
    OpenedImages opened(images);
    bool is_sent = false;
    const EndedRun killed = run.Run({}, [&](pid_t process) {
      if (is_sent) return;
      opened.Look();
      is_sent = SecondsSince(start) >= moment_s;
      if (is_sent) kill(process, SIGKILL);
    });
    opened.Look();
    const bool had_begun = opened.num_passes() == all_opened.num_passes();
    ASSERT_TRUE(killed.signal == SIGKILL || killed.exit_status == 0) << killed.errors;
    if (std::filesystem::exists(run.output())) {
      EXPECT_EQ(FaultsOfFiles(run.output(), RunState::kKilled), "");
    }
    // Its journal is removed once it is.
    const bool was_whole = std::filesystem::exists(run.output() / "report.html") &&
                           !std::filesystem::exists(run.output() / "journal/manifest");
    const EndedRun resumed = run.Run({}, {}, {"--resume"});
    ASSERT_EQ(resumed.exit_status, 0) << resumed.errors;
    EXPECT_EQ(FaultsOfFiles(run.output(), RunState::kWhole), "");
    EXPECT_TRUE(ResultsIn(run.output()) == whole) << "killed after " << moment_s << " s";
    const nlohmann::json record = nlohmann::json::parse(std::ifstream(run.output() / "run.json"));
    const bool was_resumed = record.contains("resumed_after_frames");
    const int saved = was_resumed ? record["resumed_after_frames"].back().get<int>() : -1;
    if (killed.signal != SIGKILL) {
      ++num["ended before"];
    } else if (was_whole) {
      ++num["was whole"];
    } else {
      ++num[was_resumed ? "resumed" : had_begun ? "nothing saved yet" : "before the first frame"];
      if (had_begun) num_frames_again = std::max(num_frames_again, opened.latest() - saved);
    }
  }
  Print("SIGKILL, then --resume", num);
  std::cout << "at most " << num_frames_again / kRate_hz << " s of video done again" << std::endl;
}

// At each place where the new run takes the place of the earlier one.
TEST_F(Signals, KillWhileTheNewRunTakesThePlaceOfTheEarlierOneIsMended) {
  const SmallReconstruction run(folder_, kInOrder);
  const std::filesystem::path counts = folder_ / "counts.txt";
  run.MakeEarlierRun();
  Environment environment = FileFaults(folder_, "none:0");
  environment["MONO3D_FAULT_COUNTS"] = counts;
  ASSERT_EQ(run.Run(environment).exit_status, 0);
  const std::set<std::string> whole = NamesOfFiles(run.output());
  std::map<std::string, long> num_calls;
  {
    std::ifstream file(counts);
    std::string kind;
    for (long count = 0; file >> kind >> count;) num_calls[kind] = count;
  }
  // The last of all renames are those of the files: one for each.
  const long num_files = static_cast<long>(whole.size());
  const long num_renames = num_calls["rename"];
  ASSERT_GT(num_renames, num_files);
  const int num_moments = NumMoments(2);
  for (int i = 0; i < num_moments; ++i) {
    run.MakeEarlierRun();
    const long place = num_renames - (2 * i + 1) * (num_files + 8) / (2 * num_moments);
    const EndedRun killed =
        run.Run(FileFaults(folder_, "rename:" + std::to_string(place) + ":kill"));
    ASSERT_EQ(killed.signal, SIGKILL) << killed.errors;
    // A run that fails at once: it mends the folder all the same.
    const SmallReconstruction next(folder_, {"--max-frames", "3"});
    EXPECT_EQ(next.Run({}).exit_status, 1);
    // Before it took the place of the earlier one, it may have left a file half written.
    const bool has_taken_place = run.IsEarlierRunGone();
    const RunState state = has_taken_place ? RunState::kFailed : RunState::kKilled;
    EXPECT_EQ(FaultsOfFiles(run.output(), state), "") << place;
    if (has_taken_place) {
      EXPECT_EQ(NamesOfFiles(run.output()), whole) << place;
    } else {
      EXPECT_EQ(run.ChangeOfEarlierRun(), "") << place;
    }
  }
}

}  // namespace
}  // namespace mono3d::faults
