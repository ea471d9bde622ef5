#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "pointflight/core/input_error.hpp"
#include "pointflight/core/internal/yaml_document-inl.hpp"
#include "pointflight/core/mapped_file.hpp"
#include "pointflight/core/settings.hpp"

namespace pointflight {
namespace {

constexpr std::size_t kMaxFileBytes = 4 << 20;

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    int diagonal = row[0];
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitute});
    }
  }
  return row[b.size()];
}

std::string unit_text(const Key& key) {
  return key.unit.empty() ? std::string() : fmt::format(" in {}", key.unit);
}

std::string range_text(const Key& key) {
  if (std::isfinite(key.min) && std::isfinite(key.max)) {
    return fmt::format("between {} and {}", key.min, key.max);
  }
  if (std::isfinite(key.min)) return fmt::format("at least {}", key.min);
  return fmt::format("at most {}", key.max);
}

std::string in_one_line(const YAML::Node& node) {
  YAML::Emitter emitter;
  emitter.SetMapFormat(YAML::Flow);
  emitter.SetSeqFormat(YAML::Flow);
  emitter << node;
  std::string text = emitter.c_str();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

std::string closest_word(std::string_view word, const std::vector<std::string>& known) {
  std::string best;
  int best_distance = std::max<int>(2, static_cast<int>(word.size()) / 3) + 1;
  for (const std::string& candidate : known) {
    const int distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

/// The parsed file and the location in it where the visitor stands.
struct SettingsReader::Document {
  struct Level {
    YAML::Node node;
    std::string path;             ///< "vehicle.start." with the closing dot, or "".
    std::set<std::string> asked;  ///< Keys that the settings know.
  };

  std::string name;
  std::vector<Level> levels;
  /// Lists that are being read, the innermost last.
  struct List {
    YAML::Node node;
    std::string path;
  };
  std::vector<List> lists;

  /// Conditions that the keys being described stand under, the innermost last.
  struct Condition {
    bool holds;
    std::string text;
  };
  std::vector<Condition> conditions;

  /// A key that the settings do not know. It is refused in the end, when all known ones have been
  /// asked for: it may belong elsewhere.
  struct Unknown {
    YAML::Node key;
    std::string path;  ///< Of its section.
  };
  std::optional<Unknown> unknown;
  std::map<std::string, std::set<std::string>> asked_at;  ///< Known keys by their section's path.

  void refuse_unknown() const {
    if (!unknown) return;
    const std::string& name = unknown->key.Scalar();
    const std::set<std::string>& asked = asked_at.at(unknown->path);
    const std::vector<std::string> known(asked.begin(), asked.end());
    // a section or more higher up
    std::string section = unknown->path;
    while (!section.empty()) {
      section.pop_back();
      const std::string inner = section.substr(section.rfind('.') + 1);
      section.resize(section.size() - inner.size());
      const auto above = asked_at.find(section);
      if (above == asked_at.end() || above->second.count(name) == 0) continue;
      fail(unknown->key,
           unknown->path + name,
           fmt::format("is no key of `{}`; it stands beside it, with the same indent as `{}:`",
                       inner,
                       inner));
    }
    const std::string guess = closest_word(name, known);
    fail(unknown->key,
         unknown->path + name,
         guess.empty() ? fmt::format("unknown key; known here: {}", fmt::join(known, ", "))
                       : fmt::format("unknown key; did you mean '{}'?", guess));
  }

  [[nodiscard]] std::string location(const YAML::Node& node) const {
    return fmt::format("{}:{}", name, node.Mark().line + 1);
  }

  [[noreturn]] void fail(const YAML::Node& node,
                         const std::string& path,
                         const std::string& what) const {
    throw InputError(fmt::format("{}: {}: {}", location(node), path, what));
  }

  void parse(std::string_view text) {
    const YAML::Node root = internal::one_yaml_document(std::string(text), name);
    if (!root.IsDefined() || !root.IsMap()) {
      throw InputError(fmt::format("{}: expected `key: value` lines at the top level", name));
    }
    push(root, "");
  }

  void push(const YAML::Node& node, const std::string& path) {
    // yaml-cpp keeps both of two equal keys and finds the first: refuse them
    std::set<std::string> seen;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) fail(entry.first, path, "a key must be plain text");
      if (!seen.insert(entry.first.Scalar()).second) {
        fail(entry.first, path + entry.first.Scalar(), "this key stands twice; remove one");
      }
    }
    levels.push_back({node, path, {}});
  }

  /// The value under `key`, or nothing if the file does not have it (an error if required).
  std::optional<YAML::Node> find(const Key& key) {
    Level& level = levels.back();
    level.asked.insert(std::string(key.name));
    const YAML::Node& parent = level.node;
    YAML::Node node = parent[std::string(key.name)];
    const bool given = node.IsDefined() && !node.IsNull();
    for (const Condition& condition : conditions) {
      if (condition.holds) continue;
      if (!given) return std::nullopt;
      fail(
          node,
          level.path + std::string(key.name),
          fmt::format("has no effect here: it is for `{}`; remove it or set that", condition.text));
    }
    if (given) return node;
    if (key.required) {
      fail(parent,
           level.path + std::string(key.name),
           fmt::format("missing; add it ({})", key.help));
    }
    return std::nullopt;
  }

  [[nodiscard]] std::string full_name(const Key& key) const {
    return levels.back().path + std::string(key.name);
  }

  [[nodiscard]] double number(const YAML::Node& node, const Key& key) const {
    double parsed = 0.0;
    const std::string text = node.IsScalar() ? node.Scalar() : std::string("a list or section");
    const char* end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, parsed);
    if (!node.IsScalar() || result.ec != std::errc() || result.ptr != end ||
        !std::isfinite(parsed)) {
      fail(node,
           full_name(key),
           fmt::format("expected a plain number{}, found '{}'", unit_text(key), text));
    }
    if (parsed < key.min || parsed > key.max) {
      fail(node,
           full_name(key),
           fmt::format(
               "{} is out of range; give a number{} {}", text, unit_text(key), range_text(key)));
    }
    return parsed;
  }

  [[nodiscard]] Eigen::Vector3d vector3(const YAML::Node& node, const Key& key) const {
    if (!node.IsSequence() || node.size() != 3) {
      fail(node, full_name(key), fmt::format("expected [x, y, z]{}", unit_text(key)));
    }
    return {number(node[0], key), number(node[1], key), number(node[2], key)};
  }
};

