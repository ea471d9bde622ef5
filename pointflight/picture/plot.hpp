#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "pointflight/picture/canvas.hpp"

/// Axes, colour bars and legends on a canvas.
namespace pointflight::picture {

inline constexpr double kTickText = 12.0;   ///< Size of the numbers at ticks, pixels.
inline constexpr double kLabelText = 13.0;  ///< Size of labels, pixels.
inline constexpr double kTitleText = 18.0;  ///< Size of titles, pixels.

/// Which steps between ticks count as round.
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

/// What an axis shows.
struct Axis {
  double from = 0.0;              ///< At the left or the bottom; may be above `to`.
  double to = 1.0;                ///< At the right or the top.
  std::string label;              ///< With the unit: "x (m)".
  Steps steps = Steps::kDecimal;  ///< Between ticks.
};

/// A rectangle of the canvas with axes.
struct Plot {
  /// Its corner, pixels.
  ///@{
  double left = 0.0, top = 0.0;
  ///@}
  /// Pixels.
  ///@{
  double width = 0.0, height = 0.0;
  ///@}
  Axis x;  ///< To the right.
  Axis y;  ///< Upwards.

  /// Pixels of a point.
  [[nodiscard]] std::pair<double, double> at(double px, double py) const {
    return {left + width * (px - x.from) / (x.to - x.from),
            top + height * (1.0 - (py - y.from) / (y.to - y.from))};
  }
  /// Pixels.
  [[nodiscard]] double right() const { return left + width; }
  /// Pixels.
  [[nodiscard]] double bottom() const { return top + height; }
};

inline constexpr double kLeftRoom =
    62.0;  ///< What numbers and label take to the left of a plot, pixels.
inline constexpr double kBottomRoom = 40.0;  ///< The same below it.

/// Frame, ticks at round numbers, numbers and labels.
void draw_axes(Canvas& canvas, const Plot& plot);

/// A scale beside a plot.
struct ColorBar {
  /// Values at its ends.
  ///@{
  double low = 0.0, high = 1.0;
  ///@}
  std::string label;                            ///< With the unit.
  std::function<Color(double fraction)> color;  ///< Of a fraction of the scale, 0 to 1.
  bool logarithmic = false;                     ///< Equal ratios are equally far apart.
};
/// Room that a bar takes to the right of a plot.
inline constexpr double kBarRoom = 88.0;
/// Its upper left corner at (`left`, `top`).
void draw_color_bar(Canvas& canvas, const ColorBar& bar, double left, double top, double height);

/// What a mark means.
struct LegendEntry {
  std::string words;                                             ///< The text.
  double mark_width = 14.0;                                      ///< Pixels.
  std::function<void(Canvas& canvas, double x, double y)> mark;  ///< Its left end and middle.
};
inline constexpr double kLegendRow = 20.0;  ///< From one row of a legend to the next, pixels.
/// Rows that entries take in a width.
int legend_rows(const std::vector<LegendEntry>& entries, double width);
/// `y`: the middle of the first row.
void draw_legend(
    Canvas& canvas, const std::vector<LegendEntry>& entries, double left, double y, double width);

}  // namespace pointflight::picture
