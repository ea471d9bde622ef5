// ULog, the log of PX4: https://docs.px4.io/main/en/dev_log/ulog_file_format.html
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "pointflight/core/input_error.hpp"
#include "pointflight/flight_log/internal/log_tables.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight::flight_log {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::array<unsigned char, 7> kUlogMagic = {'U', 'L', 'o', 'g', 0x01, 0x12, 0x35};
constexpr std::size_t kUlogHeader = 16;
constexpr std::size_t kMessageHeader = 3;  // size (2), kind
// far beyond what PX4 writes; a file cannot make us unfold more
constexpr std::size_t kMostFields = 4096;
constexpr int kDeepest = 8;

/// A number in a message.
struct UlogField {
  std::string name;
  std::string type;
  std::size_t offset = 0;
};

std::size_t size_of_type(std::string_view type) {
  if (type == "int8_t" || type == "uint8_t" || type == "bool" || type == "char") return 1;
  if (type == "int16_t" || type == "uint16_t") return 2;
  if (type == "int32_t" || type == "uint32_t" || type == "float") return 4;
  if (type == "int64_t" || type == "uint64_t" || type == "double") return 8;
  return 0;
}

double ulog_number(const std::byte* bytes, std::string_view type) {
  if (type == "float") return load<float>(bytes);
  if (type == "double") return load<double>(bytes);
  if (type == "int8_t") return load<std::int8_t>(bytes);
  if (type == "int16_t") return load<std::int16_t>(bytes);
  if (type == "int32_t") return load<std::int32_t>(bytes);
  if (type == "int64_t") return static_cast<double>(load<std::int64_t>(bytes));
  if (type == "uint16_t") return load<std::uint16_t>(bytes);
  if (type == "uint32_t") return load<std::uint32_t>(bytes);
  if (type == "uint64_t") return static_cast<double>(load<std::uint64_t>(bytes));
  return load<std::uint8_t>(bytes);
}

/// "float[3] gyro_rad"
struct Declaration {
  std::string_view type;
  std::size_t count = 1;
  bool is_array = false;
  std::string_view name;
};

std::optional<Declaration> parse_declaration(std::string_view text) {
  const std::size_t blank = text.find(' ');
  if (blank == std::string_view::npos) return std::nullopt;
  Declaration declaration{text.substr(0, blank), 1, false, text.substr(blank + 1)};
  const std::size_t bracket = declaration.type.find('[');
  if (bracket == std::string_view::npos) return declaration;
  if (declaration.type.back() != ']') return std::nullopt;
  double count = 0.0;
  if (!parse_number(declaration.type.substr(bracket + 1, declaration.type.size() - bracket - 2),
                    count) ||
      !(count >= 0.0 && count <= static_cast<double>(kMostFields))) {
    return std::nullopt;
  }
  declaration.type = declaration.type.substr(0, bracket);
  declaration.count = static_cast<std::size_t>(count);
  declaration.is_array = true;
  return declaration;
}

/// Reads the messages of a file one after the other.
class UlogReader {
 public:
  UlogReader(Bytes bytes, const std::string& path, const std::set<std::string, std::less<>>& wanted)
      : bytes_(bytes), path_(path), wanted_(wanted) {}

  LogTables read() {
    std::size_t at = kUlogHeader;
    while (at + kMessageHeader <= bytes_.size()) {
      const std::size_t size = load<std::uint16_t>(&bytes_[at]);
      const std::size_t next = at + kMessageHeader + size;
      // what was appended after a crash begins anew, maybe in the middle of a message
      const auto appended = std::upper_bound(appended_.begin(), appended_.end(), at);
      if (appended != appended_.end() && *appended < next) {
        at = *appended;
        continue;
      }
      if (next > bytes_.size()) break;
      take(at, static_cast<char>(bytes_[at + 2]), bytes_.subspan(at + kMessageHeader, size));
      at = next;
    }
    return std::move(tables_);
  }

 private:
  /// Fields of messages that are logged, by the number of the subscription.
  struct Subscription {
    LogTable* table = nullptr;
    const std::vector<UlogField>* fields = nullptr;
  };

  void take(std::size_t at, char kind, Bytes message) {
    switch (kind) {
      case 'B':
        take_flags(at, message);
        break;
      case 'F':
        take_format(message);
        break;
      case 'P':
        take_parameter(message);
        break;
      case 'A':
        subscribe(at, message);
        break;
      case 'R':
        if (message.size() >= 2) subscriptions_.erase(load<std::uint16_t>(message.data()));
        break;
      case 'D':
        take_data(message);
        break;
      case 'O':
        ++tables_.skipped;
        break;
      case 'I':
      case 'M':
      case 'Q':
      case 'L':
      case 'C':
      case 'S':
        break;
      default:
        ++tables_.skipped;
    }
  }

