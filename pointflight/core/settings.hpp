#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pointflight/core/registry.hpp"

namespace pointflight {

/// A value that files call by a name: a row of a closed table.
template <class Value>
struct Named {
  Value value;            ///< In the program.
  std::string_view name;  ///< In files.
};

/// The name of a value in files; empty if the table does not contain the value.
template <class Value, std::size_t N>
constexpr std::string_view name_in(const Named<Value> (&table)[N], Value value) {
  for (const Named<Value>& row : table) {
    if (row.value == value) return row.name;
  }
  return {};
}

/// One key of a settings file, for the reader, the generated documentation and the written
/// template.
struct Key {
  std::string_view name;  ///< As in the file, without the section's.
  std::string_view unit;  ///< "m", "deg", "" for pure numbers and text.
  std::string_view help;  ///< Half a sentence.
  /// Least value, inclusive; of each number in a list.
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();  ///< Greatest value, inclusive.
  bool required = false;                                 ///< Missing: an error.
};

/// What a section's key may have instead of a section, as a short form of it: `[1, 2]` for
/// `{values: [1, 2]}`. Empty: not allowed.
struct ShortForm {
  std::string_view one = {};   ///< The key that a single value stands for.
  std::string_view list = {};  ///< The key that a list stands for.
};

/// A list of values of any kind, each as YAML in one line: "2", "[0, 0, 2]", "crash".
struct YamlList {
  std::vector<std::string> items;  ///< In the order of the file.
};

/// Walks over the keys of a settings struct. Each struct has one `describe(SettingsVisitor&, T&)`;
/// reading a file, writing a commented template and generating docs are three visitors of it, so
/// that they cannot disagree.
class SettingsVisitor {
 public:
  virtual ~SettingsVisitor() = default;

  /// One key: readers set `value` if the file has it, writers and tables print it as it is.
  ///@{
  virtual void value(const Key& key, double& value) = 0;
  virtual void value(const Key& key, std::int64_t& value) = 0;
  virtual void value(const Key& key, bool& value) = 0;
  virtual void value(const Key& key, std::string& value) = 0;
  virtual void value(const Key& key, Eigen::Vector3d& value) = 0;
  virtual void value(const Key& key, std::vector<double>& value) = 0;
  virtual void value(const Key& key, std::vector<Eigen::Vector3d>& value) = 0;
  virtual void value(const Key& key, std::vector<std::string>& value) = 0;
  virtual void value(const Key& key, YamlList& value) = 0;
  ///@}
  /// Text that must be one of `choices`.
  virtual void choice(const Key& key,
                      std::string& value,
                      std::span<const std::string_view> choices) = 0;
  /// The same with the values that the words stand for.
  template <class Value, std::size_t N>
  void choice(const Key& key, Value& value, const Named<Value> (&table)[N]) {
    std::vector<std::string_view> names;
    for (const Named<Value>& row : table) names.push_back(row.name);
    std::string name(name_in(table, value));
    choice(key, name, std::span<const std::string_view>(names));
    for (const Named<Value>& row : table) {
      if (row.name == name) value = row.value;
    }
  }
  /// The same with rows of a table that programs may add to; null: none of them.
  template <class Row>
  void choice(const Key& key, const Row*& value, const Registry<Row>& rows) {
    const std::vector<std::string_view> names = rows.names();
    std::string name = value != nullptr ? value->name : std::string();
    choice(key, name, std::span<const std::string_view>(names));
    value = rows.find(name);
  }
  /// The same, one of them in any case.
  template <class Row>
  void choice(const Key& key, Choice<Row>& value) {
    const std::vector<std::string_view> names = Row::table().names();
    std::string name = value->name;
    choice(key, name, std::span<const std::string_view>(names));
    value = name;
  }
  /// `none`: the word for none of them.
  template <class Row>
  void choice(const Key& key, std::optional<Choice<Row>>& value, std::string_view none) {
    std::vector<std::string_view> names = {none};
    for (const Row& row : Row::table().rows()) names.push_back(row.name);
    std::string name(value ? (*value)->name : none);
    choice(key, name, std::span<const std::string_view>(names));
    value = name == none ? std::nullopt : std::optional<Choice<Row>>(name);
  }

  /// What makes sense only beside keys that were described before: readers and checkers throw
  /// InputError at the key unless it is `fine`. `what` goes on after its name: "is not above min".
  virtual void require(std::string_view /*name*/, bool /*fine*/, std::string_view /*what*/) {}

  /// A key that belongs to another program: any content is accepted and kept as YAML.
  virtual void leave_as_is(std::string_view /*name*/, std::string& /*yaml*/) {}

  /// Calls `describe_items(visitor, section)` one level down.
  template <class Describe>
  void section(const Key& key, const Describe& describe_items) {
    if (!enter(key)) return;
    describe_items(*this);
    leave();
  }

