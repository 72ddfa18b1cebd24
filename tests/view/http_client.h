// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

namespace mono3d {

// A connection to this machine that sends what it is told, right or wrong.
class HttpClient {
 public:
  explicit HttpClient(int port);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  bool is_connected() const { return socket_ >= 0; }
  // False where the server has ended the connection.
  bool Send(const std::string& bytes) const;
  // Until the server ends the connection, or `seconds` have passed without a byte.
  std::string ReadAll(double seconds) const;
  // One answer whose length its head tells; what there is where it ends before.
  std::string ReadAnswer(double seconds = 10) const;

 private:
  std::string Read(double seconds, bool one_answer) const;

  int socket_ = -1;
};

struct HttpReply {
  int status = 0;  // 0: no answer
  std::string head;
  std::string body;
};

// "/changes?since=0"
HttpReply Get(int port, const std::string& target, const std::string& host = "127.0.0.1");

}  // namespace mono3d
