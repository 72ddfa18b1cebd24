// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "mono3d/fusion/surfel_map.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// A model for who watches it grow.
struct PublishedModel {
  SurfelChanges surfels;   // their version counts the publications, whichever model they are of
  int map_id = 0;          // of the tracker's map that it shows
  KeyframePosesPtr poses;  // that it follows; null where nothing was published yet
};

// Passes a model that grows in one thread to others: once each time that somebody has asked, half
// of the time later that passed between the last two questions, and as often as that takes no more
// than a tenth of the thread's time. Where nobody asks any more it lets its copy of the model go.
class ModelPublisher {
 public:
  // `interest_s`: for how long somebody who has asked is interested.
  explicit ModelPublisher(double interest_s = 30) : interest_s_(interest_s) {}

  // From any thread: the latest publication, with the surfels that are newer than `since_version`.
  // Who asks is interested for a while: whoever watches asks each second, and files are written
  // each five seconds of a video.
  PublishedModel Latest(std::uint64_t since_version);

  // The rest by the thread of the model.
  void NoteChange() { has_changed_ = true; }
  // When the next publication is due, in seconds of the clock; nothing while none is.
  std::optional<double> Due_s() const;
  void PublishIfDue(SurfelMap& model, int map_id, const KeyframePosesPtr& poses);

 private:
  bool IsWanted() const;
  void ForgetUnlessWanted();
  void Take(const SurfelChanges& changes, bool is_other_model);

  struct Chunk {
    std::uint64_t version = 0;
    std::shared_ptr<const PointCloud> surfels;
  };

  double interest_s_;
  mutable std::mutex mutex_;
  std::optional<double> asked_s_;          // in seconds of the clock; last
  double pause_s_ = 0;                     // between the last two questions
  bool is_awaited_ = false;                // asked since the latest publication
  PublishedModel latest_;                  // without surfels
  std::map<std::uint32_t, Chunk> chunks_;  // by anchor

  // The model thread's own.
  bool has_changed_ = false;          // since the latest publication
  double earliest_s_ = 0;             // of the next publication
  const SurfelMap* model_ = nullptr;  // that was published last, to compare with
  std::uint64_t model_version_ = 0;   // of it
};

}  // namespace mono3d
