// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>

namespace mono3d::tracking {

// Who may touch the map: one thread at a time, and tracking before mapping, so that a frame waits
// for one short step of the mapping at most.
class MapTurns {
 public:
  void TakeForTracking();
  void TakeForMapping();
  void Give();

 private:
  std::mutex mutex_;
  std::condition_variable given_;
  bool is_taken_ = false;
  int num_tracking_waits_ = 0;
};

// Tracking's turn, from construction to destruction; for std::condition_variable_any as well.
class TrackingTurn {
 public:
  explicit TrackingTurn(MapTurns& turns) : turns_(turns) { lock(); }
  ~TrackingTurn() { unlock(); }
  TrackingTurn(const TrackingTurn&) = delete;
  TrackingTurn& operator=(const TrackingTurn&) = delete;
  void lock() { turns_.TakeForTracking(); }
  void unlock() { turns_.Give(); }

 private:
  MapTurns& turns_;
};

// Mapping's turn, which it gives up between its steps and where it works on copies. Without turns
// to take there is nobody to share the map with, and all calls do nothing.
class MappingTurn {
 public:
  MappingTurn() = default;
  // `is_interrupted`: that the adjustment under way should come to its end.
  MappingTurn(MapTurns& turns, const std::atomic<bool>& is_interrupted)
      : turns_(&turns), is_interrupted_(&is_interrupted) {
    lock();
  }
  ~MappingTurn() { unlock(); }
  MappingTurn(const MappingTurn&) = delete;
  MappingTurn& operator=(const MappingTurn&) = delete;
  void lock() {
    if (turns_ != nullptr) turns_->TakeForMapping();
  }
  void unlock() {
    if (turns_ != nullptr) turns_->Give();
  }
  bool IsShared() const { return turns_ != nullptr; }
  const std::atomic<bool>* is_interrupted() const { return is_interrupted_; }
  // Lets tracking come in, if it waits.
  void Breathe() {
    unlock();
    lock();
  }

 private:
  MapTurns* turns_ = nullptr;
  const std::atomic<bool>* is_interrupted_ = nullptr;
};

// Work on copies, for which the map is given up meanwhile.
class WithoutMap {
 public:
  explicit WithoutMap(MappingTurn& turn) : turn_(turn) { turn_.unlock(); }
  ~WithoutMap() { turn_.lock(); }
  WithoutMap(const WithoutMap&) = delete;
  WithoutMap& operator=(const WithoutMap&) = delete;

 private:
  MappingTurn& turn_;
};

}  // namespace mono3d::tracking
