// What a flight is to the one who started it: lines on the terminal, files in a folder.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "apps/flight_part.hpp"
#include "pointflight/picture/run_picture.hpp"
#include "pointflight/run/run_loop.hpp"
#include "pointflight/run/threaded_link.hpp"
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

/// The terminal as a part of a flight.
class TerminalPart : public FlightPart {
 public:
  void connect(Simulation& simulation, RunLoop& loop) override;

 private:
  std::unique_ptr<TerminalLink> link_;
};

/// What a run leaves.
struct FolderOptions {
  std::string folder;  ///< Empty: nothing.
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
  picture::RunPicture picture_;
  bool ended_ = false;
};

/// A folder of results as a part of a flight; a thread of its own writes it.
class FolderPart : public FlightPart {
 public:
  /// Of a flight on `threads`.
  FolderPart(FolderOptions options, int threads)
      : options_(std::move(options)), threads_(threads) {}
  /// What is wrong with the folder is said before a long search; `RunFolder` says it for good.
  void check() const override;
  void connect(Simulation& simulation, RunLoop& loop) override;

 private:
  FolderOptions options_;
  int threads_;
  std::unique_ptr<FolderLink> link_;
  std::optional<ThreadedLink> thread_;
};

}  // namespace pointflight::apps
