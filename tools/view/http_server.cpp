// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/http_server.h"

#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <csignal>
#include <list>
#include <random>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "mono3d/core/error.h"
#include "view/connections.h"
#include "view/limited_socket.h"

namespace mono3d::tools {
namespace {

constexpr int kMaxRequestsOfConnection = 10000;
// Connections that may wait until they are accepted. httplib has room for five: of more that come
// at once, the system drops those on top, and each of them tries again after one second, two, four.
constexpr int kMaxWaitingConnections = 1024;

// As httplib reads and writes a connection.
class LimitedStream final : public httplib::Stream {
 public:
  explicit LimitedStream(LimitedSocket& socket) : socket_(socket) {}

  bool is_readable() const override { return socket_.IsReadable(); }
  bool is_writable() const override { return socket_.IsWritable(); }
  ssize_t read(char* to, std::size_t size) override { return socket_.Read(to, size); }
  ssize_t write(const char* from, std::size_t size) override { return socket_.Write(from, size); }
  // Nobody asks for them.
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return socket_.socket(); }

 private:
  LimitedSocket& socket_;
};

// One thread for each connection. Called by the thread that accepts them.
class ConnectionThreads final : public httplib::TaskQueue {
 public:
  ConnectionThreads(Connections& connections, int max_connections)
      : connections_(connections), max_connections_(static_cast<std::size_t>(max_connections)) {}

  // True while the calling thread runs a task that must only refuse.
  static bool& MustRefuse() {
    thread_local bool must_refuse = false;
    return must_refuse;
  }

  void enqueue(std::function<void()> task) override {
    if (!MakeRoom() || !Start(task)) {
      MustRefuse() = true;
      task();
      MustRefuse() = false;
    }
  }

  void shutdown() override {
    connections_.EndAll();
    for (Thread& thread : threads_) thread.thread.join();
    threads_.clear();
  }

 private:
  struct Thread {
    std::atomic<bool> is_done = false;
    std::thread thread = {};
  };

  // On a machine that does much else it takes a while until a thread that has been started waits
  // for a request, or one that was told to end does so.
  bool MakeRoom() {
    constexpr auto kPatience = std::chrono::milliseconds(500);
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (true) {
      threads_.remove_if([](Thread& thread) {
        if (!thread.is_done) return false;
        thread.thread.join();
        return true;
      });
      // A few more than the limit do not matter.
      if (threads_.size() < max_connections_) return true;
      if (threads_.size() < 2 * max_connections_ && connections_.EndOneThatWaits()) return true;
      if (std::chrono::steady_clock::now() >= deadline) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }

  // False where the system has no more threads.
  bool Start(const std::function<void()>& task) {
    Thread& added = threads_.emplace_back();
    try {
      added.thread = std::thread([&added, task] {
        task();
        added.is_done = true;
      });
    } catch (const std::system_error&) {
      threads_.pop_back();
      return false;
    }
    return true;
  }

  Connections& connections_;
  std::size_t max_connections_;
  std::list<Thread> threads_;
};

// httplib's server, with limits on what it reads.
class LimitedServer final : public httplib::Server {
 public:
  explicit LimitedServer(const HttpServerOptions& options) : options_(options) {
    new_task_queue = [this] {
      return new ConnectionThreads(connections, options_.max_connections);
    };
  }

  // To be called when it is bound.
  void LengthenQueue() { (void)::listen(svr_sock_, kMaxWaitingConnections); }

  Connections connections;

 private:
  bool process_and_close_socket(socket_t socket) override {
    if (ConnectionThreads::MustRefuse() || !connections.Add(socket)) {
      constexpr std::string_view kBusy =
          "HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
      (void)send(socket, kBusy.data(), kBusy.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      close(socket);
      return false;
    }
    LimitedSocket limited(socket, options_.limits);
    LimitedStream stream(limited);
    for (int i = 1; i <= kMaxRequestsOfConnection; ++i) {
      connections.SetWaiting(socket, true);
      if (!limited.WaitForRequest()) break;
      connections.SetWaiting(socket, false);
      limited.BeginRequest();
      bool is_closed = false;
      const bool is_last = i == kMaxRequestsOfConnection;
      if (!process_request(stream, is_last, is_closed, nullptr) || is_closed) break;
      if (limited.has_failed()) break;
    }
    connections.Close(socket);
    return true;
  }

  const HttpServerOptions& options_;
};

bool IsOwnMachine(const std::string& address) {
  return address.starts_with("127.") || address == "localhost" || address == "::1";
}

std::string MakeToken() {
  std::random_device random;  // the system's
  std::string token;
  for (int i = 0; i < 4; ++i) {
    std::array<char, 9> digits = {};
    std::snprintf(digits.data(), digits.size(), "%08x", random());
    token += digits.data();
  }
  return token;
}

// In a time that does not tell how much agrees.
bool StartsWithSecret(std::string_view text, std::string_view secret) {
  if (text.size() < secret.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < secret.size(); ++i) {
    difference |= static_cast<unsigned>(text[i]) ^ static_cast<unsigned>(secret[i]);
  }
  return difference == 0;
}

// "[::1]:80" and "host:80" without the port.
std::string_view WithoutPort(std::string_view host) {
  const std::size_t colon = host.rfind(':');
  const std::size_t bracket = host.rfind(']');
  if (colon == std::string_view::npos) return host;
  return bracket != std::string_view::npos && bracket > colon ? host : host.substr(0, colon);
}

std::optional<std::uint64_t> ToNumber(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

HttpAnswer Refusal(int status, const char* why) {
  return {status, "text/plain", std::make_shared<const std::string>(why)};
}

}  // namespace

std::optional<std::uint64_t> HttpQuery::Number(const std::string& name) const {
  const auto found = values_.find(name);
  return found == values_.end() ? std::nullopt : ToNumber(found->second);
}

std::vector<std::uint64_t> HttpQuery::Numbers(const std::string& name) const {
  const auto found = values_.find(name);
  if (found == values_.end()) return {};
  std::vector<std::uint64_t> numbers;
  for (std::size_t begin = 0; begin <= found->second.size();) {
    const std::size_t end = std::min(found->second.find(',', begin), found->second.size());
    const auto number = ToNumber(std::string_view(found->second).substr(begin, end - begin));
    if (!number) return {};
    numbers.push_back(*number);
    begin = end + 1;
  }
  return numbers;
}

class HttpServer::Impl {
 public:
  Impl(const HttpServerOptions& options, HttpResources resources)
      : options_(options), resources_(std::move(resources)), server_(MakeServer()) {
    if (!IsOwnMachine(options_.address)) prefix_ += MakeToken() + "/";
    server_->set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) {
          Answer(request, response);
          return httplib::Server::HandlerResponse::Handled;
        });
    // Without SO_REUSEPORT, which httplib sets: two servers would share a port without a word.
    server_->set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    Bind();
    server_->LengthenQueue();
    const bool is_v6 = options_.address.find(':') != std::string::npos;
    url_ = "http://" + (is_v6 ? "[" + options_.address + "]" : options_.address) + ":" +
           std::to_string(port_) + prefix_;
    thread_ = std::thread([this] {
      server_->listen_after_bind();
      has_ended_ = true;
    });
    // stop() does nothing before.
    while (!server_->is_running() && !has_ended_) std::this_thread::sleep_for(Pause());
  }

