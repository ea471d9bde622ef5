#include "pointflight/view/web_rules.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <string>

#include "pointflight/view/foxglove.hpp"

namespace pointflight {
namespace {

constexpr std::string_view kWatchers[] = {"https://app.foxglove.dev"};

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
  in6_addr address{};
  return host == "localhost" || inet_pton(AF_INET, host.c_str(), &address) == 1 ||
         inet_pton(AF_INET6, host.c_str(), &address) == 1;
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

/// Without blanks around.
std::string_view trimmed(std::string_view text) {
  while (text.starts_with(' ')) text.remove_prefix(1);
  while (text.ends_with(' ')) text.remove_suffix(1);
  return text;
}

/// True if a list with commas has the word.
bool lists(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    if (trimmed(list.substr(0, comma)) == word) return true;
    list.remove_prefix(std::min(list.size(), comma + 1));
  }
  return false;
}

}  // namespace

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

std::string_view chosen_subprotocol(std::string_view offered) {
  for (const std::string_view name : foxglove::kSubprotocols) {
    if (lists(offered, name)) return name;
  }
  return {};
}

Permission permission_of(const Asker& asker, std::string_view token, bool control) {
  if (!is_plain_host(asker.host)) return {};
  if (!asker.origin) return {true, control};
  if (*asker.origin == "http://" + std::string(asker.host)) {
    return {true, control && is_same_secret(query_value(asker.target, "token"), token)};
  }
  const bool is_watcher =
      std::find(std::begin(kWatchers), std::end(kWatchers), *asker.origin) != std::end(kWatchers);
  return {is_watcher, false};
}

}  // namespace pointflight
