// DataFlash, the log of ArduPilot: libraries/AP_Logger/README.md and LogStructure.h. Messages
// describe each other: FMT says of a kind how long it is, and what its letters and labels are.
#include <array>
#include <optional>

#include "pointflight/core/input_error.hpp"
#include "pointflight/flight_log/internal/log_tables.hpp"
#include "pointflight/io/byte_cursor.hpp"

namespace pointflight::flight_log {
namespace {

using Packet = std::span<const std::byte>;

constexpr std::byte kHead1{0xA3};
constexpr std::byte kHead2{0x95};
constexpr std::uint8_t kFormatKind = 128;
constexpr std::size_t kFormatLength = 89;
constexpr std::size_t kPacketHead = 3;

/// What a letter of a format stands for.
struct Letter {
  char letter;
  std::size_t size;
  double (*number)(const std::byte*);  ///< Null: not a number.
};

template <class T>
double as_is(const std::byte* bytes) {
  return static_cast<double>(load<T>(bytes));
}
template <class T>
double hundredth(const std::byte* bytes) {
  return static_cast<double>(load<T>(bytes)) / 100.0;
}
double degrees_1e7(const std::byte* bytes) {
  return 1e-7 * load<std::int32_t>(bytes);
}

constexpr std::array<Letter, 19> kLetters = {{
    {'a', 64, nullptr},
    {'b', 1, as_is<std::int8_t>},
    {'B', 1, as_is<std::uint8_t>},
    {'h', 2, as_is<std::int16_t>},
    {'H', 2, as_is<std::uint16_t>},
    {'i', 4, as_is<std::int32_t>},
    {'I', 4, as_is<std::uint32_t>},
    {'f', 4, as_is<float>},
    {'d', 8, as_is<double>},
    {'n', 4, nullptr},
    {'N', 16, nullptr},
    {'Z', 64, nullptr},
    {'c', 2, hundredth<std::int16_t>},
    {'C', 2, hundredth<std::uint16_t>},
    {'e', 4, hundredth<std::int32_t>},
    {'E', 4, hundredth<std::uint32_t>},
    {'L', 4, degrees_1e7},
    {'q', 8, as_is<std::int64_t>},
    {'Q', 8, as_is<std::uint64_t>},
}};

const Letter* letter_of(char c) {
  if (c == 'M') c = 'B';  // a flight mode
  for (const Letter& letter : kLetters) {
    if (letter.letter == c) return &letter;
  }
  return nullptr;
}

/// Text in a field of fixed length, which zeros fill up.
std::string text_of(Packet field) {
  const std::string_view text = as_text(field);
  return std::string(text.substr(0, text.find('\0')));
}

/// A column of a kind of packet.
struct Column {
  std::size_t offset = 0;
  const Letter* letter = nullptr;
};

/// A kind of packet.
struct Kind {
  std::size_t length = 0;  ///< Head included; 0: not described.
  std::string name;
  std::vector<std::string> labels;
  std::vector<Column> columns;
  LogTable* table = nullptr;  ///< Null: not wanted.
  int instance = -1;          ///< Column of its instance; -1: there is one only.
};

std::vector<std::string> words(const std::string& text) {
  std::vector<std::string> words;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view word = take_word(rest);
    if (!word.empty()) words.emplace_back(word);
  }
  return words;
}

/// From the body of an FMT packet; nothing if it makes no sense.
std::optional<Kind> parse_format(Packet body) {
  Kind kind;
  kind.length = std::to_integer<std::size_t>(body[1]);
  kind.name = text_of(body.subspan(2, 4));
  const std::string letters = text_of(body.subspan(6, 16));
  kind.labels = words(text_of(body.subspan(22, 64)));
  if (kind.labels.size() != letters.size() || kind.length < kPacketHead) return std::nullopt;
  std::size_t offset = 0;
  for (const char c : letters) {
    const Letter* letter = letter_of(c);
    if (letter == nullptr) return std::nullopt;
    kind.columns.push_back({offset, letter});
    offset += letter->size;
  }
  if (offset + kPacketHead != kind.length) return std::nullopt;
  for (std::size_t i = 0; i < kind.labels.size(); ++i) {
    // the instance of a sensor: I of IMU, C (core) of the estimator
    if (kind.labels[i] == "I" || kind.labels[i] == "C") kind.instance = static_cast<int>(i);
  }
  return kind;
}

/// Reads packet after packet; where one does not begin as it should the next that does is looked
/// for.
class DataflashReader {
 public:
  DataflashReader(Packet bytes, const std::set<std::string, std::less<>>& wanted)
      : bytes_(bytes), wanted_(wanted) {
    kinds_[kFormatKind].length = kFormatLength;
  }

