// What processes that share a run say to each other, in CDR: structs with a table of fields each,
// as the messages of ROS (ros_common/messages).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ros_common/codec.hpp"

namespace pointflight::share_msg {

/// Of these messages; processes of different ones do not understand each other.
inline constexpr std::uint16_t kVersion = 1;
/// "PFSW"
inline constexpr std::uint32_t kMagic = 0x57534650;

/// Which message it is.
enum class Kind : std::uint16_t { kIntroduction = 1, kStates, kClock, kPast };

/// What each message begins with.
struct Head {
  static constexpr msg::TypeName kType{"pointflight_share", "Head"};
  std::uint32_t magic = kMagic;      ///< Else it is somebody else's.
  std::uint16_t version = kVersion;  ///< Of the messages.
  Kind kind = Kind::kIntroduction;   ///< Which one it is.
  std::uint64_t process = 0;         ///< Who says it: a random number per start of a process.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("magic", m.magic);
    v("version", m.version);
    v("kind", m.kind);
    v("process", m.process);
  }
};

/// What processes have to agree on.
struct Part {
  static constexpr msg::TypeName kType{"pointflight_share", "Part"};
  std::string name;   ///< "map", "seed", ...
  std::string value;  ///< Its figure or hash.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("name", m.name);
    v("value", m.value);
  }
  /// The same name and value.
  bool operator==(const Part&) const = default;
};

/// How far a process has come.
enum class Phase : std::uint8_t { kJoining, kFlying, kLeft };

/// Who a process is and what it flies; whoever comes late gets the last one.
struct Introduction {
  static constexpr msg::TypeName kType{"pointflight_share", "Introduction"};
  Head head;                            ///< kIntroduction
  std::string name;                     ///< "host:4711"
  Phase phase = Phase::kJoining;        ///< How far it has come.
  std::vector<std::uint32_t> vehicles;  ///< Numbers in the fleet that it flies.
  std::vector<Part> parts;              ///< What it flies in.
  /// Flying: the time of its first step, which in lockstep others need from then on.
  std::int64_t begins_at = 0;
  std::uint64_t waits_for = 0;  ///< Lockstep: the process that joins, and that it stands still for.
  std::int64_t waits_at = 0;    ///< Time of the step that it stands at.
  std::int64_t ends_at = -1;    ///< Lockstep, left: time of its last step.
  bool stops = false;  ///< It left because a vehicle with on_collision: stop met something.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("head", m.head);
    v("name", m.name);
    v("phase", m.phase);
    v("vehicles", m.vehicles);
    v("parts", m.parts);
    v("begins_at", m.begins_at);
    v("waits_for", m.waits_for);
    v("waits_at", m.waits_at);
    v("ends_at", m.ends_at);
    v("stops", m.stops);
  }
};

/// A vehicle at an instant.
struct VehicleState {
  static constexpr msg::TypeName kType{"pointflight_share", "VehicleState"};
  std::uint32_t number = 0;                       ///< In the fleet.
  std::uint32_t flags = 0;                        ///< kCrashed, kArrived, kCommanded.
  std::array<double, 3> position{};               ///< World, m.
  std::array<double, 4> orientation{1, 0, 0, 0};  ///< q_world_body: w, x, y, z.
  std::array<double, 3> velocity{};               ///< World, m/s.
  std::array<double, 3> body_rate{};              ///< Body, rad/s.
  static constexpr std::uint32_t kCrashed = 1, kArrived = 2, kCommanded = 4;  ///< Bits of `flags`.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("number", m.number);
    v("flags", m.flags);
    v("position", m.position);
    v("orientation", m.orientation);
    v("velocity", m.velocity);
    v("body_rate", m.body_rate);
  }
};

/// All vehicles of a process at an instant.
struct States {
  static constexpr msg::TypeName kType{"pointflight_share", "States"};
  Head head;                           ///< kStates
  std::uint32_t counter = 0;           ///< One more each time: gaps are what was lost.
  std::uint32_t flags = 0;             ///< kLanding, kStops, kVerdict.
  std::int64_t time = 0;               ///< ns since the start of the run.
  std::int64_t end_time = 0;           ///< When its run ends by itself.
  std::vector<VehicleState> vehicles;  ///< Those that it introduced itself with.
  static constexpr std::uint32_t kLanding = 1, kStops = 2, kVerdict = 4;  ///< Bits of `flags`.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("head", m.head);
    v("counter", m.counter);
    v("flags", m.flags);
    v("time", m.time);
    v("end_time", m.end_time);
    v("vehicles", m.vehicles);
  }
};

/// What came of another process' clock message.
struct Echo {
  static constexpr msg::TypeName kType{"pointflight_share", "Echo"};
  std::uint64_t process = 0;  ///< Whose.
  std::int64_t sent = 0;      ///< Its `Clock::sent`.
  std::int64_t held = 0;      ///< ns from its arrival until this message.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("process", m.process);
    v("sent", m.sent);
    v("held", m.held);
  }
};

/// What a process' clock says, and what it has heard of the others' (as NTP, RFC 5905, section 8).
struct Clock {
  static constexpr msg::TypeName kType{"pointflight_share", "Clock"};
  Head head;                ///< kClock
  std::int64_t sent = 0;    ///< By its own steady clock, ns.
  std::int64_t clock = -1;  ///< Where its run should be by its wall clock then, ns; -1: not flying.
  std::vector<Echo> echoes;  ///< Of the others' last ones.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("head", m.head);
    v("sent", m.sent);
    v("clock", m.clock);
    v("echoes", m.echoes);
  }
};

/// Where a vehicle was, at an instant.
struct PastState {
  static constexpr msg::TypeName kType{"pointflight_share", "PastState"};
  std::int64_t time = 0;  ///< ns since the start of the run.
  VehicleState state;     ///< Then.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("time", m.time);
    v("state", m.state);
  }
};

/// Where a process' vehicles were while it and another did not hear each other.
struct Past {
  static constexpr msg::TypeName kType{"pointflight_share", "Past"};
  Head head;                      ///< kPast
  std::uint64_t to = 0;           ///< For whom.
  std::vector<PastState> states;  ///< By vehicle and time.
  template <class M, class V>
  static void fields(M& m, V& v) {
    v("head", m.head);
    v("to", m.to);
    v("states", m.states);
  }
};

/// True for an instant that a run can come to: up to eleven days.
inline bool is_time(std::int64_t ns) {
  constexpr std::int64_t kMost = 1'000'000'000'000'000;
  return ns >= 0 && ns < kMost;
}

/// Why bytes are none of these messages, in words; or nothing, and the head.
struct Opened {
  std::optional<Head> head;  ///< Of a message of this version.
  std::string fault;         ///< Why not.
};
/// The head of a message.
Opened open_message(std::span<const std::byte> bytes);

}  // namespace pointflight::share_msg
