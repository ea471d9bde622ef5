#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "apps/cli.hpp"
#include "apps/commands.hpp"
#include "apps/input_kind.hpp"
#include "apps/modules.hpp"
#include "apps/settings_json.hpp"
#include "apps/terminal.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/recording/mcap_reader.hpp"
#include "pointflight/recording/sqlite_reader.hpp"

namespace pointflight::apps {
namespace {

nlohmann::ordered_json json_of(const std::string& path, const RecordingInfo& info, double seconds) {
  nlohmann::ordered_json json;
  json["file"] = path;
  json["format"] = info.format;
  json["complete"] = info.complete;
  json["compression"] = info.compression;
  json["messages"] = info.messages;
  json["start_ns"] = info.start;
  json["end_ns"] = info.end;
  json["attachments"] = nlohmann::ordered_json::array();
  for (const auto& attachment : info.attachments) {
    json["attachments"].push_back({{"name", attachment.name}, {"bytes", attachment.size}});
  }
  json["topics"] = nlohmann::ordered_json::array();
  for (const auto& topic : info.topics) {
    const double rate = seconds > 0.0 ? static_cast<double>(topic.messages) / seconds : 0.0;
    json["topics"].push_back(
        {{"name", topic.name}, {"type", topic.type}, {"messages", topic.messages}, {"rate", rate}});
  }
  return json;
}

void show(const std::string& path, bool as_json) {
  require_kind(
      path, {InputKind::kRecording, InputKind::kSqlite}, "a recording (.mcap, .bag, .db3)");
  require_regular_file(path);
  const bool is_bag = path.ends_with(".bag") || path.ends_with(".bag.active");
  const bool is_sqlite = kind_of_input(path) == InputKind::kSqlite || path.ends_with(".db3");
  const RecordingInfo info = is_bag      ? ros1_module().read_bag(path)
                             : is_sqlite ? read_sqlite(path, terminal_progress())
                                         : read_mcap(path, terminal_progress());
  const double seconds = 1e-9 * static_cast<double>(info.end - info.start);
  if (as_json) {
    print_json(json_of(path, info, seconds));
    return;
  }
  fmt::print("{}\n", path);
  fmt::print("  format       {}{}\n",
             printable(info.format),
             info.library.empty() ? "" : fmt::format(", written by {}", printable(info.library)));
  fmt::print("  complete     {}\n",
             info.complete ? "yes" : "no: cut short; what follows is what can be read");
  fmt::print("  messages     {}{}\n",
             info.messages,
             info.chunks > 0
                 ? fmt::format(" in {} chunks ({})", info.chunks, printable(info.compression))
                 : std::string());
  if (info.messages > 0) {
    fmt::print("  time         {:.3f} to {:.3f}, {:.3f} s\n",
               1e-9 * static_cast<double>(info.start),
               1e-9 * static_cast<double>(info.end),
               seconds);
  }
  for (const auto& attachment : info.attachments) {
    fmt::print("  attachment   {}, {} bytes\n", printable(attachment.name), attachment.size);
  }
  for (const auto& topic : info.topics) {
    const double rate = seconds > 0.0 ? static_cast<double>(topic.messages) / seconds : 0.0;
    fmt::print("  {:>8}  {:>7.1f} Hz  {}  {}\n",
               topic.messages,
               rate,
               printable(topic.name),
               printable(topic.type));
  }
}

}  // namespace

void add_bag_command(CLI::App& parent, int& /*exit_code*/) {
  auto* app = parent.add_subcommand("bag", "Recordings that `fly --record` made");
  app->require_subcommand(1);
  auto* info = app->add_subcommand("info", "What is in a recording");
  auto path = std::make_shared<std::string>();
  info->add_option("file", *path, "A .mcap, .bag or .db3, or a .mcap.active that was cut short")
      ->required();
  auto as_json = std::make_shared<bool>(false);
  info->add_flag("--json", *as_json, "JSON on stdout");
  info->callback([path, as_json] { show(*path, *as_json); });
}

}  // namespace pointflight::apps
