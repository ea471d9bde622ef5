// The inside of `LiveServer`, for live_server.cpp alone: what its parts share.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <thread>
#include <utility>  // before Asio: its 1.74 uses std::exchange without it

#include "pointflight/core/argument.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/view/live_server.hpp"
#include "pointflight/view/web_rules.hpp"

namespace pointflight {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using Clock = std::chrono::steady_clock;

inline constexpr std::size_t kMostClients = 64;
inline constexpr std::size_t kMostSessions = 256;            // connections that are no viewers' yet
inline constexpr auto kPatience = std::chrono::seconds(30);  // with a client that does not go on

inline std::string_view as_view(beast::string_view text) {
  return {text.data(), text.size()};
}

/// A frame on its way to a client.
struct Frame {
  std::string text;             ///< Where it is one of text.
  std::vector<std::byte> head;  ///< Else these,
  Bytes body;                   ///< and these.
  bool is_data = false;         ///< It may be dropped.
  [[nodiscard]] std::size_t size() const {
    return text.size() + head.size() + (body ? body->size() : 0);
  }
};

/// 32 hexadecimal digits of the system's own chance: nobody's to guess, and no part of a run.
inline std::string random_token() {
  std::random_device device;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", device());
  return token;
}

/// All of it lives on one thread, but for what stands under the mutex.
class LiveServer::Impl {
 public:
  explicit Impl(LiveServerOptions options);
  ~Impl() { close(); }

  void close();

  // ---- what other threads see ----

  struct KnownChannel {
    foxglove::Channel channel;
    bool latched = false;
    Bytes last;
    std::int64_t last_time = 0;
    std::atomic<int> subscribers = 0;
  };
  struct Input {
    Topic topic;
    std::string encoding, schema;
    std::function<void(const Received&)> on_message;
  };
  struct KnownService {
    foxglove::ServiceRow row;
    Transport::Answer answer;
  };

  class Client;
  class HttpSession;

  void accept();
  bool close_most_idle();
  [[nodiscard]] Permission permission_of(const http::request<http::string_body>& request) const;
  void greet(Client& client);
  void to_all(const Frame& frame);
  void leave(Client& client);
  /// A channel stays where it is.
  [[nodiscard]] KnownChannel* channel(std::uint32_t id) {
    const std::lock_guard lock(mutex_);
    return id >= 1 && id <= channels_.size() ? &channels_[id - 1] : nullptr;
  }

  /// The same under the mutex, of a caller's own. Throws std::invalid_argument if there is none.
  [[nodiscard]] KnownChannel& known(std::uint32_t id) {
    require_argument(id >= 1 && id <= channels_.size(), "LiveServer: no such channel");
    return channels_[id - 1];
  }

  LiveServerOptions options_;
  std::string token_ = random_token();
  std::string session_ = random_token();
  std::string address_;
  std::uint16_t port_ = 0;
  net::io_context io_{1};
  net::thread_pool makers_{1};  ///< Of what HTTP serves.
  tcp::acceptor acceptor_{io_};
  std::set<std::shared_ptr<Client>> clients_;
  std::set<HttpSession*> sessions_;  ///< All that live.
  Clock::time_point last_time_{};
  std::function<void(const foxglove::PlaybackControl&)> on_playback_;

  std::mutex input_mutex_;  ///< Held while a handler of clients' input runs.
  bool takes_input_ = true;
  mutable std::mutex mutex_;  ///< Of the three below: their lengths and entries' texts.
  std::deque<KnownChannel> channels_;
  std::deque<Input> inputs_;
  std::deque<KnownService> services_;

  std::atomic<int> client_count_ = 0;
  std::atomic<int> senders_ = 0;
  std::atomic<std::uint64_t> dropped_ = 0;
  std::atomic<std::size_t> posted_ = 0;  ///< Bytes on their way to the server's thread.
  bool closed_ = false;
  std::thread thread_;
};

}  // namespace pointflight
