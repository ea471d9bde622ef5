#include "view/live_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <boost/beast.hpp>
#include <charconv>
#include <chrono>
#include <deque>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <thread>
#include <utility>  // before Asio: its 1.74 uses std::exchange without it

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace net = boost::asio;
namespace websocket = beast::websocket;
using tcp = net::ip::tcp;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostClients = 64;
constexpr std::size_t kLargestHeader = 16 << 10;
constexpr std::size_t kLargestFrame = 4 << 20;        // of a client
constexpr std::size_t kMostControl = 4000;            // frames that wait and may not be dropped
constexpr std::size_t kMostSubscriptions = 2000;      // of a client
constexpr std::size_t kMostClientChannels = 200;      // of a client
constexpr auto kPatience = std::chrono::seconds(30);  // with a client that does not go on
constexpr auto kTimeBetween = std::chrono::milliseconds(33);
constexpr std::string_view kWatchers[] = {"https://app.foxglove.dev"};

/// 32 hexadecimal digits of the system's own chance: nobody's to guess, and no part of a run.
std::string random_token() {
  std::random_device device;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", device());
  return token;
}

/// Of texts that a stranger may try to guess: takes as long whatever they share.
bool is_same_secret(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned>(a[i]) ^ static_cast<unsigned>(b[i]);
  }
  return difference == 0;
}

/// "127.0.0.1" of "127.0.0.1:8765", "::1" of "[::1]:8765".
std::string_view host_of(std::string_view authority) {
  if (authority.starts_with('[')) {
    const std::size_t end = authority.find(']');
    return end == std::string_view::npos ? std::string_view() : authority.substr(1, end - 1);
  }
  return authority.substr(0, authority.find(':'));
}

/// An address, or localhost: names could have been pointed here by anybody.
bool is_plain_host(std::string_view authority) {
  const std::string host(host_of(authority));
  if (host == "localhost") return true;
  boost::system::error_code error;
  net::ip::make_address(host, error);
  return !error;
}

/// Bytes of a value of `name` in a query, "" without.
std::string_view query_value(std::string_view target, std::string_view name) {
  const std::size_t mark = target.find('?');
  if (mark == std::string_view::npos) return {};
  std::string_view query = target.substr(mark + 1);
  while (!query.empty()) {
    const std::string_view item = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), item.size() + 1));
    if (item.starts_with(name) && item.size() > name.size() && item[name.size()] == '=') {
      return item.substr(name.size() + 1);
    }
  }
  return {};
}

/// What a Range asks for of so many bytes: nothing where it is none that is served.
struct ByteRange {
  std::size_t from, to;  ///< Both included.
};
std::optional<ByteRange> range_of(std::string_view header, std::size_t size) {
  constexpr std::string_view kUnit = "bytes=";
  if (!header.starts_with(kUnit) || size == 0) return std::nullopt;
  header.remove_prefix(kUnit.size());
  const std::size_t dash = header.find('-');
  if (dash == std::string_view::npos || header.find(',') != std::string_view::npos) {
    return std::nullopt;
  }
  const auto number = [](std::string_view text) -> std::optional<std::size_t> {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  };
  const auto first = number(header.substr(0, dash));
  const auto last = number(header.substr(dash + 1));
  if (!first && dash == 0 && last && *last > 0) {
    return ByteRange{size - std::min(size, *last), size - 1};
  }
  if (!first || *first >= size) return std::nullopt;
  if (!last && dash + 1 != header.size()) return std::nullopt;
  const std::size_t to = std::min(last.value_or(size - 1), size - 1);
  if (to < *first) return std::nullopt;
  return ByteRange{*first, to};
}

