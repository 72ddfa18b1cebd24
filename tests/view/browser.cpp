// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "view/browser.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <vector>

namespace mono3d {
namespace {

constexpr int kAnswer_ms = 120'000;  // software rendering beside other work

std::vector<uchar> FromBase64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<uchar> bytes;
  unsigned bits = 0;
  int num_bits = 0;
  for (const char c : text) {
    const std::size_t digit = digits.find(c);
    if (digit == std::string::npos) break;
    bits = bits << 6 | static_cast<unsigned>(digit);
    num_bits += 6;
    if (num_bits < 8) continue;
    num_bits -= 8;
    bytes.push_back(static_cast<uchar>(bits >> num_bits));
  }
  return bytes;
}

// In the child: file 3 is what it reads, file 4 what it writes.
[[noreturn]] void BecomeChromium(int reads, int writes, const std::string& profile,
                                 const std::string& window) {
  // Not 3 or 4 themselves, which dup2 would leave to be closed.
  reads = fcntl(reads, F_DUPFD, 10);
  writes = fcntl(writes, F_DUPFD, 10);
  dup2(reads, 3);
  dup2(writes, 4);
  const int nothing = open("/dev/null", O_RDWR);
  for (const int file : {0, 1, 2}) dup2(nothing, file);
  // --no-sandbox: the tests may run as root. The page is our own.
  execlp("chromium", "chromium", "--headless=new", "--no-sandbox", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--disable-extensions",
         "--no-first-run", "--remote-debugging-pipe", profile.c_str(), window.c_str(),
         "about:blank", nullptr);
  _exit(127);
}

}  // namespace

Browser::Browser(const std::filesystem::path& folder, int width, int height)
    : profile_(folder / "chromium") {
  std::array<int, 2> there = {}, back = {};
  if (pipe2(there.data(), O_CLOEXEC) != 0 || pipe2(back.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("no pipes");
  }
  const std::string profile = "--user-data-dir=" + profile_.string();
  const std::string window =
      "--window-size=" + std::to_string(width) + "," + std::to_string(height);
  process_ = fork();
  if (process_ == 0) BecomeChromium(there[0], back[1], profile, window);
  close(there[0]);
  close(back[1]);
  to_ = there[1];
  from_ = back[0];
  const nlohmann::json page = Call("Target.createTarget", {{"url", "about:blank"}})["targetId"];
  session_ = Call("Target.attachToTarget", {{"targetId", page}, {"flatten", true}})["sessionId"];
  Call("Runtime.enable");
  Call("Page.enable");
  Call("Emulation.setDeviceMetricsOverride",
       {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

Browser::~Browser() {
  close(to_);  // it ends
  close(from_);
  const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(50)); };
  for (int i = 0; i < 200 && waitpid(process_, nullptr, WNOHANG) == 0; ++i) {
    if (i == 199) kill(process_, SIGKILL);
    pause();
  }
  // Its helpers may still write for a moment.
  for (int i = 0; i < 100; ++i) {
    std::error_code error;
    std::filesystem::remove_all(profile_, error);
    if (!error) return;
    pause();
  }
}

nlohmann::json Browser::Receive() {
  for (;;) {
    if (const std::size_t end = received_.find('\0'); end != std::string::npos) {
      const nlohmann::json message = nlohmann::json::parse(received_.substr(0, end));
      received_.erase(0, end + 1);
      return message;
    }
    pollfd ready{.fd = from_, .events = POLLIN, .revents = 0};
    if (poll(&ready, 1, kAnswer_ms) <= 0) throw std::runtime_error("the browser does not answer");
    std::array<char, 65536> buffer = {};
    const ssize_t num = read(from_, buffer.data(), buffer.size());
    if (num <= 0) throw std::runtime_error("there is no chromium, or it has ended");
    received_.append(buffer.data(), static_cast<std::size_t>(num));
  }
}

nlohmann::json Browser::Call(const std::string& method, const nlohmann::json& parameters) {
  nlohmann::json message = {{"id", ++num_calls_}, {"method", method}};
  if (!parameters.is_null()) message["params"] = parameters;
  if (!session_.empty()) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  if (write(to_, text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error("the browser has ended");
  }
  for (;;) {
    const nlohmann::json answer = Receive();
    if (answer.value("method", "") == "Runtime.exceptionThrown") errors_ += answer.dump() + "\n";
    if (answer.value("id", 0) != num_calls_) continue;
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return answer["result"];
  }
}

void Browser::Open(const std::string& url) { Call("Page.navigate", {{"url", url}}); }

void Browser::Reload() { Call("Page.reload"); }

nlohmann::json Browser::Evaluate(const std::string& expression) {
  const nlohmann::json answer =
      Call("Runtime.evaluate",
           {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
  if (answer.contains("exceptionDetails")) throw std::runtime_error(answer.dump());
  return answer["result"].value("value", nlohmann::json());
}

void Browser::PutToSleep() { Call("Page.setWebLifecycleState", {{"state", "frozen"}}); }

void Browser::WakeUp() {
  Call("Page.setWebLifecycleState", {{"state", "active"}});
  Call("Emulation.setFocusEmulationEnabled", {{"enabled", true}});  // it is looked at again
}

bool Browser::WaitFor(const std::string& expression, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    try {
      if (Evaluate(expression) == true) return true;
    } catch (const std::runtime_error&) {  // between two pages
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

cv::Mat Browser::Screenshot() {
  const nlohmann::json answer = Call("Page.captureScreenshot", {{"format", "png"}});
  return cv::imdecode(FromBase64(answer["data"]), cv::IMREAD_COLOR);
}

}  // namespace mono3d
