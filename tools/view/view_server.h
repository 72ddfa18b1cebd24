// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <string>

#include "view/http_server.h"
#include "view/view_store.h"

namespace mono3d::tools {

struct ViewArguments {
  std::string address = "127.0.0.1";
  int port = 0;  // 0: 8090, or another where that is taken
};

// --view-address and --view-port
void AddViewOptions(CLI::App& app, ViewArguments& arguments);

// JPEG of a keyframe, "image" or "depth"; null where there is none. Called by several threads.
using KeyframePictures = std::function<SharedBytes(const std::string& kind, std::int64_t id)>;

// Serves the page and what is in the store, which must outlive it. Without `keyframe_pictures`,
// those of the store.
class ViewServer {
 public:
  // Throws Error where the address cannot be had.
  ViewServer(const ViewArguments& arguments, const ViewStore& store,
             KeyframePictures keyframe_pictures = {});

  const std::string& url() const { return server_.url(); }
  int port() const { return server_.port(); }

 private:
  HttpServer server_;
};

}  // namespace mono3d::tools
