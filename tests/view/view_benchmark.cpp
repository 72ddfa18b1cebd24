// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What mono3d-view takes for a model of so many surfels: seconds to the first picture in a browser
// without a window, pictures a second.
//   mono3d_view_benchmark FOLDER SURFELS

#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "mono3d/io/ply_file.h"
#include "view/browser.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth_px = 1280, kHeight_px = 720;

double Now_s() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count();
}

// Hills, seen strip by strip as by a flight: a square of side 1000.
void WriteHills(const fs::path& path, std::int64_t num_surfels) {
  const auto side = static_cast<std::int64_t>(std::sqrt(static_cast<double>(num_surfels)));
  constexpr std::int64_t kStrip = 200;  // rows of surfels
  const double step = 1000.0 / static_cast<double>(side);
  PointCloud cloud;
  for (std::int64_t i = 0; i < side * side; ++i) {
    const std::int64_t strip = i / (kStrip * side), rest = i % (kStrip * side);
    const std::int64_t rows = std::min(kStrip, side - kStrip * strip);
    const double x = step * static_cast<double>(rest / rows);
    const double y = step * static_cast<double>(kStrip * strip + rest % rows);
    const double z = 20 * std::sin(x / 60) * std::cos(y / 90) + 3 * std::sin(x / 7 + y / 11);
    const Eigen::Vector3d slope(-std::cos(x / 60) * std::cos(y / 90) / 3,
                                std::sin(x / 60) * std::sin(y / 90) / 4.5, 1);
    cloud.points.push_back(Eigen::Vector3d(x, y, z).cast<float>());
    cloud.normals.push_back(slope.normalized().cast<float>());
    cloud.radii.push_back(static_cast<float>(0.8 * step));
    const auto light = static_cast<std::uint8_t>(128 + 4 * z);
    cloud.colours.push_back({light, static_cast<std::uint8_t>(200 - light / 2), 90});
    cloud.confidences.push_back(0.8F);
    cloud.observations.push_back(static_cast<std::uint32_t>(1 + strip % 20));
  }
  WritePly(path, cloud);
}

// mono3d-view, until the end.
class ViewProgram {
 public:
  explicit ViewProgram(const fs::path& run) {
    std::array<int, 2> output = {};
    if (pipe(output.data()) != 0) throw std::runtime_error("no pipe");
    process_ = fork();
    if (process_ == 0) {
      dup2(output[1], 1);
      execl(MONO3D_VIEW_TOOL, MONO3D_VIEW_TOOL, run.c_str(), nullptr);
      _exit(127);
    }
    close(output[1]);
    char c = 0;
    while (read(output[0], &c, 1) == 1 && c != '\n') url_ += c;
    output_ = output[0];
  }
  ~ViewProgram() { (void)Stop(); }
  ViewProgram(const ViewProgram&) = delete;
  ViewProgram& operator=(const ViewProgram&) = delete;

  const std::string& url() const { return url_; }
  // What it has used.
  rusage Stop() {
    rusage usage = {};
    if (process_ <= 0) return usage;
    kill(process_, SIGINT);
    wait4(process_, nullptr, 0, &usage);
    process_ = -1;
    close(output_);
    return usage;
  }

 private:
  pid_t process_ = -1;
  int output_ = -1;
  std::string url_;
};

double ProcessorSeconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// Pictures a second while a key moves the camera to and fro.
double PicturesPerSecond(Browser& browser) {
  return browser
      .Evaluate(R"(new Promise((done) => {
        const press = (type, key) => window.dispatchEvent(new KeyboardEvent(type, {key}));
        const from = mono3d.state().pictures, begin = performance.now();
        press('keydown', 'd');
        setTimeout(() => { press('keyup', 'd'); press('keydown', 'a'); }, 2500);
        setTimeout(() => {
          press('keyup', 'a');
          done(1000 * (mono3d.state().pictures - from) / (performance.now() - begin));
        }, 5000);
      }))")
      .get<double>();
}

void Measure(const fs::path& folder, std::int64_t num_surfels) {
  fs::create_directories(folder);
  const fs::path model = folder / "model.ply";
  WriteHills(model, num_surfels);
  Browser browser(folder, kWidth_px, kHeight_px);
  (void)browser.Evaluate("1");
  const double start_s = Now_s();
  ViewProgram program(folder);
  const double served_s = Now_s();
  browser.Open(program.url());
  if (!browser.WaitFor("window.mono3d !== undefined && mono3d.state().pictures > 0", 600)) {
    throw std::runtime_error("no picture: " + browser.errors());
  }
  if (!browser.WaitFor("mono3d.state().wholePictureMs !== null", 600)) {
    throw std::runtime_error("no picture of the whole model");
  }
  const auto seconds = [&browser](const std::string& name) {
    return 1e-3 * browser.Evaluate("mono3d.state()." + name).get<double>();
  };
  std::printf("served after %.2f s, first picture %.2f s later, of the whole model %.2f s later\n",
              served_s - start_s, seconds("firstPictureMs"), seconds("wholePictureMs"));
  std::printf("pictures a second at first: %.1f\n", PicturesPerSecond(browser));
  const std::string all = "mono3d.state().complete && mono3d.state().surfels > " +
                          std::to_string(num_surfels * 99 / 100);
  if (!browser.WaitFor(all, 1200)) throw std::runtime_error("never complete");
  std::printf("all there after %.2f s: %s\n", Now_s() - start_s,
              browser.Evaluate("JSON.stringify(mono3d.state())").get<std::string>().c_str());
  std::printf("pictures a second then: %.1f\n", PicturesPerSecond(browser));
  const rusage usage = program.Stop();
  std::printf("mono3d-view: %.1f s of the processor, %.0f MB\n",
              ProcessorSeconds(usage.ru_utime) + ProcessorSeconds(usage.ru_stime),
              static_cast<double>(usage.ru_maxrss) / 1024);
}

}  // namespace
}  // namespace mono3d

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s FOLDER SURFELS\n", argv[0]);
    return 2;
  }
  try {
    mono3d::Measure(argv[1], std::atoll(argv[2]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
