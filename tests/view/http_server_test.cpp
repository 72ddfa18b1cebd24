// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/http_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <list>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "mono3d/core/error.h"
#include "view/http_client.h"

namespace mono3d::tools {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

HttpResources SomeResources() {
  HttpResources resources;
  resources[""] = [](const HttpQuery&) {
    return HttpAnswer{200, "text/html", std::make_shared<const std::string>("the page")};
  };
  resources["number"] = [](const HttpQuery& query) {
    const auto number = query.Number("n");
    return HttpAnswer{200, "text/plain",
                      std::make_shared<const std::string>(number ? std::to_string(*number) : "-")};
  };
  resources["large"] = [](const HttpQuery&) {
    static const auto kBody = std::make_shared<const std::string>(64 << 20, 'x');
    return HttpAnswer{200, "application/octet-stream", kBody};
  };
  resources["broken"] = [](const HttpQuery&) -> HttpAnswer { throw Error("no"); };
  return resources;
}

HttpServerOptions AnyPort() {
  HttpServerOptions options;
  options.port = 0;
  return options;
}

double SecondsOf(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(HttpServer, ServesItsResourcesAndNothingElse) {
  const HttpServer server(AnyPort(), SomeResources());
  EXPECT_EQ(server.url(), "http://127.0.0.1:" + std::to_string(server.port()) + "/");
  EXPECT_EQ(Get(server.port(), "/").body, "the page");
  EXPECT_THAT(Get(server.port(), "/").head, HasSubstr("Content-Security-Policy: default-src"));
  EXPECT_EQ(Get(server.port(), "/number?n=12").body, "12");
  for (const char* number : {"-1", "1x", "", "99999999999999999999", "%00"}) {
    EXPECT_EQ(Get(server.port(), std::string("/number?n=") + number).body, "-") << number;
  }
  for (const char* path :
       {"/..", "/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "//", "/./", "/number/../number",
        "/etc/passwd", "/Number", "/number/", "/%00", "http://127.0.0.1/number", "*"}) {
    EXPECT_THAT(Get(server.port(), path).status, testing::AnyOf(404, 400)) << path;
  }
  EXPECT_EQ(Get(server.port(), "/broken").status, 500);
}

TEST(HttpServer, AnswersSeveralRequestsOfOneConnection) {
  const HttpServer server(AnyPort(), SomeResources());
  const HttpClient client(server.port());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(
        client.Send("GET /number?n=" + std::to_string(i) + " HTTP/1.1\r\nHost: localhost\r\n\r\n"));
    EXPECT_THAT(client.ReadAnswer(), testing::EndsWith("\r\n\r\n" + std::to_string(i)));
  }
  EXPECT_EQ(server.num_connections(), 1);
}

// A page of the web whose name leads to this machine must not read the model.
TEST(HttpServer, RefusesOtherHosts) {
  const HttpServer server(AnyPort(), SomeResources());
  EXPECT_EQ(Get(server.port(), "/", "evil.example").status, 403);
  EXPECT_EQ(Get(server.port(), "/", "127.0.0.1.evil.example:8090").status, 403);
  EXPECT_EQ(Get(server.port(), "/", "localhost:1234").status, 200);
}

TEST(HttpServer, RefusesAllButGet) {
  const HttpServer server(AnyPort(), SomeResources());
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    const HttpClient client(server.port());
    client.Send(std::string(method) +
                " / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\nhello");
    EXPECT_THAT(client.ReadAll(5), StartsWith("HTTP/1.1 405")) << method;
  }
  const HttpClient ranges(server.port());
  ranges.Send("GET /large HTTP/1.1\r\nHost: localhost\r\nRange: bytes=0-1,0-1,0-1\r\n\r\n");
  EXPECT_THAT(ranges.ReadAnswer(), StartsWith("HTTP/1.1 416"));
}

// What lies behind a body in memory is nobody's.
TEST(HttpServer, SendsNothingForRanges) {
  const HttpServer server(AnyPort(), SomeResources());
  for (const char* range : {"bytes=0-8090", "bytes=5-8090", "bytes=8000-8090", "bytes=0-1"}) {
    for (const char* request :
         {"GET / HTTP/1.1\r\nHost: localhost", "GET / HTTP/1.0\r\nHost: other",
          "GET /none HTTP/1.1\r\nHost: localhost"}) {
      const HttpClient client(server.port());
      ASSERT_TRUE(client.Send(std::string(request) + "\r\nConnection: close\r\nRange: " + range +
                              "\r\n\r\n"));
      const std::string answer = client.ReadAnswer();
      EXPECT_THAT(answer, StartsWith("HTTP/1.1 4")) << request << range;
      EXPECT_THAT(answer, testing::EndsWith("\r\n\r\n")) << request << range;
    }
  }
  EXPECT_EQ(Get(server.port(), "/").body, "the page");
}

TEST(HttpServer, NeedsTheTokenOnOtherAddresses) {
  HttpServerOptions options = AnyPort();
  options.address = "0.0.0.0";
  const HttpServer server(options, SomeResources());
  const std::string prefix = "http://0.0.0.0:" + std::to_string(server.port()) + "/";
  ASSERT_THAT(server.url(), StartsWith(prefix));
  const std::string token = server.url().substr(prefix.size());
  ASSERT_EQ(token.size(), 33U) << "32 digits and a slash";
  EXPECT_EQ(Get(server.port(), "/" + token, "any.name").body, "the page");
  EXPECT_EQ(Get(server.port(), "/").status, 404);
  EXPECT_EQ(Get(server.port(), "/number?n=1").status, 404);
  std::string wrong = token;
  wrong[31] = wrong[31] == '0' ? '1' : '0';
  EXPECT_EQ(Get(server.port(), "/" + wrong).status, 404);
}

