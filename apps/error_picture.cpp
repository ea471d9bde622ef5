#include "apps/error_picture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/canvas.hpp"
#include "pointflight/core/constants.hpp"
#include "pointflight/fidelity/error_statistics.hpp"

namespace pointflight::apps {
namespace {

constexpr double kMargin = 40.0;
constexpr double kHeader = 70.0;
constexpr double kPanelWidth = 640.0;
constexpr double kCaption = 24.0;

struct Kind {
  const char* name;
  Color color;
};
enum : std::size_t { kRight, kEarly, kLate, kMissing, kFalse, kNothing };
constexpr std::array<Kind, 6> kKinds = {{{"right (grey: to 0.1 m)", {0.75, 0.75, 0.75}},
                                         {"early", {1.0, 0.2, 0.2}},
                                         {"late", {0.25, 0.45, 1.0}},
                                         {"missing", {0.1, 0.9, 0.9}},
                                         {"false return", {1.0, 0.65, 0.1}},
                                         {"", {0.2, 0.2, 0.25}}}};

std::size_t kind_of(const ErrorMark& mark) {
  if (mark.truth < 0.0f) return mark.rendered < 0.0f ? kNothing : kFalse;
  if (mark.rendered < 0.0f) return kMissing;
  const double error = static_cast<double>(mark.rendered - mark.truth);
  if (error < -ErrorStatistics::kRight) return kEarly;
  return error > ErrorStatistics::kRight ? kLate : kRight;
}

Color color_of(const ErrorMark& mark) {
  const std::size_t kind = kind_of(mark);
  if (kind != kRight) return kKinds[kind].color;
  const double size = std::abs(static_cast<double>(mark.rendered - mark.truth));
  const double grey = 0.85 - 0.6 * std::min(1.0, size / ErrorStatistics::kRight);
  return {grey, grey, grey};
}

struct Frame {
  double az_low = kPi, az_high = -kPi, el_low = kPi, el_high = -kPi;
  [[nodiscard]] double wide() const { return std::max(0.01, az_high - az_low); }
  [[nodiscard]] double tall() const { return std::max(0.01, el_high - el_low); }
};

Frame frame_of(const ErrorPanel& panel) {
  Frame f;
  for (const ErrorMark& m : panel.marks) {
    f.az_low = std::min(f.az_low, static_cast<double>(m.azimuth));
    f.az_high = std::max(f.az_high, static_cast<double>(m.azimuth));
    f.el_low = std::min(f.el_low, static_cast<double>(m.elevation));
    f.el_high = std::max(f.el_high, static_cast<double>(m.elevation));
  }
  return f;
}

void draw_panel(Canvas& canvas, const ErrorPanel& panel, double left, double top) {
  const Frame f = frame_of(panel);
  const double scale = kPanelWidth / f.wide();
  canvas.text(left, top - 6.0, panel.title, 12.0, kInk);
  canvas.box(left, top, kPanelWidth, scale * f.tall(), kNight);
  const double area = kPanelWidth * scale * f.tall();
  const double apart =
      std::sqrt(area / static_cast<double>(std::max<std::size_t>(1, panel.marks.size())));
  const int side = std::clamp(static_cast<int>(std::ceil(apart)), 1, 4);
  canvas.begin_pixels();
  // errors over what is right
  for (const bool wrong : {false, true}) {
    for (const ErrorMark& m : panel.marks) {
      const std::size_t kind = kind_of(m);
      if ((kind != kRight && kind != kNothing) != wrong) continue;
      const int x = static_cast<int>(left + scale * (f.az_high - static_cast<double>(m.azimuth)));
      const int y = static_cast<int>(top + scale * (f.el_high - static_cast<double>(m.elevation)));
      for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) canvas.put(x + i, y + j, color_of(m), 1.0);
      }
    }
  }
  canvas.end_pixels();
}

}  // namespace

void draw_errors(std::span<const ErrorPanel> panels,
                 const std::string& title,
                 const std::string& path) {
  const std::size_t columns = panels.size() > 1 ? 2 : 1;
  double tallest = 100.0;
  std::array<std::size_t, kKinds.size()> counts{};
  std::size_t rays = 0;
  for (const ErrorPanel& panel : panels) {
    const Frame f = frame_of(panel);
    tallest = std::max(tallest, kPanelWidth / f.wide() * f.tall());
    for (const ErrorMark& m : panel.marks) ++counts[kind_of(m)];
    rays += panel.marks.size();
  }
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  Canvas canvas(
      static_cast<int>(static_cast<double>(columns) * (kPanelWidth + kMargin) + kMargin),
      static_cast<int>(kHeader + static_cast<double>(rows) * (tallest + kCaption) + kMargin),
      kPaper);
  canvas.text(kMargin, 26.0, title, 17.0, kInk);
  double x = kMargin;
  for (std::size_t kind = 0; kind < kNothing; ++kind) {
    canvas.box(x, 38.0, 11.0, 11.0, kKinds[kind].color);
    const std::string words = fmt::format("{} {:.2f} %",
                                          kKinds[kind].name,
                                          100.0 * static_cast<double>(counts[kind]) /
                                              static_cast<double>(std::max<std::size_t>(1, rays)));
    canvas.text(x + 15.0, 48.0, words, 11.0, kInk);
    x += 30.0 + 6.2 * static_cast<double>(words.size());
  }
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const auto column = static_cast<double>(i % columns);
    const std::size_t row_number = i / columns;
    const auto row = static_cast<double>(row_number);
    draw_panel(canvas,
               panels[i],
               kMargin + column * (kPanelWidth + kMargin),
               kHeader + kCaption * (row + 1.0) - 8.0 + row * tallest);
  }
  canvas.save(path);
}

}  // namespace pointflight::apps
