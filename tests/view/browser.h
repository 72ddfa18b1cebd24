// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <string>

namespace mono3d {

// Chromium without a window, drawing in software, with one page; told what to do by its DevTools
// protocol over pipes. What goes wrong throws std::runtime_error.
class Browser {
 public:
  // `folder` takes its profile.
  Browser(const std::filesystem::path& folder, int width, int height);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void Open(const std::string& url);
  void Reload();
  // Value of a JavaScript expression on the page.
  nlohmann::json Evaluate(const std::string& expression);
  // Until the expression is true; false where it is not within `seconds`.
  bool WaitFor(const std::string& expression, double seconds = 180);
  // As browsers do with a tab that nobody looks at: nothing runs on the page until it is woken.
  void PutToSleep();
  void WakeUp();
  cv::Mat Screenshot();  // CV_8UC3
  // Errors of the page's scripts so far.
  const std::string& errors() const { return errors_; }

 private:
  nlohmann::json Call(const std::string& method, const nlohmann::json& parameters = {});
  nlohmann::json Receive();

  std::filesystem::path profile_;
  pid_t process_ = -1;
  int to_ = -1, from_ = -1;
  int num_calls_ = 0;
  std::string session_;
  std::string received_;
  std::string errors_;
};

}  // namespace mono3d
