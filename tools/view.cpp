// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-view: shows a run on a page for a browser.

#include <sys/resource.h>

#include <chrono>
#include <cstdio>
#include <numeric>
#include <string>
#include <thread>

#include "common/tool.h"
#include "view/model_blocks.h"
#include "view/model_errors.h"
#include "view/ply_vertices.h"
#include "view/run_folder.h"
#include "view/view_server.h"
#include "view/view_store.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::string run;
  ViewArguments view;
};

int View(const Arguments& arguments) {
  const RunFolder folder(arguments.run);
  const PlyVertices vertices(folder.model_path());
  const auto errors = ModelErrors::Beside(folder.model_path(), vertices);
  const ModelBlocks blocks(vertices, errors.get());
  ViewStore store;
  if (errors) store.SetErrors(errors->largest_m());
  std::vector<SurfelBlock> preview = blocks.Preview();
  std::vector<std::int64_t> ids(preview.size());
  std::iota(ids.begin(), ids.end(), std::int64_t{0});
  store.SetModel(ids, std::move(preview));
  folder.Show(store, vertices.size(), blocks.Normals());
  const ViewServer server(arguments.view, store,
                          [&folder](const std::string& kind, std::int64_t keyframe) {
                            return folder.Picture(kind, keyframe);
                          });
  std::printf("%s\n", server.url().c_str());
  std::printf("Open it in a browser; Ctrl-C ends.\n");
  std::fflush(stdout);
  CatchStopSignals();
  // The page comes first; this thread alone.
  (void)setpriority(PRIO_PROCESS, 0, 10);
  store.SetModel(ids, blocks.All());
  while (!StopRequested()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  return 0;
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-view",
            "Shows the model, the way and the pictures of a run on a page for a browser.\n"
            "Example: mono3d-view out",
            ToolKind::kPlain);
  Arguments arguments;
  tool.app().add_option("RUN", arguments.run, "output folder of mono3d-reconstruct")->required();
  AddViewOptions(tool.app(), arguments.view);
  return tool.Run(argc, argv, [&] { return View(arguments); });
}