  ~Impl() {
    server_->stop();
    thread_.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  int port() const { return port_; }
  const std::string& url() const { return url_; }
  int num_connections() const { return static_cast<int>(server_->connections.size()); }

 private:
  static std::chrono::milliseconds Pause() { return std::chrono::milliseconds(1); }

  // Its constructor has the whole process ignore SIGPIPE.
  std::unique_ptr<LimitedServer> MakeServer() const {
    struct sigaction before = {};
    sigaction(SIGPIPE, nullptr, &before);
    auto server = std::make_unique<LimitedServer>(options_);
    sigaction(SIGPIPE, &before, nullptr);
    return server;
  }

  void Bind() {
    port_ = options_.port;
    if (port_ != 0 && server_->bind_to_port(options_.address, port_)) return;
    if (port_ == 0 || options_.any_port) {
      port_ = server_->bind_to_any_port(options_.address);
      if (port_ > 0) return;
    }
    throw Error(ErrorParts{.what = "the page of the view cannot be served",
                           .where = options_.address + ":" + std::to_string(options_.port),
                           .expected = "an address of this machine and a port that is free",
                           .found = {}});
  }

  bool IsOwnHost(std::string_view host) const {
    const std::string_view name = WithoutPort(host);
    // With a token, any name: the machine may have many, and the page of another does not know it.
    return prefix_ != "/" || name == options_.address || name == "localhost" ||
           name == "[" + options_.address + "]" || name == "127.0.0.1";
  }

  HttpAnswer AnswerOf(const httplib::Request& request) const {
    if (request.method != "GET" && request.method != "HEAD") return Refusal(405, "GET only\n");
    if (!request.ranges.empty()) return Refusal(416, "no ranges\n");
    if (request.get_header_value_count("Host") != 1 ||
        !IsOwnHost(request.get_header_value("Host"))) {
      return Refusal(403, "another host is asked for\n");
    }
    if (!StartsWithSecret(request.path, prefix_)) return Refusal(404, "not found\n");
    const auto resource = resources_.find(request.path.substr(prefix_.size()));
    if (resource == resources_.end()) return Refusal(404, "not found\n");
    std::map<std::string, std::string> values;
    for (const auto& [name, value] : request.params) values.emplace(name, value);
    try {
      return resource->second(HttpQuery(std::move(values)));
    } catch (const std::exception&) {
      return Refusal(500, "failed\n");
    }
  }

  void Answer(const httplib::Request& request, httplib::Response& response) const {
    const HttpAnswer answer = AnswerOf(request);
    response.status = answer.status;
    response.set_header("Cache-Control", "no-store");
    response.set_header("X-Content-Type-Options", "nosniff");
    response.set_header("Referrer-Policy", "no-referrer");
    response.set_header("Cross-Origin-Resource-Policy", "same-origin");
    response.set_header("Content-Security-Policy",
                        "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'");
    // What else it sent is not read.
    if (answer.status == 405) response.set_header("Connection", "close");
    // Of a body, httplib 0.11 would ask for whatever range was asked for, also beyond its end.
    if (!answer.body || answer.body->empty() || !request.ranges.empty()) return;
    const std::shared_ptr<const std::string> body = answer.body;
    response.set_content_provider(
        body->size(), answer.type,
        [body](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
          return offset <= body->size() && length <= body->size() - offset &&
                 sink.write(body->data() + offset, length);
        });
  }

  HttpServerOptions options_;
  HttpResources resources_;
  std::string prefix_ = "/";
  std::unique_ptr<LimitedServer> server_;
  int port_ = 0;
  std::string url_;
  std::atomic<bool> has_ended_ = false;
  std::thread thread_;
};

HttpServer::HttpServer(const HttpServerOptions& options, HttpResources resources)
    : impl_(std::make_unique<Impl>(options, std::move(resources))) {}

HttpServer::~HttpServer() = default;

int HttpServer::port() const { return impl_->port(); }

const std::string& HttpServer::url() const { return impl_->url(); }

int HttpServer::num_connections() const { return impl_->num_connections(); }

}  // namespace mono3d::tools
