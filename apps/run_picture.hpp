#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "pointflight/sim/simulation.hpp"

namespace pointflight::apps {

/// Some of what is offered, evenly over all of it: every other item goes whenever `most` are
/// reached.
template <class T>
class Thinned {
 public:
  explicit Thinned(std::size_t most) : most_(most) {}

  void add(const T& item) {
    if (offered_++ % stride_ != 0) return;
    if (items_.size() == most_) {
      for (std::size_t i = 0; 2 * i < items_.size(); ++i) items_[i] = items_[2 * i];
      items_.resize((items_.size() + 1) / 2);
      stride_ *= 2;
      if ((offered_ - 1) % stride_ != 0) return;
    }
    items_.push_back(item);
  }
  [[nodiscard]] const std::vector<T>& items() const { return items_; }

 private:
  std::size_t most_;
  std::size_t stride_ = 1;
  std::size_t offered_ = 0;
  std::vector<T> items_;
};

/// Where something went: points at least some way apart, which grows so that a path of any length
/// takes bounded memory.
class Track {
 public:
  void add(const Vector3d& p_world);
  /// The way so far, to the last place.
  [[nodiscard]] std::vector<Vector3d> points() const;
  [[nodiscard]] const Vector3d& first() const { return points_.front(); }
  [[nodiscard]] const Vector3d& last() const { return last_; }
  [[nodiscard]] bool empty() const { return points_.empty(); }

 private:
  double apart_ = 0.05;  ///< m
  std::vector<Vector3d> points_;
  Vector3d last_ = Vector3d::Zero();
};

/// What a picture of a run shows, collected while the run goes on or read from its files. Its
/// memory does not grow with the run's length.
class RunPicture : public SampleSink {
 public:
  void on_sample(const Sample& sample) override;

  void add_path_point(std::size_t vehicle, const Vector3d& p_world);
  void add_obstacle(std::uint32_t label, const Vector3d& p_world, double radius);

  /// One measured point of so many is worth drawing.
  static constexpr std::size_t kSeenStride = 40;

  /// Where an obstacle went, from the last time on that it was replaced.
  struct Trace {
    std::uint32_t label = 0;
    double radius = 0.0;
    Track track;
  };
  std::vector<Track> paths;                      ///< Of each vehicle.
  std::vector<std::string> names;                ///< Of each vehicle.
  std::vector<std::vector<Vector3d>> waypoints;  ///< Of each vehicle.
  Thinned<Vector3d> seen{200000};                ///< Measured points of the map.
  Thinned<Vector3d> seen_moving{50000};          ///< Measured points of bodies.
  Thinned<Vector3d> collisions{10000};
  std::vector<Trace> traces;
  std::string title, subtitle;

 private:
  std::set<std::size_t> own_;  ///< Vehicles that this process flies.
  void add_scan(const ScanSample& sample);
  std::unordered_map<std::uint32_t, std::size_t> trace_of_;  ///< By label.
};

/// Figures of a run for its titles.
struct RunFigures {
  std::size_t vehicles = 0;
  std::size_t others = 0;  ///< Vehicles that other processes flew.
  double flown = 0.0;      ///< By all together, m.
  double time = 0.0;       ///< s
  std::string end;
  std::uint64_t scans = 0, points = 0, collisions = 0;
  std::optional<double> closest;  ///< m; nothing where it was over 10 m.

  void add_closest(std::optional<double> distance);
};
void write_titles(const RunFigures& figures, RunPicture& picture);

/// Titles, names and waypoints of a run that has ended.
void describe_run(const Simulation& simulation, RunPicture& picture);

}  // namespace pointflight::apps
