// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "io/temporary_folder.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::Not;

class LiveInputRun : public TemporaryFolderTest {
 protected:
  // That nothing listens at.
  static int FreeTcpPort() {
    const int socket_id = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    int port = 0;
    if (bind(socket_id, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
        getsockname(socket_id, reinterpret_cast<sockaddr*>(&address), &size) == 0) {
      port = ntohs(address.sin_port);
    }
    close(socket_id);
    return port;
  }
};

// A still picture makes no model; what became of the input is told all the same.
TEST_F(LiveInputRun, TellsWhatBecameOfTheInputAndNeverThePassword) {
  const std::string address = "127.0.0.1:" + std::to_string(FreeTcpPort());
  const std::string out = (folder_ / "out").string();
  const std::string sender =
      "ffmpeg -v error -re -f lavfi -i smptebars=size=320x240:rate=20 -t 60 -c:v mpeg2video "
      "-f mpegts 'tcp://" +
      address + "?listen=1'";
  const std::string run = std::string(MONO3D_RECONSTRUCT_TOOL) + " tcp://pilot:secret@" + address +
                          " -o " + out + " --max-frames 12 --depth-files none";
  // The sender takes a while until it listens.
  const CommandResult result =
      RunCommand(sender + " </dev/null & id=$!; for i in 1 2 3 4 5 6 7 8 9; do " + run + "; [ -f " +
                     out + "/run.json ] && break; sleep 1; done; kill $id",
                 folder_);
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["input"], "tcp://" + address);
  EXPECT_EQ(record["end"], "finished");
  EXPECT_TRUE(record.contains("live")) << "such a run is one in any case";
  EXPECT_GE(record["live_input"]["images"], 12);
  EXPECT_EQ(record["live_input"]["reconnects"], 0);
  EXPECT_EQ(record["counts"]["frames"].get<int>() +
                record["live"]["frames_dropped"].value(
                    "waited past live.max_delay_s or live.max_waiting_mb", 0),
            12);
  EXPECT_THAT(result.output, HasSubstr("tcp://" + address + ": images of 320x240 come"));
  EXPECT_THAT(result.output, HasSubstr("images received "));
  EXPECT_THAT(result.output + result.errors, Not(HasSubstr("secret")));
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder_ / "out")) {
    if (!file.is_regular_file()) continue;
    EXPECT_THAT(ReadText(file.path()), Not(HasSubstr("secret"))) << file.path();
  }
}

}  // namespace
}  // namespace mono3d
