// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/view_server.h"

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "view/page_text.h"
#include "view/three.h"

namespace mono3d::tools {
namespace {

constexpr int kDefaultPort = 8090;
constexpr std::uint64_t kMaxSurfelsOfRequest = 65536;  // a megabyte

HttpServerOptions ToServerOptions(const ViewArguments& arguments) {
  HttpServerOptions options;
  options.address = arguments.address;
  options.any_port = arguments.port == 0;
  options.port = arguments.port == 0 ? kDefaultPort : arguments.port;
  return options;
}

HttpAnswer NotThere() {
  return {404, "text/plain", std::make_shared<const std::string>("not there\n")};
}

HttpAnswer Jpeg(SharedBytes jpeg) {
  if (!jpeg) return NotThere();
  return {200, "image/jpeg", std::move(jpeg)};
}

void AddText(HttpResources& resources, const std::string& path, const char* type,
             std::string_view text) {
  const auto body = std::make_shared<const std::string>(text);
  resources[path] = [type, body](const HttpQuery&) { return HttpAnswer{200, type, body}; };
}

void AddPage(HttpResources& resources) {
  constexpr const char* kJavaScript = "text/javascript";
  AddText(resources, "", "text/html", ViewHtml());
  AddText(resources, "view.css", "text/css", ViewCss());
  AddText(resources, "main.js", kJavaScript, ViewMainJs());
  AddText(resources, "surfels.js", kJavaScript, ViewSurfelsJs());
  AddText(resources, "controls.js", kJavaScript, ViewControlsJs());
  AddText(resources, "flight.js", kJavaScript, ViewFlightJs());
  AddText(resources, "measure.js", kJavaScript, ViewMeasureJs());
  AddText(resources, "next_views.js", kJavaScript, ViewNextViewsJs());
  AddText(resources, "three.module.min.js", kJavaScript, ThreeModule());
}

// "levels=3,0,2048,7,2048,6144": of block 3 the first 2048, of block 7 the 6144 behind as many, one
// behind the other. A page with hundreds of blocks would wait long for as many answers. Where a
// block is gone, the head of an empty one without a version.
HttpAnswer AnswerSurfels(const ViewStore& store, const HttpQuery& query) {
  const std::vector<std::uint64_t> levels = query.Numbers("levels");
  if (levels.empty() || levels.size() % 3 != 0) return NotThere();
  std::string bytes;
  std::uint64_t left = kMaxSurfelsOfRequest;
  for (std::size_t i = 0; i < levels.size(); i += 3) {
    const std::uint64_t count = std::min(levels[i + 2], left);
    left -= count;
    bytes += store.Surfels(static_cast<std::int64_t>(levels[i]), levels[i + 1], count)
                 .value_or(std::string(kBytesOfSurfelsHead, '\0'));
  }
  return {200, "application/octet-stream", std::make_shared<const std::string>(std::move(bytes))};
}

HttpResources MakeResources(const ViewStore& store, KeyframePictures keyframe_pictures) {
  if (!keyframe_pictures) {
    keyframe_pictures = [&store](const std::string& kind, std::int64_t id) {
      return store.PictureOfKeyframe(kind, id);
    };
  }
  HttpResources resources;
  AddPage(resources);
  resources["changes"] = [&store](const HttpQuery& query) {
    return HttpAnswer{
        200, "application/json",
        std::make_shared<const std::string>(store.Changes(query.Number("since").value_or(0)))};
  };
  resources["surfels"] = [&store](const HttpQuery& query) { return AnswerSurfels(store, query); };
  for (const std::string kind : {"image", "depth"}) {
    resources[kind] = [&store, kind](const HttpQuery&) { return Jpeg(store.Picture(kind)); };
    resources["keyframe_" + kind] = [keyframe_pictures, kind](const HttpQuery& query) {
      const auto id = query.Number("id");
      return id ? Jpeg(keyframe_pictures(kind, static_cast<std::int64_t>(*id))) : NotThere();
    };
  }
  return resources;
}

}  // namespace

void AddViewOptions(CLI::App& app, ViewArguments& arguments) {
  app.add_option("--view-address", arguments.address,
                 "address of this machine that the view is served at; other machines reach others "
                 "than 127.0.0.1, by the URL that is printed, which holds a token")
      ->capture_default_str();
  app.add_option("--view-port", arguments.port, "port of the view; 0: 8090, or a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
}

ViewServer::ViewServer(const ViewArguments& arguments, const ViewStore& store,
                       KeyframePictures keyframe_pictures)
    : server_(ToServerOptions(arguments), MakeResources(store, std::move(keyframe_pictures))) {}

}  // namespace mono3d::tools
