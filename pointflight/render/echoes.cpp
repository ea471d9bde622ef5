#include "pointflight/render/echoes.hpp"

#include <algorithm>
#include <tuple>

namespace pointflight {
namespace {

constexpr double kNearest = kNearestEcho;

double energy_of(const BeamPart& part) {
  const double range = std::max(static_cast<double>(part.range), kNearest);
  return static_cast<double>(part.share) * static_cast<double>(part.reflectivity) / (range * range);
}

}  // namespace

double energy_of(const Echo& echo) {
  const double range = std::max(static_cast<double>(echo.range), kNearest);
  return static_cast<double>(echo.reflectivity) / (range * range);
}

Echo merged(std::span<const BeamPart> parts) {
  double energy = 0.0;
  double range = 0.0;
  double intensity = 0.0;
  double most = -1.0;
  float nearest = 0.0f;
  float farthest = 0.0f;
  Echo echo;
  for (const BeamPart& part : parts) {
    if (!part.is_return()) continue;
    nearest = echo.parts == 0 ? part.range : std::min(nearest, part.range);
    farthest = std::max(farthest, part.range);
    ++echo.parts;
    const double e = energy_of(part);
    energy += e;
    range += e * static_cast<double>(part.range);
    intensity += e * static_cast<double>(part.intensity);
    echo.reflectivity += part.share * part.reflectivity;
    if (e <= most) continue;
    most = e;
    echo.label = part.label;
    echo.origin = part.origin;
    echo.range = part.range;
    echo.intensity = part.intensity;
  }
  echo.depth = farthest - nearest;
  if (energy > 0.0) {
    echo.range = static_cast<float>(range / energy);
    echo.intensity = static_cast<float>(intensity / energy);
  }
  return echo;
}

void add_echo(const Echo& echo, Echoes& echoes) {
  if (echoes.count < Echoes::kMost) {
    echoes.all[echoes.count++] = echo;
    return;
  }
  // the weakest makes room
  const auto weakest =
      std::min_element(echoes.all.begin(), echoes.all.end(), [](const Echo& a, const Echo& b) {
        return energy_of(a) < energy_of(b);
      });
  if (energy_of(*weakest) >= energy_of(echo)) return;
  std::move(weakest + 1, echoes.all.end(), weakest);
  echoes.all.back() = echo;
}

Echoes echoes_of(std::span<BeamPart> parts, float merge) {
  // ties in an order of their own: the sums below are the same bits everywhere
  std::sort(parts.begin(), parts.end(), [](const BeamPart& a, const BeamPart& b) {
    return std::tie(a.range, a.share, a.reflectivity, a.label, a.origin.sub_ray) <
           std::tie(b.range, b.share, b.reflectivity, b.label, b.origin.sub_ray);
  });
  Echoes echoes;
  std::size_t begin = 0;
  while (begin < parts.size() && !parts[begin].is_return()) ++begin;
  echoes.all_hit = begin == 0 && !parts.empty();
  while (begin < parts.size()) {
    std::size_t end = begin + 1;
    while (end < parts.size() && parts[end].range - parts[end - 1].range <= merge) ++end;
    add_echo(merged(parts.subspan(begin, end - begin)), echoes);
    begin = end;
  }
  return echoes;
}

}  // namespace pointflight
