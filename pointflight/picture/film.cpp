#include "pointflight/picture/film.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <system_error>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/locked_file.hpp"
#include "pointflight/picture/map_layers.hpp"
#include "pointflight/picture/map_views.hpp"
#include "pointflight/picture/perspective.hpp"
#include "pointflight/picture/pictures.hpp"

namespace pointflight::picture {
namespace {

namespace fs = std::filesystem;

constexpr double kBehind = 3.6;  // m
constexpr double kAbove = 1.7;   // m
constexpr double kSlow = 0.6;    // s that the camera takes to follow
constexpr Color kObstacle{0.75, 0.25, 0.25};
constexpr Color kMeasured{0.95, 0.75, 0.1};
constexpr std::size_t kMostMarks = 6000;  // of a scan

/// What the samples so far say.
class Filmed : public SampleSink {
 public:
  explicit Filmed(const RunDescription& run) : run_(run), poses_(run.vehicles.size()) {}

  void on_sample(const Sample& sample) override {
    if (const auto* state = std::get_if<StateSample>(&sample)) {
      poses_[state->vehicle] = state->state.body.T_world_body();
      speeds_.resize(poses_.size(), Vector3d::Zero());
      speeds_[state->vehicle] = state->state.body.v_world;
    } else if (const auto* obstacles = std::get_if<ObstacleSample>(&sample)) {
      obstacles_ = obstacles->obstacles;
    } else if (const auto* scan = std::get_if<ScanSample>(&sample)) {
      keep(*scan);
    }
  }

  /// All that moves, where it is.
  [[nodiscard]] std::vector<Body> bodies() const {
    std::vector<Body> bodies;
    for (std::size_t v = 0; v < poses_.size(); ++v) {
      if (!poses_[v]) continue;
      Body body;
      body.label = static_cast<Label>(kFirstVehicle + v);
      body.shape = run_.vehicles[v].shape;
      body.look = run_.vehicles[v].look;
      body.motion = PoseTrack(*poses_[v]);
      bodies.push_back(std::move(body));
    }
    for (const PlacedObstacle& o : obstacles_) {
      Body body;
      body.label = o.label;
      body.shape = o.shape;
      body.motion = PoseTrack(o.T_world_body);
      bodies.push_back(std::move(body));
    }
    return bodies;
  }

  [[nodiscard]] const std::optional<Pose>& pose(std::size_t v) const { return poses_[v]; }
  [[nodiscard]] Vector3d speed(std::size_t v) const {
    return v < speeds_.size() ? speeds_[v] : Vector3d::Zero();
  }
  [[nodiscard]] const std::vector<Vector3d>& measured() const { return measured_; }

 private:
  void keep(const ScanSample& sample) {
    const Scan& scan = *sample.scan;
    const std::size_t stride = 1 + scan.points.size() / kMostMarks;
    measured_.clear();
    for (std::size_t i = 0; i < scan.points.size(); i += stride) {
      const ScanPoint& p = scan.points[i];
      measured_.push_back(sample.T_world_sensor.at(scan.seen_at(p)) *
                          p.position_sensor.cast<double>());
    }
  }

  const RunDescription& run_;
  std::vector<std::optional<Pose>> poses_;
  std::vector<Vector3d> speeds_;
  std::vector<PlacedObstacle> obstacles_;
  std::vector<Vector3d> measured_;
};

/// Behind a vehicle, seen along the way that it goes, and never in a hurry.
class Camera {
 public:
  Eye follow(const Pose& body, const Vector3d& speed, double seconds) {
    Vector3d ahead = body.rotation * Vector3d::UnitX();
    if (speed.head<2>().norm() > 0.3) ahead = speed;
    ahead.z() = 0.0;
    ahead = ahead.norm() > 1e-6 ? ahead.normalized() : Vector3d::UnitX();
    const Vector3d wanted = body.translation - kBehind * ahead + Vector3d(0.0, 0.0, kAbove);
    const double share = std::min(1.0, seconds / kSlow);
    place_ = place_ ? Vector3d(*place_ + share * (wanted - *place_)) : wanted;
    return {*place_, body.translation + Vector3d(0.0, 0.0, 0.3), 70.0};
  }

