// Sockets of flight controllers: nothing blocks but `wait`.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pointflight {

/// A socket of this process, closed at its end.
class Socket {
 public:
  Socket() = default;
  /// Takes a descriptor over.
  explicit Socket(int descriptor) : descriptor_(descriptor) {}
  ~Socket() { close(); }
  Socket(Socket&& other) noexcept : descriptor_(other.descriptor_) { other.descriptor_ = -1; }
  Socket& operator=(Socket&& other) noexcept;
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  /// Waits for connections at an IPv4 address. Throws InputError that names the port.
  static Socket listen_tcp(const std::string& address, std::uint16_t port);
  /// Connects to a server, which may be about to start. Throws InputError after so long.
  static Socket connect_tcp(const std::string& address,
                            std::uint16_t port,
                            std::chrono::seconds at_most);
  /// Receives datagrams at an IPv4 address; port 0: any. Throws InputError that names the port.
  static Socket bind_udp(const std::string& address, std::uint16_t port);

  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  [[nodiscard]] int descriptor() const { return descriptor_; }  ///< -1: it is not open.
  [[nodiscard]] std::uint16_t port() const;                     ///< Its own.
  void close();

  /// A connection that somebody has made, small packets sent at once; not open if nobody has.
  [[nodiscard]] Socket accept();
  /// What has come of a connection, at most 64 KiB; nothing if it has ended.
  std::optional<std::vector<std::byte>> receive();
  /// False if not all of it could be sent at once: the other end does not read, or is gone.
  [[nodiscard]] bool send(std::span<const std::byte> bytes);
  /// Until something has come (or somebody wants a connection), or so long.
  void wait(std::chrono::microseconds at_most) const;

  /// A datagram and whom it came from.
  struct Datagram {
    std::vector<std::byte> bytes;
    std::uint32_t address = 0;  ///< As the wire has it.
    std::uint16_t port = 0;     ///< The same.
  };
  /// The next datagram, if one has come.
  std::optional<Datagram> receive_datagram();
  /// An answer to a datagram; one that cannot be sent is lost.
  void answer(const Datagram& to, std::span<const std::byte> bytes);
  /// A datagram; one that cannot be sent is lost.
  void send_datagram(const std::string& address,
                     std::uint16_t port,
                     std::span<const std::byte> bytes);

 private:
  int descriptor_ = -1;
};

}  // namespace pointflight
