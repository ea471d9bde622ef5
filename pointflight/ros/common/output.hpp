// What a run can send to a ROS or a recording: the table of kinds, each with what makes its
// messages, and the streams that a profile makes of them. To add a kind: `M message(const
// OutputStream&, const S&)` for a kind of sample S, or a class on `Output`, and a row in
// `output_types()` (outputs.cpp, or a program's own).
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "pointflight/core/registry.hpp"
#include "pointflight/ros/common/codec.hpp"
#include "pointflight/ros/common/conversion.hpp"
#include "pointflight/ros/common/description.hpp"
#include "pointflight/ros/common/map_frame.hpp"
#include "pointflight/ros/common/profile.hpp"
#include "pointflight/sim/run_description.hpp"
#include "pointflight/sim/sensor.hpp"

namespace pointflight {

class Output;
class OutputStream;

/// How a row makes its messages: `per_sample` or `made_by`.
struct OutputMaker {
  MessageType (*type)() = nullptr;  ///< In both ROSes.
  /// The stream outlives what makes its messages.
  std::unique_ptr<Output> (*make)(OutputStream& stream) = nullptr;
};

/// A row of the table of kinds.
struct OutputType {
  /// One message stream for the run, each vehicle or each LiDAR.
  enum class Per { kRun, kVehicle, kLidar };
  /// A frame of the profile. An IMU's is the body's unless the profile names one, which is then
  /// among the static transforms. Points in single precision are in the map's: the world's, or a
  /// frame beside it (`MapFrame`).
  enum class Frame { kWorld, kMap, kBody, kImu, kSensor, kOptical };
  /// Which sensors a stream of a LiDAR is for.
  enum class Cameras {
    kExcluded,   ///< The first that is no camera; all if the topic names the LiDAR.
    kPreferred,  ///< The first camera, if there is one; all cameras if the topic names it.
    kRequired    ///< Cameras.
  };
  std::string name;                      ///< In profiles.
  std::string help;                      ///< For docs/ros.md; half a sentence.
  OutputMaker make;                      ///< Its messages.
  Per per = Per::kVehicle;               ///< What there is one of each for.
  Frame frame = Frame::kWorld;           ///< header.frame_id if the profile names none.
  Frame child = Frame::kBody;            ///< child_frame_id if the profile names none.
  Cameras cameras = Cameras::kExcluded;  ///< Of a LiDAR's.
  bool sets_odometry_rate = false;       ///< Odometry is sampled at its rate at least.
  bool has_child = false;                ///< Profiles may name its child_frame.
  bool is_transform = false;             ///< Names its frames: all vehicles may share a topic.
  /// Of a run that several processes share: each says its own vehicles' part. Others of the run
  /// come from the process that flies the first vehicle.
  bool from_each = false;
  bool latched = false;     ///< Whoever comes late gets the last message.
  bool large = false;       ///< Paced on ROS 2.
  std::size_t depth = 10;   ///< Messages that a reader's queue should hold.
  std::string sensor = {};  ///< Of measurements: the kind of sensor (`sensor_kinds`); empty: any.
  std::string layout = "xyzi";  ///< Of clouds if the profile names none.
};

/// All kinds, in the order in which they are sent at one instant. Programs may add to it before
/// they read a profile.
Registry<OutputType>& output_types();

/// What all streams of a run share.
struct RosRun {
  RunDescription run;                  ///< What it is.
  RosProfile profile;                  ///< Names and customs.
  MapFrame map_frame{};                ///< Of clouds in the world.
  Duration epoch{0};                   ///< What stamps count from, since the Unix epoch.
  std::vector<Outlet*> outlets{};      ///< Where messages go.
  SimTime latest{};                    ///< That anything left at: outlets see time go one way.
  std::vector<StatusSample> status{};  ///< The last of each vehicle.
  std::vector<double> scan_times{};    ///< How long the last scans took by the wall clock, s.
  std::uint64_t refused = 0;           ///< Messages from outside that were left out.
  std::string last_refused{};          ///< Why the last one was.
  bool keeps_scans = false;            ///< For readers that come later.
  const std::deque<OutputStream>* streams = nullptr;  ///< All of the run.