 private:
  std::optional<Vector3d> place_;
};

/// Throws InputError if the folder has no such vehicle.
std::size_t vehicle_to_follow(const RunDescription& run, std::optional<std::size_t> wanted) {
  std::vector<std::string> there;
  for (std::size_t v = 0; v < run.vehicles.size(); ++v) {
    if (!run.vehicles[v].own) continue;
    if (!wanted || *wanted == v) return v;
    there.push_back(fmt::format("{}", v));
  }
  if (there.empty()) throw InputError("the folder has no flight of a vehicle; nothing to film");
  throw InputError(
      fmt::format("--follow {}: the folder has vehicle {}", *wanted, fmt::join(there, ", ")));
}

}  // namespace

std::size_t film_run(RecordedRun& run, const FilmOptions& options, const Progress& progress) {
  const RunDescription& description = run.description();
  const std::size_t followed = vehicle_to_follow(description, options.vehicle);
  const SurfelMap& map = *description.map;
  const MapLayers layers(map);
  const double low = layers.box().min.z();
  const double high = std::max(low + 1.0, layers.box().max.z());
  const Frame frame{
      0.0, 0.0, static_cast<double>(options.width), static_cast<double>(options.height)};
  Filmed filmed(description);
  Camera camera;
  std::vector<Vector3d> way;
  std::size_t pictures = 0;
  run.rewind();
  const double end = to_seconds(run.end());
  for (SimTime time; time <= run.end(); time += run.step()) {
    run.play_step(time, filmed);
    const auto& pose = filmed.pose(followed);
    if (!pose || to_seconds(time) * options.rate < static_cast<double>(pictures)) continue;
    way.push_back(pose->translation);
    const std::vector<Body> bodies = filmed.bodies();
    const Eye eye = camera.follow(*pose, filmed.speed(followed), 1.0 / options.rate);
    // under a ceiling the eye is, too
    const Perspective view(
        map, eye, std::numeric_limits<double>::infinity(), frame, {bodies, time});
    Canvas canvas(options.width, options.height, kNight);
    view.paint(
        canvas,
        [&](double z) { return ramp(0.1 + 0.85 * (z - low) / (high - low)); },
        [](Label label) {
          return label < kFirstObstacle ? vehicle_color(label - kFirstVehicle) : kObstacle;
        });
    for (const Vector3d& p : filmed.measured()) {
      if (const auto at = view.visible(p)) canvas.dot(at->first, at->second, 1.3, kMeasured, 0.7);
    }
    view.draw_path(canvas, way, vehicle_color(followed));
    canvas.text(16.0,
                options.height - 16.0,
                fmt::format("{}   {:.1f} s   {:.1f} m/s",
                            description.vehicles[followed].setup.name,
                            to_seconds(time),
                            filmed.speed(followed).norm()),
                kTitleText,
                kPaper);
    canvas.save((fs::path(options.frames) / fmt::format("{:06}.png", pictures)).string());
    ++pictures;
    report(progress, "filming", to_seconds(time) / std::max(1e-9, end));
  }
  return pictures;
}

namespace {

/// Runs ffmpeg over the pictures; `name` is what the user calls the film.
void encode(const FilmOptions& options, const std::string& path, const std::string& name) {
  const std::string rate = fmt::format("{:g}", options.rate);
  const std::string input = (fs::path(options.frames) / "%06d.png").string();
  std::vector<std::string> words = {"ffmpeg",
                                    "-nostdin",
                                    "-loglevel",
                                    "error",
                                    "-y",
                                    "-framerate",
                                    rate,
                                    "-i",
                                    input,
                                    "-pix_fmt",
                                    "yuv420p",
                                    path};
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, "ffmpeg", nullptr, nullptr, arguments.data(), environ);
  if (failed != 0) {
    throw InputError(
        fmt::format("--video: ffmpeg: {}; install it, or take the pictures of --frames",
                    std::generic_category().message(failed)));
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw InputError(fmt::format("--video {}: ffmpeg could not write it (above)", name));
  }
}

}  // namespace

void make_video(const FilmOptions& options, const std::string& path) {
  // under a name beside it until it is complete; ffmpeg goes by the extension
  const OutputName name(path);
  const fs::path end(path);
  const std::string partial =
      (end.parent_path() /
       fmt::format(".{}.pointflight{}", end.stem().string(), end.extension().string()))
          .string();
  const int lock = open_locked(partial, path);
  try {
    encode(options, partial, path);
    name.take(partial, lock);
  } catch (...) {
    remove_locked(lock, partial);
    ::close(lock);
    throw;
  }
  ::close(lock);
}

}  // namespace pointflight::picture
