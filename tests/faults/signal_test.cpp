// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Signals at any moment of a run. MONO3D_SIGNAL_MOMENTS: at so many moments for each signal,
// instead of a few.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
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

const std::vector<std::string> kInOrder = {"--max-frames", "16"};
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

  static void Print(const std::string& name, const std::map<std::string, int>& num) {
    std::cout << "| " << name << " |";
    for (const auto& [what, count] : num) std::cout << " " << what << ": " << count << ";";
    std::cout << std::endl;
  }

  const std::string& model() const { return model_; }

  std::optional<SmallReconstruction> run_;

 private:
  std::mt19937 random_{20261123};
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
    EXPECT_EQ(FaultsOfFiles(run.output(), RunState::kFailed), "") << place;
    if (run.IsEarlierRunGone()) {
      EXPECT_EQ(NamesOfFiles(run.output()), whole) << place;
    } else {
      EXPECT_EQ(run.ChangeOfEarlierRun(), "") << place;
    }
  }
}

}  // namespace
}  // namespace mono3d::faults
