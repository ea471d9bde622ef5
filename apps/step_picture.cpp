#include <fmt/format.h>

#include <algorithm>

#include "apps/canvas.hpp"
#include "apps/pictures.hpp"

namespace pointflight::apps {
namespace {

constexpr double kWidth = 430.0;  // of a panel's plot, pixels
constexpr double kHeight = 150.0;
constexpr double kLeft = 56.0;
constexpr double kGap = 74.0;
constexpr double kTop = 84.0;
constexpr Color kFlown{0.84, 0.37, 0.0};
constexpr Color kDesign{0.0, 0.45, 0.70};

void draw_panel(Canvas& canvas, const StepResponse& r, double left, double top) {
  const double duration = r.step * static_cast<double>(r.value.size());
  const auto at = [&](double t, double y) {
    return std::pair(left + kWidth * t / duration, top + kHeight * (1.0 - y / 1.4));
  };
  canvas.box(left, top, kWidth, kHeight, {0.96, 0.96, 0.97});
  canvas.line({at(0, 1), at(duration, 1)}, 1.0, kDim);
  const auto curve = [&](const std::vector<double>& values, double width, Color color) {
    std::vector<std::pair<double, double>> line;
    for (std::size_t i = 0; i < values.size(); i += std::max<std::size_t>(1, values.size() / 800)) {
      line.push_back(at(static_cast<double>(i) * r.step, std::clamp(values[i], -0.05, 1.4)));
    }
    canvas.line(line, width, color);
  };
  curve(designed_response(r), 1.5, kDesign);
  curve(r.value, 2.0, kFlown);
  canvas.text(left,
              top - 8.0,
              fmt::format("{}: {:g} {}; rise {:.2f} s, overshoot {:.1f} %, bandwidth {:.1f} rad/s",
                          r.name,
                          r.size,
                          r.unit,
                          r.rise_time,
                          100.0 * r.overshoot,
                          r.bandwidth),
              12.0,
              kInk);
  for (int i = 0; i <= 4; ++i) {
    const double t = duration * i / 4.0;
    canvas.text(at(t, 0).first - 12.0, top + kHeight + 15.0, fmt::format("{:.2f}", t), 10.0, kDim);
  }
  canvas.text(left + kWidth - 8.0, top + kHeight + 28.0, "s", 10.0, kDim);
  canvas.text(left - 12.0, at(0, 0).second + 4.0, "0", 10.0, kDim);
  canvas.text(left - 12.0, at(0, 1).second + 4.0, "1", 10.0, kDim);
}

}  // namespace

void draw_step_responses(const VehicleSettings& vehicle,
                         const std::vector<StepResponse>& responses,
                         const std::string& path) {
  const std::size_t rows = (responses.size() + 1) / 2;
  Canvas canvas(static_cast<int>(2 * (kLeft + kWidth) + 90.0),
                static_cast<int>(kTop + 20.0 + static_cast<double>(rows) * (kHeight + kGap)),
                kPaper);
  canvas.text(kLeft, 30.0, vehicle.title, 17.0, kInk);
  canvas.line({{kLeft, 48.0}, {kLeft + 24, 48.0}}, 2.0, kFlown);
  canvas.text(kLeft + 30, 52.0, fmt::format("flown ({})", vehicle.controller.kind), 12.0, kInk);
  canvas.line({{kLeft + 150, 48.0}, {kLeft + 174, 48.0}}, 1.5, kDesign);
  canvas.text(kLeft + 180, 52.0, "the loop's design by itself, without rotor lag", 12.0, kInk);
  for (std::size_t i = 0; i < responses.size(); ++i) {
    const std::size_t row = i / 2;
    draw_panel(canvas,
               responses[i],
               kLeft + static_cast<double>(i % 2) * (kWidth + kLeft),
               kTop + 20.0 + static_cast<double>(row) * (kHeight + kGap));
  }
  canvas.save(path);
}

}  // namespace pointflight::apps
