// A connection to `LiveServer` before it is a viewer's, for live_server.cpp alone.
#pragma once

#include "pointflight/view/internal/live_client-inl.hpp"

namespace pointflight {

inline constexpr std::size_t kLargestHeader = 16 << 10;

/// Requests of one connection, until it becomes a WebSocket.
class LiveServer::Impl::HttpSession : public std::enable_shared_from_this<HttpSession> {
 public:
  HttpSession(Impl& server, tcp::socket&& socket) : server_(server), stream_(std::move(socket)) {
    server_.sessions_.insert(this);
  }
  ~HttpSession() { server_.sessions_.erase(this); }
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  /// True while it has asked for nothing, since a time.
  [[nodiscard]] bool is_idle() const { return is_idle_; }
  [[nodiscard]] Clock::time_point since() const { return since_; }
  /// For one that asks: it ends.
  void drop() {
    is_idle_ = false;
    stream_.close();
  }

  void read() {
    is_idle_ = true;
    since_ = Clock::now();
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
    is_idle_ = false;
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
    const std::string_view chosen =
        chosen_subprotocol(as_view(request[http::field::sec_websocket_protocol]));
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

  /// Made beside the server's thread: a large map's overview takes a while, and viewers' frames go
  /// on.
  void serve(const Request& request) {
    const std::string_view target = as_view(request.target());
    net::post(server_.makers_,
              [self = shared_from_this(),
               path = std::string(target.substr(0, target.find('?')))]() mutable {
                std::optional<WebContent> content;
                std::string failure;
                try {
                  if (self->server_.options_.content)
                    content = self->server_.options_.content(path);
                } catch (const std::exception& error) {
                  failure = error.what();
                }
                // what it counts lives on the server's thread: it may not end on this one
                net::io_context& io = self->server_.io_;
                net::post(io,
                          [self = std::move(self),
                           content = std::move(content),
                           failure = std::move(failure)] { self->send(content, failure); });
              });
  }

  void send(const std::optional<WebContent>& content, const std::string& failure) {
    const Request& request = parser_->get();
    if (!failure.empty()) return refuse(http::status::internal_server_error, failure);
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
  bool is_idle_ = false;
  Clock::time_point since_{};
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  std::shared_ptr<const std::vector<std::byte>> content_;
};

}  // namespace pointflight
