// One port for all viewers: HTTP for the page and the map, a WebSocket that speaks Foxglove's
// protocol for the run.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pointflight/ros/common/wire.hpp"
#include "pointflight/view/foxglove.hpp"

namespace pointflight {

/// An answer to GET or HEAD. Ranges of it are the server's matter.
struct WebContent {
  std::string type;                                     ///< "text/html; charset=utf-8"
  std::shared_ptr<const std::vector<std::byte>> bytes;  ///< Not null.
  bool may_be_kept = false;  ///< It never changes under its name: browsers need not ask again.
};

/// Where and how to serve.
struct LiveServerOptions {
  std::string address = "127.0.0.1";  ///< An address of this machine, or 0.0.0.0.
  std::uint16_t port = 8765;          ///< The first to try; 0: any.
  int ports = 20;                     ///< So many are tried, one after the other.
  std::string name = "pointflight";   ///< In serverInfo.
  bool control = true;                ///< Clients may command: own page with the token, natives.
  std::vector<std::string> capabilities;  ///< Beside those that channels and services need.
  /// First and last time of what can be played back, ns.
  std::optional<std::pair<std::int64_t, std::int64_t>> range;
  std::size_t queue_bytes = std::size_t{16} << 20;  ///< Of data that waits for one client.
  /// What lies under a path ("/", "/page.js", "/map/info"); nothing: 404. From a thread of the
  /// server's.
  std::function<std::optional<WebContent>(const std::string& path)> content;
  std::function<void(const std::string&)> log;  ///< Lines for the user, from a thread of its own.
};

/// Serves on a thread of its own. A client that is slow loses the oldest data that waits for it; no
/// call here waits for one.
///
/// Permissions: the Host of a request must be an address or localhost (no name that a page
/// elsewhere could have pointed here); the Origin of a WebSocket has to be the server's own, none
/// (native clients), or Foxglove's page, which may only watch. Commands want `control` and, from
/// the own page, the token in its address.
class LiveServer {
 public:
  /// Listens. Throws InputError if no port is free or the address is not this machine's.
  explicit LiveServer(LiveServerOptions options);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  /// For a browser, with the token if clients may command.
  [[nodiscard]] const std::string& address() const;
  /// That it listens on.
  [[nodiscard]] std::uint16_t port() const;

  /// Makes a channel known; its id is given here and returned. With `latched` those who come later
  /// get the last message.
  std::uint32_t add_channel(foxglove::Channel channel, bool latched);
  /// True if a client has subscribed to it.
  [[nodiscard]] bool has_subscribers(std::uint32_t channel) const;
  /// How many have.
  [[nodiscard]] int subscriber_count(std::uint32_t channel) const;
  /// Sends to its subscribers; `time`: ns.
  void publish(std::uint32_t channel, const Bytes& bytes, std::int64_t time);
  /// The clock: for clients, at most some 30 times a second.
  void publish_time(std::int64_t time);

  /// What clients publish on a topic of a type; bytes in CDR. `on_message` is called from the
  /// server's thread.
  void subscribe(const Topic& topic, std::function<void(const Received&)> on_message);
  /// The same of texts in JSON, for a page's own orders; what `on_message` throws (InputError) is
  /// told to the client.
  void subscribe_json(const std::string& topic,
                      const std::string& schema,
                      std::function<void(const Received&)> on_message);
  /// When it returns no handler of these runs or will run any more.
  void refuse_input();
  /// A service that clients may call.
  void serve(foxglove::ServiceRow service, Transport::Answer answer);
  /// What clients want of a playback; the server's thread.
  void on_playback(std::function<void(const foxglove::PlaybackControl&)> handler);
  /// To all clients.
  void publish_playback(const foxglove::PlaybackState& state);
  /// The run starts anew: clients forget what they had.
  void new_session();

  /// Clients that are connected.
  [[nodiscard]] int client_count() const;
  /// True while a client sends on a topic that `Topic::answers`.
  [[nodiscard]] bool has_senders() const;
  /// Messages that were dropped for slow clients.
  [[nodiscard]] std::uint64_t dropped() const;
  /// Says goodbye to all clients and ends the thread.
  void close();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pointflight