  /// What names of a vehicle and its LiDAR stand for.
  [[nodiscard]] RosNames names(std::size_t vehicle, std::size_t lidar = 0) const;
  /// A vehicle's frame.
  [[nodiscard]] std::string body_frame(std::size_t vehicle) const {
    return body_frame_of(profile, names(vehicle), vehicle);
  }
  /// A LiDAR's own axes; in optical axes it ends in `kOpticalSuffix`. Where the profile's pattern
  /// does not tell them apart, others than the first have their LiDAR's name behind.
  [[nodiscard]] std::string sensor_frame(std::size_t vehicle, std::size_t lidar) const;
};

/// One message stream of a run: an output of the profile for one vehicle or LiDAR.
class OutputStream {
 public:
  /// `entry` of the profile; what it leaves open is filled in and names are written out. Throws
  /// InputError if the kind has no such message.
  OutputStream(
      RosRun& run, const OutputType& row, RosOutput entry, std::size_t vehicle, std::size_t lidar);
  OutputStream(const OutputStream&) = delete;
  OutputStream& operator=(const OutputStream&) = delete;
  ~OutputStream();

  RosRun& ros;                     ///< Outlives the stream.
  const OutputType& type;          ///< Its row of the table.
  RosOutput settings;              ///< Names written out.
  std::size_t vehicle = 0;         ///< Number in the fleet; 0 for what is of the run.
  std::size_t lidar = 0;           ///< On that vehicle; 0 for what is of no LiDAR.
  Topic topic;                     ///< What an outlet is told of it.
  std::vector<int> numbers;        ///< Of its topic at each outlet.
  std::unique_ptr<Output> output;  ///< Makes its messages; never null.

  /// The vehicle and the LiDAR that it is about.
  ///@{
  [[nodiscard]] const VehicleDescription& of_vehicle() const { return ros.run.vehicles[vehicle]; }
  [[nodiscard]] const LidarDescription& of_lidar() const { return of_vehicle().lidars[lidar]; }
  ///@}
  /// Where the zero of its frame is in the world, m: not at zero only in the map's frame.
  [[nodiscard]] Vector3d frame_origin() const {
    return type.frame == OutputType::Frame::kMap ? ros.map_frame.origin : Vector3d::Zero();
  }
  /// A pose in the world, in the stream's frame.
  [[nodiscard]] Pose in_frame(const Pose& T_world_any) const {
    return {T_world_any.rotation, T_world_any.translation - frame_origin()};
  }
  /// Its stamp and frame.
  [[nodiscard]] msg::Header header(SimTime time) const {
    return header_of(time, ros.epoch, settings.frame);
  }
  /// True for samples of its vehicle, scans of its LiDAR, measurements of its kind of sensor.
  template <class S>
  [[nodiscard]] bool is_about(const S& sample) const {
    if constexpr (std::is_same_v<S, Measurement>) {
      if (!type.sensor.empty() &&
          ros.run.vehicles[sample.vehicle].sensors[sample.sensor] != type.sensor) {
        return false;
      }
    }
    if (type.per == OutputType::Per::kRun) return true;
    if constexpr (requires { sample.scan; }) {
      return sample.scan->vehicle == vehicle &&
             (type.per != OutputType::Per::kLidar || sample.scan->sensor == lidar);
    } else if constexpr (requires { sample.vehicle; }) {
      return sample.vehicle == vehicle;
    } else {
      return true;
    }
  }

  /// How many get a message now.
  [[nodiscard]] int reader_count() const;
  /// True if somebody does.
  [[nodiscard]] bool is_wanted() const;
  /// True if its rate has come round and somebody gets it; to be asked once for each message.
  [[nodiscard]] bool is_due(SimTime time);
  /// True once, `calls` calls after a reader has come: it may not know of us at first.
  [[nodiscard]] bool has_newcomer(int calls);
  /// Those who are there have got what there is.
  void note_served() { served_ = reader_count(); }
  /// Messages so far.
  [[nodiscard]] std::uint32_t sent() const { return sent_; }

  /// Sends a message that leaves at a time; `always`: also if nobody reads, for transports that
  /// keep it for whoever comes.
  template <class M>
  // NOLINTNEXTLINE(performance-unnecessary-value-param): a header's number is written
  void send(M message, SimTime leaves, bool always = false) {
    if constexpr (requires { message.header; }) message.header.seq = sent_;
    ++sent_;
    const std::int64_t time = stamp_leaving(leaves);
    Bytes bytes[2];
    for (std::size_t i = 0; i < ros.outlets.size(); ++i) {
      Outlet& outlet = *ros.outlets[i];
      if (!always && !outlet.has_readers(numbers[i])) continue;
      const bool ros1 = outlet.wire() == Wire::kRos1;
      Bytes& own = bytes[ros1 ? 0 : 1];
      if (!own) {
        own = std::make_shared<const std::vector<std::byte>>(ros1 ? encode<Wire::kRos1>(message)
                                                                  : encode<Wire::kCdr>(message));
      }
      outlet.send(numbers[i], own, time);
    }
    keep(bytes, time);
  }
  /// The last scan once more for those who have come since, if scans are kept.
  void resend(int calls);
  /// The run starts again at zero.
  void restart();

