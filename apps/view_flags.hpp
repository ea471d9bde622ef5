#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/cli.hpp"
#include "pointflight/map/surfel_map.hpp"
#include "pointflight/view/live_server.hpp"

namespace pointflight::apps {

/// Flags of commands whose result can be looked at in a browser.
struct ViewFlags {
  const CLI::Option* option = nullptr;  ///< --view itself.
  std::vector<std::string> at;          ///< ADDRESS:PORT, at most one.
  bool control = false;                 ///< Viewers may command, wherever it listens.
  bool no_control = false;              ///< They may not, on loopback either.

  /// Somebody wants to look.
  [[nodiscard]] bool is_asked() const { return option != nullptr && option->count() > 0; }
};

/// Where viewers connect and what they may.
struct ViewAccess {
  std::string at;           ///< ADDRESS:PORT; empty: 127.0.0.1:8765.
  bool control = false;     ///< As `ViewFlags`.
  bool no_control = false;  ///< As `ViewFlags`.
};

/// Serves the page and the map and says its address; `range`: first and last time of what can be
/// played back, ns. Throws InputError.
std::shared_ptr<LiveServer> serve_view(
    const ViewAccess& access,
    const std::shared_ptr<const SurfelMap>& map,
    const std::optional<std::pair<std::int64_t, std::int64_t>>& range = std::nullopt);

/// --view, --view-control, --no-view-control.
void add_view_flags(CLI::App& app, ViewFlags& flags);

/// As the flags say; null if nobody asked. Throws InputError.
std::shared_ptr<LiveServer> start_viewing(const ViewFlags& flags,
                                          const std::shared_ptr<const SurfelMap>& map);

}  // namespace pointflight::apps
