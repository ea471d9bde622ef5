#include "pointflight/picture/map_views.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pointflight::picture {
namespace {

constexpr double kWide = 1000.0;    // most room for the views, pixels
constexpr double kTall = 1050.0;    // of both together
constexpr double kNarrow = 480.0;   // least width: for titles and legends
constexpr double kFlattest = 70.0;  // least height of a side view
constexpr double kGap = 66.0;       // between the views

}  // namespace

Page lay_out(const Aabb& shown, double header) {
  const Vector3d size = shown.size();
  const double scale =
      std::min({kWide / size.x(), kTall / (size.y() + size.z()), 0.8 * kTall / size.y()});
  // a flat map's side view is drawn higher than it is
  const double stretch = std::max(1.0, std::ceil(kFlattest / (scale * size.z())));
  Page page{};
  page.shown = shown;
  page.top = {kLeftRoom + 6.0,
              header,
              scale * size.x(),
              scale * size.y(),
              {shown.min.x(), shown.max.x(), "x (m)", Steps::kDecimal},
              {shown.min.y(), shown.max.y(), "y (m)", Steps::kDecimal}};
  page.side = {page.top.left,
               page.top.bottom() + kGap,
               page.top.width,
               scale * size.z() * stretch,
               {shown.min.x(), shown.max.x(), "x (m)", Steps::kDecimal},
               {shown.min.z(),
                shown.max.z(),
                stretch > 1.0 ? fmt::format("z (m), {:.0f} : 1", stretch) : std::string("z (m)"),
                Steps::kDecimal}};
  page.width =
      static_cast<int>(page.top.left + std::max(kNarrow, page.top.width) + kBarRoom + 16.0);
  page.height = static_cast<int>(page.side.bottom() + kBottomRoom + 12.0);
  return page;
}

void add_perspective(Page& page) {
  constexpr double kShare = 0.58;  // of its width
  constexpr double kCaption = 24.0;
  page.perspective_top = page.height + kCaption;
  page.perspective_height = std::round(kShare * (page.width - page.top.left - 12.0));
  page.height = static_cast<int>(page.perspective_top + page.perspective_height + 12.0);
}

Aabb with_room(Aabb box) {
  const double room = 0.01 * box.size().maxCoeff() + 0.05;
  for (int axis = 0; axis < 3; ++axis) {
    const double more = std::max(room, 0.5 * (1.0 - box.size()[axis]));
    box.min[axis] -= more;
    box.max[axis] += more;
  }
  return box;
}

Views render(const SurfelMap& map,
             const Page& page,
             const std::function<bool(const Vector3d& p_world)>& shown_on_top) {
  const auto raster_of = [](const Plot& plot, float fill) {
    return Raster(static_cast<int>(plot.width), static_cast<int>(plot.height), fill);
  };
  Views views{raster_of(page.top, kEmpty), raster_of(page.top, kEmpty), raster_of(page.side, 0.0f)};
  const double scale = page.top.width / page.shown.size().x();
  const int side = std::max(1, static_cast<int>(std::ceil(map.resolution() * scale + 0.5)));
  map.for_each_surfel([&](const Vector3d& p, const Vector3d&, double, std::uint32_t word) {
    if ((p - page.shown.min).head<2>().minCoeff() < 0.0 ||
        (page.shown.max - p).head<2>().minCoeff() < 0.0) {
      return;
    }
    splat(views.density, page.side, page.on_side(p), side, [](float& n) { n += 1.0f; });
    if (!shown_on_top(p)) return;
    const auto z = static_cast<float>(p.z());
    const auto raise = [&](float& top) { top = std::max(top, z); };
    splat(views.top, page.top, page.on_top(p), side, raise);
    if (map.is_assumed(word)) splat(views.assumed, page.top, page.on_top(p), side, raise);
  });
  return views;
}

double ink_of(float density, double usual) {
  constexpr double kSteps = 10.0;  // few, for small files
  return std::ceil(kSteps * (1.0 - std::exp(-static_cast<double>(density) / usual))) / kSteps;
}

double usual_density(const Raster& raster) {
  std::vector<float> some;
  for (const float value : raster.values) {
    if (value > 0.0f) some.push_back(value);
  }
  if (some.empty()) return 1.0;
  const auto at = some.begin() + static_cast<std::ptrdiff_t>(some.size() * 7 / 10);
  std::nth_element(some.begin(), at, some.end());
  return std::max(1.0, static_cast<double>(*at));
}

Color mixed(Color from, Color to, double share) {
  return {from.r + share * (to.r - from.r),
          from.g + share * (to.g - from.g),
          from.b + share * (to.b - from.b)};
}

void draw_captions(Canvas& canvas, const Page& page, const std::string& top) {
  canvas.text_within(
      page.top.left, page.top.top - 7.0, top, kTickText, page.width - page.top.left - 12.0, kDim);
  canvas.text(page.side.left, page.side.top - 7.0, "from the side", kTickText, kDim);
  if (page.perspective_height <= 0.0) return;
  canvas.text(page.side.left,
              page.perspective_top - 7.0,
              "in perspective, from the south west (-x, -y)",
              kTickText,
              kDim);
}

}  // namespace pointflight::picture