  LogTables read() {
    std::size_t at = 0;
    while (at + kPacketHead <= bytes_.size()) {
      const auto number = std::to_integer<std::uint8_t>(bytes_[at + 2]);
      Kind& kind = kinds_[number];
      if (bytes_[at] != kHead1 || bytes_[at + 1] != kHead2 || kind.length == 0) {
        ++at;
        ++tables_.skipped;
        continue;
      }
      if (at + kind.length > bytes_.size()) break;
      take(number, kind, bytes_.subspan(at + kPacketHead, kind.length - kPacketHead));
      at += kind.length;
    }
    return std::move(tables_);
  }

 private:
  void take(std::uint8_t number, Kind& kind, Packet body) {
    if (number == kFormatKind) {
      describe_kind(body);
    } else if (kind.name == "PARM") {
      take_parameter(kind, body);
    } else if (kind.table != nullptr) {
      take_row(kind, body);
    }
  }

  void describe_kind(Packet body) {
    const auto number = std::to_integer<std::uint8_t>(body[0]);
    if (number == kFormatKind || kinds_[number].length != 0) return;  // the first one counts
    auto kind = parse_format(body);
    if (!kind) {
      ++tables_.skipped;
      return;
    }
    const bool is_wanted =
        wanted_.contains(kind->name) && !kind->labels.empty() && kind->labels[0] == "TimeUS";
    if (is_wanted && !tables_.tables.contains(kind->name)) {
      kind->table = &tables_.tables[kind->name];
      kind->table->columns = kind->labels;
    }
    kinds_[number] = std::move(*kind);
  }

  void take_parameter(const Kind& kind, Packet body) {
    std::string name;
    std::optional<double> value;
    for (std::size_t i = 0; i < kind.labels.size(); ++i) {
      const auto& [offset, letter] = kind.columns[i];
      if (kind.labels[i] == "Name" && letter->number == nullptr) {
        name = text_of(body.subspan(offset, letter->size));
      } else if (kind.labels[i] == "Value" && letter->number != nullptr) {
        value = letter->number(&body[offset]);
      }
    }
    if (value) tables_.parameters[name] = *value;
  }

  void take_row(const Kind& kind, Packet body) {
    if (kind.instance >= 0) {
      const auto& [offset, letter] = kind.columns[static_cast<std::size_t>(kind.instance)];
      if (letter->number == nullptr || letter->number(&body[offset]) != 0.0) return;
    }
    for (const auto& [offset, letter] : kind.columns) {
      kind.table->values.push_back(letter->number != nullptr ? letter->number(&body[offset]) : 0.0);
    }
  }

  Packet bytes_;
  const std::set<std::string, std::less<>>& wanted_;
  std::array<Kind, 256> kinds_;
  LogTables tables_;
};

}  // namespace

bool is_dataflash(Packet bytes) {
  return bytes.size() >= kFormatLength && bytes[0] == kHead1 && bytes[1] == kHead2 &&
         std::to_integer<std::uint8_t>(bytes[2]) == kFormatKind;
}

LogTables read_dataflash(Packet bytes,
                         const std::string& path,
                         const std::set<std::string, std::less<>>& wanted) {
  if (!is_dataflash(bytes)) {
    throw InputError(path + ": byte 0: does not begin as a log of ArduPilot does");
  }
  return DataflashReader(bytes, wanted).read();
}

}  // namespace pointflight::flight_log