SettingsReader::SettingsReader(const std::string& path) : document_(std::make_unique<Document>()) {
  document_->name = path;
  const MappedFile file(path);
  if (file.bytes().size() > kMaxFileBytes) {
    throw InputError(fmt::format("{}: larger than 4 MiB; this is not a settings file", path));
  }
  document_->parse({reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size()});
}

SettingsReader::SettingsReader(std::string_view text, const std::string& name)
    : document_(std::make_unique<Document>()) {
  document_->name = name;
  document_->parse(text);
}

SettingsReader::~SettingsReader() = default;

bool SettingsReader::has(std::string_view name) const {
  const YAML::Node& parent = document_->levels.back().node;
  return parent[std::string(name)].IsDefined();
}

bool SettingsReader::is_section(std::string_view name) const {
  const YAML::Node& parent = document_->levels.back().node;
  return parent[std::string(name)].IsDefined() && parent[std::string(name)].IsMap();
}

void SettingsReader::require(std::string_view name, bool fine, std::string_view what) {
  if (fine) return;
  const Document::Level& level = document_->levels.back();
  const YAML::Node given = level.node[std::string(name)];
  document_->fail(
      given.IsDefined() ? given : level.node, level.path + std::string(name), std::string(what));
}

void SettingsReader::leave_as_is(std::string_view name, std::string& yaml) {
  const auto node = document_->find({name, "", ""});
  if (!node) return;
  YAML::Node alone;
  alone[std::string(name)] = *node;
  yaml = YAML::Dump(alone);
}

void SettingsReader::finish() {
  while (!document_->levels.empty()) leave();
  document_->refuse_unknown();
}

void SettingsReader::leave() {
  const Document::Level level = document_->levels.back();
  for (const auto& entry : level.node) {
    const std::string& name = entry.first.Scalar();
    if (level.asked.count(name) != 0) continue;
    if (!document_->unknown) document_->unknown = Document::Unknown{entry.first, level.path};
  }
  document_->asked_at[level.path].insert(level.asked.begin(), level.asked.end());
  document_->levels.pop_back();
}

bool SettingsReader::enter_condition(bool holds, std::string_view condition) {
  document_->conditions.push_back({holds, std::string(condition)});
  return true;  // also if it does not hold: what stands there is refused
}

void SettingsReader::leave_condition() {
  document_->conditions.pop_back();
}

bool SettingsReader::enter(const Key& key, const ShortForm& form) {
  const auto node = document_->find(key);
  if (!node) return false;
  const std::string path = document_->full_name(key);
  lines_[path] = node->Mark().line + 1;
  if (node->IsMap()) {
    document_->push(*node, path + ".");
    return true;
  }
  const std::string_view stands_for = node->IsSequence() ? form.list : form.one;
  if (stands_for.empty()) {
    document_->fail(*node,
                    path,
                    fmt::format("expected {}{}indented `key: value` lines",
                                form.one.empty() ? "" : "a value or ",
                                form.list.empty() ? "" : "a list or "));
  }
  YAML::Node whole;
  whole[std::string(stands_for)] = *node;
  document_->push(whole, path + ".");
  return true;
}

std::vector<std::string> SettingsReader::other_keys(std::vector<std::string> /*own*/) {
  const Document::Level& level = document_->levels.back();
  std::vector<std::string> names;
  for (const auto& entry : level.node) {
    const std::string& name = entry.first.Scalar();
    if (level.asked.count(name) == 0) names.push_back(name);
  }
  return names;
}

