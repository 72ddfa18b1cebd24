// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Each call that may fail fails once, one after the other: the run ends in order, with what there
// was, and says so. MONO3D_FAULTS_PER_KIND: so many places of each kind, 0: all of them; without it
// one of some kinds. MONO3D_FAULT_KINDS: only these, separated by commas.

#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <set>
#include <string>
#include <vector>

#include "faults/result_files.h"
#include "faults/small_reconstruction.h"
#include "io/temporary_folder.h"

namespace mono3d::faults {
namespace {

using Counts = std::map<std::string, long>;
using MakeEnvironment = Environment (*)(const std::filesystem::path&, const std::string&);

Environment DeviceFaultsOf(const std::filesystem::path& /*folder*/, const std::string& fault) {
  return DeviceFaults(fault);
}

// At most `wanted` places out of `count`, spread evenly, from 1. 0: all; less: none.
std::vector<long> Places(long count, long wanted) {
  std::vector<long> places;
  const long num = wanted == 0 ? count : std::clamp(wanted, 0L, count);
  for (long i = 0; i < num; ++i) places.push_back(1 + (2 * i + 1) * count / (2 * num));
  return places;
}

// So many places of each kind; without a wish one of the kinds `usual`.
long NumPlaces(const std::string& kind, const std::set<std::string>& usual) {
  const char* kinds = std::getenv("MONO3D_FAULT_KINDS");
  const std::string wanted = kinds == nullptr ? "" : "," + std::string(kinds) + ",";
  if (!wanted.empty() && wanted.find("," + kind + ",") == std::string::npos) return -1;
  const char* per_kind = std::getenv("MONO3D_FAULTS_PER_KIND");
  if (per_kind != nullptr) return std::atol(per_kind);
  return usual.contains(kind) ? 1 : -1;
}

std::string Summary(const EndedRun& run) {
  if (run.has_hung) return "it hangs";
  if (run.signal != 0) return "ended by signal " + std::to_string(run.signal);
  return "exit status " + std::to_string(run.exit_status);
}

class Faults : public TemporaryFolderTest {
 protected:
  // Runs without a fault, and counts.
  void Count(MakeEnvironment make) {
    counts_.clear();
    const std::filesystem::path counts = folder_ / "counts.txt";
    std::filesystem::remove(counts);
    Environment environment = make(folder_, "none:0");
    environment["MONO3D_FAULT_COUNTS"] = counts;
    run_.MakeEarlierRun();
    const EndedRun run = run_.Run(environment);
    ASSERT_EQ(run.exit_status, 0) << run.errors;
    ASSERT_EQ(FaultsOfFiles(run_.output(), RunState::kWhole), "");
    whole_ = NamesOfFiles(run_.output());
    std::ifstream file(counts);
    std::string kind;
    for (long count = 0; file >> kind >> count;) counts_[kind] += count;
    ASSERT_FALSE(counts_.empty());
  }

  // What is wrong with the end of a run with this fault; empty: nothing.
  std::string Complaint(const std::string& kind, const EndedRun& run) const {
    if (run.exit_status != 0 && run.exit_status != 1) return Summary(run) + ": " + run.errors;
    std::string complaint;
    // What cannot be removed stays.
    const RunState state = kind == "remove"       ? RunState::kKilled
                           : run.exit_status == 0 ? RunState::kWhole
                                                  : RunState::kFailed;
    const std::string faults = FaultsOfFiles(run_.output(), state);
    if (!faults.empty()) complaint += "; files that are not whole:" + faults;
    const long num_errors = CountOf(run.errors, "mono3d-reconstruct: error: ");
    if (num_errors != run.exit_status) complaint += "; lines of errors: " + run.errors;
    const bool is_changed = !run_.ChangeOfEarlierRun().empty();
    if (run.exit_status != 0 && is_changed && !run_.IsEarlierRunGone()) {
      complaint += "; of the earlier result is not as it was:" + run_.ChangeOfEarlierRun();
    }
    if (run.exit_status == 0 && run.errors.empty() && NamesOfFiles(run_.output()) != whole_) {
      complaint += "; files are missing or too many, without a word";
    }
    if (run.exit_status == 0 && !run_.IsEarlierRunGone()) {
      complaint += "; exit status 0, and the earlier result is there";
    }
    return complaint;
  }

  // Of one kind alone, where that is named.
  void TryAll(MakeEnvironment make, const std::set<std::string>& usual,
              const std::string& only = {}) {
    ASSERT_NO_FATAL_FAILURE(Count(make));
    for (const auto& [kind, count] : counts_) {
      if (!only.empty() && kind != only) continue;
      const std::vector<long> places = Places(count, NumPlaces(kind, usual));
      if (places.empty()) continue;
      long num_tried = 0;
      long num_survived = 0;
      std::map<int, long> num_of_status;
      for (const long place : places) {
        const std::string fault = kind + ":" + std::to_string(place);
        run_.MakeEarlierRun();
        const EndedRun run = run_.Run(make(folder_, fault));
        const std::string complaint = Complaint(kind, run);
        EXPECT_EQ(complaint, "") << fault << ", " << Summary(run) << "\n" << run.errors;
        ++num_tried;
        ++num_of_status[run.exit_status];
        if (complaint.empty()) ++num_survived;
      }
      std::cout << "| " << kind << " | " << count << " | " << num_tried << " | " << num_survived
                << " | " << num_of_status[0] << " |" << std::endl;
    }
  }

  static long CountOf(const std::string& text, const std::string& part) {
    long count = 0;
    for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
    return count;
  }

  SmallReconstruction run_{folder_, {"--max-frames", "16", "--mesh"}};
  Counts counts_;
  std::set<std::string> whole_;
};

TEST_F(Faults, CallsOfFilesAndMemoryFailOnce) {
  TryAll(FileFaults, {"open", "open_stream", "write", "rename", "remove", "list_folder",
                      "decode_image", "memory", "image_memory"});
}

TEST_F(Faults, CallsOfTheDeviceFailOnce) {
  TryAll(DeviceFaultsOf, {"vkAllocateMemory", "vkCreateComputePipelines", "vkCreateCommandPool",
                          "vkQueueSubmit", "vkGetQueryPoolResults", "vkCreateDevice"});
}

TEST_F(Faults, FramesOfAVideoCannotBeReadOnce) {
  const std::filesystem::path video = folder_ / "flight.avi";
  cv::VideoWriter writer(video, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 30,
                         cv::Size(384, 224));
  ASSERT_TRUE(writer.isOpened());
  for (int i = 0; i < 16; ++i) {
    char name[32];
    std::snprintf(name, sizeof(name), "%06d.jpg", i);
    const cv::Mat image = cv::imread(std::filesystem::path(MONO3D_EXAMPLE) / "images" / name);
    ASSERT_FALSE(image.empty()) << name;
    cv::Mat resized;
    cv::resize(image, resized, cv::Size(384, 224), 0, 0, cv::INTER_AREA);
    writer.write(resized);
  }
  writer.release();
  run_ = SmallReconstruction(folder_, {}, video);
  TryAll(FileFaults, {"decode_video"}, "decode_video");
}

}  // namespace
}  // namespace mono3d::faults
