// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/sparsification_drawing.h"

#include <algorithm>
#include <string>

namespace mono3d::tools {
namespace {

// Pixels of the drawing.
constexpr double kLeft = 62;
constexpr double kTop = 18;
constexpr double kWidth = 540;
constexpr double kHeight = 250;

// Axes: share dropped, 0 to 1, and error left by the error of all pixels, 0 to `top`.
struct Axes {
  double top = 1;
  double x(double dropped) const { return kLeft + dropped * kWidth; }
  double y(double error) const { return kTop + kHeight * (1 - error / top); }
};

std::string SvgNumber(double value) { return FormatFixed(value, 1); }

std::string Points(const std::vector<double>& curve, double whole, const Axes& axes) {
  std::string points;
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double dropped = static_cast<double>(i) / static_cast<double>(curve.size());
    points += SvgNumber(axes.x(dropped)) + "," + SvgNumber(axes.y(curve[i] / whole)) + " ";
  }
  return points;
}

std::string Text(double x, double y, const std::string& anchor, const std::string& words) {
  return "<text x=\"" + SvgNumber(x) + "\" y=\"" + SvgNumber(y) + "\" text-anchor=\"" + anchor +
         "\">" + EscapeHtml(words) + "</text>\n";
}

std::string Grid(const Axes& axes) {
  std::string svg = "<g stroke=\"currentColor\" stroke-opacity=\".18\">\n";
  std::string labels = "<g fill=\"currentColor\" font-size=\"13\">\n";
  for (int i = 0; i <= 4; ++i) {
    const double error = axes.top * i / 4;
    svg += "<path d=\"M" + SvgNumber(kLeft) + " " + SvgNumber(axes.y(error)) + "h" +
           SvgNumber(kWidth) + "\"/>\n";
    labels += Text(kLeft - 8, axes.y(error) + 4, "end", FormatPercent(error, 0));
    labels += Text(axes.x(i / 4.0), kTop + kHeight + 20, "middle", FormatPercent(i / 4.0, 0));
  }
  labels += Text(kLeft + kWidth / 2, kTop + kHeight + 42, "middle",
                 "pixels dropped, the least confident first");
  return svg + "</g>\n" + labels + "</g>\n";
}

std::string Legend() {
  const double y = kTop + kHeight + 66;
  return "<path class=\"curve\" fill=\"none\" stroke=\"#1f5fa8\" stroke-width=\"2\" d=\"M" +
         SvgNumber(kLeft) + " " + SvgNumber(y) + "h34\"/>\n" +
         "<path class=\"curve oracle\" fill=\"none\" stroke=\"#c2571a\" stroke-width=\"2\" "
         "stroke-dasharray=\"6 4\" d=\"M" +
         SvgNumber(kLeft + 190) + " " + SvgNumber(y) + "h34\"/>\n" +
         "<g fill=\"currentColor\" font-size=\"13\">\n" +
         Text(kLeft + 42, y + 4, "start", "by confidence") +
         Text(kLeft + 232, y + 4, "start", "by the true error (oracle)") + "</g>\n";
}

}  // namespace

Figure SparsificationFigure(const ConfidenceCalibration& confidence) {
  Axes axes;
  const double whole = confidence.mean_error > 0 ? confidence.mean_error : 1;
  for (const double error : confidence.error_left) axes.top = std::max(axes.top, error / whole);
  const std::string curve = Points(confidence.error_left, whole, axes);
  const std::string oracle = Points(confidence.error_left_oracle, whole, axes);
  // Attributes for the file alone; on the page the style's colours for light and dark go first.
  Figure figure;
  figure.name = "sparsification";
  figure.svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 350\" width=\"640\" "
      "height=\"350\" font-family=\"sans-serif\">\n" +
      Grid(axes) +
      "<polyline class=\"curve oracle\" fill=\"none\" stroke=\"#c2571a\" "
      "stroke-width=\"2\" stroke-dasharray=\"6 4\" points=\"" +
      oracle +
      "\"/>\n<polyline class=\"curve\" fill=\"none\" stroke=\"#1f5fa8\" "
      "stroke-width=\"2\" points=\"" +
      curve + "\"/>\n" + Legend() + "</svg>\n";
  figure.caption =
      "Sparsification: the mean relative error that is left, as a share of that of all pixels. The "
      "closer to the oracle, the better the confidence knows where the depth is wrong.";
  figure.alternative =
      "Two falling curves over the share of pixels dropped: by confidence, where the worst tenth "
      "removes " +
      FormatPercent(confidence.error_removed_by_worst_tenth) +
      " of the error, and by the oracle, where it removes " +
      FormatPercent(confidence.error_removed_by_worst_tenth_oracle) + ".";
  return figure;
}

}  // namespace mono3d::tools
