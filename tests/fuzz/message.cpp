// Any bytes as a message of either wire: refused, or one that is written and read again the same.
#include <cstdint>
#include <tuple>

#include "pointflight/ros/common/codec.hpp"

namespace {

using namespace pointflight;

template <Wire W, class M>
void try_as(std::span<const std::byte> bytes) {
  const auto message = decode<W, M>(bytes);
  if (!message) return;
  const auto written = encode<W>(*message);
  const auto again = decode<W, M>(written);
  if (!again || encode<W>(*again) != written) __builtin_trap();
}

template <class... M>
void try_all(std::uint8_t which, std::span<const std::byte> bytes) {
  std::size_t i = 0;
  ((i++ == which % sizeof...(M) ? (try_as<Wire::kRos1, M>(bytes), try_as<Wire::kCdr, M>(bytes))
                                : void()),
   ...);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto bytes = std::as_bytes(std::span(data + 1, size - 1));
  // what comes in, and what has the most kinds of fields
  try_all<msg::PoseStamped,
          msg::TwistStamped,
          msg::PositionCommandShort,
          msg::PositionCommandLong,
          msg::PositionCommandOldest,
          msg::AttitudeTarget,
          msg::Float32MultiArray,
          msg::Joy,
          msg::Bool,
          msg::Empty,
          msg::TakeoffLand,
          msg::Odometry,
          msg::PointCloud2,
          msg::CustomMsg,
          msg::MarkerArray,
          msg::DiagnosticArray>(data[0], bytes);
  return 0;
}
