#include <fmt/format.h>

#include <algorithm>

#include "pointflight/picture/canvas.hpp"
#include "pointflight/picture/pictures.hpp"
#include "pointflight/picture/plot.hpp"

namespace pointflight::picture {
namespace {

constexpr double kWidth = 430.0;  // of a panel's plot, pixels
constexpr double kHeight = 150.0;
constexpr double kPlotLeft = kLeftRoom + 6.0;
constexpr double kRowGap = 78.0;
constexpr double kTop = 92.0;
constexpr double kMargin = 24.0;
constexpr double kHighest = 1.4;  // of the step
constexpr Color kFlown{0.84, 0.37, 0.0};
constexpr Color kDesign{0.0, 0.45, 0.70};

void draw_panel(Canvas& canvas, const StepResponse& r, double left, double top) {
  const Plot plot{left,
                  top,
                  kWidth,
                  kHeight,
                  {0.0, r.step * static_cast<double>(r.value.size()), "time (s)", Steps::kDecimal},
                  {0.0, kHighest, "share of the step", Steps::kDecimal}};
  canvas.line({plot.at(plot.x.from, 1.0), plot.at(plot.x.to, 1.0)}, 1.0, kDim, 0.6);
  const auto curve = [&](const std::vector<double>& values, double width, Color color) {
    std::vector<std::pair<double, double>> line;
    for (std::size_t i = 0; i < values.size(); i += std::max<std::size_t>(1, values.size() / 800)) {
      line.push_back(plot.at(static_cast<double>(i) * r.step, values[i]));
    }
    canvas.line(line, width, color);
  };
  canvas.begin_clip(plot.left, plot.top, plot.width, plot.height);
  curve(designed_response(r), 1.5, kDesign);
  curve(r.value, 2.0, kFlown);
  canvas.end_clip();
  draw_axes(canvas, plot);
  canvas.text_within(
      left,
      top - 8.0,
      fmt::format("{}: {:g} {}; rise {:.2f} s, overshoot {:.1f} %, bandwidth {:.1f} rad/s",
                  r.name,
                  r.size,
                  r.unit,
                  r.rise_time,
                  100.0 * std::max(0.0, r.overshoot),
                  r.bandwidth),
      kLabelText,
      kWidth,
      kInk);
}

}  // namespace

void draw_step_responses(const VehicleSettings& vehicle,
                         const std::vector<StepResponse>& responses,
                         const std::string& path) {
  const std::size_t rows = (responses.size() + 1) / 2;
  const double column_width = kPlotLeft + kWidth;
  Canvas canvas(static_cast<int>(2.0 * column_width + kMargin),
                static_cast<int>(kTop + static_cast<double>(rows) * (kHeight + kRowGap)),
                kPaper);
  const double room = 2.0 * column_width - kPlotLeft;
  canvas.text_within(kPlotLeft, 30.0, vehicle.title, kTitleText, room, kInk);
  const auto stroke = [](double width, Color color) {
    return [=](Canvas& c, double x, double y) { c.line({{x, y}, {x + 24.0, y}}, width, color); };
  };
  draw_legend(
      canvas,
      {{fmt::format("flown ({})", vehicle.controller.kind->name), 24.0, stroke(2.0, kFlown)},
       {"the loop's design by itself, without rotor lag", 24.0, stroke(1.5, kDesign)}},
      kPlotLeft,
      50.0,
      room);
  for (std::size_t i = 0; i < responses.size(); ++i) {
    const std::size_t row = i / 2;
    draw_panel(canvas,
               responses[i],
               kPlotLeft + static_cast<double>(i % 2) * column_width,
               kTop + static_cast<double>(row) * (kHeight + kRowGap));
  }
  canvas.save(path);
}

}  // namespace pointflight::picture
