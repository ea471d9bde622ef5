// A viewer of `LiveServer`, for live_server.cpp alone.
#pragma once

#include "pointflight/view/internal/live_impl-inl.hpp"

namespace pointflight {

inline constexpr std::size_t kLargestFrame = 4 << 20;    // of a client
inline constexpr std::size_t kMostControl = 4000;        // frames that wait and may not be dropped
inline constexpr std::size_t kMostSubscriptions = 2000;  // of a client
inline constexpr std::size_t kMostClientChannels = 200;  // of a client

/// A WebSocket.
class LiveServer::Impl::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Impl& server, beast::tcp_stream&& stream, bool may_command)
      : server_(server), socket_(std::move(stream)), may_command_(may_command) {}

  void start(const http::request<http::string_body>& request, std::string_view subprotocol) {
    socket_.set_option(websocket::stream_base::decorator(
        [name = std::string(subprotocol)](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, name);
        }));
    auto timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeout.handshake_timeout = kPatience;
    timeout.idle_timeout = kPatience;
    timeout.keep_alive_pings = true;  // one that answers none is gone
    socket_.set_option(timeout);
    socket_.read_message_max(kLargestFrame);
    socket_.auto_fragment(false);
    socket_.async_accept(request, [self = shared_from_this()](beast::error_code error) {
      if (error) return;
      self->server_.clients_.insert(self);
      ++self->server_.client_count_;
      self->server_.greet(*self);
      self->read();
    });
  }

  void send(Frame frame) {
    const std::size_t size = frame.size();
    if (!frame.is_data) {
      if (++control_waiting_ > kMostControl) return end();
    } else {
      waiting_bytes_ += size;
    }
    queue_.push_back(std::move(frame));
    // the oldest data goes, the newest stays
    for (auto at = queue_.begin();
         waiting_bytes_ > server_.options_.queue_bytes && at + 1 != queue_.end();) {
      if (!at->is_data) {
        ++at;
        continue;
      }
      waiting_bytes_ -= at->size();
      ++server_.dropped_;
      at = queue_.erase(at);
    }
    write();
  }
  void send_text(std::string text) { send({std::move(text), {}, {}, false}); }

  void publish(std::uint32_t channel, const Bytes& bytes, std::int64_t time, bool is_data) {
    const auto found = subscriptions_.find(channel);
    if (found == subscriptions_.end()) return;
    for (const std::uint32_t id : found->second) {
      send({{}, foxglove::message_head(id, time), bytes, is_data});
    }
  }

  [[nodiscard]] bool may_command() const { return may_command_; }

  /// Tells of channels; of those that it knows already not again: clients would subscribe twice.
  void advertise(std::span<const foxglove::Channel> channels) {
    while (!channels.empty() && channels.front().id <= last_advertised_) {
      channels = channels.subspan(1);
    }
    if (channels.empty()) return;
    last_advertised_ = channels.back().id;
    send_text(foxglove::advertise_text(channels));
  }
  /// It is to forget what it knew: another session begins.
  void forget_channels() { last_advertised_ = 0; }

  void end() {
    if (ended_) return;
    ended_ = true;
    beast::error_code ignored;
    beast::get_lowest_layer(socket_).socket().shutdown(tcp::socket::shutdown_both, ignored);
    beast::get_lowest_layer(socket_).socket().close(ignored);
  }

  /// Closes with a word, once what waits was written.
  void say_goodbye() {
    if (ended_) return;
    socket_.async_close(websocket::close_code::going_away,
                        [self = shared_from_this()](beast::error_code) {});
  }

  /// Gives back what it held of channels.
  void release() {
    for (const auto& [channel, ids] : subscriptions_) {
      if (auto* known = server_.channel(channel)) --known->subscribers;
    }
    subscriptions_.clear();
    for (const auto& [id, input] : published_) server_.senders_ -= input->topic.answers ? 1 : 0;
    published_.clear();
  }

 private:
  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return self->server_.leave(*self);
      self->take_frame();
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void take_frame() {
    const auto bytes =
        std::span(static_cast<const std::byte*>(buffer_.data().data()), buffer_.data().size());
    try {
      if (socket_.got_text()) {
        const auto* text = reinterpret_cast<const char*>(bytes.data());
        const auto request = foxglove::parse_text({text, bytes.size()});
        std::visit([this](const auto& r) { obey(r); }, request);
      } else {
        const auto request = foxglove::parse_binary(bytes);
        std::visit([this](const auto& r) { obey(r); }, request);
      }
    } catch (const InputError& error) {
      send_text(foxglove::status_text(foxglove::Level::kError, error.what()));
    }
  }

  void obey(const foxglove::Subscribe& subscribe) {
    for (const foxglove::Subscription& s : subscribe.subscriptions) {
      auto* known = server_.channel(s.channel);
      if (known == nullptr) {
        throw InputError(fmt::format("there is no channel {}", s.channel));
      }
      const bool is_used =
          std::any_of(subscriptions_.begin(), subscriptions_.end(), [&](const auto& entry) {
            return std::find(entry.second.begin(), entry.second.end(), s.id) != entry.second.end();
          });
      if (is_used) throw InputError(fmt::format("subscription {} is there already", s.id));
      if (++subscription_count_ > kMostSubscriptions) throw InputError("too many subscriptions");
      std::vector<std::uint32_t>& ids = subscriptions_[s.channel];
      if (ids.empty()) ++known->subscribers;
      ids.push_back(s.id);
      Bytes last;
      std::int64_t time = 0;
      {
        const std::lock_guard lock(server_.mutex_);
        last = known->last;
        time = known->last_time;
      }
      if (last) send({{}, foxglove::message_head(s.id, time), last, false});
    }
  }

  void obey(const foxglove::Unsubscribe& unsubscribe) {
    for (const std::uint32_t id : unsubscribe.ids) {
      for (auto entry = subscriptions_.begin(); entry != subscriptions_.end(); ++entry) {
        const auto found = std::find(entry->second.begin(), entry->second.end(), id);
        if (found == entry->second.end()) continue;
        entry->second.erase(found);
        --subscription_count_;
        if (entry->second.empty()) {
          if (auto* known = server_.channel(entry->first)) --known->subscribers;
          subscriptions_.erase(entry);
        }
        break;
      }
    }
  }

  void obey(const foxglove::ClientAdvertise& advertise) {
    require_permission();
    for (const foxglove::ClientChannel& c : advertise.channels) {
      if (published_.size() >= kMostClientChannels) throw InputError("too many channels");
      if (published_.contains(c.id)) {
        throw InputError(fmt::format("channel {} is there already", c.id));
      }
      const Input* found = nullptr;
      {
        const std::lock_guard lock(server_.mutex_);
        for (const Input& input : server_.inputs_) {
          if (input.topic.name == c.topic) found = &input;
        }
      }
      if (found == nullptr) {
        throw InputError(fmt::format("nobody here reads {}", c.topic));
      }
      if (found->schema != c.schema_name || found->encoding != c.encoding) {
        throw InputError(fmt::format("{} is read as {} in {}, not as {} in {}",
                                     c.topic,
                                     found->schema,
                                     found->encoding,
                                     c.schema_name,
                                     c.encoding));
      }
      published_[c.id] = found;
      server_.senders_ += found->topic.answers ? 1 : 0;
    }
  }

  void obey(const foxglove::ClientUnadvertise& unadvertise) {
    for (const std::uint32_t id : unadvertise.ids) {
      const auto found = published_.find(id);
      if (found == published_.end()) continue;
      server_.senders_ -= found->second->topic.answers ? 1 : 0;
      published_.erase(found);
    }
  }

  void obey(const foxglove::Ignored& ignored) {
    static constexpr std::string_view kKnown[] = {"getParameters",
                                                  "setParameters",
                                                  "subscribeParameterUpdates",
                                                  "unsubscribeParameterUpdates",
                                                  "subscribeConnectionGraph",
                                                  "unsubscribeConnectionGraph",
                                                  "fetchAsset"};
    if (std::find(std::begin(kKnown), std::end(kKnown), ignored.op) != std::end(kKnown)) return;
    throw InputError("an op that the protocol does not have");
  }

  void obey(const foxglove::ClientMessage& message) {
    require_permission();
    const auto found = published_.find(message.channel);
    if (found == published_.end()) {
      throw InputError(fmt::format("channel {} was not advertised", message.channel));
    }
    Received received;
    received.data = message.data.data();
    received.size = message.data.size();
    const std::lock_guard lock(server_.input_mutex_);
    if (server_.takes_input_) found->second->on_message(received);
  }

  void obey(const foxglove::ServiceRequest& request) {
    const KnownService* found = nullptr;
    {
      const std::lock_guard lock(server_.mutex_);
      if (request.service >= 1 && request.service <= server_.services_.size()) {
        found = &server_.services_[request.service - 1];
      }
    }
    const auto fail = [&](std::string_view why) {
      send_text(foxglove::service_failure_text(request.service, request.call, why));
    };
    if (found == nullptr) return fail("there is no such service");
    if (!may_command_) return fail(kNoPermission);
    if (request.encoding != "cdr") return fail("requests are in cdr");
    Received received;
    received.data = request.data.data();
    received.size = request.data.size();
    std::vector<std::byte> answer;
    {
      const std::lock_guard lock(server_.input_mutex_);
      if (!server_.takes_input_) return fail("the run has ended");
      answer = found->answer(received);
    }
    if (answer.empty()) return fail("the request could not be read");
    send({{}, foxglove::service_response_frame(request.service, request.call, answer), {}, false});
  }

  void obey(const foxglove::PlaybackControl& control) {
    require_permission();
    if (!server_.on_playback_) throw InputError("this run is live: it cannot be played back");
    server_.on_playback_(control);
  }

  static constexpr std::string_view kNoPermission =
      "you may watch and not command: open the address that pointflight printed, or start it with "
      "--view-control";
  void require_permission() const {
    if (!may_command_) throw InputError(std::string(kNoPermission));
  }

  void write() {
    if (written_ || queue_.empty() || ended_) return;
    written_ = std::move(queue_.front());
    queue_.pop_front();
    if (written_->is_data) {
      waiting_bytes_ -= written_->size();
    } else {
      --control_waiting_;
    }
    const Frame& frame = *written_;
    const auto done = [self = shared_from_this()](beast::error_code error, std::size_t) {
      self->written_.reset();
      if (error) return self->end();
      self->write();
    };
    if (frame.head.empty()) {
      socket_.text(true);
      socket_.async_write(net::buffer(frame.text), done);
      return;
    }
    socket_.binary(true);
    const std::array<net::const_buffer, 2> parts = {
        net::buffer(frame.head.data(), frame.head.size()),
        frame.body ? net::buffer(frame.body->data(), frame.body->size()) : net::const_buffer()};
    socket_.async_write(parts, done);
  }

  Impl& server_;
  websocket::stream<beast::tcp_stream> socket_;
  beast::flat_buffer buffer_;
  std::uint32_t last_advertised_ = 0;  ///< Ids only grow.
  bool may_command_;
  std::map<std::uint32_t, std::vector<std::uint32_t>> subscriptions_;  ///< By channel.
  std::size_t subscription_count_ = 0;
  std::map<std::uint32_t, const Input*> published_;  ///< By the client's number.
  std::deque<Frame> queue_;
  std::size_t waiting_bytes_ = 0;
  std::size_t control_waiting_ = 0;
  std::optional<Frame> written_;  ///< What the socket is taking.
  bool ended_ = false;
};

}  // namespace pointflight
