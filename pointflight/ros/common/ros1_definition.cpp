#include "pointflight/ros/common/ros1_definition.hpp"

#include <cctype>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <vector>

namespace pointflight {
namespace {

constexpr std::size_t kMostSteps = 20000;  // of a definition that nests itself, or of long arrays
constexpr int kMostDepth = 32;

struct MessageField {
  std::string type, name;
  bool is_array = false;
  std::optional<std::size_t> length;  ///< Of an array; nothing: it has its length in front.
};
/// Fields of each type, "" for the message itself.
using Types = std::map<std::string, std::vector<MessageField>>;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string package_of(const std::string& type) {
  const auto slash = type.find('/');
  return slash == std::string::npos ? "" : type.substr(0, slash);
}

/// "float64[3] kx # gains" as a field; nothing for comments and constants.
std::optional<MessageField> field_of(std::string line, const std::string& package) {
  line = trimmed(line.substr(0, line.find('#')));
  const auto space = line.find_first_of(" \t");
  if (line.empty() || space == std::string::npos || line.find('=') != std::string::npos) {
    return std::nullopt;
  }
  MessageField field;
  field.type = line.substr(0, space);
  field.name = trimmed(line.substr(space));
  const auto bracket = field.type.find('[');
  if (bracket != std::string::npos) {
    field.is_array = true;
    const std::string inside = field.type.substr(bracket + 1);
    if (!inside.empty() && std::isdigit(static_cast<unsigned char>(inside.front())) != 0) {
      field.length = std::strtoul(inside.c_str(), nullptr, 10);
    }
    field.type.resize(bracket);
  }
  if (field.type == "Header") field.type = "std_msgs/Header";
  // a name without a package is of the same one
  static const std::map<std::string, int> kBuiltin = {{"bool", 0},
                                                      {"int8", 0},
                                                      {"uint8", 0},
                                                      {"byte", 0},
                                                      {"char", 0},
                                                      {"int16", 0},
                                                      {"uint16", 0},
                                                      {"int32", 0},
                                                      {"uint32", 0},
                                                      {"int64", 0},
                                                      {"uint64", 0},
                                                      {"float32", 0},
                                                      {"float64", 0},
                                                      {"string", 0},
                                                      {"time", 0},
                                                      {"duration", 0}};
  const bool builtin = kBuiltin.contains(field.type);
  if (!builtin && field.type.find('/') == std::string::npos && !package.empty()) {
    field.type = package + "/" + field.type;
  }
  return field;
}

Types types_of(const std::string& definition) {
  Types types;
  std::string current;
  types[current];
  std::istringstream lines(definition);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("====")) continue;
    if (line.starts_with("MSG: ")) {
      current = trimmed(line.substr(5));
      types[current];
      continue;
    }
    if (auto field = field_of(line, package_of(current))) types[current].push_back(*field);
  }
  return types;
}

class Walk {
 public:
  Walk(const Types& types, std::span<const std::byte> bytes) : types_(types), bytes_(bytes) {}

  bool message(const std::string& type, const std::string& prefix, bool keep, int depth) {
    const auto fields = types_.find(type);
    if (fields == types_.end() || depth > kMostDepth) return false;
    for (const MessageField& field : fields->second) {
      if (!this->field(
              field, prefix.empty() ? field.name : prefix + "." + field.name, keep, depth)) {
        return false;
      }
    }
    return true;
  }

  [[nodiscard]] bool at_end() const { return at_ == bytes_.size(); }
  std::map<std::string, double> numbers;

 private:
  bool field(const MessageField& field, const std::string& name, bool keep, int depth) {
    if (!field.is_array) return one(field.type, name, keep, depth);
    std::uint64_t length = 0;
    if (field.length) {
      length = *field.length;
    } else {
      std::uint32_t count = 0;
      if (!raw(count)) return false;
      length = count;
      keep = false;
    }
    for (std::uint64_t i = 0; i < length; ++i) {
      if (!one(field.type, name + "[" + std::to_string(i) + "]", keep, depth)) return false;
    }
    return true;
  }

  bool one(const std::string& type, const std::string& name, bool keep, int depth) {
    if (++steps_ > kMostSteps) return false;
    if (type == "string") {
      std::uint32_t length = 0;
      return raw(length) && skip(length);
    }
    if (type == "time" || type == "duration") return skip(8);
    if (type == "float64") return number<double>(name, keep);
    if (type == "float32") return number<float>(name, keep);
    if (type == "bool" || type == "uint8" || type == "char") {
      return number<std::uint8_t>(name, keep);
    }
    if (type == "int8" || type == "byte") return number<std::int8_t>(name, keep);
    if (type == "int16") return number<std::int16_t>(name, keep);
    if (type == "uint16") return number<std::uint16_t>(name, keep);
    if (type == "int32") return number<std::int32_t>(name, keep);
    if (type == "uint32") return number<std::uint32_t>(name, keep);
    if (type == "int64") return number<std::int64_t>(name, keep);
    if (type == "uint64") return number<std::uint64_t>(name, keep);
    return message(type, name, keep, depth + 1);
  }

  template <class T>
  bool number(const std::string& name, bool keep) {
    T value{};
    if (!raw(value)) return false;
    if (keep) numbers[name] = static_cast<double>(value);
    return true;
  }
  template <class T>
  bool raw(T& value) {
    if (bytes_.size() - at_ < sizeof(T)) return false;
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return true;
  }
  bool skip(std::size_t size) {
    if (bytes_.size() - at_ < size) return false;
    at_ += size;
    return true;
  }

  const Types& types_;
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::size_t steps_ = 0;
};

}  // namespace

std::optional<std::map<std::string, double>> numbers_of(const std::string& definition,
                                                        std::span<const std::byte> bytes) {
  const Types types = types_of(definition);
  Walk walk(types, bytes);
  if (!walk.message("", "", true, 0) || !walk.at_end()) return std::nullopt;
  return std::move(walk.numbers);
}

}  // namespace pointflight
