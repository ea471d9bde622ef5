#include "pointflight/core/random.hpp"

#include <Random123/philox.h>

#include <cassert>
#include <cmath>

#include "pointflight/core/constants.hpp"
#include "pointflight/core/floor.hpp"
#include "pointflight/core/internal/random_kernel.hpp"
#include "pointflight/core/math.hpp"

namespace pointflight {
namespace {

double to_unit_interval(std::uint32_t high, std::uint32_t low) {
  const std::uint64_t bits = (static_cast<std::uint64_t>(high) << 32 | low) >> 11;
  return static_cast<double>(bits) * 0x1p-53;
}

}  // namespace

std::array<std::uint32_t, 4> RandomStream::bits(std::uint64_t index) const {
  const r123::Philox4x32::ctr_type counter = {{static_cast<std::uint32_t>(index),
                                               static_cast<std::uint32_t>(index >> 32),
                                               entity_,
                                               static_cast<std::uint32_t>(stream_)}};
  const r123::Philox4x32::key_type key = {
      {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)}};
  const auto words = r123::Philox4x32()(counter, key);
  return {words[0], words[1], words[2], words[3]};
}

std::array<double, 2> RandomStream::uniform2(std::uint64_t index) const {
  const auto words = bits(index);
  return {to_unit_interval(words[0], words[1]), to_unit_interval(words[2], words[3])};
}

std::array<double, 2> RandomStream::normal2(std::uint64_t index) const {
  const auto [u, v] = uniform2(index);
  // 1 - u lies in (0, 1], so that the logarithm is finite
  const double radius = std::sqrt(-2.0 * math::log(1.0 - u));
  const auto angle = math::sincos(2.0 * kPi * v);
  return {radius * angle.cos, radius * angle.sin};
}

double RandomStream::moving_normal(double t, std::uint64_t which, std::uint64_t count) const {
  const std::int64_t before = floor_to_integer(t);
  const double part = t - static_cast<double>(before);
  const auto draw = static_cast<std::uint64_t>(before);
  const double mixed =
      (1.0 - part) * normal(draw * count + which) + part * normal((draw + 1) * count + which);
  return mixed / std::sqrt((1.0 - part) * (1.0 - part) + part * part);
}

void RandomStream::uniform2(std::uint64_t first, std::span<double> u, std::span<double> v) const {
  assert(u.size() == v.size());
  draw_uniforms(
      {seed_, static_cast<std::uint32_t>(stream_), entity_}, first, u.size(), u.data(), v.data());
}

void RandomStream::normal2(std::uint64_t first, std::span<double> u, std::span<double> v) const {
  assert(u.size() == v.size());
  draw_normals(
      {seed_, static_cast<std::uint32_t>(stream_), entity_}, first, u.size(), u.data(), v.data());
}

}  // namespace pointflight