TEST(HttpServer, SaysThatAPortIsTaken) {
  const HttpServer server(AnyPort(), SomeResources());
  HttpServerOptions options;
  options.port = server.port();
  EXPECT_THROW(HttpServer(options, SomeResources()), Error);
  options.any_port = true;
  const HttpServer other(options, SomeResources());
  EXPECT_NE(other.port(), server.port());
  options.address = "192.0.2.1";  // of no machine
  EXPECT_THROW(HttpServer(options, SomeResources()), Error);
}

TEST(HttpServer, EndsRequestsThatAreTooLong) {
  const HttpServer server(AnyPort(), SomeResources());
  const std::string start = "GET / HTTP/1.1\r\nHost: localhost\r\n";
  std::string lines = start;
  for (int i = 0; i < 200; ++i) lines += "A: b\r\n";
  for (const std::string& request : {start + "A: " + std::string(20000, 'x'), lines,
                                     std::string(100000, 'x'), "GET /" + std::string(20000, 'x')}) {
    const HttpClient client(server.port());
    client.Send(request);
    const std::string answer = client.ReadAll(5);
    EXPECT_THAT(answer, testing::AnyOf("", StartsWith("HTTP/1.1 4"))) << request.substr(0, 60);
  }
  EXPECT_EQ(Get(server.port(), "/").status, 200);
}

TEST(HttpServer, EndsRequestsThatAreTooSlow) {
  HttpServerOptions options = AnyPort();
  options.limits.request_s = 0.2;
  const HttpServer server(options, SomeResources());
  const HttpClient client(server.port());
  client.Send("GET / HTT");
  EXPECT_LT(SecondsOf([&] { (void)client.ReadAll(20); }), 10);
  EXPECT_EQ(Get(server.port(), "/").status, 200);
}

// A request with some of its bytes changed, cut or doubled. MONO3D_MALFORMED_REQUESTS says how many
// of them.
TEST(HttpServer, OutlivesMalformedRequests) {
  HttpServerOptions options = AnyPort();
  options.limits.request_s = 0.02;
  const HttpServer server(options, SomeResources());
  const char* asked = std::getenv("MONO3D_MALFORMED_REQUESTS");
  const int num_requests = asked != nullptr ? std::atoi(asked) : 400;
  std::mt19937 random(7);
  const std::string good =
      "GET /number?n=3&%41=%zz HTTP/1.1\r\nHost: localhost\r\nAccept: */*\r\n"
      "Content-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\nabcd";
  for (int i = 0; i < num_requests; ++i) {
    std::string request = good;
    const int num_changes = 1 + static_cast<int>(random() % 8);
    for (int k = 0; k < num_changes && !request.empty(); ++k) {
      const std::size_t at = random() % request.size();
      switch (random() % 4) {
        case 0:
          request[at] = static_cast<char>(random());
          break;
        case 1:
          request.erase(at, random() % 8);
          break;
        case 2:
          request.insert(at, request.substr(random() % request.size(), random() % 40));
          break;
        default:
          request.insert(at, 1, "\0\r\n :%./?&="[random() % 11]);
          break;
      }
    }
    const HttpClient client(server.port());
    ASSERT_TRUE(client.is_connected()) << i;
    client.Send(request);
    if (i % 16 == 0) (void)client.ReadAnswer(0.05);
  }
  EXPECT_EQ(Get(server.port(), "/number?n=5").body, "5");
}

// Where the queue is short, the system drops what comes on top, and a client tries again a second
// later.
TEST(HttpServer, LosesNoneOfManyThatConnectAtOnce) {
  const HttpServer server(AnyPort(), SomeResources());
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(server.port()));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::vector<int> sockets;
  for (int i = 0; i < 300; ++i) {
    sockets.push_back(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    (void)connect(sockets.back(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  int num_connected = 0, num_tried_again = 0;
  for (const int socket : sockets) {
    pollfd ready{.fd = socket, .events = POLLOUT, .revents = 0};
    if (poll(&ready, 1, 30'000) > 0) ++num_connected;
    tcp_info info = {};
    socklen_t size = sizeof info;
    getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &size);
    if (info.tcpi_total_retrans > 0) ++num_tried_again;
    close(socket);
  }
  EXPECT_EQ(num_connected, 300);
  EXPECT_EQ(num_tried_again, 0);
}

TEST(HttpServer, AnswersBesideAHundredIdleConnections) {
  const HttpServer server(AnyPort(), SomeResources());
  std::list<HttpClient> idle;
  for (int i = 0; i < 100; ++i) {
    idle.emplace_back(server.port());
    if (i % 2 == 0) idle.back().Send("GET / HTTP/1.1\r\n");
  }
  EXPECT_LT(SecondsOf([&] { EXPECT_EQ(Get(server.port(), "/").status, 200); }), 10);
  EXPECT_LE(server.num_connections(), 2 * HttpServerOptions().max_connections);
}

TEST(HttpServer, AnswersBesideViewersThatDoNotRead) {
  auto server = std::make_unique<HttpServer>(AnyPort(), SomeResources());
  std::list<HttpClient> viewers;
  for (int i = 0; i < 10; ++i) {
    viewers.emplace_back(server->port());
    viewers.back().Send("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  EXPECT_EQ(Get(server->port(), "/").status, 200);
  EXPECT_LT(SecondsOf([&] { server.reset(); }), 3) << "the server does not end";
}

}  // namespace
}  // namespace mono3d::tools
