#include "pointflight/view/live_server.hpp"

#include "pointflight/view/internal/live_http-inl.hpp"

namespace pointflight {
namespace {

constexpr auto kTimeBetween = std::chrono::milliseconds(33);

}  // namespace

LiveServer::Impl::Impl(LiveServerOptions options) : options_(std::move(options)) {
  boost::system::error_code error;
  const net::ip::address address = net::ip::make_address(options_.address, error);
  if (error) {
    throw InputError(fmt::format("--view {}: is no address of this machine", options_.address));
  }
  if (options_.ports < 1) throw InputError("--view: one port or more is tried");
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
  makers_.stop();
  makers_.join();
  io_.stop();
  thread_.join();
  clients_.clear();
}

void LiveServer::Impl::accept() {
  acceptor_.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (error == net::error::operation_aborted || !acceptor_.is_open()) return;
    if (!error && (sessions_.size() < kMostSessions || close_most_idle())) {
      boost::system::error_code ignored;
      socket.set_option(tcp::no_delay(true), ignored);
      std::make_shared<HttpSession>(*this, std::move(socket))->read();
    }
    accept();
  });
}

/// Of connections that ask for nothing, the one that has done so for longest. False if all do.
bool LiveServer::Impl::close_most_idle() {
  HttpSession* idlest = nullptr;
  for (HttpSession* session : sessions_) {
    if (!session->is_idle()) continue;
    if (idlest == nullptr || session->since() < idlest->since()) idlest = session;
  }
  if (idlest == nullptr) return false;
  idlest->drop();
  return true;
}

Permission LiveServer::Impl::permission_of(const http::request<http::string_body>& request) const {
  // said twice, nobody knows what others took for true
  if (request.count(http::field::host) != 1 || request.count(http::field::origin) > 1) return {};
  Asker asker;
  asker.host = as_view(request[http::field::host]);
  asker.target = as_view(request.target());
  if (request.count(http::field::origin) == 1) asker.origin = as_view(request[http::field::origin]);
  return pointflight::permission_of(asker, token_, options_.control);
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
  client.forget_channels();
  if (channels.empty()) client.send_text(foxglove::advertise_text({}));  // that there are none
  client.advertise(channels);
  if (client.may_command() && !services.empty()) {
    client.send_text(foxglove::advertise_services_text(services));
  }
}

void LiveServer::Impl::to_all(const Frame& frame) {
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
    for (const auto& client : impl->clients_) client->advertise({&channel, 1});
  });
  return id;
}

bool LiveServer::has_subscribers(std::uint32_t channel) const {
  return subscriber_count(channel) > 0;
}

int LiveServer::subscriber_count(std::uint32_t channel) const {
  const std::lock_guard lock(impl_->mutex_);
  return impl_->known(channel).subscribers;
}

void LiveServer::publish(std::uint32_t channel, const Bytes& bytes, std::int64_t time) {
  bool is_latched = false;
  {
    const std::lock_guard lock(impl_->mutex_);
    auto& known = impl_->known(channel);
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
