// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <system_error>

#include "fuzz/fuzz_targets.h"
#include "view/view_server.h"

namespace mono3d::fuzz {
namespace {

// A view of one block of surfels.
class View {
 public:
  View() {
    tools::SurfelBlock block = tools::MakeSurfelBlock({tools::ViewSurfel{}, tools::ViewSurfel{}});
    block.id = 1;
    store_.SetModel({1}, {block});
    store_.SetPicture("image", std::make_shared<const std::string>("a picture"));
  }
  int port() const { return server_.port(); }

 private:
  tools::ViewStore store_;
  tools::ViewServer server_{tools::ViewArguments{}, store_};
};

// libFuzzer's alarm may interrupt it: then once more.
int ConnectTo(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  while (true) {
    const int connection = socket(AF_INET, SOCK_STREAM, 0);
    if (connect(connection, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      return connection;
    }
    const int failure = errno;
    close(connection);
    if (failure != EINTR) throw std::system_error(failure, std::generic_category(), "connect");
  }
}

}  // namespace

void Http(std::string_view input) {
  static const View view;
  const int connection = ConnectTo(view.port());
  // Of a request that is refused, the rest is not read.
  while (!input.empty()) {
    const ssize_t num = send(connection, input.data(), input.size(), MSG_NOSIGNAL);
    if (num <= 0) break;
    input.remove_prefix(static_cast<std::size_t>(num));
  }
  shutdown(connection, SHUT_WR);
  std::array<char, 65536> answer{};
  while (recv(connection, answer.data(), answer.size(), 0) > 0) {
  }
  // No state of a closed connection is kept: thousands of them would use up the ports.
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  setsockopt(connection, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  close(connection);
}

}  // namespace mono3d::fuzz