std::string_view as_view(beast::string_view text) {
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

/// What a request may do.
struct Permission {
  bool watch = false;
  bool command = false;
};

}  // namespace

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
  [[nodiscard]] Permission permission_of(const http::request<http::string_body>& request) const;
  void greet(Client& client);
  void to_all(Frame frame);
  void leave(Client& client);
  /// A channel stays where it is.
  [[nodiscard]] KnownChannel* channel(std::uint32_t id) {
    const std::lock_guard lock(mutex_);
    return id >= 1 && id <= channels_.size() ? &channels_[id - 1] : nullptr;
  }

  LiveServerOptions options_;
  std::string token_ = random_token();
  std::string session_ = random_token();
  std::string address_;
  std::uint16_t port_ = 0;
  net::io_context io_{1};
  tcp::acceptor acceptor_{io_};
  std::set<std::shared_ptr<Client>> clients_;
  std::size_t connections_ = 0;
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

/// Requests of one connection, until it becomes a WebSocket.
class LiveServer::Impl::HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(Impl& server, tcp::socket&& socket) : server_(server), stream_(std::move(socket)) {
    ++server_.connections_;
  }
  ~HttpSession() { --server_.connections_; }

  void read() {
    parser_.emplace();
    parser_->header_limit(kLargestHeader);
    parser_->body_limit(0);
    stream_.expires_after(kPatience);
    http::async_read(
        stream_,
        buffer_,
        *parser_,
        [self = shared_from_this()](beast::error_code error, std::size_t) { self->answer(error); });
  }

 private:
  using Request = http::request<http::string_body>;

  void answer(beast::error_code error) {
    if (error == http::error::end_of_stream) return close();
    if (error == http::error::header_limit || error == http::error::body_limit) {
      return refuse(http::status::payload_too_large, "too large");
    }
    if (error) {
      // what is no HTTP gets an answer; who is gone does not
      const bool is_parser =
          error.category() == http::make_error_code(http::error::bad_method).category();
      if (is_parser && error != http::error::partial_message) {
        return refuse(http::status::bad_request, "this is no HTTP request");
      }
      return;
    }
    const Request& request = parser_->get();
    if (websocket::is_upgrade(request)) return upgrade();
    if (!server_.permission_of(request).watch) {
      return refuse(http::status::forbidden, "open it by its address, not by a name");
    }
    if (request.method() != http::verb::get && request.method() != http::verb::head) {
      return refuse(http::status::method_not_allowed, "GET and HEAD only");
    }
    serve(request);
  }

  void upgrade() {
    const Request& request = parser_->get();
    const Permission permission = server_.permission_of(request);
    if (!permission.watch) {
      return refuse(http::status::forbidden, "this origin may not look at the run");
    }
    std::string_view chosen;
    const std::string offered(request[http::field::sec_websocket_protocol]);
    for (const std::string_view name : foxglove::kSubprotocols) {
      for (std::string_view left = offered; !left.empty() && chosen.empty();) {
        const std::size_t comma = std::min(left.find(','), left.size());
        std::string_view item = left.substr(0, comma);
        while (item.starts_with(' ')) item.remove_prefix(1);
        while (item.ends_with(' ')) item.remove_suffix(1);
        if (item == name) chosen = name;
        left.remove_prefix(std::min(left.size(), comma + 1));
      }
    }
    if (chosen.empty()) {
      return refuse(http::status::bad_request,
                    "the WebSocket speaks foxglove.sdk.v1 and foxglove.websocket.v1");
    }
    if (server_.clients_.size() >= kMostClients) {
      return refuse(http::status::service_unavailable, "too many clients");
    }
    stream_.expires_never();
    const auto client = std::make_shared<Client>(server_, std::move(stream_), permission.command);
    client->start(request, chosen);
  }

  void serve(const Request& request) {
    std::string_view target = as_view(request.target());
    const std::string path(target.substr(0, target.find('?')));
    std::optional<WebContent> content;
    try {
      if (server_.options_.content) content = server_.options_.content(path);
    } catch (const std::exception& error) {
      return refuse(http::status::internal_server_error, error.what());
    }
    if (!content) return refuse(http::status::not_found, "there is nothing here");
    content_ = content->bytes;
    const std::size_t size = content_->size();
    auto response = std::make_shared<http::response<http::buffer_body>>();
    response->version(request.version());
    response->keep_alive(request.keep_alive());
    response->set(http::field::content_type, content->type);
    set_safety(*response);
    response->set(http::field::accept_ranges, "bytes");
    response->set(http::field::cache_control,
                  content->may_be_kept ? "private, max-age=86400" : "no-store");
    std::size_t from = 0;
    std::size_t length = size;
    if (const std::string_view header = as_view(request[http::field::range]); !header.empty()) {
      const auto range = range_of(header, size);
      if (!range) {
        response->result(http::status::range_not_satisfiable);
        response->set(http::field::content_range, fmt::format("bytes */{}", size));
        length = 0;
      } else {
        from = range->from;
        length = range->to - range->from + 1;
        response->result(http::status::partial_content);
        response->set(http::field::content_range,
                      fmt::format("bytes {}-{}/{}", range->from, range->to, size));
      }
    } else {
      response->result(http::status::ok);
    }
    response->content_length(length);
    const bool has_body = request.method() == http::verb::get;
    // not copied: the bytes live as long as `content_`
    response->body().data = has_body ? const_cast<std::byte*>(content_->data()) + from : nullptr;
    response->body().size = has_body ? length : 0;
    response->body().more = false;
    stream_.expires_after(kPatience);
    auto serializer = std::make_shared<http::response_serializer<http::buffer_body>>(*response);
    const auto done = [self = shared_from_this(), response, serializer](beast::error_code error,
                                                                        std::size_t) {
      self->content_.reset();
      if (error || !response->keep_alive()) return self->close();
      self->read();
    };
    if (has_body) {
      http::async_write(stream_, *serializer, done);
    } else {
      http::async_write_header(stream_, *serializer, done);
    }
  }

  template <class Response>
  static void set_safety(Response& response) {
    response.set(http::field::server, "pointflight");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Referrer-Policy", "no-referrer");
    response.set("X-Frame-Options", "DENY");
    response.set(
        "Content-Security-Policy",
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "connect-src 'self' ws: wss:; frame-ancestors 'none'");
  }

  void refuse(http::status status, std::string_view why) {
    auto response = std::make_shared<http::response<http::string_body>>();
    response->version(11);
    response->result(status);
    response->keep_alive(false);
    response->set(http::field::content_type, "text/plain; charset=utf-8");
    set_safety(*response);
    if (status == http::status::method_not_allowed) response->set(http::field::allow, "GET, HEAD");
    response->body() = std::string(why) + "\n";
    response->prepare_payload();
    stream_.expires_after(kPatience);
    http::async_write(
        stream_, *response, [self = shared_from_this(), response](beast::error_code, std::size_t) {
          self->close();
        });
  }

  void close() {
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  Impl& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  std::shared_ptr<const std::vector<std::byte>> content_;
};

