#include "pointflight/sitl/internal/socket.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <thread>
#include <utility>

#include "pointflight/core/input_error.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kLargest = 65536;  // bytes that are read at once

std::string reason(int error) {
  return std::generic_category().message(error);
}

sockaddr_in address_of(const std::string& address, std::uint16_t port) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  if (inet_pton(AF_INET, address.c_str(), &to.sin_addr) != 1) {
    throw InputError(fmt::format("'{}' is no IPv4 address, such as 127.0.0.1", address));
  }
  return to;
}

void send_to(int descriptor, const sockaddr_in& to, std::span<const std::byte> bytes) {
  ::sendto(descriptor,
           bytes.data(),
           bytes.size(),
           MSG_NOSIGNAL,
           reinterpret_cast<const sockaddr*>(&to),
           sizeof(to));
}

Socket bound(int type, const std::string& address, std::uint16_t port) {
  const sockaddr_in at = address_of(address, port);
  Socket socket(::socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const int descriptor = socket.descriptor();
  const int on = 1;
  if (type == SOCK_STREAM && descriptor >= 0) {
    setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  }
  const bool is_bound = descriptor >= 0 &&
                        ::bind(descriptor, reinterpret_cast<const sockaddr*>(&at), sizeof(at)) == 0;
  if (!is_bound || (type == SOCK_STREAM && ::listen(descriptor, 4) != 0)) {
    throw InputError(fmt::format("{} port {} of {}: {}; does another program use it?",
                                 type == SOCK_STREAM ? "TCP" : "UDP",
                                 port,
                                 address,
                                 reason(errno)));
  }
  return socket;
}

}  // namespace

Socket& Socket::operator=(Socket&& other) noexcept {
  if (this != &other) {
    close();
    descriptor_ = std::exchange(other.descriptor_, -1);
  }
  return *this;
}

Socket Socket::listen_tcp(const std::string& address, std::uint16_t port) {
  return bound(SOCK_STREAM, address, port);
}

Socket Socket::connect_tcp(const std::string& address,
                           std::uint16_t port,
                           std::chrono::seconds at_most) {
  const sockaddr_in to = address_of(address, port);
  const auto until = std::chrono::steady_clock::now() + at_most;
  for (;;) {
    Socket socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    const int descriptor = socket.descriptor();
    const int on = 1;
    if (descriptor >= 0 &&
        ::connect(descriptor, reinterpret_cast<const sockaddr*>(&to), sizeof(to)) == 0) {
      setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
      fcntl(descriptor, F_SETFL, O_NONBLOCK);
      return socket;
    }
    if (std::chrono::steady_clock::now() > until) {
      throw InputError(fmt::format("TCP port {} of {}: {}", port, address, reason(errno)));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

Socket Socket::bind_udp(const std::string& address, std::uint16_t port) {
  return bound(SOCK_DGRAM, address, port);
}

std::uint16_t Socket::port() const {
  sockaddr_in at{};
  socklen_t size = sizeof(at);
  if (getsockname(descriptor_, reinterpret_cast<sockaddr*>(&at), &size) != 0) return 0;
  return ntohs(at.sin_port);
}

void Socket::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

Socket Socket::accept() {
  if (!is_open()) return {};
  Socket other(::accept4(descriptor_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  const int on = 1;
  if (other.is_open()) setsockopt(other.descriptor_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  return other;
}

std::optional<std::vector<std::byte>> Socket::receive() {
  std::vector<std::byte> bytes(kLargest);
  const ssize_t got = ::recv(descriptor_, bytes.data(), bytes.size(), 0);
  const bool is_none = got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
  if (got <= 0 && !is_none) return std::nullopt;
  bytes.resize(is_none ? 0 : static_cast<std::size_t>(got));
  return bytes;
}

bool Socket::send(std::span<const std::byte> bytes) {
  const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  return sent == static_cast<ssize_t>(bytes.size());
}

void Socket::wait(std::chrono::microseconds at_most) const {
  if (!is_open()) return;
  pollfd look{descriptor_, POLLIN, 0};
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(at_most);
  const std::chrono::nanoseconds rest = at_most - seconds;
  const timespec until{seconds.count(), rest.count()};
  ppoll(&look, 1, &until, nullptr);
}

std::optional<Socket::Datagram> Socket::receive_datagram() {
  Datagram datagram;
  datagram.bytes.resize(kLargest);
  sockaddr_in from{};
  socklen_t size = sizeof(from);
  const ssize_t got = ::recvfrom(descriptor_,
                                 datagram.bytes.data(),
                                 datagram.bytes.size(),
                                 0,
                                 reinterpret_cast<sockaddr*>(&from),
                                 &size);
  if (got < 0) return std::nullopt;
  datagram.bytes.resize(static_cast<std::size_t>(got));
  datagram.address = from.sin_addr.s_addr;
  datagram.port = from.sin_port;
  return datagram;
}

void Socket::answer(const Datagram& to, std::span<const std::byte> bytes) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = to.port;
  at.sin_addr.s_addr = to.address;
  send_to(descriptor_, at, bytes);
}

void Socket::send_datagram(const std::string& address,
                           std::uint16_t port,
                           std::span<const std::byte> bytes) {
  send_to(descriptor_, address_of(address, port), bytes);
}

}  // namespace pointflight