  /// The same, if the file may also have a short form.
  template <class Describe>
  void section(const Key& key, const ShortForm& form, const Describe& describe_items) {
    if (!enter(key, form)) return;
    describe_items(*this);
    leave();
  }

  /// All keys of the present section that were not described before: the file chooses their names,
  /// and each is a section. The reader makes an item for each key, named in `T::key`.
  template <class T, class Describe>
  void others(const Key& each,
              const ShortForm& form,
              std::vector<T>& items,
              const Describe& describe_item) {
    std::vector<std::string> names;
    for (const T& item : items) names.push_back(item.key);
    names = other_keys(std::move(names));
    items.resize(names.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
      items[i].key = names[i];
      section(Key{items[i].key, each.unit, each.help}, form, [&](SettingsVisitor& visitor) {
        describe_item(visitor, items[i]);
      });
    }
  }

  /// Keys that matter only under a condition on what was described before, written as the file
  /// would have it ("convention: ouster"). Elsewhere the reader refuses them, for they would have
  /// no effect, and the writer leaves them out; required ones are required under it alone.
  template <class Describe>
  void only_if(bool holds, std::string_view condition, const Describe& describe_keys) {
    if (!enter_condition(holds, condition)) return;
    describe_keys(*this);
    leave_condition();
  }

  /// A list of sections; the reader resizes `items` to what the file has.
  template <class T, class Describe>
  void list(const Key& key, std::vector<T>& items, const Describe& describe_item) {
    const std::size_t size = enter_list(key, items.size());
    if (size == kAbsent) return;
    items.resize(size);
    for (std::size_t i = 0; i < items.size(); ++i) {
      enter_item(i);
      describe_item(*this, items[i]);
      leave();
    }
    leave_list();
  }

 protected:
  /// Returns false to skip the keys.
  virtual bool enter_condition(bool holds, std::string_view condition) = 0;
  /// Ends what `enter_condition` has begun; called only if that returned true.
  virtual void leave_condition() {}
  /// Returns false to skip the section (absent from the file: its defaults stay).
  virtual bool enter(const Key& key) = 0;
  /// The same if there may be a short form instead.
  virtual bool enter(const Key& key, const ShortForm& /*form*/) { return enter(key); }
  /// The names of the keys that `others` visits; its items have `own` so far.
  virtual std::vector<std::string> other_keys(std::vector<std::string> own) { return own; }
  /// Ends the section or list item that was entered last.
  virtual void leave() = 0;
  /// Returns the number of items to visit, or kAbsent to leave the list as it is.
  virtual std::size_t enter_list(const Key& key, std::size_t size) = 0;
  /// Item `index` begins; `leave` ends it.
  virtual void enter_item(std::size_t index) = 0;
  /// After the last item.
  virtual void leave_list() = 0;

  /// `enter_list`: not in the file.
  static constexpr std::size_t kAbsent = std::numeric_limits<std::size_t>::max();
};

/// Reads YAML. Unknown, duplicate and missing keys, values of a wrong type, out of range or with a
/// unit written behind them throw InputError with file, line and what would do.
class SettingsReader : public SettingsVisitor {
 public:
  /// Opens a file. Throws InputError if it cannot be read or is no YAML.
  explicit SettingsReader(const std::string& path);
  /// From text; `name` stands for the path in messages.
  SettingsReader(std::string_view text, const std::string& name);
  ~SettingsReader() override;

  /// Call after the last key: throws at the first key that nobody asked for.
  void finish();

  /// True if the file has this key in the present section (for settings with alternatives).
  [[nodiscard]] bool has(std::string_view name) const;
  /// True if it has, and keys of its own below it.
  [[nodiscard]] bool is_section(std::string_view name) const;

  /// Line of each key that was read, by its full name such as "vehicle.start.position" or
  /// "lidars[0].model"; for messages about values that only make sense together.
  [[nodiscard]] const std::map<std::string, int>& lines() const { return lines_; }

  void require(std::string_view name, bool fine, std::string_view what) override;
  void leave_as_is(std::string_view name, std::string& yaml) override;
  void value(const Key& key, double& value) override;
  void value(const Key& key, std::int64_t& value) override;
  void value(const Key& key, bool& value) override;
  void value(const Key& key, std::string& value) override;
  void value(const Key& key, Eigen::Vector3d& value) override;
  void value(const Key& key, std::vector<double>& value) override;
  void value(const Key& key, std::vector<Eigen::Vector3d>& value) override;
  void value(const Key& key, std::vector<std::string>& value) override;
  void value(const Key& key, YamlList& value) override;
  void choice(const Key& key,
              std::string& value,
              std::span<const std::string_view> choices) override;

