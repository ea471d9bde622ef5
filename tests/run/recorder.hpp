#pragma once

#include <string>

#include "pointflight/run/link.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight::testing {

/// Writes the run's folder.
class Recorder : public Link {
 public:
  Recorder(const std::string& folder, const Simulation& simulation)
      : simulation_(simulation), recorder_(folder, simulation) {}
  void on_sample(const Sample& sample) override { recorder_.on_sample(sample); }
  void close() override { recorder_.finish(simulation_); }

 private:
  const Simulation& simulation_;
  FlightRecorder recorder_;
};

}  // namespace pointflight::testing