LiveServer::Impl::Impl(LiveServerOptions options) : options_(std::move(options)) {
  boost::system::error_code error;
  const net::ip::address address = net::ip::make_address(options_.address, error);
  if (error) {
    throw InputError(fmt::format("--view {}: is no address of this machine", options_.address));
  }
  const int first = options_.port;
  const int last = options_.port == 0 ? 0 : std::min(65535, first + options_.ports - 1);
  for (int port = first; port <= last; ++port) {
    const tcp::endpoint endpoint(address, static_cast<std::uint16_t>(port));
    acceptor_.open(endpoint.protocol(), error);
    if (!error) acceptor_.set_option(net::socket_base::reuse_address(true), error);
    if (!error) acceptor_.bind(endpoint, error);
    if (!error) acceptor_.listen(net::socket_base::max_listen_connections, error);
    if (!error) break;
    boost::system::error_code ignored;
    acceptor_.close(ignored);
  }
  if (error) {
    throw InputError(fmt::format(
        "--view {}: ports {} to {}: {}", options_.address, first, last, error.message()));
  }
  port_ = acceptor_.local_endpoint().port();
  const std::string shown = address.is_unspecified() ? "127.0.0.1" : options_.address;
  address_ = fmt::format(
      "http://{}:{}/", shown.find(':') == std::string::npos ? shown : "[" + shown + "]", port_);
  if (options_.control) address_ += "?token=" + token_;
  accept();
  thread_ = std::thread([this] { io_.run(); });
}

