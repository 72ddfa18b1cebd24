// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "view/limited_socket.h"

namespace mono3d::tools {

// What stands behind the "?" of a request.
class HttpQuery {
 public:
  explicit HttpQuery(std::map<std::string, std::string> values) : values_(std::move(values)) {}
  // A whole number from 0 on; nothing where there is none.
  std::optional<std::uint64_t> Number(const std::string& name) const;
  // Such numbers with commas between them; none where one of them is none.
  std::vector<std::uint64_t> Numbers(const std::string& name) const;

 private:
  std::map<std::string, std::string> values_;
};

struct HttpAnswer {
  int status = 200;
  std::string type = {};                         // "text/html"
  std::shared_ptr<const std::string> body = {};  // shared with what it comes from
};

// By the path behind the "/"; nothing else is ever served.
using HttpResources = std::map<std::string, std::function<HttpAnswer(const HttpQuery&)>>;

struct HttpServerOptions {
  std::string address = "127.0.0.1";
  int port = 8090;
  bool any_port = false;  // where that one is taken, another one
  // The most connections at a time; of more, those end that have waited longest for a request.
  int max_connections = 64;
  SocketLimits limits = {};
};

// A web server for a page and its data, in threads of its own; it reads no files. A request has at
// most 16 KB in 64 lines, and is GET or HEAD; it must name the server as the host, so that no page
// of the web gets through by a name of its own that leads here. Other addresses than that of the
// own machine ("127...", "::1", "localhost") have a token in front of every path: who does not know
// it gets nothing.
class HttpServer {
 public:
  // Throws Error where the address cannot be had. The resources are called by several threads at a
  // time; what they throw is status 500.
  HttpServer(const HttpServerOptions& options, HttpResources resources);
  // Ends all connections; waits until resources that were called have returned.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const;
  const std::string& url() const;  // "http://127.0.0.1:8090/"
  int num_connections() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d::tools
