#include "apps/view_flags.hpp"

#include <fmt/format.h>

#include <charconv>

#include "apps/terminal.hpp"
#include "pointflight/core/input_error.hpp"
#include "pointflight/view/map_blocks.hpp"
#include "pointflight/view/page_content.hpp"

namespace pointflight::apps {
namespace {

/// "127.0.0.1:8765", "8765", "0.0.0.0", "[::1]:8765".
void parse_address(const std::string& text, LiveServerOptions& options) {
  if (text.empty()) return;
  const auto fail = [&] {
    throw InputError(
        fmt::format("--view {}: give ADDRESS:PORT, such as 127.0.0.1:8765 or 0.0.0.0:8765", text));
  };
  std::string port;
  if (text.find_first_not_of("0123456789") == std::string::npos) {
    port = text;
  } else if (text.starts_with('[')) {
    const std::size_t end = text.find(']');
    if (end == std::string::npos) fail();
    options.address = text.substr(1, end - 1);
    if (end + 1 < text.size() && text[end + 1] != ':') fail();
    port = end + 1 < text.size() ? text.substr(end + 2) : "";
  } else {
    const std::size_t colon = text.find(':');
    options.address = text.substr(0, colon);
    if (colon != std::string::npos) port = text.substr(colon + 1);
  }
  if (options.address == "localhost") options.address = "127.0.0.1";
  if (port.empty()) return;
  unsigned number = 0;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (error != std::errc() || end != port.data() + port.size() || number > 65535) fail();
  options.port = static_cast<std::uint16_t>(number);
  options.ports = 20;
}

bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address == "::1";
}

}  // namespace

void add_view_flags(CLI::App& app, ViewFlags& flags) {
  auto* view = app.add_option("--view",
                              flags.at,
                              "Show it in a browser, live: prints an address of this machine; "
                              "[ADDRESS:PORT], 127.0.0.1:8765 or the next port that is free. "
                              "Foxglove and Lichtblick connect to the same port")
                   ->expected(0, 1)
                   ->type_name("[ADDRESS:PORT]")
                   ->trigger_on_parse(false);
  auto* control = app.add_flag("--view-control",
                               flags.control,
                               "Viewers may command the run (the default where only this machine "
                               "can connect)");
  control->needs(view);
  app.add_flag("--no-view-control", flags.no_control, "They may only watch")
      ->needs(view)
      ->excludes(control);
  flags.option = view;
}

std::shared_ptr<LiveServer> start_viewing(const ViewFlags& flags,
                                          const std::shared_ptr<const SurfelMap>& map) {
  if (!flags.is_asked()) return nullptr;
  return serve_view({flags.at.empty() ? "" : flags.at.front(), flags.control, flags.no_control},
                    map);
}

std::shared_ptr<LiveServer> serve_view(
    const ViewAccess& access,
    const std::shared_ptr<const SurfelMap>& map,
    const std::optional<std::pair<std::int64_t, std::int64_t>>& range) {
  LiveServerOptions options;
  parse_address(access.at, options);
  options.control = access.control || (is_loopback(options.address) && !access.no_control);
  options.range = range;
  if (range) options.capabilities = {"playbackControl"};
  const std::string folder = page_folder();
  options.content = page_content(folder, map ? std::make_shared<const MapBlocks>(map) : nullptr);
  auto server = std::make_shared<LiveServer>(std::move(options));
  if (folder.empty()) {
    log("the page was not built, which takes node and npm (./dev build); Foxglove and Lichtblick "
        "can "
        "connect:");
  }
  log(fmt::format("watch it: {}", server->address()));
  return server;
}

}  // namespace pointflight::apps