void LiveServer::Impl::close() {
  if (std::exchange(closed_, true)) return;
  net::post(io_, [this] {
    boost::system::error_code ignored;
    acceptor_.close(ignored);
    for (const auto& client : clients_) client->say_goodbye();
  });
  // goodbyes take a moment; who does not answer is left
  const auto until = Clock::now() + std::chrono::milliseconds(500);
  while (client_count_ > 0 && Clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  io_.stop();
  thread_.join();
  clients_.clear();
}

void LiveServer::Impl::accept() {
  acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (error == net::error::operation_aborted || !acceptor_.is_open()) return;
    if (!error && connections_ < 4 * kMostClients) {
      boost::system::error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      std::make_shared<HttpSession>(*this, std::move(socket))->read();
    }
    accept();
  });
}

Permission LiveServer::Impl::permission_of(const http::request<http::string_body>& request) const {
  const std::string_view host = as_view(request[http::field::host]);
  if (request.count(http::field::host) != 1 || !is_plain_host(host)) return {};
  if (request.count(http::field::origin) == 0) {
    // no page: a program of somebody who can reach this port; a browser's own requests for the page
    // and the map as well
    return {true, options_.control};
  }
  if (request.count(http::field::origin) != 1) return {};
  const std::string_view origin = as_view(request[http::field::origin]);
  if (origin == fmt::format("http://{}", host)) {
    const std::string_view given = query_value(as_view(request.target()), "token");
    return {true, options_.control && is_same_secret(given, token_)};
  }
  const bool is_watcher =
      std::find(std::begin(kWatchers), std::end(kWatchers), origin) != std::end(kWatchers);
  return {is_watcher, false};
}

void LiveServer::Impl::greet(Client& client) {
  foxglove::ServerInfo info;
  info.name = options_.name;
  info.session = session_;
  info.capabilities = options_.capabilities;
  info.capabilities.emplace_back("time");
  std::vector<foxglove::Channel> channels;
  std::vector<foxglove::ServiceRow> services;
  {
    const std::lock_guard lock(mutex_);
    if (client.may_command() && !inputs_.empty()) info.capabilities.emplace_back("clientPublish");
    if (client.may_command() && !services_.empty()) info.capabilities.emplace_back("services");
    for (const KnownChannel& known : channels_) channels.push_back(known.channel);
    for (const KnownService& known : services_) services.push_back(known.row);
  }
  info.encodings = {"cdr", "json"};
  info.range = options_.range;
  client.send_text(foxglove::server_info_text(info));
  client.send_text(foxglove::advertise_text(channels));
  if (client.may_command() && !services.empty()) {
    client.send_text(foxglove::advertise_services_text(services));
  }
}

void LiveServer::Impl::to_all(Frame frame) {
  for (const auto& client : clients_) client->send(frame);
}

void LiveServer::Impl::leave(Client& client) {
  client.release();
  client.end();
  if (clients_.erase(client.shared_from_this()) > 0) --client_count_;
}

LiveServer::LiveServer(LiveServerOptions options)
    : impl_(std::make_unique<Impl>(std::move(options))) {}

LiveServer::~LiveServer() = default;

const std::string& LiveServer::address() const {
  return impl_->address_;
}

std::uint16_t LiveServer::port() const {
  return impl_->port_;
}

