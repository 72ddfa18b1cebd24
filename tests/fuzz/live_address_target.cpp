// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <stdexcept>
#include <string>

#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "io/live_address.h"
#include "mono3d/io/live_input.h"

namespace mono3d::fuzz {

// No password is shown, wherever the rest of an address ends.
void LiveAddresses(std::string_view input) {
  constexpr std::string_view kPassword = "Zq9!7x";
  if (input.find(kPassword) != input.npos) return;
  const std::string rest(input);
  static_cast<void>(ReadOrRefuse([&] { return ParseLiveAddress(rest); }));
  for (const char* kind : {"rtsp", "rtsps", "udp", "tcp"}) {
    const std::string address =
        std::string(kind) + "://pilot:" + std::string(kPassword) + "@" + rest;
    std::string shown = WithoutPassword(address);
    try {
      shown += ParseLiveAddress(address).shown;
    } catch (const Error& error) {
      shown += error.what();
    }
    if (shown.find(kPassword) != shown.npos) throw std::logic_error("a password is shown");
  }
}

}  // namespace mono3d::fuzz
