// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/connections.h"

#include <sys/socket.h>
#include <unistd.h>

namespace mono3d::tools {

bool Connections::Add(int socket) {
  const std::lock_guard lock(mutex_);
  if (is_ended_) return false;
  states_[socket] = {.since = std::chrono::steady_clock::now()};
  return true;
}

void Connections::Close(int socket) {
  const std::lock_guard lock(mutex_);
  states_.erase(socket);
  close(socket);
}

void Connections::SetWaiting(int socket, bool is_waiting) {
  const std::lock_guard lock(mutex_);
  State& state = states_[socket];
  state.is_waiting = is_waiting;
  state.since = std::chrono::steady_clock::now();
}

bool Connections::EndOneThatWaits() {
  const std::lock_guard lock(mutex_);
  auto longest = states_.end();
  for (auto it = states_.begin(); it != states_.end(); ++it) {
    if (!it->second.is_waiting || it->second.is_ended) continue;
    if (longest == states_.end() || it->second.since < longest->second.since) longest = it;
  }
  if (longest == states_.end()) return false;
  longest->second.is_ended = true;
  shutdown(longest->first, SHUT_RDWR);
  return true;
}

void Connections::EndAll() {
  const std::lock_guard lock(mutex_);
  is_ended_ = true;
  for (const auto& [socket, state] : states_) shutdown(socket, SHUT_RDWR);
}

std::size_t Connections::size() const {
  const std::lock_guard lock(mutex_);
  return states_.size();
}

}  // namespace mono3d::tools
