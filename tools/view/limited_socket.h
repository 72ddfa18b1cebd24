// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <sys/types.h>

#include <array>
#include <chrono>
#include <cstddef>

namespace mono3d::tools {

struct SocketLimits {
  std::size_t max_bytes = 16 * 1024;  // of a request
  int max_lines = 64;
  double idle_s = 15;     // in which a request must begin
  double request_s = 3;   // in which it must be there as a whole
  double progress_s = 5;  // in which something of an answer must be taken
};

// A socket of a viewer, with limits. It does not own the socket.
class LimitedSocket {
 public:
  LimitedSocket(int socket, const SocketLimits& limits) : socket_(socket), limits_(limits) {}

  // Until a request begins; false where none does.
  bool WaitForRequest() const;
  // From now on the limits are those of the next request.
  void BeginRequest();

  bool IsReadable() const;
  bool IsWritable() const;
  // Bytes read or written, 1 at least, or -1: the connection has ended, or a limit was met.
  ssize_t Read(char* to, std::size_t size);
  ssize_t Write(const char* from, std::size_t size);
  bool has_failed() const { return has_failed_; }
  int socket() const { return socket_; }

 private:
  using Clock = std::chrono::steady_clock;

  bool Fill();
  ssize_t Fail();

  int socket_;
  SocketLimits limits_;
  Clock::time_point deadline_ = {};
  std::size_t bytes_left_ = 0;
  int lines_left_ = 0;
  bool has_failed_ = false;
  std::array<char, 4096> buffer_ = {};
  std::size_t begin_ = 0, end_ = 0;  // what is left in buffer_
};

}  // namespace mono3d::tools
