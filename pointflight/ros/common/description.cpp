#include "pointflight/ros/common/description.hpp"

#include <fmt/format.h>
#include <md5.h>
#include <sha2.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

namespace pointflight {
namespace {

using Many = FieldDescription::Many;

/// "float64", "geometry_msgs/Point", ...; ROS 1's own words for time if `ros` is 1.
std::string word_for(const FieldDescription& field, int ros) {
  switch (field.kind) {
    case FieldKind::kBool:
      return "bool";
    case FieldKind::kByte:
      return "byte";
    case FieldKind::kString:
      return "string";
    case FieldKind::kFloat:
      return "float32";
    case FieldKind::kDouble:
      return "float64";
    case FieldKind::kInt8:
      return "int8";
    case FieldKind::kUint8:
      return "uint8";
    case FieldKind::kInt16:
      return "int16";
    case FieldKind::kUint16:
      return "uint16";
    case FieldKind::kInt32:
      return "int32";
    case FieldKind::kUint32:
      return "uint32";
    case FieldKind::kInt64:
      return "int64";
    case FieldKind::kUint64:
      return "uint64";
    case FieldKind::kNested:
      break;
  }
  const TypeDescription& nested = *field.nested;
  if (ros == 1 && nested.package == "builtin_interfaces") {
    return nested.name == "Time" ? "time" : "duration";
  }
  return nested.package + "/" + nested.name;
}

std::string brackets(const FieldDescription& field) {
  if (field.many == Many::kOne) return "";
  return field.many == Many::kArray ? fmt::format("[{}]", field.capacity) : "[]";
}

/// True for types that are built into ROS 1 and have no definition of their own.
bool is_builtin(const FieldDescription& field, int ros) {
  if (field.kind != FieldKind::kNested) return true;
  return ros == 1 && field.nested->package == "builtin_interfaces";
}

std::string own_text(const TypeDescription& type, int ros) {
  std::string text = type.constants;
  for (const FieldDescription& field : type.fields) {
    if (field.name == msg::kNoField) continue;
    text += fmt::format("{}{} {}\n", word_for(field, ros), brackets(field), field.name);
  }
  return text;
}

/// Nested types in the order in which they are met, each once.
void collect(const TypeDescription& type, int ros, std::vector<const TypeDescription*>& found) {
  for (const FieldDescription& field : type.fields) {
    if (is_builtin(field, ros)) continue;
    const TypeDescription& nested = *field.nested;
    const bool known = std::any_of(found.begin(), found.end(), [&](const TypeDescription* t) {
      return t->package == nested.package && t->name == nested.name;
    });
    if (!known) found.push_back(&nested);
    collect(nested, ros, found);
  }
}

template <std::size_t N>
std::string hex(const std::array<std::uint8_t, N>& digest) {
  std::string text;
  for (const std::uint8_t byte : digest) text += fmt::format("{:02x}", byte);
  return text;
}

std::string type_name_of(const TypeDescription& type) {
  return type.package + "/msg/" + type.name;
}

/// JSON of one type as type_description_interfaces has it; separators are added when printed.
nlohmann::ordered_json json_of(const TypeDescription& type) {
  nlohmann::ordered_json fields = nlohmann::ordered_json::array();
  for (const FieldDescription& field : type.fields) {
    constexpr int kArray = 48;
    constexpr int kSequence = 144;
    const int many = field.many == Many::kOne ? 0 : field.many == Many::kArray ? kArray : kSequence;
    const bool nested = field.kind == FieldKind::kNested;
    nlohmann::ordered_json type_json;
    type_json["type_id"] = static_cast<int>(field.kind) + many;
    type_json["capacity"] = field.capacity;
    type_json["string_capacity"] = 0;
    type_json["nested_type_name"] = nested ? type_name_of(*field.nested) : std::string();
    nlohmann::ordered_json json;
    json["name"] = field.name;
    json["type"] = std::move(type_json);
    fields.push_back(std::move(json));
  }
  nlohmann::ordered_json json;
  json["type_name"] = type_name_of(type);
  json["fields"] = std::move(fields);
  return json;
}

/// JSON on one line with ", " and ": " between: the text that is hashed.
std::string spaced(const nlohmann::ordered_json& json) {
  std::string text;
  const auto joined = [&](const auto& items, const auto& print) {
    bool first = true;
    for (const auto& item : items) {
      if (!first) text += ", ";
      first = false;
      print(item);
    }
  };
  if (json.is_object()) {
    text += '{';
    joined(json.items(), [&](const auto& item) {
      text += nlohmann::ordered_json(item.key()).dump() + ": " + spaced(item.value());
    });
    return text + '}';
  }
  if (json.is_array()) {
    text += '[';
    joined(json, [&](const auto& item) { text += spaced(item); });
    return text + ']';
  }
  return json.dump();
}

}  // namespace

std::string definition_text(const TypeDescription& type, int ros) {
  std::string text = own_text(type, ros);
  std::vector<const TypeDescription*> nested;
  collect(type, ros, nested);
  for (const TypeDescription* t : nested) {
    text += std::string(80, '=') + fmt::format("\nMSG: {}/{}\n", t->package, t->name);
    text += own_text(*t, ros);
  }
  return text;
}

std::string md5_of(const TypeDescription& type) {
  std::string text;
  // constants first, "type NAME=value"
  std::istringstream constants(type.constants);
  for (std::string line; std::getline(constants, line);) {
    std::istringstream words(line.substr(0, line.find('=')));
    std::string kind;
    std::string name;
    words >> kind >> name;
    std::string value = line.substr(line.find('=') + 1);
    value.erase(0, value.find_first_not_of(' '));
    text += fmt::format("{} {}={}\n", kind, name, value);
  }
  for (const FieldDescription& field : type.fields) {
    text += is_builtin(field, 1)
                ? fmt::format("{}{} {}\n", word_for(field, 1), brackets(field), field.name)
                : fmt::format("{} {}\n", md5_of(*field.nested), field.name);
  }
  if (!text.empty()) text.pop_back();
  std::array<std::uint8_t, MD5_DIGEST_LENGTH> digest{};
  MD5_CTX context;
  MD5Init(&context);
  MD5Update(&context, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  MD5Final(digest.data(), &context);
  return hex(digest);
}

std::string type_hash_of(const TypeDescription& type) {
  std::vector<const TypeDescription*> nested;
  collect(type, 2, nested);
  std::sort(nested.begin(), nested.end(), [](const TypeDescription* a, const TypeDescription* b) {
    return type_name_of(*a) < type_name_of(*b);
  });
  nlohmann::ordered_json json;
  json["type_description"] = json_of(type);
  json["referenced_type_descriptions"] = nlohmann::ordered_json::array();
  for (const TypeDescription* t : nested) {
    json["referenced_type_descriptions"].push_back(json_of(*t));
  }
  const std::string text = spaced(json);
  std::array<std::uint8_t, SHA256_DIGEST_LENGTH> digest{};
  SHA2_CTX context;
  SHA256Init(&context);
  SHA256Update(&context, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  SHA256Final(digest.data(), &context);
  return "RIHS01_" + hex(digest);
}

}  // namespace pointflight