std::uint32_t LiveServer::add_channel(foxglove::Channel channel, bool latched) {
  std::uint32_t id = 0;
  {
    const std::lock_guard lock(impl_->mutex_);
    id = static_cast<std::uint32_t>(impl_->channels_.size() + 1);
    channel.id = id;
    auto& known = impl_->channels_.emplace_back();
    known.channel = channel;
    known.latched = latched;
  }
  net::post(impl_->io_, [impl = impl_.get(), channel = std::move(channel)] {
    impl->to_all({foxglove::advertise_text({&channel, 1}), {}, {}, false});
  });
  return id;
}

bool LiveServer::has_subscribers(std::uint32_t channel) const {
  return subscriber_count(channel) > 0;
}

int LiveServer::subscriber_count(std::uint32_t channel) const {
  const std::lock_guard lock(impl_->mutex_);
  return impl_->channels_[channel - 1].subscribers;
}

void LiveServer::publish(std::uint32_t channel, const Bytes& bytes, std::int64_t time) {
  bool is_latched = false;
  {
    const std::lock_guard lock(impl_->mutex_);
    auto& known = impl_->channels_[channel - 1];
    is_latched = known.latched;
    if (is_latched) {
      known.last = bytes;
      known.last_time = time;
    }
    if (known.subscribers == 0) return;
  }
  // a server whose thread gets no turn must not gather the run
  if (impl_->posted_ > impl_->options_.queue_bytes && !is_latched) {
    ++impl_->dropped_;
    return;
  }
  impl_->posted_ += bytes->size();
  net::post(impl_->io_, [impl = impl_.get(), channel, bytes, time, is_latched] {
    impl->posted_ -= bytes->size();
    for (const auto& client : impl->clients_) client->publish(channel, bytes, time, !is_latched);
  });
}

void LiveServer::publish_time(std::int64_t time) {
  if (impl_->client_count_ == 0) return;
  const Clock::time_point now = Clock::now();
  if (now - impl_->last_time_ < kTimeBetween) return;
  impl_->last_time_ = now;
  net::post(impl_->io_, [impl = impl_.get(), time] {
    impl->to_all({{}, foxglove::time_frame(time), {}, true});
  });
}

void LiveServer::subscribe(const Topic& topic, std::function<void(const Received&)> on_message) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->inputs_.push_back({topic, "cdr", topic.type.ros2_name(), std::move(on_message)});
}

void LiveServer::subscribe_json(const std::string& topic,
                                const std::string& schema,
                                std::function<void(const Received&)> on_message) {
  const std::lock_guard lock(impl_->mutex_);
  Topic named;
  named.name = topic;
  impl_->inputs_.push_back({named, "json", schema, std::move(on_message)});
}

void LiveServer::refuse_input() {
  const std::lock_guard lock(impl_->input_mutex_);
  impl_->takes_input_ = false;
}

void LiveServer::serve(foxglove::ServiceRow service, Transport::Answer answer) {
  const std::lock_guard lock(impl_->mutex_);
  service.id = static_cast<std::uint32_t>(impl_->services_.size() + 1);
  impl_->services_.push_back({std::move(service), std::move(answer)});
}

void LiveServer::on_playback(std::function<void(const foxglove::PlaybackControl&)> handler) {
  net::post(impl_->io_, [impl = impl_.get(), handler = std::move(handler)]() mutable {
    impl->on_playback_ = std::move(handler);
  });
}

void LiveServer::publish_playback(const foxglove::PlaybackState& state) {
  net::post(impl_->io_, [impl = impl_.get(), state] {
    impl->to_all({{}, foxglove::playback_state_frame(state), {}, false});
  });
}

void LiveServer::new_session() {
  net::post(impl_->io_, [impl = impl_.get()] {
    impl->session_ = random_token();
    for (const auto& client : impl->clients_) impl->greet(*client);
  });
}

int LiveServer::client_count() const {
  return impl_->client_count_;
}

bool LiveServer::has_senders() const {
  return impl_->senders_ > 0;
}

std::uint64_t LiveServer::dropped() const {
  return impl_->dropped_;
}

void LiveServer::close() {
  impl_->close();
}

}  // namespace pointflight
