#include "pointflight/io/spool.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <system_error>
#include <vector>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/scratch.hpp"

namespace pointflight {
namespace {

[[noreturn]] void fail(const std::string& name, const std::string& what, int error) {
  throw InputError(fmt::format("{}: {}: {}", name, what, std::generic_category().message(error)));
}

void write_all(int file, const std::byte* bytes, std::size_t size, const std::string& name) {
  while (size > 0) {
    const ssize_t written = ::write(file, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(name, "cannot be kept; choose another --scratch", errno);
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

}  // namespace

std::shared_ptr<const int> spool(const BlockReader& read,
                                 const std::string& name,
                                 const std::string& folder,
                                 const Progress& progress) {
  const std::shared_ptr<const int> file(new int(open_nameless_file(folder)), [](const int* f) {
    ::close(*f);
    delete f;
  });
  std::vector<std::byte> buffer(1 << 20);
  for (;;) {
    report(progress, "reading " + name, 0.0);
    const auto size = read(buffer);
    if (!size) continue;
    if (*size == 0) return file;
    write_all(*file, buffer.data(), *size, name);
  }
}

std::shared_ptr<const int> spool(int descriptor,
                                 const std::string& name,
                                 const std::string& folder,
                                 const Progress& progress) {
  const auto read = [&](std::span<std::byte> block) -> std::optional<std::size_t> {
    // with a limit, so that a signal is noticed while nothing comes
    constexpr int kPollMilliseconds = 100;
    struct pollfd ready {
      descriptor, POLLIN, 0
    };
    if (::poll(&ready, 1, kPollMilliseconds) <= 0) return std::nullopt;
    const ssize_t size = ::read(descriptor, block.data(), block.size());
    if (size < 0 && (errno == EINTR || errno == EAGAIN)) return std::nullopt;
    if (size < 0) fail(name, "cannot be read", errno);
    return static_cast<std::size_t>(size);
  };
  return spool(read, name, folder, progress);
}

}  // namespace pointflight
