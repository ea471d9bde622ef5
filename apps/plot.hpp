#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "apps/canvas.hpp"

/// Axes, colour bars and legends on a canvas.
namespace pointflight::apps {

inline constexpr double kTickText = 12.0;  ///< Sizes of letters, pixels.
inline constexpr double kLabelText = 13.0;
inline constexpr double kTitleText = 18.0;

enum class Steps {
  kDecimal,  ///< 1, 2, 5, 10, ...
  kAngle,    ///< The same and 15, 30, 45, 90.
};

/// The least round step of which at most `most` fit into `span`.
double tick_step(double span, int most, Steps steps = Steps::kDecimal);

/// Multiples of `step` from `low` to `high`, both included.
std::vector<double> ticks(double low, double high, double step);

/// A tick's number with the decimals that its step needs; never "-0".
std::string tick_text(double value, double step);

struct Axis {
  double from = 0.0;  ///< At the left or the bottom; may be above `to`.
  double to = 1.0;
  std::string label;  ///< With the unit: "x (m)".
  Steps steps = Steps::kDecimal;
};

/// A rectangle of the canvas with axes.
struct Plot {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;
  Axis x, y;

  /// Pixels of a point.
  [[nodiscard]] std::pair<double, double> at(double px, double py) const {
    return {left + width * (px - x.from) / (x.to - x.from),
            top + height * (1.0 - (py - y.from) / (y.to - y.from))};
  }
  [[nodiscard]] double right() const { return left + width; }
  [[nodiscard]] double bottom() const { return top + height; }
};

/// Room that numbers and label take beside a plot.
inline constexpr double kLeftRoom = 62.0;
inline constexpr double kBottomRoom = 40.0;

/// Frame, ticks at round numbers, numbers and labels.
void draw_axes(Canvas& canvas, const Plot& plot);

/// A scale beside a plot.
struct ColorBar {
  double low = 0.0, high = 1.0;
  std::string label;
  std::function<Color(double share)> color;
  bool logarithmic = false;
};
/// Room that a bar takes to the right of a plot.
inline constexpr double kBarRoom = 88.0;
void draw_color_bar(Canvas& canvas, const ColorBar& bar, double left, double top, double height);

/// What a mark means.
struct LegendEntry {
  std::string words;
  double mark_width = 14.0;
  std::function<void(Canvas& canvas, double x, double y)> mark;  ///< Its left end and middle.
};
inline constexpr double kLegendRow = 20.0;
/// Rows that entries take in a width.
int legend_rows(const std::vector<LegendEntry>& entries, double width);
/// `y`: the middle of the first row.
void draw_legend(
    Canvas& canvas, const std::vector<LegendEntry>& entries, double left, double y, double width);

}  // namespace pointflight::apps
