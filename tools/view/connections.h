// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <mutex>

namespace mono3d::tools {

// The sockets that are open, so that any thread can end them. A socket is in the list from before
// its first use until it is closed: no number is used again meanwhile.
class Connections {
 public:
  // False: no more are taken; the socket is not in the list.
  bool Add(int socket);
  void Close(int socket);  // and takes it out

  // It waits for a request; or works on one.
  void SetWaiting(int socket, bool is_waiting);
  // Ends the connection that has waited longest; false where none waits.
  bool EndOneThatWaits();
  // Ends all and takes no more.
  void EndAll();

  std::size_t size() const;

 private:
  struct State {
    bool is_waiting = false;
    bool is_ended = false;
    std::chrono::steady_clock::time_point since = {};
  };
  mutable std::mutex mutex_;
  std::map<int, State> states_;
  bool is_ended_ = false;
};

}  // namespace mono3d::tools