 protected:
  bool enter_condition(bool holds, std::string_view condition) override;
  void leave_condition() override;
  bool enter(const Key& key) override { return enter(key, {}); }
  bool enter(const Key& key, const ShortForm& form) override;
  std::vector<std::string> other_keys(std::vector<std::string> own) override;
  void leave() override;
  std::size_t enter_list(const Key& key, std::size_t size) override;
  void enter_item(std::size_t index) override;
  void leave_list() override;

 private:
  struct Document;
  std::unique_ptr<Document> document_;
  std::map<std::string, int> lines_;
};

/// Applies the file reader's checks to settings that a program has filled in: throws InputError at
/// the first number that is not finite or out of range, and at unknown words.
class SettingsChecker : public SettingsVisitor {
 public:
  /// `name` stands for the path in messages.
  explicit SettingsChecker(std::string name) : name_(std::move(name)) {}

  void require(std::string_view name, bool fine, std::string_view what) override;
  void value(const Key& key, double& value) override;
  void value(const Key& key, std::int64_t& value) override;
  void value(const Key& key, bool& value) override;
  void value(const Key& key, std::string& value) override;
  void value(const Key& key, Eigen::Vector3d& value) override;
  void value(const Key& key, std::vector<double>& value) override;
  void value(const Key& key, std::vector<Eigen::Vector3d>& value) override;
  void value(const Key& key, std::vector<std::string>& value) override;
  void value(const Key& key, YamlList& value) override;
  void choice(const Key& key,
              std::string& value,
              std::span<const std::string_view> choices) override;

 protected:
  /// Keys without effect are not looked at.
  bool enter_condition(bool holds, std::string_view /*condition*/) override { return holds; }
  bool enter(const Key& key) override;
  void leave() override;
  std::size_t enter_list(const Key& key, std::size_t size) override;
  void enter_item(std::size_t index) override;
  void leave_list() override;

 private:
  void check(const Key& key, double number) const;
  [[noreturn]] void fail(const Key& key, const std::string& what) const;
  std::string name_;
  std::vector<std::string> path_;  ///< "vehicles", "[0]", ...
};

/// Checks a copy of `settings`.
template <class T>
void check_settings(T settings, const std::string& name) {
  SettingsChecker checker(name);
  describe(checker, settings);
}

/// Writes the values as YAML with a comment per key: `scenario new`.
class SettingsWriter : public SettingsVisitor {
 public:
  /// The file so far.
  [[nodiscard]] const std::string& text() const { return text_; }

  void leave_as_is(std::string_view name, std::string& yaml) override;
  void value(const Key& key, double& value) override;
  void value(const Key& key, std::int64_t& value) override;
  void value(const Key& key, bool& value) override;
  void value(const Key& key, std::string& value) override;
  void value(const Key& key, Eigen::Vector3d& value) override;
  void value(const Key& key, std::vector<double>& value) override;
  void value(const Key& key, std::vector<Eigen::Vector3d>& value) override;
  void value(const Key& key, std::vector<std::string>& value) override;
  void value(const Key& key, YamlList& value) override;
  void choice(const Key& key,
              std::string& value,
              std::span<const std::string_view> choices) override;

 protected:
  bool enter_condition(bool holds, std::string_view condition) override;
  bool enter(const Key& key) override;
  void leave() override;
  std::size_t enter_list(const Key& key, std::size_t size) override;
  void enter_item(std::size_t index) override;
  void leave_list() override;

 private:
  void line(const Key& key, const std::string& value, const std::string& extra = {});
  std::string text_;
  int depth_ = 0;
  bool first_of_item_ = false;
};

/// Writes a Markdown table of the keys: name, unit, default, range, meaning.
class SettingsTable : public SettingsVisitor {
 public:
  /// The rows so far, without the table's head.
  [[nodiscard]] const std::string& text() const { return text_; }

  void value(const Key& key, double& value) override;
  void value(const Key& key, std::int64_t& value) override;
  void value(const Key& key, bool& value) override;
  void value(const Key& key, std::string& value) override;
  void value(const Key& key, Eigen::Vector3d& value) override;
  void value(const Key& key, std::vector<double>& value) override;
  void value(const Key& key, std::vector<Eigen::Vector3d>& value) override;
  void value(const Key& key, std::vector<std::string>& value) override;
  void value(const Key& key, YamlList& value) override;
  void choice(const Key& key,
              std::string& value,
              std::span<const std::string_view> choices) override;

 protected:
  bool enter_condition(bool holds, std::string_view condition) override;
  void leave_condition() override;
  bool enter(const Key& key) override;
  std::vector<std::string> other_keys(std::vector<std::string> own) override;
  void leave() override;
  std::size_t enter_list(const Key& key, std::size_t size) override;
  void enter_item(std::size_t index) override;
  void leave_list() override;

 private:
  void row(const Key& key, const std::string& value, const std::string& range);
  std::string text_;
  std::vector<std::string> path_;
  std::vector<std::string> conditions_;
};

/// The word of `known` closest to `word` (edit distance at most a third of its length), or "".
std::string closest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace pointflight
