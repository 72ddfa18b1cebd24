// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/http_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>

namespace mono3d {
namespace {

// Of the head and what it announces; 0 where the head is not there yet.
std::size_t LengthOfAnswer(const std::string& answer) {
  const std::size_t end = answer.find("\r\n\r\n");
  if (end == std::string::npos) return 0;
  const std::string name = "Content-Length: ";
  const std::size_t length = answer.find(name);
  const std::size_t body =
      length < end ? std::strtoull(&answer[length + name.size()], nullptr, 10) : 0;
  return end + 4 + body;
}

}  // namespace

HttpClient::HttpClient(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return;
  close(socket_);
  socket_ = -1;
}

HttpClient::~HttpClient() {
  if (socket_ >= 0) close(socket_);
}

bool HttpClient::Send(const std::string& bytes) const {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t num = send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (num <= 0) return false;
    sent += static_cast<std::size_t>(num);
  }
  return true;
}

std::string HttpClient::Read(double seconds, bool one_answer) const {
  std::string answer;
  std::array<char, 65536> buffer = {};
  for (;;) {
    pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
    if (poll(&ready, 1, static_cast<int>(1000 * seconds)) <= 0) return answer;
    const ssize_t num = recv(socket_, buffer.data(), buffer.size(), 0);
    if (num <= 0) return answer;
    answer.append(buffer.data(), static_cast<std::size_t>(num));
    if (!one_answer) continue;
    const std::size_t length = LengthOfAnswer(answer);
    if (length > 0 && answer.size() >= length) return answer;
  }
}

std::string HttpClient::ReadAll(double seconds) const { return Read(seconds, false); }

std::string HttpClient::ReadAnswer(double seconds) const { return Read(seconds, true); }

HttpReply Get(int port, const std::string& target, const std::string& host) {
  const HttpClient client(port);
  if (!client.is_connected()) return {};
  client.Send("GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n");
  const std::string answer = client.ReadAnswer();
  const std::size_t end = answer.find("\r\n\r\n");
  if (end == std::string::npos) return {};
  return {std::atoi(answer.c_str() + answer.find(' ')), answer.substr(0, end),
          answer.substr(end + 4)};
}

}  // namespace mono3d
