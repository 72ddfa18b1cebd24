// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/limited_socket.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

namespace mono3d::tools {
namespace {

using SocketClock = std::chrono::steady_clock;

SocketClock::time_point SecondsFromNow(double seconds) {
  return SocketClock::now() +
         std::chrono::duration_cast<SocketClock::duration>(std::chrono::duration<double>(seconds));
}

// True once the socket is ready for `event`; false at `deadline` or on an error.
bool WaitFor(int socket, short event, SocketClock::time_point deadline) {
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - SocketClock::now());
    pollfd poll_fd{.fd = socket, .events = event, .revents = 0};
    const int result = poll(&poll_fd, 1, static_cast<int>(std::max<long>(0, left.count())));
    if (result > 0) return true;
    if (result == 0 || errno != EINTR) return false;
  }
}

}  // namespace

bool LimitedSocket::WaitForRequest() const {
  return begin_ < end_ || WaitFor(socket_, POLLIN, SecondsFromNow(limits_.idle_s));
}

void LimitedSocket::BeginRequest() {
  deadline_ = SecondsFromNow(limits_.request_s);
  bytes_left_ = limits_.max_bytes;
  lines_left_ = limits_.max_lines;
}

bool LimitedSocket::IsReadable() const {
  return begin_ < end_ || WaitFor(socket_, POLLIN, deadline_);
}

bool LimitedSocket::IsWritable() const {
  return !has_failed_ && WaitFor(socket_, POLLOUT, SecondsFromNow(limits_.progress_s));
}

ssize_t LimitedSocket::Read(char* to, std::size_t size) {
  if (has_failed_ || (begin_ == end_ && !Fill())) return Fail();
  const std::size_t num = std::min({size, end_ - begin_, bytes_left_});
  if (num == 0) return Fail();  // too long a request
  const char* from = buffer_.data() + begin_;
  lines_left_ -= static_cast<int>(std::count(from, from + num, '\n'));
  if (lines_left_ < 0) return Fail();
  std::copy(from, from + num, to);
  begin_ += num;
  bytes_left_ -= num;
  return static_cast<ssize_t>(num);
}

ssize_t LimitedSocket::Write(const char* from, std::size_t size) {
  for (;;) {
    if (!IsWritable()) return Fail();
    const ssize_t num = send(socket_, from, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (num >= 0) return num;
    if (errno != EAGAIN && errno != EINTR) return Fail();
  }
}

bool LimitedSocket::Fill() {
  if (!WaitFor(socket_, POLLIN, deadline_)) return false;
  const ssize_t num = recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
  if (num <= 0) return false;
  begin_ = 0;
  end_ = static_cast<std::size_t>(num);
  return true;
}

ssize_t LimitedSocket::Fail() {
  has_failed_ = true;
  return -1;
}

}  // namespace mono3d::tools
