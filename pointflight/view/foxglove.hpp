// The messages of Foxglove's WebSocket protocol, as it stands under both its names
// ("foxglove.sdk.v1", "foxglove.websocket.v1"): text frames are JSON, binary frames an opcode and
// little-endian numbers. Nothing here knows a socket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace pointflight::foxglove {

/// What a WebSocket handshake offers and answers, the one that servers prefer first.
inline constexpr std::string_view kSubprotocols[] = {"foxglove.sdk.v1", "foxglove.websocket.v1"};

/// A topic that the server sends.
struct Channel {
  std::uint32_t id = 0;         ///< In `Subscription::channel`.
  std::string topic;            ///< "/drone0/odom"
  std::string encoding;         ///< "cdr", "json"
  std::string schema_name;      ///< "nav_msgs/msg/Odometry"
  std::string schema;           ///< Its text.
  std::string schema_encoding;  ///< "ros2msg", "jsonschema"
};

/// A service that the server answers; requests and responses are CDR.
struct ServiceRow {
  std::uint32_t id = 0;  ///< In requests.
  std::string name;      ///< "/pointflight/reset"
  std::string type;      ///< "std_srvs/srv/Trigger"
  /// Texts, "ros2msg".
  ///@{
  std::string request_schema, response_schema;
  ///@}
};

/// What a server is.
struct ServerInfo {
  std::string name;                       ///< For people.
  std::string session;                    ///< Another one: clients forget what they had.
  std::vector<std::string> capabilities;  ///< "time", "clientPublish", "services", ...
  std::vector<std::string> encodings;     ///< Of what clients publish.
  /// First and last time of what can be played back, ns; none if it is live.
  std::optional<std::pair<std::int64_t, std::int64_t>> range;
};

/// How bad a status is.
enum class Level { kInfo = 0, kWarning = 1, kError = 2 };

// ---- from the server ----

/// The first frame of a connection.
std::string server_info_text(const ServerInfo& info);
/// All channels; may be none.
std::string advertise_text(std::span<const Channel> channels);
/// All services.
std::string advertise_services_text(std::span<const ServiceRow> services);
/// A line for the person at the other end.
std::string status_text(Level level, std::string_view message);
/// A service that failed.
std::string service_failure_text(std::uint32_t service,
                                 std::uint32_t call,
                                 std::string_view message);
/// What goes before a message's bytes; `time`: ns.
std::vector<std::byte> message_head(std::uint32_t subscription, std::int64_t time);
/// The clock, ns.
std::vector<std::byte> time_frame(std::int64_t time);
/// The answer to a service's request, CDR.
std::vector<std::byte> service_response_frame(std::uint32_t service,
                                              std::uint32_t call,
                                              std::span<const std::byte> response);
/// How a playback stands.
struct PlaybackState {
  /// What it does.
  enum class Status : std::uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };
  Status status = Status::kPaused;  ///< What it does now.
  std::int64_t time = 0;            ///< ns
  float speed = 1.0f;               ///< Times real time.
  bool did_seek = false;            ///< It jumped there.
  std::string request;              ///< What it answers; may be empty.
};
/// As a frame.
std::vector<std::byte> playback_state_frame(const PlaybackState& state);

// ---- from clients ----

/// A client wants a channel under a number of its own.
struct Subscription {
  std::uint32_t id = 0;       ///< The client's.
  std::uint32_t channel = 0;  ///< The server's.
};
/// "subscribe"
struct Subscribe {
  std::vector<Subscription> subscriptions;  ///< New ones.
};
/// "unsubscribe"
struct Unsubscribe {
  std::vector<std::uint32_t> ids;  ///< As it subscribed.
};
/// A topic that a client wants to send.
struct ClientChannel {
  std::uint32_t id = 0;     ///< The client's.
  std::string topic;        ///< "/drone0/cmd"
  std::string encoding;     ///< "cdr"
  std::string schema_name;  ///< "geometry_msgs/msg/Twist"
};
/// "advertise"
struct ClientAdvertise {
  std::vector<ClientChannel> channels;  ///< New ones.
};
/// "unadvertise"
struct ClientUnadvertise {
  std::vector<std::uint32_t> ids;  ///< As it advertised.
};
/// An op that the protocol has and this server does not need: parameters, assets, graphs.
struct Ignored {
  std::string op;  ///< Its name.
};
/// A text frame of a client.
using TextRequest =
    std::variant<Subscribe, Unsubscribe, ClientAdvertise, ClientUnadvertise, Ignored>;

/// A message of a client; `data` are bytes of the frame.
struct ClientMessage {
  std::uint32_t channel = 0;        ///< The client's.
  std::span<const std::byte> data;  ///< In the channel's encoding.
};
/// A request to a service; `data` are bytes of the frame.
struct ServiceRequest {
  std::uint32_t service = 0;        ///< The server's.
  std::uint32_t call = 0;           ///< The client's.
  std::string encoding;             ///< "cdr"
  std::span<const std::byte> data;  ///< The request.
};
/// Play, pause, jump.
struct PlaybackControl {
  bool play = false;                 ///< False: pause.
  float speed = 1.0f;                ///< Times real time.
  std::optional<std::int64_t> seek;  ///< Where to, ns.
  std::string request;               ///< To be answered with.
};
/// A binary frame of a client.
using BinaryRequest = std::variant<ClientMessage, ServiceRequest, PlaybackControl>;

/// Throws InputError with a line for the client.
TextRequest parse_text(std::string_view frame);
/// Throws InputError with a line for the client.
BinaryRequest parse_binary(std::span<const std::byte> frame);

}  // namespace pointflight::foxglove