 private:
  std::int64_t stamp_leaving(SimTime leaves);
  void keep(Bytes (&bytes)[2], std::int64_t time);

  Schedule schedule_;
  std::optional<SimTime> first_;  ///< Sample: the schedule counts from it.
  std::int64_t next_ = 0;         ///< Of the schedule.
  std::uint32_t sent_ = 0;
  int served_ = 0;              ///< Readers that have got what there is.
  int newcomer_calls_ = 0;      ///< Since there are more of them.
  Bytes last_[2];               ///< Of a scan, by wire, if it may have to be sent again.
  std::int64_t last_time_ = 0;  ///< When it left.
};

/// Makes the messages of one stream.
class Output {
 public:
  /// The stream outlives it.
  explicit Output(OutputStream& stream) : stream_(stream) {}
  virtual ~Output() = default;
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// All topics are known: what is there before anything else.
  virtual void on_start() {}
  /// Samples of the whole run, also if nobody reads; obstacles behind all else of their step.
  virtual void on_sample(const Sample& /*sample*/) {}
  /// The run has reached a time.
  virtual void on_time(SimTime /*time*/) {}
  /// The run stands still at a time.
  virtual void on_wait(SimTime /*now*/) {}
  /// Every 50 ms, and while the run stands still: what is latched, for those who have come.
  virtual void on_look() {}
  /// The run starts again at zero.
  virtual void on_restart() {}

 protected:
  OutputStream& stream_;  ///< The way out.
};

/// How many of the last scans `RosRun::scan_times` has: MARSIM takes the mean of 21.
inline constexpr std::size_t kScanTimes = 21;

/// Bare points in the stream's layout and frame.
msg::PointCloud2 points_message(const OutputStream& stream,
                                std::span<const Vector3f> points,
                                SimTime time);

/// Messages of an own class `O` of `Output`, which sends messages of type `M`.
template <class O, class M>
OutputMaker made_by() {
  return {
      [] {
        static const MessageType type = message_type<M>();
        return type;
      },
      [](OutputStream& stream) -> std::unique_ptr<Output> { return std::make_unique<O>(stream); }};
}

namespace detail {

template <class Function>
struct MessageFunction;
template <class M, class S>
struct MessageFunction<M (*)(const OutputStream&, const S&)> {
  using Message = M;
  using Sample = S;
};

/// One message for each sample that is due, made by a function.
template <auto make>
class MessagePerSample : public Output {
  using Input = typename MessageFunction<decltype(make)>::Sample;

 public:
  using Output::Output;

  void on_sample(const Sample& sample) override {
    const auto* input = std::get_if<Input>(&sample);
    if (input == nullptr || !stream_.is_about(*input)) return;
    const SimTime leaves = arrival_of(sample);
    if (stream_.is_due(leaves)) stream_.send(make(stream_, *input), leaves);
  }
};

}  // namespace detail

/// One message for each sample of a kind, by a function `M (const OutputStream&, const S&)`.
template <auto make>
OutputMaker per_sample() {
  return made_by<detail::MessagePerSample<make>,
                 typename detail::MessageFunction<decltype(make)>::Message>();
}

/// Names of a vehicle's LiDARs, as ROS takes them: their model's, with a number if several are
/// alike.
std::vector<std::string> lidar_names(const VehicleSetup& vehicle);

/// What the optical frame (z ahead, x right, y down) of a camera ends in.
inline constexpr const char* kOpticalSuffix = "_optical";

/// The streams of a profile in a run. Outputs with `{lidar}` in their topic have one for each
/// LiDAR; without it the first that fits (a camera for depth pictures). Throws InputError if two
/// streams have one topic but different types.
std::deque<OutputStream> output_streams(RosRun& run);

/// The rate of odometry samples that a profile needs, Hz.
double odometry_rate(const RosProfile& profile);

/// Bytes per second of clouds and pictures if all are read and every beam returns.
double large_rate(const RunDescription& run, const RosProfile& profile);

}  // namespace pointflight
