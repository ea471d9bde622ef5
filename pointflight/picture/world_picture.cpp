#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "pointflight/picture/map_layers.hpp"
#include "pointflight/picture/map_views.hpp"
#include "pointflight/picture/perspective.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::picture {
namespace {

constexpr double kHeader = 30.0;  // pixels, above the two views
constexpr double kGap = 6.0;

/// Title, view from outside and view from inside, in a frame.
void paint_world(Canvas& canvas, const WorldPicture& picture, const Frame& frame) {
  const SurfelMap& map = *picture.map;
  const Aabb& bounds = map.bounds_world();
  const double low = bounds.min.z();
  const double high = bounds.max.z() + 0.01;
  const auto color_at = [&](double z) { return ramp((z - low) / (high - low)); };
  const double width = 0.5 * (frame.width - kGap);
  const double top = frame.top + kHeader;
  const double height = frame.height - kHeader;
  const MapLayers layers(map);
  const Perspective outside(map, bounds, ceiling_cut(layers), {frame.left, top, width, height});
  outside.paint(canvas, color_at);
  const Eye eye{picture.from, picture.to, 80.0};
  const Perspective inside(map,
                           eye,
                           std::numeric_limits<double>::infinity(),
                           {frame.left + width + kGap, top, width, height},
                           {});
  inside.paint(canvas, color_at);
  canvas.text_within(
      frame.left + 4.0, frame.top + 21.0, picture.title, kTitleText, frame.width - 8.0, kInk);
}

}  // namespace

void draw_worlds(std::span<const WorldPicture> worlds, const std::string& path) {
  // one is large, more are a sheet of two columns
  const bool is_sheet = worlds.size() > 1;
  const double width = is_sheet ? 640.0 : 1240.0;
  const double height = is_sheet ? 240.0 : 430.0;
  const std::size_t columns = is_sheet ? 2 : 1;
  const std::size_t rows = (worlds.size() + columns - 1) / columns;
  Canvas canvas(static_cast<int>(static_cast<double>(columns) * (width + kGap)),
                static_cast<int>(static_cast<double>(rows) * (height + kGap)),
                kPaper);
  for (std::size_t i = 0; i < worlds.size(); ++i) {
    const std::size_t row = i / columns;
    const Frame frame{static_cast<double>(i % columns) * (width + kGap),
                      static_cast<double>(row) * (height + kGap),
                      width,
                      height};
    paint_world(canvas, worlds[i], frame);
  }
  canvas.save(path);
}

}  // namespace pointflight::picture
