#pragma once

#include <deque>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace pointflight {

/// A table of what there is to choose from, by name; rows have a `std::string name`. Programs may
/// add rows of their own before they read settings that name them. Rows stay where they are.
template <class Row>
class Registry {
 public:
  Registry() = default;
  /// What is built in.
  Registry(std::initializer_list<Row> rows) : rows_(rows) {}

  /// One more row, from one thread, before any other uses the table. Throws std::invalid_argument
  /// if there is one of its name, or it has none.
  const Row& add(Row row) {
    if (row.name.empty()) throw std::invalid_argument("a row of a table needs a name");
    if (find(row.name) != nullptr)
      throw std::invalid_argument("'" + row.name + "' is there already");
    return rows_.emplace_back(std::move(row));
  }

  /// Null if there is none of that name.
  [[nodiscard]] const Row* find(std::string_view name) const {
    for (const Row& row : rows_) {
      if (row.name == name) return &row;
    }
    return nullptr;
  }

  /// In the order in which they were added.
  [[nodiscard]] const std::deque<Row>& rows() const { return rows_; }
  /// Of all rows, in that order; valid as long as the table.
  [[nodiscard]] std::vector<std::string_view> names() const {
    std::vector<std::string_view> names;
    for (const Row& row : rows_) names.push_back(row.name);
    return names;
  }

 private:
  std::deque<Row> rows_;
};

/// Throws InputError: "renderer 'foo' is unknown; one of: beam, paper".
[[noreturn]] void throw_unknown(std::string_view what,
                                std::string_view name,
                                const std::vector<std::string_view>& names);

/// A row of `Row::table()`, chosen by its name; the first one at first. `Row::kWhat` says what it
/// is, for messages.
template <class Row>
class Choice {
 public:
  /// The first row.
  Choice() : row_(&Row::table().rows().front()) {}
  /// By name. Throws InputError that lists the names.
  ///@{
  Choice(std::string_view name) : row_(Row::table().find(name)) {  // NOLINT: as good as its name
    if (row_ == nullptr) throw_unknown(Row::kWhat, name, Row::table().names());
  }
  Choice(const char* name) : Choice(std::string_view(name)) {}         // NOLINT: the same
  Choice(const std::string& name) : Choice(std::string_view(name)) {}  // NOLINT: the same
  ///@}

  /// The row.
  ///@{
  const Row* operator->() const { return row_; }
  const Row& operator*() const { return *row_; }
  ///@}
  /// The same row.
  friend bool operator==(const Choice&, const Choice&) = default;

 private:
  const Row* row_;
};

}  // namespace pointflight
