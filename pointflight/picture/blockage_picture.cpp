#include <fmt/format.h>

#include "pointflight/picture/plot.hpp"
#include "pointflight/picture/sensor_picture.hpp"

namespace pointflight::picture {
namespace {

constexpr int kBlockageWidth = 940;
constexpr int kBlockageHeight = 520;
constexpr double kBlockageTop = 76.0;

Color color_of_share(double share) {
  return {0.98 - 0.43 * share, 0.93 - 0.83 * share, 0.88 - 0.73 * share};
}

}  // namespace

void draw_blockage(const BlockageFit& fit, const std::string& title, const std::string& path) {
  Canvas canvas(kBlockageWidth, kBlockageHeight, kPaper);
  Plot plot{kLeftRoom + 10.0,
            kBlockageTop,
            kBlockageWidth - kLeftRoom - kBarRoom - 40.0,
            kBlockageHeight - kBlockageTop - kBottomRoom - 16.0,
            {180.0, -180.0, "azimuth (deg): left of the sensor is on the left", Steps::kAngle},
            {-90.0, 90.0, "elevation (deg)", Steps::kAngle}};
  canvas.text_within(kLeftRoom, 30.0, title, kTitleText, kBlockageWidth - 2.0 * kLeftRoom, kInk);
  canvas.text(kLeftRoom + 10.0,
              54.0,
              fmt::format("{:.1f} % of all beams are lost to what carries it; {:.0f} % lie where "
                          "the scans tell it",
                          100.0 * fit.blocked,
                          100.0 * fit.told),
              kLabelText,
              kDim);
  for (const BlockedSector& s : fit.sectors) {
    const auto [left, top] = plot.at(s.azimuth_to, s.elevation_to);
    const auto [right, bottom] = plot.at(s.azimuth_from, s.elevation_from);
    canvas.box(left, top, right - left, bottom - top, color_of_share(s.share));
  }
  draw_axes(canvas, plot);
  const ColorBar bar{0.0, 100.0, "blocked (% of the time)", color_of_share};
  draw_color_bar(canvas, bar, plot.right() + 16.0, plot.top, plot.height);
  canvas.save(path);
}

}  // namespace pointflight::picture