  void take_flags(std::size_t at, Bytes message) {
    if (message.size() < 40) return;
    const auto incompatible = [&](std::size_t i) { return std::to_integer<int>(message[8 + i]); };
    bool is_unknown = (incompatible(0) & ~1) != 0;
    for (std::size_t i = 1; i < 8; ++i) is_unknown = is_unknown || incompatible(i) != 0;
    if (is_unknown) {
      throw InputError(fmt::format(
          "{}: byte {}: a log of a later PX4 than is known here (its incompatible flags)",
          path_,
          at));
    }
    if ((incompatible(0) & 1) == 0) return;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto offset = load<std::uint64_t>(&message[16 + 8 * i]);
      if (offset > at && offset < bytes_.size()) appended_.push_back(offset);
    }
    std::sort(appended_.begin(), appended_.end());
  }

  void take_format(Bytes message) {
    const std::string_view text = as_text(message);
    const std::size_t colon = text.find(':');
    if (colon == std::string_view::npos) return;
    formats_[std::string(text.substr(0, colon))] = std::string(text.substr(colon + 1));
  }

  void take_parameter(Bytes message) {
    if (message.empty()) return;
    const auto length = std::to_integer<std::size_t>(message[0]);
    if (message.size() < 1 + length + 4) return;
    const auto declared = parse_declaration(as_text(message.subspan(1, length)));
    if (!declared || size_of_type(declared->type) != 4) return;
    tables_.parameters[std::string(declared->name)] =
        ulog_number(&message[1 + length], declared->type);
  }

  /// A format with all that it holds, written out one after the other.
  struct Layout {
    std::vector<UlogField> fields;
    std::size_t size = 0;
    std::size_t steps = 0;  ///< Elements gone through, empty ones and padding, too.
  };

  /// False if it makes no sense.
  bool unfold(const std::string& format,
              const std::string& prefix,
              int depth,
              Layout& layout) const {
    const auto found = formats_.find(format);
    if (found == formats_.end() || depth > kDeepest) return false;
    std::string_view rest = found->second;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(';'), rest.size());
      const auto declared = parse_declaration(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
      if (!declared) return false;
      const std::size_t size = size_of_type(declared->type);
      for (std::size_t i = 0; i < declared->count; ++i) {
        if (++layout.steps > kMostFields) return false;
        const std::string name = prefix + std::string(declared->name) +
                                 (declared->is_array ? fmt::format("[{}]", i) : std::string());
        if (size == 0) {
          if (!unfold(std::string(declared->type), name + ".", depth + 1, layout)) return false;
          continue;
        }
        if (!declared->name.starts_with("_padding")) {
          layout.fields.push_back({name, std::string(declared->type), layout.size});
        }
        layout.size += size;
      }
    }
    return true;
  }

  void subscribe(std::size_t at, Bytes message) {
    if (message.size() < 3) return;
    const auto number = load<std::uint16_t>(&message[1]);
    const std::string name(as_text(message.subspan(3)));
    subscriptions_.erase(number);
    if (std::to_integer<int>(message[0]) != 0 || !wanted_.contains(name)) return;
    const auto [known, is_new] = layouts_.try_emplace(name);
    Layout& layout = known->second;
    if (is_new && (!unfold(name, "", 0, layout) || layout.fields.empty() ||
                   layout.fields[0].name != "timestamp")) {
      throw InputError(
          fmt::format("{}: byte {}: the format of '{}' is not in the log, or makes no sense",
                      path_,
                      at,
                      excerpt(name)));
    }
    LogTable& table = tables_.tables[name];
    if (table.columns.empty()) {
      for (const UlogField& field : layout.fields) table.columns.push_back(field.name);
    }
    subscriptions_[number] = {&table, &layout.fields};
  }

  void take_data(Bytes message) {
    if (message.size() < 2) return;
    const auto found = subscriptions_.find(load<std::uint16_t>(message.data()));
    if (found == subscriptions_.end()) return;
    const Bytes data = message.subspan(2);
    const auto& [table, fields] = found->second;
    // padding at the end may be missing, nothing else
    const UlogField& last = fields->back();
    if (last.offset + size_of_type(last.type) > data.size()) {
      ++tables_.skipped;
      return;
    }
    for (const UlogField& field : *fields) {
      table->values.push_back(ulog_number(&data[field.offset], field.type));
    }
  }

  Bytes bytes_;
  const std::string& path_;
  const std::set<std::string, std::less<>>& wanted_;
  std::vector<std::size_t> appended_;
  std::map<std::string, std::string> formats_;
  std::map<std::string, Layout> layouts_;  ///< Of messages that are wanted.
  std::map<std::uint16_t, Subscription> subscriptions_;
  LogTables tables_;
};

}  // namespace

bool is_ulog(Bytes bytes) {
  return bytes.size() >= kUlogHeader &&
         std::equal(
             kUlogMagic.begin(), kUlogMagic.end(), bytes.begin(), [](unsigned char a, std::byte b) {
               return static_cast<std::byte>(a) == b;
             });
}

LogTables read_ulog(Bytes bytes,
                    const std::string& path,
                    const std::set<std::string, std::less<>>& wanted) {
  if (!is_ulog(bytes)) throw InputError(path + ": byte 0: does not begin as a log of PX4 does");
  return UlogReader(bytes, path, wanted).read();
}

}  // namespace pointflight::flight_log
