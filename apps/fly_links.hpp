// What a flight is to the one who started it: lines on the terminal, files in a folder.
#pragma once

#include <string>

#include "apps/run_picture.hpp"
#include "pointflight/run/run_loop.hpp"
#include "pointflight/sim/flight_recorder.hpp"
#include "pointflight/sim/simulation.hpp"

namespace pointflight::apps {

/// Says collisions and what happens on board as they happen.
class TerminalLink : public Link {
 public:
  explicit TerminalLink(const Simulation& simulation) : simulation_(simulation) {}
  void on_sample(const Sample& sample) override;
  /// Nobody flies for its sake alone.
  [[nodiscard]] bool is_in_use() const override { return false; }

 private:
  void say(const CollisionEvent& event);
  void say(const VehicleEvent& event);

  const Simulation& simulation_;
  int collisions_ = 0;
  int events_ = 0;
};

/// What a run leaves.
struct FolderOptions {
  std::string folder;
  Existing existing;
  bool draws = true;  ///< overview.png
};

/// Files and picture of a run. A run that starts again ends its files.
class FolderLink : public Link {
 public:
  /// All must outlive it; `loop` knows how long the run took, on `threads`.
  FolderLink(const FolderOptions& options,
             const Simulation& simulation,
             const RunLoop& loop,
             int threads);
  void on_sample(const Sample& sample) override;
  void on_reset(SimTime reached) override;
  void close() override;

 private:
  void write_timing() const;

  const Simulation& simulation_;
  const RunLoop& loop_;
  int threads_;
  bool draws_;
  FlightRecorder recorder_;
  std::string picture_path_, timing_path_;  ///< In the run's folder.
  RunPicture picture_;
  bool ended_ = false;
};

}  // namespace pointflight::apps