std::size_t SettingsReader::enter_list(const Key& key, std::size_t /*size*/) {
  const auto node = document_->find(key);
  if (!node) return kAbsent;
  if (!node->IsSequence()) {
    document_->fail(*node, document_->full_name(key), "expected a list, one `- ` per entry");
  }
  lines_[document_->full_name(key)] = node->Mark().line + 1;
  document_->lists.push_back({*node, document_->full_name(key)});
  return node->size();
}

void SettingsReader::enter_item(std::size_t index) {
  const auto& list = document_->lists.back();
  const YAML::Node item = list.node[index];
  const std::string path = fmt::format("{}[{}]", list.path, index);
  if (!item.IsMap()) document_->fail(item, path, "expected indented `key: value` lines");
  lines_[path] = item.Mark().line + 1;
  document_->push(item, path + ".");
}

void SettingsReader::leave_list() {
  document_->lists.pop_back();
}

void SettingsReader::value(const Key& key, double& value) {
  if (const auto node = document_->find(key)) {
    value = document_->number(*node, key);
    lines_[document_->full_name(key)] = node->Mark().line + 1;
  }
}

void SettingsReader::value(const Key& key, std::int64_t& value) {
  if (const auto node = document_->find(key)) {
    const double number = document_->number(*node, key);
    if (number != std::floor(number) || std::abs(number) > 9e15) {
      document_->fail(*node,
                      document_->full_name(key),
                      fmt::format("expected a whole number, found '{}'", node->Scalar()));
    }
    value = static_cast<std::int64_t>(number);
    lines_[document_->full_name(key)] = node->Mark().line + 1;
  }
}

void SettingsReader::value(const Key& key, bool& value) {
  const auto node = document_->find(key);
  if (!node) return;
  const std::string text = node->IsScalar() ? node->Scalar() : "a list or section";
  if (text != "true" && text != "false") {
    document_->fail(
        *node, document_->full_name(key), fmt::format("expected true or false, found '{}'", text));
  }
  value = text == "true";
}

void SettingsReader::value(const Key& key, std::string& value) {
  const auto node = document_->find(key);
  if (!node) return;
  if (!node->IsScalar() || (key.required && node->Scalar().empty())) {
    document_->fail(*node, document_->full_name(key), "expected text on the same line");
  }
  value = node->Scalar();
  lines_[document_->full_name(key)] = node->Mark().line + 1;
}

void SettingsReader::value(const Key& key, Eigen::Vector3d& value) {
  if (const auto node = document_->find(key)) {
    value = document_->vector3(*node, key);
    lines_[document_->full_name(key)] = node->Mark().line + 1;
  }
}

void SettingsReader::value(const Key& key, std::vector<double>& value) {
  const auto node = document_->find(key);
  if (!node) return;
  if (!node->IsSequence()) {
    document_->fail(*node, document_->full_name(key), "expected a list such as [1, 2, 3]");
  }
  value.clear();
  for (const auto& item : *node) value.push_back(document_->number(item, key));
  lines_[document_->full_name(key)] = node->Mark().line + 1;
}

void SettingsReader::value(const Key& key, std::vector<Eigen::Vector3d>& value) {
  const auto node = document_->find(key);
  if (!node) return;
  if (!node->IsSequence()) {
    document_->fail(*node, document_->full_name(key), "expected a list of [x, y, z]");
  }
  value.clear();
  for (const auto& item : *node) {
    lines_[fmt::format("{}[{}]", document_->full_name(key), value.size())] = item.Mark().line + 1;
    value.push_back(document_->vector3(item, key));
  }
  lines_[document_->full_name(key)] = node->Mark().line + 1;
}

void SettingsReader::value(const Key& key, std::vector<std::string>& value) {
  const auto node = document_->find(key);
  if (!node) return;
  const std::string path = document_->full_name(key);
  if (!node->IsSequence()) document_->fail(*node, path, "expected a list such as [a, b]");
  value.clear();
  for (const auto& item : *node) {
    if (!item.IsScalar()) document_->fail(item, path, "expected plain text in the list");
    value.push_back(item.Scalar());
  }
  lines_[path] = node->Mark().line + 1;
}

void SettingsReader::value(const Key& key, YamlList& value) {
  const auto node = document_->find(key);
  if (!node) return;
  const std::string path = document_->full_name(key);
  if (!node->IsSequence()) document_->fail(*node, path, "expected a list such as [1, 2, 4]");
  value.items.clear();
  for (const auto& item : *node) value.items.push_back(in_one_line(item));
  lines_[path] = node->Mark().line + 1;
}

void SettingsReader::choice(const Key& key,
                            std::string& value,
                            std::span<const std::string_view> choices) {
  const auto node = document_->find(key);
  if (!node) return;
  const std::string text = node->IsScalar() ? node->Scalar() : "a list or section";
  if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
    document_->fail(*node,
                    document_->full_name(key),
                    fmt::format("'{}' is unknown; one of: {}", text, fmt::join(choices, ", ")));
  }
  value = text;
  lines_[document_->full_name(key)] = node->Mark().line + 1;
}

}  // namespace pointflight
