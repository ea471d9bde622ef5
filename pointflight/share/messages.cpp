#include "pointflight/share/messages.hpp"

#include <fmt/format.h>

namespace pointflight::share_msg {

Opened open_message(std::span<const std::byte> bytes) {
  const auto head = decode<Wire::kCdr, Head>(bytes, true);
  if (!head || head->magic != Head::MAGIC)
    return {std::nullopt, "bytes that are not pointflight's"};
  if (head->version != Head::VERSION) {
    return {
        std::nullopt,
        fmt::format("messages of version {}; this program has {}", head->version, Head::VERSION)};
  }
  return {head, ""};
}

}  // namespace pointflight::share_msg
