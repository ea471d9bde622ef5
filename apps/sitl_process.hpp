#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <thread>

#include "pointflight/campaign/process.hpp"
#include "pointflight/vehicle/airframe.hpp"

namespace pointflight::apps {

/// PX4 as a child of this program: started with the parameters of a vehicle in a folder of its own,
/// ended with it.
class StartedPx4 {
 public:
  /// `program`: bin/px4 of a build for SITL, or that build's folder. `folder` is made if it is not
  /// there; what PX4 writes there stays, its console in console.txt. Throws InputError if there is
  /// no such program.
  StartedPx4(const std::string& program,
             const std::string& folder,
             std::uint16_t instance,
             const VehicleSettings& vehicle,
             bool vision);
  ~StartedPx4();
  StartedPx4(const StartedPx4&) = delete;
  StartedPx4& operator=(const StartedPx4&) = delete;

  /// It has ended by itself.
  [[nodiscard]] bool is_gone() const { return gone_; }

 private:
  std::atomic<bool> stop_ = false;
  std::atomic<bool> gone_ = false;
  std::thread thread_;
};

}  // namespace pointflight::apps
