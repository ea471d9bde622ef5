// What a request may have and see: functions of its words alone.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace pointflight {

/// Bytes of a content.
struct ByteRange {
  std::size_t from = 0;  ///< First.
  std::size_t to = 0;    ///< Last.
};
/// What a Range header asks for of so many bytes; nothing if it is malformed, several ranges, or
/// beyond the end.
std::optional<ByteRange> range_of(std::string_view header, std::size_t size);

/// The first subprotocol of the server's list (`foxglove::kSubprotocols`) that a client's
/// Sec-WebSocket-Protocol offers; empty if it offers none.
std::string_view chosen_subprotocol(std::string_view offered);

/// Who asks.
struct Asker {
  std::string_view host;                   ///< The Host header.
  std::optional<std::string_view> origin;  ///< The Origin header; nothing: no page.
  std::string_view target;                 ///< Path and query.
};
/// What a request may do.
struct Permission {
  bool watch = false;    ///< See page, map and run.
  bool command = false;  ///< Publish, call services, control a playback.
};
/// Host has to be an address or localhost: a name could have been pointed here by anybody. Without
/// an Origin it is a program of somebody who can reach the port; with the server's own it is our
/// page, which commands by the token in its query; Foxglove's page may watch; others nothing.
/// `control`: that anybody may command.
Permission permission_of(const Asker& asker, std::string_view token, bool control);

}  // namespace pointflight
