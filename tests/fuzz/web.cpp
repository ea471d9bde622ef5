// Any bytes at the port of --view, over a real socket: as an HTTP request, as frames behind a valid
// handshake, and as the payloads of valid frames. The server answers or closes, in time, and goes
// on.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include "pointflight/view/live_server.hpp"

namespace {

using pointflight::LiveServer;
using pointflight::LiveServerOptions;
using pointflight::Received;
using pointflight::WebContent;

constexpr std::string_view kHandshake =
    "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";

LiveServer& server() {
  static LiveServer* const made = [] {
    LiveServerOptions options;
    options.port = 0;
    options.content = [](const std::string& path) -> std::optional<WebContent> {
      if (path != "/") return std::nullopt;
      const std::string text(1000, 'x');
      auto bytes = std::make_shared<std::vector<std::byte>>(text.size(), std::byte{'x'});
      return WebContent{"text/plain", std::move(bytes), false};
    };
    auto* live = new LiveServer(std::move(options));  // lives as long as the process
    live->add_channel({0, "/a", "json", "A", "{}", "jsonschema"}, true);
    live->subscribe_json("/order", "Order", [](const Received&) {});
    live->serve({0, "/s", "std_srvs/srv/Trigger", "", ""},
                [](const Received& request) { return std::vector<std::byte>(request.size + 1); });
    live->on_playback([](const pointflight::foxglove::PlaybackControl&) {});
    return live;
  }();
  return *made;
}

/// Payloads of frames as a browser would send them: of each a byte that says of what kind it is
/// and a length.
std::string frames_of(std::string_view data) {
  std::string frames;
  while (data.size() >= 2) {
    const bool is_text = (data[0] & 1) != 0;
    const auto length = std::min<std::size_t>(static_cast<std::uint8_t>(data[1]) & 0x7F,
                                              std::min<std::size_t>(data.size() - 2, 125));
    frames += static_cast<char>(0x80 | (is_text ? 1 : 2));
    frames += static_cast<char>(0x80 | length);
    frames += std::string(4, '\0');  // the mask
    frames += data.substr(2, length);
    data.remove_prefix(2 + length);
  }
  return frames;
}

void send_all(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;  // it has closed already
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
}

void talk(std::string_view bytes) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  if (socket < 0) __builtin_trap();
  const timeval patience{15, 0};  // a server that neither answers nor closes is a finding
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(server().port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    const bool is_interrupted = errno == EINTR;  // by the fuzzer's own alarm
    if (!is_interrupted) std::perror("connect");
    close(socket);
    if (!is_interrupted) __builtin_trap();
    return;
  }
  send_all(socket, bytes);
  shutdown(socket, SHUT_WR);
  char answer[4096];
  ssize_t got = 0;
  while ((got = recv(socket, answer, sizeof(answer), 0)) > 0 || (got < 0 && errno == EINTR)) {
  }
  if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
    std::perror("no answer");
    __builtin_trap();
  }
  close(socket);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 3) {
    case 0:
      talk(rest);
      break;
    case 1:
      talk(std::string(kHandshake) + std::string(rest));
      break;
    default:
      talk(std::string(kHandshake) + frames_of(rest));
  }
  return 0;
}
