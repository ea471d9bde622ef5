#include "pointflight/lidar/return_chances.hpp"

namespace pointflight {

ReturnChances::ReturnChances(const ScanAddress& address, bool noise)
    : address_(address),
      has_noise_(noise),
      noise_(address.seed, StreamId::kLidarRangeNoise, address.sensor),
      detection_(address.seed, StreamId::kLidarDetection, address.sensor),
      weather_(address.seed, StreamId::kLidarWeather, address.sensor) {}

BeamChances ReturnChances::of(std::size_t first, std::size_t count) {
  const std::uint64_t beam = address_.scan << 32 | first;
  normals_.assign(count + count % 2, 0.0);
  detections_.resize(count);
  places_.resize(count);
  detection_.uniform2(beam, detections_, places_);
  if (has_noise_) {  // two neighbours share a draw of two
    const std::size_t pairs = normals_.size() / 2;
    even_.resize(pairs);
    odd_.resize(pairs);
    noise_.normal2(address_.scan << 32 | first / 2, even_, odd_);
    for (std::size_t i = 0; i < pairs; ++i) {
      normals_[2 * i] = even_[i];
      normals_[2 * i + 1] = odd_[i];
    }
  }
  return {normals_, detections_, places_, [this, beam](std::size_t i, std::size_t echo) {
            return more(beam + i, echo);
          }};
}

EchoChance ReturnChances::more(std::uint64_t beam, std::size_t echo) const {
  const auto entity = static_cast<std::uint32_t>(echo) << 28 | address_.sensor;
  const RandomStream own(address_.seed, StreamId::kLidarEcho, entity);
  EchoChance chance;
  chance.normal = has_noise_ ? own.normal(2 * beam) : 0.0;
  chance.detection = own.uniform(2 * beam + 1);
  if (echo == Echoes::kMost) {
    const auto [drop, drop_position] = weather_.uniform2(beam);
    chance.drop = drop;
    chance.drop_position = drop_position;
  }
  return chance;
}

}  // namespace pointflight
