#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "pointflight/sim/simulation.hpp"

namespace pointflight::picture {

/// Some of what is offered, evenly over all of it: every other item goes whenever `most` are
/// reached.
template <class T>
class Thinned {
 public:
  /// Keeps `most` items at most.
  explicit Thinned(std::size_t most) : most_(most) {}

  /// Offers an item.
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
  /// Those that were kept.
  [[nodiscard]] const std::vector<T>& items() const { return items_; }

 private:
  std::size_t most_;
  std::size_t stride_ = 1;
  std::size_t offered_ = 0;
  std::vector<T> items_;
};

/// The path of something: points at least some distance apart, which grows so that a path of any
/// length takes bounded memory.
class Track {
 public:
  /// Adds its position.
  void add(const Vector3d& p_world);
  /// The path so far, up to the last position.
  [[nodiscard]] std::vector<Vector3d> points() const;
  /// The first position; undefined if `empty`.
  [[nodiscard]] const Vector3d& first() const { return points_.front(); }
  /// The last position.
  [[nodiscard]] const Vector3d& last() const { return last_; }
  /// True if nothing was added.
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

  /// Where a vehicle was.
  void add_path_point(std::size_t vehicle, const Vector3d& p_world);
  /// Where an obstacle was; `radius` of the ball around it, m.
  void add_obstacle(std::uint32_t label, const Vector3d& p_world, double radius);

  /// One measured point of so many is worth drawing.
  static constexpr std::size_t kSeenStride = 40;

  /// The path of an obstacle since it was last replaced.
  struct Trace {
    std::uint32_t label = 0;  ///< Of its body.
    double radius = 0.0;      ///< m
    Track track;              ///< Its path.
  };
  std::vector<Track> paths;                      ///< Of each vehicle.
  std::vector<std::string> names;                ///< Of each vehicle.
  std::vector<std::vector<Vector3d>> waypoints;  ///< Of each vehicle.
  Thinned<Vector3d> seen{200000};                ///< Measured points of the map.
  Thinned<Vector3d> seen_moving{50000};          ///< Measured points of bodies.
  Thinned<Vector3d> collisions{10000};           ///< Positions, world.
  std::vector<Trace> traces;                     ///< Of obstacles.
  /// Above the picture.
  ///@{
  std::string title, subtitle;
  ///@}

 private:
  std::set<std::size_t> own_;  ///< Vehicles that this process flies.
  void add_scan(const ScanSample& sample);
  std::unordered_map<std::uint32_t, std::size_t> trace_of_;  ///< By label.
};

/// Figures of a run for its titles.
struct RunFigures {
  std::size_t vehicles = 0;      ///< That this process flew.
  std::size_t others = 0;        ///< Vehicles that other processes flew.
  double flown = 0.0;            ///< By all together, m.
  double time = 0.0;             ///< s
  std::string end;               ///< How it ended, in words.
  std::uint64_t scans = 0;       ///< Of all LiDARs.
  std::uint64_t points = 0;      ///< Of all scans.
  std::uint64_t collisions = 0;  ///< Of all vehicles.
  std::optional<double>
      closest;  ///< Least distance to anything, m; nothing if it was always over 10 m.

  /// Keeps the least distance.
  void add_closest(std::optional<double> distance);
};
/// Titles of figures.
void write_titles(const RunFigures& figures, RunPicture& picture);

/// Titles, names and waypoints of a run that has ended.
void describe_run(const Simulation& simulation, RunPicture& picture);

}  // namespace pointflight::picture
