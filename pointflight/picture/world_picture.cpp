#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "pointflight/map/surfel.hpp"
#include "pointflight/picture/map_layers.hpp"
#include "pointflight/picture/map_views.hpp"
#include "pointflight/picture/perspective.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::picture {
namespace {

constexpr double kHeader = 30.0;  // pixels, above the two views
constexpr double kGap = 6.0;
constexpr int kSamples = 3;  // rays along each side of a pixel

/// Colours of what is seen of a world: its class's in daylight, brighter where the map's intensity
/// (percent) is higher.
class Daylight {
 public:
  explicit Daylight(const WorldPicture& picture)
      : map_(*picture.map), colors_(picture.class_colors) {}

  Color operator()(const Seen& seen, const Vector3d& direction) const {
    const Color c = color_of(seen);
    const double brightness =
        std::min(1.0, 0.75 + 0.005 * static_cast<double>(map_.intensity(seen.surfel)));
    const double light = brightness * light_on(seen, direction);
    return {light * c.r, light * c.g, light * c.b};
  }

 private:
  [[nodiscard]] Color color_of(const Seen& seen) const {
    const std::size_t kind = map_.notes().label(seen.surfel).kind;
    if (kind > 0 && kind < colors_.size()) return colors_[kind];
    const Aabb& box = map_.bounds_world();
    return ramp((static_cast<double>(seen.z) - box.min.z()) / (box.size().z() + 0.01));
  }

  /// From the sky, from the sun and from the eye.
  [[nodiscard]] double light_on(const Seen& seen, const Vector3d& direction) const {
    if (seen.surfel >= map_.words().size()) return 1.0;
    static const Vector3d sun = Vector3d(-0.35, -0.65, 0.68).normalized();
    Vector3d normal = decode(map_.words()[seen.surfel]).axes.col(0).cast<double>();
    if (normal.dot(direction) > 0.0) normal = -normal;
    return 0.42 + 0.08 * normal.z() + 0.25 * static_cast<double>(seen.cosine) +
           0.33 * std::max(0.0, normal.dot(sun));
  }

  const SurfelMap& map_;
  const std::vector<Color>& colors_;
};

/// Title, view from outside and view from inside, in a frame.
void paint_world(Canvas& canvas, const WorldPicture& picture, const Frame& frame) {
  const SurfelMap& map = *picture.map;
  const double width = 0.5 * (frame.width - kGap);
  const double top = frame.top + kHeader;
  const double height = frame.height - kHeader;
  const MapLayers layers(map);
  const Daylight daylight(picture);
  const Perspective outside(
      map, map.bounds_world(), ceiling_cut(layers), {frame.left, top, width, height}, kSamples);
  outside.paint_seen(canvas, daylight);
  const Eye eye{picture.from, picture.to, 80.0};
  const Perspective inside(map,
                           eye,
                           std::numeric_limits<double>::infinity(),
                           {frame.left + width + kGap, top, width, height},
                           {},
                           kSamples);
  inside.paint_seen(canvas, daylight);
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
