#pragma once
// The one document of a YAML file.
#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <string>

#include "pointflight/core/input_error.hpp"

namespace pointflight::internal {

/// Remembers where a document begins, and nothing else of it.
class DocumentStart final : public YAML::EventHandler {
 public:
  std::optional<YAML::Mark> mark;

  void OnDocumentStart(const YAML::Mark& start) override { mark = start; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&,
                const std::string&,
                YAML::anchor_t,
                const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&,
                       const std::string&,
                       YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&,
                  const std::string&,
                  YAML::anchor_t,
                  YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

/// The document in `text`, undefined or null if there is none. What follows it, which YAML::Load
/// leaves unread, is an error; `name` is the file's, for messages.
/// @throws InputError with file and line.
inline YAML::Node one_yaml_document(const std::string& text, const std::string& name) {
  try {
    // not YAML::LoadAll: it never returns from ",l" or "a: 1\n}" (yaml-cpp 0.7)
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    DocumentStart document;
    if (!parser.HandleNextDocument(document)) return {};
    document.mark.reset();
    if (parser.HandleNextDocument(document) && document.mark) {
      const auto mark = static_cast<std::size_t>(std::max(0, document.mark->pos));
      const bool marked = text.compare(std::min(mark, text.size()), 3, "---") == 0;
      throw InputError(fmt::format("{}:{}: {}",
                                   name,
                                   document.mark->line + 1,
                                   marked ? "a second document (---) begins; a file has one"
                                          : "not valid YAML: belongs to nothing above it"));
    }
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw InputError(fmt::format(
        "{}:{}: not valid YAML: {}", name, std::max(0, error.mark.line) + 1, error.msg));
  }
}

}  // namespace pointflight::internal
